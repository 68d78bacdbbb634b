#include "engine/cli/photometry/luminaire_types.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "engine/cli/light/light_commands.h"
#include "engine/colour/chromaticity.h"
#include "engine/colour/working_space.h"
#include "engine/figures/polar.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

void describe(LuminaireType& type, const PhotometricWeb& web) {
    const double flux = web.flux();
    if (!(flux > 0)) return;
    PolarFigure figure;
    figure.intensity = [&](int half_plane, double angle) {
        // Towards a pole all half planes are one.
        return 1000 / flux * web.intensity(web.direction(angle, 90.0 * half_plane));
    };
    if (web.grid().planes == PhotometricPlanes::c) type.polar = polar_svg(figure);
    type.beam = beam_of(web);
    type.beam.peak *= type.flux / flux;
    type.watts = web.info().watts;
    type.provenance = web.info().provenance;
}

// Returns the colour temperature of light in linear sRGB, 0 if it has none. White without a colour of its own
// says nothing about the lamp.
double kelvin_of(const Rgb& light) {
    const float most = std::max({light.x, light.y, light.z}), least = std::min({light.x, light.y, light.z});
    if (most - least < 1e-3F * most) return 0;
    const auto temperature = colour_temperature(WorkingSpace().light_to_xyz(light));
    return temperature ? temperature->kelvin : 0;
}

}  // namespace

PhotometricWeb far_field_of(const std::filesystem::path& file, const FarFieldGrid& grid,
                            const Workers& workers, Monitor& monitor) {
    const auto web = [&](const auto& lamp) {
        if constexpr (std::is_same_v<std::decay_t<decltype(lamp)>, Lumigraph>)
            return far_field(lamp, grid, workers, monitor);
        else
            return far_field(lamp, grid);
    };
    return std::visit(web, read_lamp_file(file, monitor));
}

std::vector<LuminaireType> luminaire_types(const Scene& scene, const Workers& workers, Monitor& monitor) {
    // Fine enough for a diagram; the time grows with the number of directions.
    FarFieldGrid of_diagrams;
    of_diagrams.polar_step = 2.5;
    of_diagrams.azimuth_step = 15;
    Monitor silent;  // what the files warn of was said when the scene was read
    std::vector<LuminaireType> types;
    for (const auto& light : scene.lights()) {
        const auto bounds = light->bounds();
        if (!bounds || !(light->power() > 0)) continue;
        const std::string file = light->file().filename().string();
        const auto known = std::ranges::find_if(types, [&](const LuminaireType& type) {
            return type.kind == light->kind() && type.file == file &&
                   std::fabs(type.flux - light->power()) < 1e-4 * type.flux;
        });
        if (known != types.end()) {
            ++known->count;
            continue;
        }
        LuminaireType& type = types.emplace_back();
        type.kind = light->kind();
        type.file = file;
        type.count = 1;
        type.flux = light->power();
        type.size = V3d(bounds->box.size());
        type.kelvin = kelvin_of(light->flux());
        if (light->kind() == "photometric")
            describe(type, read_photometric(light->file(), silent));
        else if (light->kind() == "lightfield" || light->kind() == "rayfile")
            describe(type, far_field_of(light->file(), of_diagrams, workers, monitor));
    }
    return types;
}

}  // namespace lucerna
