// Lobes without a direction of their own.
#include "engine/base/warp.h"
#include "engine/world/lobe_models.h"

namespace lucerna {

Rgb value(const BlackLobe&, const Local&, Transport) {
    return Rgb(0.0F);
}
float density(const BlackLobe&, const Local&) {
    return 0;
}
Draw draw(const BlackLobe&, const Local&, const BsdfU&, Transport) {
    return std::nullopt;
}
Rgb albedo_of(const BlackLobe&, const Local&) {
    return Rgb(0.0F);
}
bool is_delta_lobe(const BlackLobe&) {
    return false;
}
float chance_of(const BlackLobe&, const Local&) {
    return 0;
}
bool is_sound(const BlackLobe&) {
    return true;
}

// --- Lambertian reflection

namespace {

// Only the light must stand above the shading horizon: were the eye to, silhouettes of smooth meshes would be
// black.
bool is_lit(const Local& at, Transport transport) {
    return (transport == Transport::radiance ? at.wi : at.wo).z >= 0;
}

}  // namespace

Rgb value(const DiffuseLobe& lobe, const Local& at, Transport transport) {
    return at.transmission || !is_lit(at, transport) ? Rgb(0.0F) : lobe.albedo * kInvPi;
}
float density(const DiffuseLobe&, const Local& at) {
    return at.transmission ? 0.0F : cosine_hemisphere_pdf_w(at.wi.z);
}
Draw draw(const DiffuseLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    const V3f wi = square_to_cosine_hemisphere(u.direction);
    if (!(wi.z > 0) || (transport == Transport::particles && at.wo.z < 0)) return std::nullopt;
    return LocalSample{.wi = wi, .weight = lobe.albedo, .pdf_w = cosine_hemisphere_pdf_w(wi.z)};
}
Rgb albedo_of(const DiffuseLobe& lobe, const Local&) {
    return lobe.albedo;
}
bool is_delta_lobe(const DiffuseLobe&) {
    return false;
}
float chance_of(const DiffuseLobe& lobe, const Local&) {
    return max_component(lobe.albedo);
}
bool is_sound(const DiffuseLobe& lobe) {
    return is_share(lobe.albedo);
}

}  // namespace lucerna
