// Path tracing in rounds of samples, each continuing the one before, until an interval is as narrow as
// wanted.
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "engine/render/render.h"

namespace lucerna {

// The remaining time until an interval is as narrow as wanted, at the rate of the seconds so far.
struct Forecast {
    enum class Verdict : std::uint8_t { go_on, tell, give_up };
    Verdict verdict;
    double left;  // seconds
};
Forecast forecast(double so_far, double reached, double wanted);

class PathRounds {
  public:
    // Renders `job`, which must outlive this object, with its path tracer or a default one that measures
    // `quantity`. The first round has `samples` per pixel. All rounds together end after `seconds`.
    PathRounds(Job& job, Quantity quantity, int samples, std::uint64_t seed, const Workers& workers,
               double seconds);
    PathRounds(const PathRounds&) = delete;
    PathRounds& operator=(const PathRounds&) = delete;

    // All rounds together end after `seconds` of rendering.
    void end_at(double seconds) { options_.limits.seconds = seconds; }
    // Returns the result of all samples so far. Ends early when the monitor says so.
    RenderResult render(Monitor& monitor);
    // Sets the samples of the next round for intervals that were `too_wide` times as wide as wanted. Bounds
    // on the growth keep rounds few and their forecast reliable. There are never more than `most` samples.
    void grow(double too_wide, int most);
    // Tells whether more rounds are worth their time if no time limit is set (forecast()). Reports a long
    // remaining time; if it is hours, warns that the computation ends for that reason. `reached` and `wanted`
    // are relative half-widths.
    bool is_worth_going_on(double reached, double wanted, Monitor& monitor) const;

  private:
    Job& job_;
    RenderOptions options_;
    Checkpoint kept_;
    Stopwatch clock_;
};

}  // namespace lucerna
