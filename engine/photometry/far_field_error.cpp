#include "engine/photometry/far_field_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/base/elementary.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Propagates the half-widths to first order, taking `near` and `far` as independent, as their samples are.
Reading95 relative_error(const Reading95& near, const Reading95& far) {
    if (!(near.value > 0)) return {std::nan(""), 0};
    const double ratio = far.value / near.value;
    return {ratio - 1, hypot(far.half_width, ratio * near.half_width) / near.value};
}

std::string percent(const Reading95& error) {
    const std::string text = reading_text({100 * error.value, 100 * error.half_width}) + " %";
    return error.value < 0 ? text : "+" + text;
}

}  // namespace

std::vector<FarFieldError> far_field_errors(const IlluminanceReport& near, const IlluminanceReport& far) {
    std::vector<FarFieldError> all;
    for (std::size_t s = 0; s < near.surfaces.size(); ++s) {
        const SurfaceIlluminance &by_near = near.surfaces[s], &by_far = far.surfaces[s];
        FarFieldError& error = all.emplace_back();
        error.surface = by_near.surface.name;
        error.mean = relative_error(by_near.mean, by_far.mean);
        double squares = 0, lit = 0;
        // Converts half-widths to standard errors.
        const double width = student_95(static_cast<std::uint64_t>(near.sensors));
        for (std::size_t i = 0; i < by_near.points.size(); ++i) {
            const Reading95 of = relative_error(by_near.points[i].all, by_far.points[i].all);
            error.points.push_back(of);
            if (std::isnan(of.value)) continue;
            const bool first = lit == 0;
            if (first || of.value < error.least.value) error.least = of;
            if (first || of.value > error.greatest.value) error.greatest = of;
            squares += of.value * of.value - sqr(of.half_width / width);
            ++lit;
        }
        error.rms = lit > 0 ? std::sqrt(std::max(0.0, squares / lit)) : 0;
    }
    return all;
}

std::string far_field_text(const FarFieldErrors& errors) {
    std::string text;
    const auto add = [&text](const std::vector<FarFieldError>& surfaces, std::string_view from) {
        if (surfaces.empty()) return;
        text += fmt::format(
            "error of the far field from {}: lamps with their far-field intensities, compared with their "
            "near "
            "field\n",
            from);
        for (const FarFieldError& error : surfaces) {
            text += fmt::format("{}: mean {}, RMS over points {:.2g} %, from {} to {}\n",
                                plain_text(error.surface), percent(error.mean), 100 * error.rms,
                                percent(error.least), percent(error.greatest));
        }
    };
    add(errors.from_point, "a point");
    add(errors.from_opening, "the luminous opening");
    if (errors.floor > 0) {
        text += fmt::format(
            "floor of the method: the table of the far field differs from the lamps' intensities by {:.2g} % "
            "of their flux; an error that is not larger may be the table's\n",
            100 * errors.floor);
    }
    return text;
}

}  // namespace lucerna
