#include "photon/importance_pre_pass.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/stopwatch.h"
#include "photon/emission_blocks.h"
#include "photon/near_photons.h"
#include "photon/photon_map.h"

namespace lucerna {
namespace {

// Of the mean radiance, added to a pixel's own: what is darker than that may be as wrong as that.
constexpr double kDarkest = 0.05;

// ImportancePrePass paths for one camera ray: estimates cost as much as the paths that they judge.
constexpr std::int64_t kPathsPerRay = 4;

constexpr std::array kSurfaceMaps{MapKind::direct, MapKind::global, MapKind::caustic};

// Photons of the pre-pass, by map; a photon's `cell` is the number of its path. Powers are those of the
// pre-pass's mean.
using PrePassPhotons = std::array<Photons, kMapKinds>;

PrePassPhotons trace_pilot_paths(const Scene& scene, const ImportancePrePassSettings& settings,
                                 std::int64_t begin, std::int64_t end) {
    PrePassPhotons photons;
    Ledger ledger;
    const float share = 1.0F / static_cast<float>(settings.paths);
    Emission emission(scene, settings.seed, Purpose::emission, kEmissionPrePass);
    emission.for_each(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          if (!start) return;
                          Sampler sampler =
                              Sampler::stratified(settings.seed, Purpose::emission, kEmissionPrePass, path);
                          const auto visit = [&](const LightPathHit& at) {
                              if (!stores_photons(at.bsdf)) return;
                              const V3f& n = at.hit.at.n;
                              photons[static_cast<std::size_t>(map_of(at.path))].add(
                                  at.hit.at.p, PackedDirection(n.dot(at.d) > 0 ? -n : n),
                                  {PackedDirection(at.d), at.power * share, start->light, path});
                          };
                          trace_light_path(
                              scene, *start, sampler, ledger, visit, [](const LightPathScatter&) {},
                              [](const LightPathEscape&) {}, settings.specular_below);
                      });
    return photons;
}

// The maps of the pre-pass.
std::array<std::optional<PhotonMap>, kMapKinds> pre_pass_maps(const Scene& scene,
                                                              const ImportancePrePassSettings& settings,
                                                              const Workers& workers, Monitor& monitor) {
    constexpr std::int64_t kGrain = 2048;  // fixed, so that results do not depend on threads
    std::vector<PrePassPhotons> chunks(static_cast<std::size_t>((settings.paths + kGrain - 1) / kGrain));
    Phase phase(monitor, "pre-pass", static_cast<std::uint64_t>(settings.paths));
    parallel_ranges(
        workers, settings.paths, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
            if (monitor.stopped()) return;
            chunks[static_cast<std::size_t>(chunk)] = trace_pilot_paths(scene, settings, begin, end);
            phase.advance(static_cast<std::uint64_t>(end - begin));
        });
    std::array<std::optional<PhotonMap>, kMapKinds> maps;
    for (const MapKind kind : kSurfaceMaps) {
        const auto k = static_cast<std::size_t>(kind);
        Photons all;
        for (const PrePassPhotons& chunk : chunks) {
            for (std::size_t i = 0; i < chunk[k].size(); ++i) {
                all.add(chunk[k].positions[i], chunk[k].normals[i], chunk[k].photons[i]);
            }
        }
        if (all.size() > 0) maps[k].emplace(all, IndexKind::tree, workers);
    }
    return maps;
}

// Looks at the pre-pass's maps as the image will at its own.
class Scorer {
  public:
    Scorer(const std::array<std::optional<PhotonMap>, kMapKinds>& maps,
           const ImportancePrePassSettings& settings, std::span<const Importon> importons,
           const Workers& workers)
        : maps_(maps), settings_(settings) {
        constexpr std::int64_t kGrain = 256;
        parts_.resize((importons.size() + kGrain - 1) / kGrain);
        parallel_ranges(workers, static_cast<std::int64_t>(importons.size()), kGrain,
                        [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                            const auto first = static_cast<std::size_t>(begin);
                            const auto count = static_cast<std::size_t>(end - begin);
                            for (const Importon& importon : importons.subspan(first, count)) {
                                look(importon, parts_[static_cast<std::size_t>(chunk)]);
                            }
                        });
    }

    // By path.
    std::vector<float> scores() const {
        const std::vector<float> shown = radiances();
        std::vector<float> scores(static_cast<std::size_t>(settings_.paths));
        for (const auto& chunk : parts_) {
            for (const Part& part : chunk) {
                if (!part.read) continue;
                const float share = part.radiance / shown[part.ray];
                scores[part.path] += share * share;
            }
        }
        return scores;
    }

  private:
    // Of a camera ray's radiance, what one photon brings.
    struct Part {
        std::uint32_t ray, path;
        float radiance;
        bool read;    // by the image from its maps; what it finds otherwise is only shown
        bool landed;  // where a gather ray is: no radiance of the surface that the camera sees
    };

    void look(const Importon& importon, std::vector<Part>& parts) const {
        const auto& reads = importon.landed ? settings_.landed : settings_.seen;
        for (const MapKind kind : kSurfaceMaps) {
            const auto k = static_cast<std::size_t>(kind);
            if (!maps_[k] || (importon.landed && !reads[k])) continue;
            const DensityEstimateSettings& how = settings_.estimate;
            const TangentMetric metric(importon.p, importon.n, how.metric, how.ratio);
            const NearPhotons near(*maps_[k], importon.p, metric, static_cast<std::size_t>(how.k),
                                   sqr(how.radius));
            // Photons at one point would weigh without bound.
            const float r2 = std::max(near.radius2(), sqr(kSmallest * how.radius));
            const float per_power = importon.weight / (kPi * r2);
            if (!std::isfinite(per_power)) continue;  // r2 is 0 where float32 cannot hold it
            for (const Neighbour& neighbour : near.found()) {
                const Photon& photon = maps_[k]->photons()[neighbour.index];
                parts.push_back({importon.ray, photon.cell, luminance(photon.power) * per_power, reads[k],
                                 importon.landed});
            }
        }
    }

    // What each camera ray shows, and a little more: > 0.
    std::vector<float> radiances() const {
        std::vector<float> shown;
        double sum = 0;
        for (const auto& chunk : parts_) {
            for (const Part& part : chunk) {
                if (part.ray >= shown.size()) shown.resize(part.ray + 1);
                if (part.landed) continue;
                shown[part.ray] += part.radiance;
                sum += double{part.radiance};
            }
        }
        const auto dark =
            static_cast<float>(kDarkest * sum / std::max(static_cast<double>(shown.size()), 1.0));
        for (float& radiance : shown) radiance += dark > 0 ? dark : 1.0F;
        return shown;
    }

    static constexpr float kSmallest = 1e-4F;  // of the largest radius

    const std::array<std::optional<PhotonMap>, kMapKinds>& maps_;
    const ImportancePrePassSettings& settings_;
    std::vector<std::vector<Part>> parts_;  // by chunk of importons
};

// The pre-pass's paths by light, with the numbers they began with.
std::vector<std::vector<EmitTrial>> trials(const Scene& scene, std::uint64_t seed,
                                           std::span<const float> scores) {
    std::vector<std::vector<EmitTrial>> by_light(scene.lights().size());
    const EmitNet net(seed, Purpose::emission, kEmissionPrePass);
    for (std::size_t path = 0; path < scores.size(); ++path) {
        const EmitNet::Point point = net.at(static_cast<std::uint32_t>(path));
        const auto pick = scene.picker().pick(point.light);
        if (pick) by_light[pick->light].push_back({point.u, scores[path]});
    }
    return by_light;
}

}  // namespace

LearnedEmission learn_density(const Scene& scene, std::uint64_t seed, std::span<const float> scores,
                              float defensive_weight) {
    auto by_light = trials(scene, seed, scores);
    std::vector<double> powers;
    for (const auto& light : scene.lights()) powers.push_back(light->power());
    return LearnedEmission(scene, learn_blocks(by_light, powers, {}), defensive_weight);
}

std::optional<ImportancePrePass> run_importance_pre_pass(const Scene& scene, const View& view,
                                                         const ImportancePrePassSettings& settings,
                                                         const Workers& workers, Monitor& monitor) {
    const Stopwatch watch;
    if (!(scene.picker().total_power() > 0) || scatters(scene.media())) return std::nullopt;

    // Where the picture looks.
    ImportonParameters looks;
    looks.rays = std::clamp<std::int64_t>(settings.paths / kPathsPerRay, 64, looks.rays);
    looks.gather = settings.gather;
    looks.meter = settings.meter;
    looks.seed = settings.seed;
    const std::vector<Importon> importons = trace_importons(scene, view, looks, workers);
    if (importons.empty()) return std::nullopt;

    // What light paths bring there.
    const auto maps = pre_pass_maps(scene, settings, workers, monitor);
    if (monitor.stopped()) return std::nullopt;
    const std::vector<float> scores = Scorer(maps, settings, importons, workers).scores();

    // Which ones to emit.
    ImportancePrePass pre_pass{learn_density(scene, settings.seed, scores, settings.defensive_weight)};
    pre_pass.importons = importons.size();
    for (const float score : scores) pre_pass.useful += score > 0 ? 1 : 0;
    pre_pass.useful /= static_cast<double>(settings.paths);
    pre_pass.seconds = watch.seconds();
    return pre_pass;
}

}  // namespace lucerna
