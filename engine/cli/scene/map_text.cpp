#include "engine/cli/scene/map_text.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <set>
#include <string>

#include "engine/colour/working_space.h"

namespace lucerna {
namespace {

// Returns the colour space of the photons' power that the facts state, by default sRGB.
WorkingSpace colours_of(const MapOrigin& origin) {
    for (const auto& [name, value] : origin.facts) {
        if (name == kColourSpaceFact) return WorkingSpace::named(value).value_or(WorkingSpace());
    }
    return {};
}

std::string flux_text(const V3d& light, const WorkingSpace& colours, const std::string& unit) {
    const Rgb rgb = colours.light_to_rgb(Rgb(light));
    return fmt::format("{:.6g} {} ({:.4g} {:.4g} {:.4g})", double{luminance(Rgb(light))}, unit, rgb.x, rgb.y,
                       rgb.z);
}

void print_map(std::ostream& out, const SavedMaps& saved, MapKind kind, const WorkingSpace& colours) {
    const std::optional<Photons>& photons = saved.maps[static_cast<std::size_t>(kind)];
    const std::string name = fmt::format("{} map", map_name(kind));
    if (!photons) return fmt::print(out, "{:<12} not built\n", name);
    if (photons->size() == 0) return fmt::print(out, "{:<12} 0 photons\n", name);
    V3d flux(0);
    Box3d box;
    std::set<std::uint32_t> lights;
    for (std::size_t i = 0; i < photons->size(); ++i) {
        flux += V3d(photons->photons[i].power);
        box.extendBy(V3d(photons->positions[i]) + saved.origin.place);
        lights.insert(photons->photons[i].light);
    }
    const int most = *std::ranges::max_element(photons->bounces);
    fmt::print(out, "{:<12} {} photons of {} light{}, {}, up to {} bounces before\n", name, photons->size(),
               lights.size(), lights.size() == 1 ? "" : "s", flux_text(flux, colours, saved.origin.unit),
               most);
    fmt::print(out, "  bounds     ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})\n", box.min.x, box.min.y,
               box.min.z, box.max.x, box.max.y, box.max.z);
}

}  // namespace

void print_maps(std::ostream& out, const SavedMaps& saved) {
    const WorkingSpace colours = colours_of(saved.origin);
    fmt::print(out, "photon maps  {}\n",
               saved.origin.scene.empty() ? "of a scene in memory" : "of " + saved.origin.scene);
    fmt::print(out, "light paths  {}, which emit {}\n", saved.ledger.paths,
               flux_text(saved.ledger.emitted, colours, saved.origin.unit));
    for (int kind = 0; kind < kMapKinds; ++kind) print_map(out, saved, static_cast<MapKind>(kind), colours);
    fmt::print(out, "made for\n");
    for (const auto& [name, value] : saved.origin.facts) fmt::print(out, "  {}: {}\n", name, value);
}

}  // namespace lucerna
