#include "engine/integrators/precomputed_irradiance.h"

#include <algorithm>
#include <cmath>

#include "engine/base/monitor.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/light_choice.h"

namespace lucerna {
namespace {

// These are branches of an irradiance point's sampler; its probes have a sampler of their own.
constexpr std::uint32_t kLightSamplesBranch = 1, kSunsBranch = 2;

constexpr int kLightSamples = 4;  // of direct light at each point

// Samples direct light at a point by both strategies of MIS, as direct_light() does for a white surface
// there. The irradiance is π times that surface's radiance.
NearLight add_direct_light(const Scene& scene, const LightChooser& lights, const SurfacePoint& at,
                           const Sampler& point, IncidentLightSum& light) {
    Hit hit;
    hit.at = at;
    hit.ns = at.n;
    hit.wo = at.n;
    hit.dpdu = Frame(at.n).s;
    hit.dpdv = Frame(at.n).t;
    const Bsdf white = white_receiver(hit);
    const LightChoice choice = lights.at(at, white, hit.wo);
    const Vertex vertex{hit, white, hit.wo};
    const float scale = kPi / static_cast<float>(kLightSamples);
    float sum = 0, over_distance = 0;
    const auto add = [&](const Rgb& irradiance, const V3f& wi, float distance) {
        light.add(irradiance, wi);
        sum += luminance(irradiance);
        over_distance += luminance(irradiance) / std::max(distance, at.error);  // error > 0
    };
    Sampler to_suns = point.split(kSunsBranch);
    for (const std::uint32_t sun : choice.suns()) {
        if (const auto from_sun = sunlight(scene, vertex, sun, to_suns))
            add(kPi * from_sun->radiance, from_sun->w, INFINITY);
    }
    for (int i = 0; i < kLightSamples; ++i) {
        Sampler sampler = point.split_stratified(kLightSamplesBranch, static_cast<std::uint32_t>(i));
        const float u_light = sampler.next();
        const V2f u_place = sampler.next2();
        if (const auto drawn = choice.draw(scene, at.p, u_light, u_place)) {
            const Rgb asked = unshadowed(vertex, *drawn);
            if (!is_black(asked)) {
                add(scale * asked * transmitted_share(scene, vertex, drawn->light_sample, sampler),
                    drawn->light_sample.w, drawn->light_sample.distance);
            }
        }
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = white.sample(hit.wo, u, Transport::radiance);
        if (!sample) continue;
        const Ray ray{at.towards(sample->wi), sample->wi};
        const auto met = scene.intersect(ray);
        SampleAccount found;
        add_emission_ahead(scene,
                           EyePath(PathAccount(found, scale * sample->weight), ray, kNoMedium,
                                   EmissionRule::mis(sample->pdf_w, choice)),
                           met, sampler);
        add(found.radiance(), sample->wi, met ? met->t : INFINITY);
    }
    return {sum, over_distance > 0 ? sum / over_distance : INFINITY};
}

// Returns the stride between the photons that get a point, as the time left allows. It times points at a few
// photons and then at more, because the first points pay for cold caches.
std::size_t stride_in_time(const PassContext& context, const PhotonMap& global,
                           const IrradianceSources& sources, BounceParameters bounce) {
    constexpr std::size_t kMostStride = 1 << 16;
    const std::size_t wanted = bounce.stride;
    for (const std::size_t few : {std::size_t{128}, std::size_t{2048}}) {
        const std::size_t trial = global.size() / few;
        if (trial <= bounce.stride && few == 128) return wanted;
        bounce.stride = std::max(wanted, trial);
        const Stopwatch clock;
        const IrradiancePoints points(bounce_on(context.scene, global, bounce, context.workers), sources,
                                      context.workers, context.monitor);
        // This extrapolates to a point at each photon. The first points of a trial take the longest.
        const double seconds = clock.seconds() * static_cast<double>(bounce.stride);
        const double left = std::max(context.prepared.left(), 1e-3);
        const auto stride =
            static_cast<std::size_t>(std::min(std::ceil(seconds / left), double{kMostStride}));
        bounce.stride = agreed(context.workers, std::max(wanted, stride));
        if (bounce.stride == wanted) break;
    }
    return bounce.stride;
}

}  // namespace

bool holds_direct(const PhotonMapSettings& settings, const Scene& scene) {
    return settings.direct == DirectMethod::map || scene.media().empty();
}

IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how,
                                       const PhotonMapSettings& settings) {
    const PhotonMap& global = *maps.find(MapKind::global);
    std::vector<const PhotonMap*> read = {&global};
    if (const PhotonMap* caustic = maps.find(MapKind::caustic)) read.push_back(caustic);
    if (settings.direct == DirectMethod::map) read.push_back(maps.find(MapKind::direct));
    constexpr std::uint64_t kNoPoint = ~std::uint64_t{0};  // no point has this path number
    const Sampler probes(context.seed, Purpose::gather, context.pass, kNoPoint);
    IrradianceSources sources{read, how, Probing{context.scene, probes}, {}};
    if (settings.direct != DirectMethod::map && holds_direct(settings, context.scene)) {
        sources.more = [&, lights = LightChooser(context.scene)](std::uint32_t number, const SurfacePoint& at,
                                                                 IncidentLightSum& light) {
            const Sampler point(context.seed, Purpose::gather, context.pass, number);
            return add_direct_light(context.scene, lights, at, point, light);
        };
    }
    BounceParameters bounce{static_cast<std::size_t>(settings.precompute), context.seed, context.pass};
    if (context.prepared.exists()) bounce.stride = stride_in_time(context, global, sources, bounce);
    return {bounce_on(context.scene, global, bounce, context.workers), sources, context.workers,
            context.monitor};
}

}  // namespace lucerna
