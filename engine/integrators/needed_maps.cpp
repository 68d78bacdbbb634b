#include "engine/integrators/photon_mapping.h"

#include <fmt/format.h>

#include <optional>

#include "engine/scene/path_limits.h"
#include "engine/transport/light_choice.h"

namespace lucerna {
namespace {

MapNeed direct_map(const PhotonMapSettings& settings, const Scene& scene) {
    if (uses_light_guides(settings, scene)) {
        return {false, fmt::format("direct light is sampled, guided by {} light paths of its own",
                                   guide_paths(settings))};
    }
    if (settings.direct == DirectMethod::guided) {
        return {false, "direct light is sampled as with mc: a single light without parts leaves no choice"};
    }
    const bool map = settings.direct == DirectMethod::map;
    return {map, map ? "direct light is read from it" : "direct light is sampled (direct = mc)"};
}

// Returns why a map is not built: paths of fewer than `least` bounces contribute nothing to it.
std::optional<MapNeed> too_short(const PhotonMapSettings& settings, int least) {
    if (most_bounces(settings.max_depth) >= least) return std::nullopt;
    return MapNeed{false, fmt::format("paths have at most {} bounce{} (maxdepth)", settings.max_depth,
                                      settings.max_depth == 1 ? "" : "s")};
}

MapNeed global_map(const PhotonMapSettings& settings) {
    if (settings.indirect == IndirectMethod::none) return {false, "indirect = none"};
    if (const auto none = too_short(settings, settings.indirect == IndirectMethod::map ? 2 : 3)) return *none;
    return {true, settings.indirect == IndirectMethod::map ? "indirect light is read from it"
                                                           : "gather rays read it where they land"};
}

MapNeed caustic_map(const PhotonMapSettings& settings, const Scene& scene) {
    if (settings.indirect == IndirectMethod::none) return {false, "indirect = none"};
    if (const auto none = too_short(settings, 2)) return *none;
    if (settings.specular_below > 0) {
        return {true, fmt::format("gloss with alpha below {:g} counts as specular", settings.specular_below)};
    }
    const bool specular = scene.has_specular();
    return {specular,
            specular ? "the scene has mirrors or smooth glass" : "no surface of the scene is specular"};
}

MapNeed volume_map(const PhotonMapSettings& settings, const Scene& scene) {
    if (!scatters(scene.media())) return {false, "no medium of the scene scatters"};
    return {true,
            settings.direct == DirectMethod::map
                ? "light scattered in media is read from it"
                : "light scattered in media is read from it, except for light directly from light sources"};
}

}  // namespace

MapNeed map_need(MapKind kind, const PhotonMapSettings& settings, const Scene& scene) {
    switch (kind) {
        case MapKind::direct:
            return direct_map(settings, scene);
        case MapKind::global:
            return global_map(settings);
        case MapKind::caustic:
            return caustic_map(settings, scene);
        case MapKind::volume:
            return volume_map(settings, scene);
    }
    return {false, ""};
}

bool uses_light_guides(const PhotonMapSettings& settings, const Scene& scene) {
    return settings.direct == DirectMethod::gated ||
           (settings.direct == DirectMethod::guided && !nothing_to_choose(scene));
}

std::int64_t guide_paths(const PhotonMapSettings& settings) {
    constexpr std::int64_t kOneIn = 5;  // light paths of the maps; 200,000 by default
    return (settings.photons + kOneIn - 1) / kOneIn;
}

}  // namespace lucerna
