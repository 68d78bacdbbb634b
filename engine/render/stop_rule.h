// Decides when a render ends: when it has its samples, its time is up or its error is small enough, whichever
// comes first.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace lucerna {

struct Limits {
    double seconds = std::numeric_limits<double>::infinity();  // since the render began, preparation included
    double error = 0;  // Film::relative_error() at which to end; 0: none
};

// Counts in units of work that are useful only when complete: a sample of every pixel, or a pass.
class StopRule {
  public:
    // The error is an estimate, too, and is not trusted with fewer units.
    static constexpr int kLeastForError = 8;

    // `done` units are there at the beginning, after so many seconds.
    StopRule(const Limits& limits, int most, int done = 0, double seconds = 0)
        : limits_(limits), most_(most), last_done_(done), last_seconds_(seconds) {}
    // Replaces the limit of time.
    void end_at(double seconds) { limits_.seconds = seconds; }

    bool wants_error() const { return limits_.error > 0; }

    // Returns the number of units to do next, at most `wanted` (>= 1), or 0 to end. Called with the number of
    // units done and the seconds since the beginning, before the first unit and after the work of every
    // answer. Units that would not end in time at the pace of the last answer are not begun, except for the
    // first.
    int next(int done, int wanted, double seconds) {
        int units = std::min(wanted, most_ - done);
        if (units <= 0) {
            reason_ = "samples";
            return 0;
        }
        if (done > last_done_ && std::isfinite(limits_.seconds)) {
            const double pace = std::max(seconds - last_seconds_, 1e-9) / (done - last_done_);
            const double fit = std::max(0.0, limits_.seconds - seconds) / pace;
            if (fit < 1) reason_ = kTime;
            units = fit < units ? static_cast<int>(fit) : units;
        }
        last_done_ = done;
        last_seconds_ = seconds;
        return units;
    }
    // Returns whether `done` units with that error suffice.
    bool satisfied(int done, double error) {
        const bool enough = wants_error() && done >= kLeastForError && error <= limits_.error;
        if (enough) reason_ = "error";
        return enough;
    }
    // Returns whether there was too little time for another unit. There may be enough for a part of one.
    bool out_of_time() const { return reason_ == kTime; }
    // Records that time is up within a unit.
    const char* time_is_up() { return reason_ = kTime; }
    // Returns what ended it: "samples", "time" or "error"; "user" as long as none of them did.
    const char* reason() const { return reason_; }

  private:
    static constexpr const char* kTime = "time";

    Limits limits_;
    int most_;
    int last_done_ = 0;
    double last_seconds_ = 0;
    const char* reason_ = "user";
};

}  // namespace lucerna
