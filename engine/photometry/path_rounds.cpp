#include "engine/photometry/path_rounds.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lucerna {
namespace {

// The least and most that a round makes of the samples before it.
constexpr double kLeastGrowth = 1.25, kMostGrowth = 4;

}  // namespace

PathRounds::PathRounds(Job& job, Quantity quantity, int samples, std::uint64_t seed, const Workers& workers,
                       double seconds)
    : job_(job) {
    const auto* asked = std::get_if<PathSettings>(&job.integrator);
    PathSettings path = asked ? *asked : PathSettings();
    path.quantity = quantity;
    job.integrator = path;
    job.spp = samples;
    options_.seed = seed;
    options_.workers = workers;
    options_.limits.seconds = seconds;
    options_.keep = [this](Checkpoint now) { kept_ = std::move(now); };
}

RenderResult PathRounds::render(Monitor& monitor) {
    return lucerna::render(job_, options_, monitor);
}

void PathRounds::grow(double too_wide, int most) {
    const double growth = std::clamp(sqr(too_wide), kLeastGrowth, kMostGrowth);
    job_.spp = static_cast<int>(std::min<double>(most, std::ceil(job_.spp * growth)));
    options_.resume = &kept_;
}

}  // namespace lucerna
