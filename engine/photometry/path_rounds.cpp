#include "engine/photometry/path_rounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/units.h"

namespace lucerna {
namespace {

// The least and most that a round makes of the samples before it.
constexpr double kLeastGrowth = 1.25, kMostGrowth = 4;

// Seconds: a forecast of less is not told, one of more ends the computation, but not before it is worth
// something.
constexpr double kShort = 60, kTooLong = 3600, kLeastForForecast = 15;

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

bool PathRounds::is_worth_going_on(double reached, double wanted, Monitor& monitor) const {
    if (std::isfinite(options_.limits.seconds)) return true;
    const double so_far = clock_.seconds();
    const double left = so_far * (sqr(reached / wanted) - 1);  // wanted > 0
    if (so_far < kLeastForForecast || !(left > kShort)) return true;
    const std::string forecast =
        fmt::format("± {:.2g} % after {}; at this rate ± {:.2g} % takes about {} more", 100 * reached,
                    duration_text(so_far), 100 * wanted, duration_text(left));
    if (left > kTooLong) {
        monitor.warn(forecast + ", so the computation ends here; state --time to go on for that long");
        return false;
    }
    monitor.info(forecast);
    return true;
}

void PathRounds::grow(double too_wide, int most) {
    const double growth = std::clamp(sqr(too_wide), kLeastGrowth, kMostGrowth);
    job_.spp = static_cast<int>(std::min<double>(most, std::ceil(job_.spp * growth)));
    options_.resume = &kept_;
}

}  // namespace lucerna
