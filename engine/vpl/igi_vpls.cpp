#include "engine/vpl/igi_vpls.h"

namespace lucerna {
namespace {

// Returns the weight of each channel in luminance().
Rgb channel_weights() {
    return {luminance({1, 0, 0}), luminance({0, 1, 0}), luminance({0, 0, 1})};
}

void bound(LightReceiver& at, const IgiSettings& settings) {
    at.mindist = settings.mindist;
    if (settings.glimit > 0) at.glimit = settings.glimit;
}

}  // namespace

LightReceiver light_receiver(const Vertex& vertex, const IgiSettings& settings, float unit) {
    const Bsdf& bsdf = vertex.bsdf;
    const float side = bsdf.geometric_normal().dot(vertex.wo) >= 0 ? 1.0F : -1.0F;
    LightReceiver at;
    at.x = vertex.hit.at.p;
    at.ns = side * bsdf.shading_normal();
    at.through = bsdf.transmits();
    if (!at.through) at.ng = side * bsdf.geometric_normal();
    at.exact = bsdf.is_lambertian();
    at.below = at.exact ? 0.0F : -1.0F;
    at.weight = channel_weights() * unit;
    // A Lambertian surface has the same f towards all directions on the eye's side.
    if (at.exact) at.weight *= bsdf.f(vertex.wo, at.ns, Transport::radiance);
    bound(at, settings);
    return at;
}

LightReceiver light_receiver(const MediumVertex& vertex, const IgiSettings& settings, float unit) {
    LightReceiver at;
    at.kind = LightReceiver::Kind::medium;
    at.x = vertex.p;
    at.wo = vertex.wo;
    at.phase_g = vertex.phase.g();
    at.weight = channel_weights() * unit;
    bound(at, settings);
    return at;
}

IgiVpls::IgiVpls(const VplSets& sets, std::uint32_t paths, const IgiSettings& settings,
                 const Workers& workers)
    : settings_(settings), store_(sets, workers), paths_(paths) {
    // This is computed in double, because the unit of very faint lights is near the largest float.
    to_radiance_ = static_cast<float>(double{settings.indirect_scale} /
                                      (static_cast<double>(paths_) * double{store_.unit()}));
}

IgiSettings with_distance(const Scene& scene, IgiSettings settings) {
    // This share of the scene's diagonal hides the bright spots of some ten VPLs per set.
    constexpr float kDefaultMinDist = 0.02F;
    if (settings.mindist == 0 && settings.glimit == 0) settings.mindist = kDefaultMinDist * diagonal(scene);
    return settings;
}

}  // namespace lucerna
