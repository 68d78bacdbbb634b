#include "engine/guiding/importance_pre_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/scene/quantity.h"
#include "photon/deposit.h"
#include "photon/photon_map.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// This is ε relative to the mean radiance. Darker pixels may be off by as much.
constexpr double kDarkest = 0.05;

// There is one camera ray for so many pre-pass paths: estimates cost as much as the paths that they judge.
constexpr std::int64_t kPathsPerRay = 4;

constexpr std::array kSurfaceMaps{MapKind::direct, MapKind::global, MapKind::caustic};

// Stores the photons of the pre-pass, by map. A photon's `cell` is the number of its path. Powers are already
// divided by the number of paths.
struct PrePassPhotons : LightPathVisitor {
    float share = 0;  // of one path among all
    std::uint32_t path = 0;
    std::array<Photons, kMapKinds> photons;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, photons);
    }
    bool begin(std::uint32_t number, const std::optional<LightPathStart>& /*start*/,
               const Sampler& /*sampler*/) {
        path = number;
        return true;
    }
    void hit(const LightPathHit& at) {
        if (!stores_photons(at.bsdf)) return;
        photons[static_cast<std::size_t>(map_of(at.path))].add_hit(at.hit.at, at.d, at.power * share,
                                                                   at.start.light, path);
    }
};

// Builds the maps of the pre-pass.
std::array<std::optional<PhotonMap>, kMapKinds> pre_pass_maps(const Scene& scene,
                                                              const ImportancePrePassSettings& settings,
                                                              const Workers& workers, Monitor& monitor) {
    LightPathRequest paths;
    paths.count = settings.paths;
    paths.seed = settings.seed;
    paths.pass = kEmissionPrePass;
    paths.specular_below = settings.specular_below;
    paths.per_chunk = 2048;
    paths.interleaved = false;  // a path is traced as a whole, so that `path` is its photons'
    paths.phase = "pre-pass";
    std::vector<PrePassPhotons> chunks;
    trace_light_paths({scene, workers, monitor}, paths, chunks, [&](std::int64_t /*count*/) {
        PrePassPhotons chunk;
        chunk.share = 1.0F / static_cast<float>(settings.paths);
        return chunk;
    });
    std::array<std::optional<PhotonMap>, kMapKinds> maps;
    for (const MapKind kind : kSurfaceMaps) {
        const auto k = static_cast<std::size_t>(kind);
        Photons all;
        for (const PrePassPhotons& chunk : chunks) all.append(chunk.photons[k]);
        if (all.size() > 0) maps[k].emplace(all, settings.index, workers);
    }
    return maps;
}

// Reads the pre-pass's maps as the image will read its own.
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
                                visit(importon, parts_[static_cast<std::size_t>(chunk)]);
                            }
                        });
    }

    // Returns the second moment of each path.
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
    // Holds what one photon adds to a camera ray's radiance.
    struct Part {
        std::uint32_t ray, path;
        float radiance;
        bool read;       // by the image from its maps; otherwise it only counts as shown
        bool at_gather;  // found by a gather ray, thus not radiance of the surface that the camera sees
    };

    void visit(const Importon& importon, std::vector<Part>& parts) const {
        const auto& reads = importon.at_gather ? settings_.at_gather : settings_.seen;
        for (const MapKind kind : kSurfaceMaps) {
            const auto k = static_cast<std::size_t>(kind);
            if (!maps_[k] || (importon.at_gather && !reads[k])) continue;
            const DensityEstimateSettings& how = settings_.estimate;
            const TangentMetric metric(importon.p, importon.n, how.metric, how.ratio);
            const NearPhotons near(*maps_[k], importon.p, metric, static_cast<std::size_t>(how.k),
                                   sqr(how.radius));
            // The bound of the radius also bounds what photons at one point contribute.
            const float r2 = std::max(near.radius2(), sqr(kSmallest * how.radius));
            const float per_power = importon.weight / (kPi * r2);
            if (!std::isfinite(per_power)) continue;  // r2 is 0 where float32 cannot hold it
            for (const Neighbour& neighbour : near.found()) {
                const Photon& photon = maps_[k]->photons()[neighbour.index];
                parts.push_back({importon.ray, photon.cell, luminance(photon.power) * per_power, reads[k],
                                 importon.at_gather});
            }
        }
    }

    // Returns the radiance that each camera ray shows, plus ε: > 0.
    std::vector<float> radiances() const {
        std::vector<float> shown;
        double sum = 0;
        for (const auto& chunk : parts_) {
            for (const Part& part : chunk) {
                if (part.ray >= shown.size()) shown.resize(part.ray + 1);
                if (part.at_gather) continue;
                shown[part.ray] += part.radiance;
                sum += double{part.radiance};
            }
        }
        const auto dark =
            static_cast<float>(kDarkest * sum / std::max(static_cast<double>(shown.size()), 1.0));
        for (float& radiance : shown) radiance += dark > 0 ? dark : 1.0F;
        return shown;
    }

    static constexpr float kSmallest = 1e-4F;  // relative to the largest radius

    const std::array<std::optional<PhotonMap>, kMapKinds>& maps_;
    const ImportancePrePassSettings& settings_;
    std::vector<std::vector<Part>> parts_;  // by chunk of importons
};

// Returns q/p of a light and its numbers.
double relative_density(const Scene& scene, const LearnedEmission* emission, std::uint32_t light,
                        const LeSampleU& u) {
    if (!emission) return 1;
    // A light that is drawn has a probability > 0.
    return emission->probability(light) / double{scene.picker().probability(light)} *
           double{emission->density(light, u)};
}

// Returns the paths of all pilots by light, with their emission numbers.
std::vector<std::vector<EmissionTrial>> trials(const Scene& scene, std::uint64_t seed,
                                               std::span<const PilotPaths> pilots,
                                               std::span<const float> moments) {
    std::vector<std::vector<EmissionTrial>> by_light(scene.lights().size());
    std::size_t next = 0;
    for (const PilotPaths& pilot : pilots) {
        const EmissionNet net(seed, Purpose::emission, pilot.pass);
        for (std::int64_t path = 0; path < pilot.count; ++path, ++next) {
            const EmissionNet::Point point = net.at(static_cast<std::uint32_t>(path));
            const auto pick =
                pilot.emission ? pilot.emission->pick(point.light) : scene.picker().pick(point.light);
            if (!pick) continue;
            EmissionTrial trial{point.u};
            if (pilot.emission) pilot.emission->warp(pick->light, trial.u);
            double density = 0;  // of the mixture, times the number of all paths; > 0
            for (const PilotPaths& other : pilots) {
                density += static_cast<double>(other.count) *
                           relative_density(scene, other.emission.get(), pick->light, trial.u);
            }
            const double own = relative_density(scene, pilot.emission.get(), pick->light, trial.u);
            trial.weight = static_cast<float>(static_cast<double>(moments.size()) / density);
            // The path's power was divided by its own density.
            trial.score = static_cast<float>(double{moments[next]} * sqr(own));
            by_light[pick->light].push_back(trial);
        }
    }
    return by_light;
}

}  // namespace

LearnedDensity learn_density(const Scene& scene, std::uint64_t seed, std::span<const PilotPaths> pilots,
                             std::span<const float> moments) {
    auto by_light = trials(scene, seed, pilots, moments);
    double sum = 0, squares = 0;
    for (const auto& of_light : by_light) {
        for (const EmissionTrial& trial : of_light) {
            const double moment = double{trial.weight} * double{trial.score};
            sum += moment;
            squares += sqr(moment);
        }
    }
    std::vector<double> powers;
    for (const auto& light : scene.lights()) powers.push_back(light->power());
    return {LearnedEmission(scene, learn_blocks(by_light, powers, {})), squares > 0 ? sqr(sum) / squares : 0};
}

std::string describe_pre_pass(std::int64_t paths) {
    return fmt::format("an importance pre-pass of {} light paths, which guides the emission of all others",
                       paths);
}

std::string_view why_emission_is_plain(std::int64_t paths, const RenderContext& context) {
    if (paths == 0) return "plain: prepass = 0";
    if (!context.view) return "plain: there is no camera";
    if (scatters(context.scene.media())) return "plain: a medium scatters";
    if (!(context.scene.picker().total_power() > 0)) return "plain: no light shines";
    return "";
}

std::optional<ImportancePrePass> run_importance_pre_pass(const Scene& scene, const View& view,
                                                         const ImportancePrePassSettings& settings,
                                                         const Workers& workers, Monitor& monitor) {
    const Stopwatch watch;
    if (!(scene.picker().total_power() > 0) || scatters(scene.media())) return std::nullopt;

    // Find where the image reads photon maps.
    ImportonParameters looks;
    looks.rays = std::clamp<std::int64_t>(settings.paths / kPathsPerRay, 64, looks.rays);
    looks.gather = settings.gather;
    looks.meter = settings.meter;
    looks.seed = settings.seed;
    const std::vector<Importon> importons = trace_importons(scene, view, looks, workers);
    if (importons.empty()) return std::nullopt;

    // Trace light paths, and score what they bring there.
    const auto maps = pre_pass_maps(scene, settings, workers, monitor);
    if (monitor.stopped()) return std::nullopt;
    const std::vector<float> scores = Scorer(maps, settings, importons, workers).scores();

    // Learn which paths to emit.
    ImportancePrePass pre_pass{
        learn_density(scene, settings.seed, std::array{PilotPaths{.count = settings.paths}}, scores)
            .emission};
    pre_pass.importons = importons.size();
    for (const float score : scores) pre_pass.useful += score > 0 ? 1 : 0;
    pre_pass.useful /= static_cast<double>(settings.paths);
    pre_pass.seconds = watch.seconds();
    return pre_pass;
}

namespace {

// Camera and gather rays have at most this many bounces: what is seen beyond is dim, or a maze of mirrors,
// and no light of the image is lost with it. The limit is larger than for irradiance points, because the
// camera may look through several glasses.
constexpr int kMostImportonBounces = 16;

// Follows one camera ray and its gather rays.
class Follower {
  public:
    Follower(const Scene& scene, const ImportonParameters& parameters, std::uint32_t ray, Sampler& sampler,
             std::vector<Importon>& found)
        : scene_(scene), parameters_(parameters), ray_(ray), sampler_(sampler), found_(found) {}

    void follow(Ray ray, Rgb throughput, bool at_gather) {
        float squeeze = 1;
        for (int bounce = 0; bounce < kMostImportonBounces; ++bounce) {
            const auto hit = scene_.intersect(ray);
            if (!hit) return;
            const bool metered = parameters_.meter && !at_gather;
            const Bsdf bsdf = metered ? white_receiver(*hit) : scene_.bsdf(*hit);
            const V3f wo = -ray.d;
            if (stores_photons(bsdf)) visit(*hit, bsdf.diffuse_part(), wo, throughput, at_gather);
            if (metered || bsdf.is_diffuse()) return;
            const auto sample = bsdf.rest().sample(wo, numbers(), Transport::radiance);
            if (!sample) return;
            throughput *= sample->weight;
            squeeze *= sample->eta_scale;  // glass gives back the radiance that it takes: no reason to end
            const float survival = std::min(1.0F, luminance(throughput) / squeeze);
            if (!(sampler_.next() < survival)) return;
            throughput /= survival;
            ray = Ray{hit->at.towards(sample->wi), sample->wi};
        }
    }

  private:
    BsdfU numbers() { return {sampler_.next(), sampler_.next2()}; }

    void visit(const Hit& hit, const Bsdf& diffuse, const V3f& wo, const Rgb& throughput, bool at_gather) {
        const float weight = luminance(throughput * diffuse.albedo(wo)) * kInvPi;
        if (weight > 0) {
            found_.push_back({hit.at.p, face_forward(hit.at.n, wo), weight, ray_, at_gather});
        }
        if (at_gather || !parameters_.gather) return;
        const auto sample = diffuse.sample(wo, numbers(), Transport::radiance);
        if (!sample || is_black(sample->weight)) return;
        follow(Ray{hit.at.towards(sample->wi), sample->wi}, throughput * sample->weight, true);
    }

    const Scene& scene_;
    const ImportonParameters& parameters_;
    std::uint32_t ray_;
    Sampler& sampler_;
    std::vector<Importon>& found_;
};

}  // namespace

std::vector<Importon> trace_importons(const Scene& scene, const View& view,
                                      const ImportonParameters& parameters, const Workers& workers) {
    const auto chunks = trace_view_rays<std::vector<Importon>>(
        view, {parameters.rays, 512, parameters.seed}, workers,
        [&](const Ray& ray, std::uint32_t number, Sampler& sampler, std::vector<Importon>& found) {
            Follower(scene, parameters, number, sampler, found).follow(ray, Rgb(1.0F), false);
        });
    std::vector<Importon> all;
    for (const auto& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
    return all;
}

}  // namespace lucerna
