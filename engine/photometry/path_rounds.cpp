#include "engine/photometry/path_rounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/text/units.h"

namespace lucerna {
namespace {

// Bounds of the growth of the sample count from one round to the next.
constexpr double kLeastGrowth = 1.25, kMostGrowth = 4;

// Limits in seconds: a forecast of at most kShort is not reported, one above kTooLong ends the computation,
// and neither is made in the first kLeastForForecast.
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

Forecast forecast(double so_far, double reached, double wanted) {
    using enum Forecast::Verdict;
    const double left = so_far * (sqr(reached / wanted) - 1);  // wanted > 0
    if (so_far < kLeastForForecast || !(left > kShort)) return {go_on, left};
    return {left > kTooLong ? give_up : tell, left};
}

bool PathRounds::is_worth_going_on(double reached, double wanted, Monitor& monitor) const {
    using enum Forecast::Verdict;
    if (std::isfinite(options_.limits.seconds)) return true;
    const double so_far = clock_.seconds();
    const Forecast expected = forecast(so_far, reached, wanted);
    if (expected.verdict == go_on) return true;
    const std::string text =
        fmt::format("± {:.2g} % after {}; at this rate ± {:.2g} % takes {} more", 100 * reached,
                    duration_text(so_far), 100 * wanted, duration_text(expected.left));
    if (expected.verdict == tell) {
        monitor.info(text);
        return true;
    }
    monitor.warn(text + ", so the computation ends here; --time sets how long it may go on");
    return false;
}

void PathRounds::grow(double too_wide, int most) {
    const double growth = std::clamp(sqr(too_wide), kLeastGrowth, kMostGrowth);
    job_.spp = static_cast<int>(std::min<double>(most, std::ceil(job_.spp * growth)));
    options_.resume = &kept_;
}

}  // namespace lucerna
