// Path tracing until an interval is as narrow as wanted: rounds of samples, each going on from those before.
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "engine/render/render.h"

namespace lucerna {

// How long it takes until an interval is as narrow as wanted, at the rate of the seconds so far.
struct Forecast {
    enum class Verdict : std::uint8_t { go_on, tell, give_up };
    Verdict verdict;
    double left;  // seconds
};
Forecast forecast(double so_far, double reached, double wanted);

class PathRounds {
  public:
    // Of `job`, which must outlive this, by its path tracer or a default one, that measures `quantity`; its
    // first round has `samples`. All rounds together end after so many seconds.
    PathRounds(Job& job, Quantity quantity, int samples, std::uint64_t seed, const Workers& workers,
               double seconds);
    PathRounds(const PathRounds&) = delete;
    PathRounds& operator=(const PathRounds&) = delete;

    // With all samples so far. Ends early, with what there is, when the monitor says so.
    RenderResult render(Monitor& monitor);
    // The next round has enough samples for intervals that were `too_wide` times as wide as wanted, within
    // bounds that keep rounds few and their forecast sound; at most `most`.
    void grow(double too_wide, int most);
    // Whether more rounds are worth their time, where none is set (forecast()). Tells how long they take
    // where that is long; where it is hours, warns that the computation ends for that reason. `reached` and
    // `wanted` are shares.
    bool is_worth_going_on(double reached, double wanted, Monitor& monitor) const;

  private:
    Job& job_;
    RenderOptions options_;
    Checkpoint kept_;
    Stopwatch clock_;
};

}  // namespace lucerna
