#include "engine/cli/photometry/luminaire_types.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <type_traits>

#include "engine/base/elementary.h"
#include "engine/cli/light/light_commands.h"
#include "engine/colour/chromaticity.h"
#include "engine/colour/working_space.h"
#include "engine/figures/polar.h"
#include "engine/photometry/ugr_table.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

// Returns the first of the file's keywords with text, which are named differently in each format; empty:
// none.
std::string stated(const PhotometricInfo& info, std::initializer_list<std::string_view> keys) {
    for (const std::string_view key : keys) {
        for (const auto& [name, text] : info.keywords) {
            if (name == key && !trimmed(text).empty()) return std::string(trimmed(text));
        }
    }
    return {};
}

std::string angle_text(double degrees) {
    return degrees > 0 ? fmt::format("{:.0f}°", degrees) : std::string("–");
}

// Returns the ratings of the room most often stated in data sheets, 4H x 8H with reflectances of 70, 50 and
// 20 %, for luminaires of `flux` [lm] each.
std::string ugr_of(const PhotometricWeb& web, double flux) {
    constexpr int kPerHeight = 4;
    const auto room = std::ranges::find_if(
        kUgrRooms, [](const UgrRoom& each) { return each.across == 4 && each.along == 8; });
    const UgrTable table = ugr_table(ugr_luminaire(web, web.info().axis_along_c90), kPerHeight);
    const auto& ratings = table.uncorrected[static_cast<std::size_t>(room - kUgrRooms.begin())];
    const double correction = table.correction() + 8 * log10(flux / web.flux());
    const auto rating = [&](std::size_t view) {
        const double value = ratings[view][0];
        return std::isfinite(value) ? fmt::format("{:.1f}", value + correction) : std::string("no glare");
    };
    return fmt::format("{} crosswise, {} endwise", rating(kCrosswise), rating(kEndwise));
}

void add_size(LuminaireType& type, const V3d& size) {
    type.facts.emplace_back("size", fmt::format("{:.3g} × {:.3g} × {:.3g} m", size.x, size.y, size.z));
}

void describe(LuminaireType& type, const PhotometricWeb& web, bool in_lumens) {
    const PhotometricInfo& info = web.info();
    const auto add = [&type](const char* name, std::string text) {
        if (!text.empty()) type.facts.emplace_back(name, std::move(text));
    };
    add("manufacturer", stated(info, {"MANUFAC", "manufacturer", "Manufacturer"}));
    add("luminaire", stated(info, {"LUMINAIRE", "luminaire", "Description"}));
    add("article", stated(info, {"LUMCAT", "number", "CatalogNumber"}));
    add("lamp", stated(info, {"LAMP", "lamp"}));
    add("colour as stated", stated(info, {"colour"}));
    add("colour rendering as stated", stated(info, {"colour rendering"}));
    add("source", info.provenance);
    if (info.opening.size != V3d(0)) {
        add("luminous opening", std::string(info.opening.name()));
        add_size(type, info.opening.size);
    }
    type.watts = info.watts;
    const double flux = web.flux();
    if (!(flux > 0)) return;
    PolarFigure figure;
    figure.intensity = [&](int half_plane, double angle) {
        // Towards a pole all half planes are one.
        return 1000 / flux * web.intensity(web.direction(angle, 90.0 * half_plane));
    };
    if (web.grid().planes == PhotometricPlanes::c) type.polar = polar_svg(figure);
    if (info.output_ratio > 0) add("light output ratio", fmt::format("{:.0f} %", 100 * info.output_ratio));
    const Beam beam = beam_of(web);
    add("peak intensity", fmt::format("{:.4g} cd", beam.peak * type.flux / flux));
    add("beam angle, C0 and C90", angle_text(beam.beam_angle[0]) + " and " + angle_text(beam.beam_angle[1]));
    if (in_lumens && info.opening.faces().second > 0) add("UGR, 4H × 8H, 70/50/20", ugr_of(web, type.flux));
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

Luminaires with_types(std::vector<LuminairePlace> places, const Scene& scene, const Workers& workers,
                      Monitor& monitor) {
    // Fine enough for a diagram; the time grows with the number of directions.
    FarFieldGrid of_diagrams;
    of_diagrams.polar_step = 2.5;
    of_diagrams.azimuth_step = 15;
    Monitor silent;  // what the files warn of was said when the scene was read
    Luminaires luminaires{std::move(places), {}, {}};
    std::vector<LuminaireType>& types = luminaires.types;
    for (const LuminairePlace& lamp : luminaires.places) {
        const auto known = std::ranges::find_if(types, [&](const LuminaireType& type) {
            return type.kind == lamp.kind && type.file == lamp.file &&
                   std::fabs(type.flux - lamp.flux) < 1e-4 * type.flux;
        });
        luminaires.type_of.push_back(static_cast<std::size_t>(known - types.begin()));
        if (known != types.end()) {
            ++known->count;
            continue;
        }
        const Light& light = *scene.lights()[lamp.light];
        LuminaireType& type = types.emplace_back();
        type.kind = lamp.kind;
        type.file = lamp.file;
        type.count = 1;
        type.flux = lamp.flux;
        const bool in_lumens = light.unit() == FluxUnit::lumen;
        if (lamp.kind == "photometric")
            describe(type, read_photometric(light.file(), silent), in_lumens);
        else if (lamp.kind == "lightfield" || lamp.kind == "rayfile")
            describe(type, far_field_of(light.file(), of_diagrams, workers, monitor), in_lumens);
        else
            add_size(type, lamp.size);
        if (const double kelvin = kelvin_of(light.flux()); kelvin > 0)
            type.facts.emplace_back("colour temperature", fmt::format("{:.0f} K", kelvin));
    }
    return luminaires;
}

}  // namespace lucerna
