// Path tracing until an interval is as narrow as wanted: rounds of samples, each going on from those before.
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "engine/render/render.h"

namespace lucerna {

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
    // Whether more rounds are worth their time, where none is set: at the rate so far, intervals that are
    // `too_wide` times as wide as wanted are narrow enough within an hour. Tells how long it takes where that
    // is more than a minute; `reached` and `wanted` are shares. Where it is hours, it warns and says why the
    // computation ends.
    bool is_worth_going_on(double reached, double wanted, Monitor& monitor) const;

  private:
    Job& job_;
    RenderOptions options_;
    Checkpoint kept_;
    Stopwatch clock_;
};

}  // namespace lucerna
