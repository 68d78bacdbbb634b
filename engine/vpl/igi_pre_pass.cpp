#include "engine/vpl/igi_pre_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "engine/base/defensive.h"
#include "engine/base/monitor.h"
#include "engine/transport/follow.h"
#include "engine/transport/light_choice.h"
#include "engine/vpl/igi_caustics.h"
#include "engine/vpl/vpl.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// This is ε relative to the mean radiance. Darker pixels may be off by as much.
constexpr double kDarkest = 0.05;

// Each path is tried at kTries places, with a camera ray for kPathsPerRay paths: most shadow rays serve
// paths.
constexpr std::size_t kTries = 4;
constexpr std::int64_t kPathsPerRay = 16, kMostRays = 4096;

// Holds what one pre-pass path adds to the radiance at its places.
struct PathTrial {
    std::array<std::uint32_t, kTries> place;
    std::array<float, kTries> radiance{};
};

// Draws the places of one path, stratified over all of them.
PathTrial draw_places(std::size_t places, Sampler sampler) {
    PathTrial trial;
    for (std::size_t i = 0; i < kTries; ++i) {
        const float u = (static_cast<float>(i) + sampler.next()) / static_cast<float>(kTries);
        const auto place = static_cast<std::size_t>(u * static_cast<float>(places));
        trial.place[i] = static_cast<std::uint32_t>(std::min(place, places - 1));
    }
    return trial;
}

// Lights places by the VPLs of each path.
struct ShadingPointsLit : LightPathVisitor {
    VplGloss gloss{};
    const ShadingPointContribution* shading = nullptr;
    std::span<const ShadingPoint> places;
    std::span<PathTrial> all;    // by path
    PathTrial* trial = nullptr;  // of the current path
    std::optional<Sampler> roulette;
    std::uint32_t first = 0, end = 0;  // paths of the chunk

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, first, end);
        std::span<PathTrial> own = all.subspan(first, end - first);
        archive(own);
    }
    bool begin(std::uint32_t path, const std::optional<LightPathStart>& /*start*/, const Sampler& sampler) {
        trial = &all[path];
        if (end == 0) first = path;
        end = path + 1;
        *trial = draw_places(places.size(), sampler.split(2));
        roulette = sampler.split(1);
        return true;
    }
    void hit(const LightPathHit& at) {
        make_vpls(at, gloss, [&](const Vpl& light) {
            for (std::size_t i = 0; i < kTries; ++i) {
                trial->radiance[i] += shading->radiance(places[trial->place[i]], light, *roulette);
            }
        });
    }
};

std::vector<PathTrial> try_paths(const RenderContext& context, const IgiSettings& settings,
                                 std::span<const ShadingPoint> places) {
    const ShadingPointContribution shading(context.scene, settings);
    std::vector<PathTrial> all(static_cast<std::size_t>(settings.pre_pass));
    LightPathRequest paths;
    paths.count = settings.pre_pass;
    paths.seed = context.seed;
    paths.pass = kEmissionPrePass;
    paths.specular_below = vpl_specular_below(vpl_gloss(settings));
    paths.per_chunk = 2048;
    paths.interleaved = false;  // a path is traced as a whole, so that `trial` is its own
    paths.phase = "pre-pass";
    std::vector<ShadingPointsLit> chunks;
    trace_light_paths({context.scene, context.workers, context.monitor}, paths, chunks,
                      [&](std::int64_t /*count*/) {
                          ShadingPointsLit chunk;
                          chunk.gloss = vpl_gloss(settings);
                          chunk.shading = &shading;
                          chunk.places = places;
                          chunk.all = all;
                          return chunk;
                      });
    return all;
}

// Returns the radiance that each camera ray shows, direct and indirect light, plus ε: > 0.
std::vector<float> radiances(const ShadingPoints& seen, std::span<const PathTrial> trial) {
    std::vector<double> sum(seen.places.size()), count(seen.places.size());
    for (const PathTrial& one : trial) {
        for (std::size_t i = 0; i < kTries; ++i) {
            sum[one.place[i]] += double{one.radiance[i]};
            count[one.place[i]] += 1;
        }
    }
    std::vector<float> shown = seen.shown;
    for (std::size_t i = 0; i < seen.places.size(); ++i) {
        if (count[i] > 0) shown[seen.places[i].ray] += static_cast<float>(sum[i] / count[i]);
    }
    double mean = 0;
    for (const float radiance : shown) mean += double{radiance} / static_cast<double>(shown.size());
    const auto dark = static_cast<float>(kDarkest * mean);
    for (float& radiance : shown) radiance += dark > 0 ? dark : 1.0F;
    return shown;
}

std::vector<float> scores(const ShadingPoints& seen, std::span<const PathTrial> trial) {
    std::vector<float> result(trial.size());
    for (std::size_t path = 0; path < trial.size(); ++path) {
        for (std::size_t i = 0; i < kTries; ++i) {
            const ShadingPoint& place = seen.places[trial[path].place[i]];
            result[path] += sqr(trial[path].radiance[i] / seen.shown[place.ray]) / static_cast<float>(kTries);
        }
    }
    return result;
}

// Builds guides from the first hits of the pre-pass's own paths.
std::optional<GuideMap> guides(const IgiSettings& settings, const RenderContext& context) {
    if (nothing_to_choose(context.scene)) return std::nullopt;
    GuideParameters parameters{settings.pre_pass, context.seed, kEmissionPrePass, {}};
    parameters.settings.radius = largest_radius(diagonal(context.scene));  // as for photon maps
    parameters.settings.index = settings.index;
    return build_guides(context.scene, parameters, context.workers, context.monitor);
}

}  // namespace

std::optional<IgiPrePass> run_igi_pre_pass(const IgiSettings& settings, const RenderContext& context) {
    const Stopwatch watch;
    const Scene& scene = context.scene;
    if (!(scene.picker().total_power() > 0)) return std::nullopt;

    // Find the places that VPLs shade, and their direct light.
    const std::int64_t rays = std::clamp<std::int64_t>(settings.pre_pass / kPathsPerRay, 64, kMostRays);
    ShadingPoints seen = find_shading_points(settings, context, rays);
    if (seen.places.empty()) return std::nullopt;

    // Light them by the VPLs of light paths.
    const auto trial = try_paths(context, settings, seen.places);
    if (context.monitor.stopped()) return std::nullopt;
    seen.shown = radiances(seen, trial);
    const std::vector<float> second_moments = scores(seen, trial);

    // Learn which paths to emit, and which lights to sample.
    IgiPrePass result{
        ImportancePrePass{
            learn_density(scene, context.seed,
                          std::array{PilotPaths{.count = static_cast<std::int64_t>(second_moments.size())}},
                          second_moments)
                .emission},
        guides(settings, context),
        {}};
    if (context.monitor.stopped()) return std::nullopt;
    result.importance.importons = seen.places.size();
    const auto useful =
        std::count_if(second_moments.begin(), second_moments.end(), [](float score) { return score > 0; });
    result.importance.useful = static_cast<double>(useful) / static_cast<double>(second_moments.size());
    result.seen = std::move(seen);
    result.importance.seconds = watch.seconds();
    return result;
}

namespace {

// Each place takes this many samples of direct light.
constexpr int kLightSamples = 4;

constexpr std::uint32_t kDirectBranch = 1;  // of a camera ray's sampler

// A camera ray has at most this many bounces over mirrors and glass: what lies behind more of them is a small
// part of an image.
constexpr int kMostSpecular = 8;

// Follows camera rays to the places where they are shaded.
class ShadingPointFinder {
  public:
    ShadingPointFinder(const Scene& scene, const IgiSettings& settings)
        : scene_(scene), settings_(settings), lights_(scene) {}

    void trace(const Ray& ray, std::uint32_t number, Sampler& sampler, ShadingPoints& seen) const {
        SampleAccount account;
        EyePath path = EyePath::begin(scene_, ray, settings_.quantity, settings_.max_depth, account);
        path.left = std::min(path.left, kMostSpecular);
        path.splits = 0;
        follow(scene_, path, sampler, Visitor{{}, *this, number, seen});
        seen.shown.push_back(luminance(account.radiance()));
    }

  private:
    struct Visitor : EyeVisitor {
        const ShadingPointFinder& of;
        std::uint32_t number;
        ShadingPoints& seen;

        bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler) const {
            const LightChoice choice = of.lights_.at(at.hit.at, at.bsdf, at.wo);
            const PathAccount one = path.times(1 / static_cast<float>(kLightSamples));
            const auto specular = direct_light(of.scene_, at, sampler, choice, one);
            if (!at.bsdf.is_black() && !is_black(path.throughput)) {
                seen.places.push_back({at.hit, at.bsdf, at.wo, at.medium, path.throughput, number});
                for (int i = 1; i < kLightSamples; ++i) {
                    Sampler more = sampler.split_stratified(kDirectBranch, static_cast<std::uint32_t>(i));
                    direct_light(of.scene_, at, more, choice, one);
                }
            }
            return go_on(path, at, specular, sampler);
        }
        // No medium scatters in a scene with a pre-pass.
        static bool at_medium(EyePath& /*path*/, const MediumVertex& /*at*/, const Rgb& /*sigma_s*/,
                              Sampler& /*sampler*/) {
            return false;
        }
    };

    const Scene& scene_;
    const IgiSettings& settings_;
    LightChooser lights_;
};

}  // namespace

ShadingPoints find_shading_points(const IgiSettings& settings, const RenderContext& context,
                                  std::int64_t rays) {
    const ShadingPointFinder finder(context.scene, settings);
    const auto chunks = trace_view_rays<ShadingPoints>(
        *context.view, {rays, 256, context.seed}, context.workers,
        [&](const Ray& ray, std::uint32_t number, Sampler& sampler, ShadingPoints& seen) {
            finder.trace(ray, number, sampler, seen);
        });
    ShadingPoints all;
    for (const ShadingPoints& chunk : chunks) {
        all.places.insert(all.places.end(), chunk.places.begin(), chunk.places.end());
        all.shown.insert(all.shown.end(), chunk.shown.begin(), chunk.shown.end());
    }
    return all;
}

ShadingPointContribution::ShadingPointContribution(const Scene& scene, const IgiSettings& settings)
    : shading_(scene, settings, 1), scale_(settings.indirect_scale) {}

namespace {

// Trying VPLs takes about this share of the time in which the VPLs that are kept light each pixel once;
// `factor` times as many are tried as are kept. Each is tried at kLeastTries to kMostTries places.
constexpr float kShareOfTime = 0.1F;
constexpr float kLeastTries = 16, kMostTries = 256;

std::size_t tries(const View& view, std::uint32_t factor) {
    const V2f size = view.end - view.begin;
    const float share = kShareOfTime * size.x * size.y / static_cast<float>(factor);
    return static_cast<std::size_t>(std::clamp(share, kLeastTries, kMostTries));
}

// These are pass numbers of the samplers of VPLs and of sets, which no pass of light paths has.
constexpr std::uint32_t kLightsPass = 0xfffffffdU, kSetsPass = 0xfffffffcU;

float importance_of(const Vpl& light, const ShadingPoints& seen, const ShadingPointContribution& shading,
                    std::size_t tries, Sampler& sampler) {
    double sum = 0;
    for (std::size_t i = 0; i < tries; ++i) {
        const float u = (static_cast<float>(i) + sampler.next()) / static_cast<float>(tries);
        const auto drawn = static_cast<std::size_t>(u * static_cast<float>(seen.places.size()));
        const ShadingPoint& place = seen.places[std::min(drawn, seen.places.size() - 1)];
        const double share =
            double{shading.radiance(place, light, sampler)} / double{seen.shown[place.ray]};  // shown > 0
        sum += share * share;
    }
    return static_cast<float>(std::sqrt(sum / static_cast<double>(tries)));
}

std::vector<float> importances_of(const VplSets& sets, std::size_t many, const ShadingPoints& seen,
                                  const IgiSettings& settings, const RenderContext& context) {
    constexpr std::size_t kGrain = 1024;  // fixed, so that results do not depend on threads
    const ShadingPointContribution shading(context.scene, settings);
    std::vector<float> result(sets.lights.size());
    const std::size_t chunks = (result.size() + kGrain - 1) / kGrain;
    Phase phase(context.monitor, "virtual point lights that matter", chunks);
    const auto values_of = [&](std::int64_t chunk) {
        const std::size_t begin = static_cast<std::size_t>(chunk) * kGrain;
        return std::span(result).subspan(begin, std::min(kGrain, result.size() - begin));
    };
    shared_chunks(
        context.workers, "importance of virtual point lights", static_cast<std::int64_t>(chunks),
        ResultsGo::to_all_ranks,
        [&](std::int64_t chunk) {
            if (context.monitor.stopped()) return;
            std::size_t i = static_cast<std::size_t>(chunk) * kGrain;
            for (float& value : values_of(chunk)) {
                Sampler sampler(context.seed, Purpose::importance, kLightsPass, i);
                value = importance_of(sets.lights[i++], seen, shading, many, sampler);
            }
        },
        [&](std::int64_t chunk, auto& archive) {
            auto values = values_of(chunk);
            archive(values);
        },
        [&](std::int64_t more) { phase.advance(static_cast<std::uint64_t>(more)); });
    return result;
}

// Returns the probability of keeping each VPL: by importance, with a defensive share of the mean, at most 1,
// so that `wanted` of them are kept on average.
std::vector<double> chances(std::span<const float> importance, double defensive_weight, double wanted) {
    double mean = 0;
    for (const float w : importance) mean += double{w} / static_cast<double>(importance.size());
    std::vector<double> chance;
    for (const float w : importance)
        chance.push_back(mean > 0 ? defensive_weight * mean + (1 - defensive_weight) * double{w} : 1.0);
    // Where the bound of 1 cuts off some probability, the others get it, in a few rounds that each leave
    // less.
    double scale = 0;
    for (int round = 0; round < 8; ++round) {
        double sure = 0, open = 0;
        for (const double c : chance) {
            if (scale * c < 1) {
                open += c;
            } else {
                ++sure;
            }
        }
        if (!(open > 0) || !(wanted > sure)) break;
        scale = (wanted - sure) / open;
    }
    for (double& c : chance) c = std::min(scale * c, 1.0);
    return chance;
}

}  // namespace

VplSets thin_vpls(const VplSets& sets, std::uint32_t factor, const ShadingPoints& seen,
                  const IgiSettings& settings, const RenderContext& context) {
    const std::vector<float> all =
        importances_of(sets, tries(*context.view, factor), seen, settings, context);
    if (context.monitor.stopped()) return sets;
    const std::vector<double> chance =
        chances(all, double{kDefensiveWeight}, static_cast<double>(all.size()) / factor);
    VplSets kept;
    kept.ledger = sets.ledger;
    kept.begins.push_back(0);
    for (std::size_t set = 0; set + 1 < sets.begins.size(); ++set) {
        // A VPL is kept wherever the sum of the probabilities passes an integer.
        Sampler sampler(context.seed, Purpose::importance, kSetsPass, set);
        double sum = double{sampler.next()};
        for (std::size_t i = sets.begins[set]; i < sets.begins[set + 1]; ++i) {
            const double before = std::floor(sum);
            sum += chance[i];
            if (!(std::floor(sum) > before)) continue;
            kept.lights.push_back(sets.lights[i]);
            kept.lights.back().contribution *= static_cast<float>(1 / chance[i]);  // > 0: it was kept
        }
        kept.begins.push_back(static_cast<std::uint32_t>(kept.lights.size()));
    }
    return kept;
}

}  // namespace lucerna
