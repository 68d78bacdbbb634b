#include "engine/render/precompute_irradiance.h"

#include "engine/render/direct_light.h"
#include "engine/render/light_choice.h"

namespace lucerna {
namespace {

// The irradiance E of direct light at a point: π times what a white surface shows of it.
Rgb sampled_irradiance(const Scene& scene, const LightChooser& lights, const SurfacePoint& at,
                       const Sampler& point, int samples) {
    Hit hit;
    hit.at = at;
    hit.ns = at.n;
    hit.wo = at.n;
    hit.dpdu = Frame(at.n).s;
    hit.dpdv = Frame(at.n).t;
    const Bsdf white = white_receiver(hit);
    const LightChoice choice = lights.at(at, white, hit.wo);
    Rgb sum(0.0F);
    for (int i = 0; i < samples; ++i) {
        Sampler sampler = point.split_stratified(1, static_cast<std::uint32_t>(i));
        sum += direct_light(scene, Vertex{hit, white, hit.wo}, sampler, choice).radiance;
    }
    return sum * (kPi / static_cast<float>(samples));
}

}  // namespace

IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how,
                                       const PhotonMapSettings& settings) {
    const PhotonMap& global = *maps.find(MapKind::global);
    std::vector<const PhotonMap*> read = {&global};
    if (const PhotonMap* caustic = maps.find(MapKind::caustic)) read.push_back(caustic);
    // Other methods build a Direct map, too, but only to be led by it.
    if (settings.direct == DirectMethod::map) read.push_back(maps.find(MapKind::direct));
    constexpr std::uint64_t kNoPlace = ~std::uint64_t{0};  // the chance of the probes is that of no place
    const Sampler chance(context.seed, Purpose::gather, context.pass, kNoPlace);
    IrradianceSources sources{read, how, Probing{context.scene, chance}, {}};
    if (settings.direct != DirectMethod::map && holds_direct(settings, context.scene)) {
        sources.more = [&, lights = LightChooser(context.scene, settings.lights)](std::uint32_t number,
                                                                                  const SurfacePoint& at) {
            const Sampler point(context.seed, Purpose::gather, context.pass, number);
            return sampled_irradiance(context.scene, lights, at, point, settings.precompute_lights);
        };
    }
    const BounceParameters bounce{static_cast<std::size_t>(settings.precompute), context.seed, context.pass};
    return {bounce_on(context.scene, global, bounce, context.workers), sources, context.workers,
            context.monitor};
}

}  // namespace lucerna
