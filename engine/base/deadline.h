// Until when work may take, by the clock: what can do with less asks how much time is left.
#pragma once

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

namespace lucerna {

class Deadline {
  public:
    Deadline() = default;  // never
    // So many seconds from now; infinite, or more than a clock can hold: never.
    static Deadline after(double seconds) {
        constexpr double kMost = 1e9;
        Deadline deadline;
        if (seconds < kMost) {
            deadline.at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(std::fmax(seconds, 0.0)));
        }
        return deadline;
    }

    // When the first of `count` > 0 things that follow on one another and take as long is to be done.
    Deadline shared_by(int count) const { return count > 1 && exists() ? after(left() / count) : *this; }

    bool exists() const { return at_.has_value(); }
    // Seconds; not above 0 once it has passed, infinite where there is none.
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
