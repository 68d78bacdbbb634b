// How a render tells of its way through the image.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "engine/base/monitor.h"
#include "engine/render/render.h"

namespace lucerna {

// Phases within a pass are not told: a thousand passes would be thousands of lines.
class PassMonitor final : public Monitor {
  public:
    explicit PassMonitor(Monitor& monitor) : monitor_(monitor) {}
    void warn(std::string_view line) override { monitor_.warn(line); }
    bool stopped() const override { return monitor_.stopped(); }

  private:
    Monitor& monitor_;
};

// The way through the image: by samples, or by time where that is what ends it. Of an image that is taken up
// again, the part that is left.
class Progress {
  public:
    struct Span {
        std::uint64_t asked = 0;  // samples of all tiles together; 0: no end
        std::uint64_t there = 0;  // of them, from the start
        double seconds = 0;       // from the start
    };
    Progress(Monitor& monitor, std::string_view name, const Span& span, const Limits& limits)
        : by_time_(std::isfinite(limits.seconds)),
          begin_(tenths(span.seconds)),
          total_(by_time_          ? left(tenths(limits.seconds), begin_)
                 : span.asked == 0 ? 0
                                   : left(span.asked, span.there)),
          phase_(monitor, name, total_) {}

    // From any thread.
    void tile(int samples) {
        if (!by_time_) phase_.advance(static_cast<std::uint64_t>(samples));
    }
    void round(double seconds) {
        if (by_time_) advance_to(std::min(left(tenths(seconds), begin_), total_));
    }
    // It ended as it should: what is left of the time is not needed.
    void finish() {
        if (by_time_) advance_to(total_);
    }

  private:
    static std::uint64_t tenths(double seconds) {
        return static_cast<std::uint64_t>(std::min(seconds, 1e9) * 10);
    }
    static std::uint64_t left(std::uint64_t all, std::uint64_t there) { return all - std::min(all, there); }
    void advance_to(std::uint64_t done) {
        if (done > done_) phase_.advance(done - done_);
        done_ = std::max(done, done_);
    }

    bool by_time_;
    std::uint64_t begin_, total_;
    std::uint64_t done_ = 0;
    Phase phase_;
};

// What is done again and again, but no more often than every so many seconds; nor, where it may wait, so
// often that it takes more than a twentieth of all time.
class Recurring {
  public:
    explicit Recurring(double every, bool may_wait = false)
        : every_(every), next_(every), may_wait_(may_wait) {}
    bool due(double now) const { return now >= next_; }
    // It was, from the one time to the other.
    void done(double begin, double end) {
        next_ = end + (may_wait_ ? std::max(every_, 19 * (end - begin)) : every_);
    }

  private:
    double every_, next_;
    bool may_wait_;
};

}  // namespace lucerna
