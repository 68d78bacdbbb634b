#include "engine/photometry/daylight_factor.h"

#include <fmt/format.h>

#include <utility>

#include "engine/base/error.h"
#include "engine/scene/scene.h"

namespace lucerna {
namespace {

void scale(Reading95& reading, double factor) {
    reading.value *= factor;
    reading.half_width *= factor;
}

void scale(std::vector<double>& values, double factor) {
    for (double& value : values) value *= factor;
}

void scale(PointIlluminance& point, double factor) {
    scale(point.all, factor);
    scale(point.indirect, factor);
    scale(point.groups, factor);
    point.direct *= factor;
    point.mirrored *= factor;
}

void scale(SurfaceIlluminance& surface, double factor) {
    for (PointIlluminance& point : surface.points) scale(point, factor);
    for (Reading95* reading : {&surface.mean, &surface.least, &surface.greatest}) scale(*reading, factor);
    for (double* value : {&surface.direct, &surface.by_light_paths, &surface.never_met, &surface.blur})
        *value *= factor;
    scale(surface.groups, factor);
}

}  // namespace

double sky_illuminance(const Scene& scene) {
    std::optional<double> found;
    for (const auto& light : scene.lights()) {
        if (!(light->power() > 0)) continue;
        const std::optional<double> irradiance = light->sky_irradiance();
        if (!irradiance) {
            throw InputError(fmt::format(
                "the scene has a {} light, but a daylight factor is that of the sky alone; remove the light "
                "from the scene",
                light->kind()));
        }
        if (found) throw InputError("the scene has more than one sky; a daylight factor is relative to one");
        found = irradiance;
    }
    if (emitting_medium(scene.media()))
        throw InputError("a medium of the scene emits light, but a daylight factor is that of the sky alone");
    if (!found || !(*found > 0)) {
        throw InputError(
            "the scene has no sky, to which a daylight factor is relative; expected LightSource \"sky\" or "
            "\"infinite\"");
    }
    return *found;
}

IlluminanceReport daylight_factors(IlluminanceReport report, double sky_illuminance) {
    for (SurfaceIlluminance& surface : report.surfaces) scale(surface, 100 / sky_illuminance);
    report.quantity = "daylight factor";
    report.symbol = "D";
    report.unit = "%";
    report.sky_illuminance = sky_illuminance;
    return report;
}

}  // namespace lucerna
