#include "engine/integrators/igi_pre_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/base/stopwatch.h"
#include "engine/integrators/igi_caustics.h"
#include "engine/integrators/light_choice.h"
#include "engine/vpl/vpl_of_hit.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// Of the mean radiance, added to a pixel's own: what is darker than that may be as wrong as that.
constexpr double kDarkest = 0.05;

// Places at which a path is tried, and paths for one camera ray: four of five shadow rays are those of paths.
constexpr std::size_t kTries = 4;
constexpr std::int64_t kPathsPerRay = 16, kMostRays = 4096;
// Of the scene's diagonal: within it photons tell which lights to ask.
constexpr float kGuideRadius = 0.05F;

// What each pre-pass path adds at its places.
struct Tried {
    std::array<std::uint32_t, kTries> place;
    std::array<float, kTries> radiance{};
};

// Places evenly over all of them, others for each path.
Tried draw_places(std::size_t places, Sampler sampler) {
    Tried tried;
    for (std::size_t i = 0; i < kTries; ++i) {
        const float u = (static_cast<float>(i) + sampler.next()) / static_cast<float>(kTries);
        const auto place = static_cast<std::size_t>(u * static_cast<float>(places));
        tried.place[i] = static_cast<std::uint32_t>(std::min(place, places - 1));
    }
    return tried;
}

// Lights up places by the VPLs of each path.
struct PlacesLit : LightPathVisitor {
    VplGloss gloss{};
    const PlaceShading* shading = nullptr;
    std::span<const SeenPlace> places;
    std::span<Tried> all;    // by path
    Tried* tried = nullptr;  // of the path that is under way
    std::optional<Sampler> roulette;

    bool begin(std::uint32_t path, const std::optional<LightPathStart>& /*start*/, const Sampler& sampler) {
        tried = &all[path];
        *tried = draw_places(places.size(), sampler.split(2));
        roulette = sampler.split(1);
        return true;
    }
    void hit(const LightPathHit& at) {
        make_vpls(at, gloss, [&](const Vpl& light) {
            for (std::size_t i = 0; i < kTries; ++i) {
                tried->radiance[i] += shading->radiance(places[tried->place[i]], light, *roulette);
            }
        });
    }
};

std::vector<Tried> try_paths(const PassContext& context, const IgiSettings& settings,
                             std::span<const SeenPlace> places) {
    const PlaceShading shading(context.scene, settings);
    std::vector<Tried> all(static_cast<std::size_t>(settings.pre_pass));
    LightPaths paths;
    paths.count = settings.pre_pass;
    paths.seed = context.seed;
    paths.pass = kEmissionPrePass;
    paths.specular_below = vpl_specular_below(vpl_gloss(settings));
    paths.per_chunk = 2048;
    paths.interleaved = false;  // a place is lit by the path that is under way
    paths.phase = "pre-pass";
    std::vector<PlacesLit> chunks;
    trace_light_paths({context.scene, context.workers, context.monitor}, paths, chunks,
                      [&](std::int64_t /*count*/) {
                          PlacesLit chunk;
                          chunk.gloss = vpl_gloss(settings);
                          chunk.shading = &shading;
                          chunk.places = places;
                          chunk.all = all;
                          return chunk;
                      });
    return all;
}

// What each camera ray shows, direct and indirect light, and a little more: > 0.
std::vector<float> radiances(const SeenPlaces& seen, std::span<const Tried> tried) {
    std::vector<double> sum(seen.places.size()), count(seen.places.size());
    for (const Tried& one : tried) {
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

std::vector<float> scores(const SeenPlaces& seen, std::span<const Tried> tried) {
    std::vector<float> result(tried.size());
    for (std::size_t path = 0; path < tried.size(); ++path) {
        for (std::size_t i = 0; i < kTries; ++i) {
            const SeenPlace& place = seen.places[tried[path].place[i]];
            result[path] += sqr(tried[path].radiance[i] / seen.shown[place.ray]) / static_cast<float>(kTries);
        }
    }
    return result;
}

// By the pre-pass's own paths, as far as their first surfaces.
std::optional<GuideMap> guides(const IgiSettings& settings, const PassContext& context) {
    if (nothing_to_choose(context.scene) || settings.pre_pass_defensive_weight == 1) return std::nullopt;
    GuideParameters parameters{settings.pre_pass, context.seed, kEmissionPrePass, {}};
    parameters.settings.radius = kGuideRadius * diagonal(context.scene);
    return build_guides(context.scene, parameters, context.workers, context.monitor);
}

}  // namespace

std::optional<IgiPrePass> run_igi_pre_pass(const IgiSettings& settings, const PassContext& context) {
    const Stopwatch watch;
    const Scene& scene = context.scene;
    if (!(scene.picker().total_power() > 0)) return std::nullopt;

    // Where the picture is shaded, and by which lights it is lit directly.
    const std::int64_t rays = std::clamp<std::int64_t>(settings.pre_pass / kPathsPerRay, 64, kMostRays);
    SeenPlaces seen = see_places(settings, context, rays);
    if (seen.places.empty()) return std::nullopt;

    // What light paths bring there.
    const auto tried = try_paths(context, settings, seen.places);
    if (context.monitor.stopped()) return std::nullopt;
    seen.shown = radiances(seen, tried);
    const std::vector<float> second_moments = scores(seen, tried);

    // Which ones to emit, and which lights to ask.
    IgiPrePass result{ImportancePrePass{learn_density(scene, context.seed, second_moments,
                                                      settings.pre_pass_defensive_weight)},
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

}  // namespace lucerna
