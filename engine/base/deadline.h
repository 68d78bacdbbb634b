// Limits the time of work. Code that can do with less work reads how much time is left.
#pragma once

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

namespace lucerna {

class Deadline {
  public:
    Deadline() = default;  // never
    // Returns a deadline in `seconds` from now; none if that is infinite or exceeds what a clock holds.
    static Deadline after(double seconds) {
        constexpr double kMost = 1e9;
        Deadline deadline;
        if (seconds < kMost) {
            deadline.at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(std::fmax(seconds, 0.0)));
        }
        return deadline;
    }

    // Returns the deadline of the first of `count` > 0 consecutive tasks that take equal time.
    Deadline shared_by(int count) const { return count > 1 && exists() ? after(left() / count) : *this; }

    bool exists() const { return at_.has_value(); }
    // Returns seconds: <= 0 once the deadline has passed, infinity without a deadline.
    double left() const {
        if (!at_) return std::numeric_limits<double>::infinity();
        return std::chrono::duration<double>(*at_ - Clock::now()).count();
    }
    bool passed() const { return at_ && !(left() > 0); }

  private:
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> at_;
};

}  // namespace lucerna
