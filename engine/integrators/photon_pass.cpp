#include "engine/integrators/photon_pass.h"

#include "engine/base/monitor.h"
#include "engine/integrators/photon_mapping.h"
#include "engine/integrators/precomputed_irradiance.h"
#include "engine/system/files.h"
#include "photon/map_points.h"

namespace lucerna {
namespace {

std::array<bool, kMapKinds> wanted_maps(const PhotonMapSettings& settings, const PassContext& context) {
    std::array<bool, kMapKinds> maps{};
    for (std::size_t i = 0; i < kMapKinds; ++i) {
        const auto kind = static_cast<MapKind>(i);
        const MapNeed need = map_need(kind, settings, context.scene);
        maps[i] = need.build;
        context.statistics.map_needs[i] = need.text();
    }
    return maps;
}

// Photons get this share of the preparation time where irradiance is precomputed, too.
constexpr double kPhotonsShare = 0.4;

PhotonMaps make_maps(const MapParameters& parameters, const PassContext& context, const MapFiles& files) {
    const Scene& scene = context.scene;
    MapOrigin origin{files.scene, flux_unit_text(scene_unit(scene)), scene.origin(), files.scene_facts};
    const Facts by_parameters = map_facts(parameters);
    origin.facts.insert(origin.facts.end(), by_parameters.begin(), by_parameters.end());
    if (!files.load.empty()) {
        context.statistics.map_source = "read from a file";
        return load_maps(files.load, origin.facts, scene.lights().size(), parameters.index, context.workers);
    }
    PhotonMaps maps = build_photon_maps(scene, parameters, context.workers, context.monitor);
    const bool writes = !context.workers.ranks || context.workers.ranks->leads();
    if (!files.save.empty() && writes && !context.monitor.stopped()) {
        if (suffix_of(files.save) == kMapPointsSuffix) {
            write_map_points(files.save, maps, scene.origin());
        } else {
            save_maps(files.save, maps, origin);
        }
    }
    return maps;
}

void report(const PhotonMaps& maps, PassStatistics& statistics) {
    statistics.ledger = LedgerStatistics(maps.ledger);
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) statistics.maps[kind] = maps.counts[kind];
    statistics.seconds.add("photons", maps.seconds_trace);
    statistics.seconds.add("index", maps.seconds_index);
}

// Returns the radius at each photon of the Caustic map.
std::vector<float> radii_of(const PhotonMap& caustics, const RadiusRule& radii, const PassContext& context) {
    constexpr std::int64_t kGrain = 1024;
    std::vector<float> result(caustics.size());
    const auto count = static_cast<std::int64_t>(caustics.size());
    parallel_ranges(context.workers, count, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            const V3f n = caustics.normals()[i].unpack();
            // As for an estimate, the radius is never less than the surface's error.
            const SurfacePoint at = surface_point_of(context.scene, caustics.positions()[i], n);
            result[i] = std::max(radii.radius(MapKind::caustic, at.p, n).radius, at.error);
        }
    });
    return result;
}

// Returns the bounce limit of photons at irradiance points: gather rays have a bounce at both ends.
int kept_where_rays_land(const PhotonMapSettings& settings) {
    return settings.max_depth > 0 ? settings.max_depth - 2 : kMaxBounces;  // >= 1: there is a map
}

bool may_guide(const PhotonMapSettings& settings) {
    return is_split_by_pilot(settings);
}

}  // namespace

DensityEstimatePair density_settings(const PhotonMapSettings& settings, const Scene& scene) {
    DensityEstimatePair pair{settings.estimate, settings.estimate};
    const float radius = settings.estimate.radius;
    pair.eye.radius = pair.gather.radius = largest_radius(diagonal(scene), radius);
    pair.volume_radius = largest_radius(diagonal_with_media(scene), radius);
    pair.gather.k = settings.gather_k;
    return pair;
}

bool is_split_by_pilot(const PhotonMapSettings& settings) {
    return settings.gather_rays == 0 && settings.indirect == IndirectMethod::gather;
}

MapParameters map_parameters(const PhotonMapSettings& settings, const PassContext& context) {
    MapParameters parameters;
    parameters.paths = settings.photons;
    parameters.wanted = wanted_maps(settings, context);
    parameters.targets[static_cast<std::size_t>(MapKind::caustic)] = settings.caustic_photons;
    parameters.targets[static_cast<std::size_t>(MapKind::global)] = settings.indirect_photons;
    parameters.volume_direct = settings.direct == DirectMethod::map;
    parameters.specular_below = settings.specular_below;
    parameters.longest = most_bounces(settings.max_depth) - 1;  // the last bounce is where the photon is seen
    parameters.seed = context.seed;
    parameters.pass = context.pass;
    parameters.deadline = context.prepared;
    // Irradiance points take more time than the photons that they are made of.
    if (context.prepared.exists() && settings.indirect == IndirectMethod::gather && settings.precompute > 0)
        parameters.deadline = Deadline::after(kPhotonsShare * context.prepared.left());
    parameters.index = settings.index;
    return parameters;
}

std::optional<PhotonMappingState> first_pass(const PhotonMapSettings& settings, const PassContext& context,
                                             const FirstPassResult& parts) {
    PhotonMappingState state;
    MapParameters parameters = map_parameters(settings, context);
    parameters.emission = parts.emission;
    parameters.sets = parts.sets;
    if (parameters.wanted != std::array<bool, kMapKinds>{}) {
        state.maps = make_maps(parameters, context, parts.files);
        if (context.monitor.stopped()) return std::nullopt;
        report(state.maps, context.statistics);
        if (context.pass == 0) warn_of_endless_light(state.maps.ledger, context.monitor);
    }
    const PhotonMap* caustics = state.maps.find(MapKind::caustic);
    if (parts.radii && caustics) state.caustic_radii = radii_of(*caustics, *parts.radii, context);
    if (settings.indirect == IndirectMethod::gather && settings.precompute > 0 &&
        state.maps.find(MapKind::global)) {
        const Stopwatch computing;
        DensityEstimateSettings how = density_settings(settings, context.scene).gather;
        how.most_bounces = kept_where_rays_land(settings);
        state.irradiance.emplace(precompute_irradiance(context, state.maps, how, settings));
        context.statistics.seconds.add("irradiance", computing.seconds());
        context.statistics.irradiance_points = state.irradiance->size();
        if (context.monitor.stopped()) return std::nullopt;
    }
    const PhotonMap* global = state.maps.find(MapKind::global);
    if (may_guide(settings) && global) {
        const Stopwatch building;
        DirectionGuiding guiding;
        guiding.radius = density_settings(settings, context.scene).eye.radius;
        guiding.index = settings.index;
        state.directions.emplace(*global, guiding, context.workers);
        context.statistics.seconds.add("guide", building.seconds());
    }
    return state;
}

}  // namespace lucerna
