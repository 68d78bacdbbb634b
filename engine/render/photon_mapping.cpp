// Photon mapping in two passes (Jensen 2001) with separate Direct, Global and Caustic maps: the first pass.
// What the second one makes of them is in photon_estimator.h.
#include "engine/render/photon_mapping.h"

#include "engine/base/stopwatch.h"
#include "engine/render/energy_report.h"
#include "engine/render/integrator.h"
#include "engine/render/needed_maps.h"
#include "engine/render/photon_estimator.h"
#include "engine/render/precompute_irradiance.h"
#include "engine/render/steering.h"
#include "photon/resting_point.h"

namespace lucerna {
namespace {

// The largest radius of an estimate unless it is set, as a share of the scene's diagonal.
constexpr float kDefaultRadius = 0.05F;

class PhotonMapIntegrator final : public Integrator {
  public:
    explicit PhotonMapIntegrator(const PhotonMapSettings& settings) : settings_(settings) {}

    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        const std::optional<ImportancePrePass> pre_pass =
            learn_emission(settings_, density_settings(context.scene).eye, context);
        if (context.monitor.stopped()) return nullptr;
        return prepare(context, nullptr, pre_pass ? &pre_pass->emission : nullptr);
    }
    std::unique_ptr<const Estimator> prepare(const PassContext& context,
                                             std::unique_ptr<const RadiusRule> radii,
                                             const LearnedEmission* emission) const {
        PhotonEstimatorParts parts;
        parts.radii = std::move(radii);
        MapParameters parameters = map_parameters(context);
        parameters.emission = emission;
        if (parameters.wanted != std::array<bool, kMapKinds>{}) {
            parts.maps = make_maps(parameters, context);
            if (context.monitor.stopped()) return nullptr;
            report(parts.maps, context.report);
            if (context.pass == 0) warn_of_endless_light(parts.maps.ledger, context.monitor);
        }
        const PhotonMap* caustics = parts.maps.find(MapKind::caustic);
        if (parts.radii && caustics) parts.caustic_radii = radii_of(*caustics, *parts.radii, context);
        const DensityEstimatePair how = density_settings(context.scene);
        parts.guides = guide(context, how.eye.radius);
        if (context.monitor.stopped()) return nullptr;
        if (settings_.indirect == IndirectMethod::gather && settings_.precompute > 0) {
            const Stopwatch computing;
            parts.irradiance.emplace(precompute_irradiance(context, parts.maps, how.gather, settings_));
            context.report.seconds.emplace_back("irradiance", computing.seconds());
            context.report.numbers["irradiance.points"] = static_cast<double>(parts.irradiance->size());
            if (context.monitor.stopped()) return nullptr;
        }
        return make_photon_estimator(context.scene, settings_, how, std::move(parts));
    }

    std::vector<std::string> describe(const Scene& scene) const override {
        std::vector<std::string> lines;
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            lines.push_back(
                fmt::format("{} map {}", map_name(kind), map_need(kind, settings_, scene).text()));
        }
        if (settings_.pre_pass > 0) lines.push_back(describe_pre_pass(settings_.pre_pass));
        const bool targets = settings_.caustic_photons > 0 || settings_.indirect_photons > 0;
        lines.push_back(targets ? "light paths until the targets are met"
                                : fmt::format("{} light paths", settings_.photons));
        if (settings_.indirect == IndirectMethod::gather && settings_.precompute > 0) {
            lines.push_back(
                fmt::format("irradiance where a bounce from one photon in {} leads", settings_.precompute));
        }
        return lines;
    }

  private:
    MapParameters map_parameters(const PassContext& context) const {
        MapParameters parameters;
        parameters.paths = settings_.photons;
        parameters.wanted = wanted(context);
        parameters.targets[static_cast<std::size_t>(MapKind::caustic)] = settings_.caustic_photons;
        parameters.targets[static_cast<std::size_t>(MapKind::global)] = settings_.indirect_photons;
        parameters.volume_direct = settings_.direct == DirectMethod::map;
        parameters.specular_below = settings_.specular_below;
        parameters.seed = context.seed;
        parameters.pass = context.pass;
        parameters.index = settings_.index;
        return parameters;
    }

    static PhotonMaps make_maps(const MapParameters& parameters, const PassContext& context) {
        const Scene& scene = context.scene;
        const MapFiles files = context.map_files ? *context.map_files : MapFiles{};
        if (!files.load.empty()) {
            context.report.notes["maps"] = "read from a file";
            return load_maps(files.load, map_key(scene, parameters), scene.lights().size(), parameters.index,
                             context.workers);
        }
        PhotonMaps maps = build_photon_maps(scene, parameters, context.workers, context.monitor);
        if (!files.save.empty() && !context.monitor.stopped()) {
            save_maps(files.save, maps, map_key(scene, parameters));
        }
        return maps;
    }

    // The radius at each of the Caustic map's photons.
    static std::vector<float> radii_of(const PhotonMap& caustics, const RadiusRule& radii,
                                       const PassContext& context) {
        constexpr std::int64_t kGrain = 1024;
        std::vector<float> result(caustics.size());
        const auto count = static_cast<std::int64_t>(caustics.size());
        parallel_ranges(
            context.workers, count, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
                for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
                    const V3f n = caustics.normals()[i].unpack();
                    // Never less than the surface's error: as for an estimate.
                    const SurfacePoint at = resting_point(context.scene, caustics.positions()[i], n);
                    result[i] = std::max(radii.radius(MapKind::caustic, at.p, n), at.error);
                }
            });
        return result;
    }

    std::array<bool, kMapKinds> wanted(const PassContext& context) const {
        std::array<bool, kMapKinds> maps{};
        for (std::size_t i = 0; i < kMapKinds; ++i) {
            const auto kind = static_cast<MapKind>(i);
            const MapNeed need = map_need(kind, settings_, context.scene);
            maps[i] = need.build;
            context.report.notes[fmt::format("map.{}", map_name(kind))] = need.text();
        }
        return maps;
    }

    // The photons by which direct light is sampled, if it is.
    std::optional<GuideMap> guide(const PassContext& context, float radius) const {
        if (!goes_by_guides(settings_, context.scene)) return std::nullopt;
        const bool gate = settings_.direct == DirectMethod::gated;
        const Stopwatch building;
        const GuideParameters parameters{
            settings_.guide_photons, context.seed, context.pass, {gate ? 0 : settings_.guide_k, radius}};
        GuideMap map = build_guides(context.scene, parameters, context.workers, context.monitor);
        context.report.seconds.emplace_back("guide", building.seconds());
        context.report.numbers["guide.photons"] = static_cast<double>(map.map().size());
        context.report.numbers["guide.stations"] = static_cast<double>(map.distributions());
        return map;
    }

    DensityEstimatePair density_settings(const Scene& scene) const {
        DensityEstimateSettings how;
        how.radius = settings_.radius > 0 ? settings_.radius : kDefaultRadius * diagonal(scene);
        how.ratio = settings_.ratio;
        how.kernel = settings_.kernel;
        how.metric = settings_.metric;
        how.boundary = settings_.boundary;
        DensityEstimatePair pair{how, how};
        pair.volume_radius =
            settings_.radius > 0 ? settings_.radius : kDefaultRadius * diagonal_with_media(scene);
        pair.eye.k = settings_.k;
        pair.gather.k = settings_.gather_k;
        return pair;
    }

    static void report(const PhotonMaps& maps, RenderReport& report) {
        report_energy(maps.ledger, report);
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            const std::string name = fmt::format("photons.{}.", map_name(static_cast<MapKind>(kind)));
            report.numbers[name + "stored"] = static_cast<double>(maps.counts[kind].stored);
            report.numbers[name + "dropped.map_not_wanted"] =
                static_cast<double>(maps.counts[kind].not_wanted);
            report.numbers[name + "dropped.surface_not_diffuse"] =
                static_cast<double>(maps.counts[kind].not_storable);
        }
        report.seconds.emplace_back("photons", maps.seconds_trace);
        report.seconds.emplace_back("index", maps.seconds_index);
    }

    PhotonMapSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings) {
    return std::make_unique<PhotonMapIntegrator>(settings);
}

std::unique_ptr<const Estimator> prepare_photon_maps(const PhotonMapSettings& settings,
                                                     const PassContext& context,
                                                     std::unique_ptr<const RadiusRule> radii,
                                                     const LearnedEmission* emission) {
    return PhotonMapIntegrator(settings).prepare(context, std::move(radii), emission);
}

}  // namespace lucerna
