// Reports the progress of a render, and measures its time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "engine/base/monitor.h"
#include "engine/render/render.h"

namespace lucerna {

// Hides the phases within a pass: a thousand passes would print thousands of lines.
class PassMonitor final : public Monitor {
  public:
    explicit PassMonitor(Monitor& monitor) : monitor_(monitor) {}
    void warn(std::string_view line) override { monitor_.warn(line); }
    bool stopped() const override { return monitor_.stopped(); }

  private:
    Monitor& monitor_;
};

// Reports the progress of the image, in samples, or in time if that ends the render. A resumed render reports
// what is left.
class Progress {
  public:
    struct Span {
        std::uint64_t asked = 0;  // samples of all tiles together; 0 means no end
        std::uint64_t there = 0;  // samples at the beginning
        double seconds = 0;       // at the beginning
    };
    Progress(Monitor& monitor, std::string_view name, const Span& span, const Limits& limits)
        : by_time_(std::isfinite(limits.seconds)),
          begin_(tenths(span.seconds)),
          total_(by_time_          ? left(tenths(limits.seconds), begin_)
                 : span.asked == 0 ? 0
                                   : left(span.asked, span.there)),
          phase_(monitor, name, total_) {}

    // Adds samples of a tile; from any thread.
    void tile(int samples) {
        if (!by_time_) phase_.advance(static_cast<std::uint64_t>(samples));
    }
    void round(double seconds) {
        if (by_time_) advance_to(std::min(left(tenths(seconds), begin_), total_));
    }
    // Completes the phase where the render did not need all of its time.
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

// Schedules a repeated task: at intervals of at least `every` seconds and, if it may wait, so rarely that it
// takes at most a twentieth of the total time.
class Recurring {
  public:
    explicit Recurring(double every, bool may_wait = false)
        : every_(every), next_(every), may_wait_(may_wait) {}
    bool is_due(double now) const { return now >= next_; }
    // Records that the task was done from one time to another.
    void done(double begin, double end) {
        next_ = end + (may_wait_ ? std::max(every_, 19 * (end - begin)) : every_);
    }

  private:
    double every_, next_;
    bool may_wait_;
};

// Measures the time that an image has taken.
class RenderClock {
  public:
    // `earlier`: seconds of the renders that this one continues.
    explicit RenderClock(double earlier) : earlier_(earlier) {}
    double seconds() const { return clock_.seconds(); }             // of this render
    double elapsed() const { return earlier_ + clock_.seconds(); }  // of all renders of the image
    double earlier() const { return earlier_; }

  private:
    double earlier_;
    Stopwatch clock_;
};

// Seconds, by the clock and by the processors of all threads.
struct PhaseTime {
    double seconds = 0, processor = 0;
};
// Adds the time of its scope to a phase.
class TimedPhase {
  public:
    explicit TimedPhase(PhaseTime& phase) : phase_(phase) {}
    ~TimedPhase() {
        phase_.seconds += clock_.seconds();
        phase_.processor += processor_.seconds();
    }
    TimedPhase(const TimedPhase&) = delete;
    TimedPhase& operator=(const TimedPhase&) = delete;
    double seconds() const { return clock_.seconds(); }

  private:
    PhaseTime& phase_;
    Stopwatch clock_;
    ProcessorStopwatch processor_;
};

}  // namespace lucerna
