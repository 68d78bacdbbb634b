#include "engine/photometry/measurement_uncertainty.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/stats.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr double kCoverageFactor = 2;       // k
constexpr double kNormal95 = 1.6448536269;  // the 95 % quantile of the standard normal distribution

// The variances of a number over the replicates.
struct Scatter {
    double variance = 0;     // s², due to lamps and Monte Carlo noise
    double monte_carlo = 0;  // Monte Carlo variance of one run, mean of all runs
};

Scatter scatter_of(std::span<const Reading95> by_replicate, int sensors) {
    RunningStats values;
    Scatter scatter;
    const double width = student_95(static_cast<std::uint64_t>(sensors));  // in standard errors
    for (const Reading95& reading : by_replicate) {
        values.add(reading.value);
        scatter.monte_carlo += sqr(reading.half_width / width) / static_cast<double>(by_replicate.size());
    }
    scatter.variance = values.variance();
    return scatter;
}

// Returns an upper bound. It replaces an s² below the Monte Carlo variance by that variance, the expectation
// of s² for lamps without uncertainty, because an s² that is small by chance would give a bound near 0.
LampUncertainty bound_of(const Scatter& scatter, int freedom) {
    const double most =
        std::max(scatter.variance, scatter.monte_carlo) * freedom / chi_square_quantile(-kNormal95, freedom);
    return {kCoverageFactor * std::sqrt(std::max(0.0, most - scatter.monte_carlo)), scatter.monte_carlo > 0,
            0};
}

std::string half_width_text(double half_width, bool upper_bound) {
    return fmt::format("{} {:.2g}", upper_bound ? "<" : "±", half_width);
}

template <typename Of>
std::vector<Reading95> readings(std::span<const IlluminanceReport> by_replicate, Of&& of) {
    std::vector<Reading95> all;
    for (const IlluminanceReport& report : by_replicate) all.push_back(of(report));
    return all;
}

SurfaceUncertainty surface_uncertainty(const IlluminanceReport& whole,
                                       std::span<const IlluminanceReport> by_replicate, std::size_t s) {
    const auto of = [&](Reading95 SurfaceIlluminance::*what) {
        return lamp_uncertainty(
            readings(by_replicate, [&](const IlluminanceReport& r) { return r.surfaces[s].*what; }),
            whole.sensors);
    };
    SurfaceUncertainty made;
    made.surface = whole.surfaces[s].surface.name;
    made.mean = of(&SurfaceIlluminance::mean);
    made.least = of(&SurfaceIlluminance::least);
    made.uniformity = of(&SurfaceIlluminance::uniformity);
    double squares = 0, lit = 0;
    for (std::size_t i = 0; i < whole.surfaces[s].points.size(); ++i) {
        const std::vector<Reading95> values =
            readings(by_replicate, [&](const IlluminanceReport& r) { return r.surfaces[s].points[i].all; });
        made.points.push_back(lamp_uncertainty(values, whole.sensors));
        made.upper_bounds += made.points.back().upper_bound;
        const double e = whole.surfaces[s].points[i].all.value;
        if (!(e > 0)) continue;
        const Scatter scatter = scatter_of(values, whole.sensors);
        squares += (scatter.variance - scatter.monte_carlo) / sqr(e);
        ++lit;
    }
    made.rms = lit > 0 ? kCoverageFactor * std::sqrt(std::max(0.0, squares / lit)) : 0;
    return made;
}

}  // namespace

double chi_square_quantile(double z, int n) {
    const double v = 2.0 / (9.0 * n);  // n >= 1
    return n * pow(1 - v + z * std::sqrt(v), 3);
}

LampUncertainty lamp_uncertainty(std::span<const Reading95> by_replicate, int sensors) {
    assert(by_replicate.size() >= 2);
    const int freedom = static_cast<int>(by_replicate.size()) - 1;
    const Scatter scatter = scatter_of(by_replicate, sensors);
    if (!(scatter.variance * freedom > scatter.monte_carlo * chi_square_quantile(kNormal95, freedom)))
        return bound_of(scatter, freedom);
    const double lamps = scatter.variance - scatter.monte_carlo;  // > 0, as the quantile is above `freedom`
    return {kCoverageFactor * std::sqrt(lamps), false, scatter.variance / (lamps * std::sqrt(2.0 * freedom))};
}

MeasurementUncertainty measurement_uncertainty(const IlluminanceReport& whole,
                                               std::span<const IlluminanceReport> by_replicate) {
    MeasurementUncertainty made;
    made.replicates = static_cast<int>(by_replicate.size());
    for (std::size_t s = 0; s < whole.surfaces.size(); ++s)
        made.surfaces.push_back(surface_uncertainty(whole, by_replicate, s));
    return made;
}

FieldError field_error(std::string lamp, std::span<const LightField* const> slabs) {
    FieldError made{std::move(lamp), !slabs.empty(), 0, 0};
    for (const LightField* const slab : slabs) {
        const std::vector<PlaneError>& errors = slab->info().errors;
        made.known = made.known && !errors.empty();
        for (const PlaneError& e : errors) {
            made.greatest = std::max(made.greatest, e.relative());
            if (std::isinf(e.distance)) made.by_direction = std::max(made.by_direction, e.relative());
        }
    }
    return made;
}

double combined(const Reading95& monte_carlo, const LampUncertainty& lamps) {
    return hypot(monte_carlo.half_width, lamps.expanded);
}

std::vector<std::vector<std::string>> uncertainty_rows(const IlluminanceReport& whole,
                                                       const MeasurementUncertainty& lamps) {
    std::vector<std::vector<std::string>> rows{{"surface", "of", "value", "Monte Carlo", "lamps", "both"}};
    for (std::size_t s = 0; s < lamps.surfaces.size(); ++s) {
        const SurfaceIlluminance& surface = whole.surfaces[s];
        const SurfaceUncertainty& of = lamps.surfaces[s];
        const auto add = [&](const char* name, const Reading95& value, const LampUncertainty& by_lamps) {
            rows.push_back({plain_text(of.surface), name, fmt::format("{:.4g}", value.value),
                            half_width_text(value.half_width, false),
                            half_width_text(by_lamps.expanded, by_lamps.upper_bound),
                            half_width_text(combined(value, by_lamps), by_lamps.upper_bound)});
        };
        add("mean", surface.mean, of.mean);
        add("least", surface.least, of.least);
        add("U_0", surface.uniformity, of.uniformity);
    }
    return rows;
}

std::string uncertainty_heading(const MeasurementUncertainty& lamps) {
    return fmt::format(
        "U (k = 2) from {} bootstrap replicates, known to ± {:.0f} %; < is an upper bound (95 %), where it "
        "is not distinguishable from Monte Carlo noise",
        lamps.replicates, 100 / std::sqrt(2.0 * (lamps.replicates - 1)));
}

std::vector<std::string> uncertainty_lines(const MeasurementUncertainty& lamps) {
    std::vector<std::string> lines;
    for (const SurfaceUncertainty& of : lamps.surfaces) {
        lines.push_back(
            fmt::format("{}: U ± {:.2g} % of illuminance, RMS over points; at {} of {} points no more than "
                        "an upper bound",
                        plain_text(of.surface), 100 * of.rms, of.upper_bounds, of.points.size()));
    }
    for (const FieldError& of : lamps.fields) {
        lines.push_back(
            of.known
                ? fmt::format("{}: error of the light field by held-out rays, its bias included: {:.2g} % "
                              "of irradiance by direction, up to {:.2g} % on planes nearby",
                              plain_text(of.lamp), 100 * of.by_direction, 100 * of.greatest)
                : fmt::format("{}: the file does not say the error of the light field; import it anew",
                              plain_text(of.lamp)));
    }
    return lines;
}

std::string uncertainty_text(const IlluminanceReport& whole, const MeasurementUncertainty& lamps) {
    std::string text = "uncertainty of the lamps' measurement: " + uncertainty_heading(lamps) + '\n' +
                       table_text(uncertainty_rows(whole, lamps));
    for (const std::string& line : uncertainty_lines(lamps)) text += line + '\n';
    return text;
}

}  // namespace lucerna
