#include "photon/emission.h"

namespace lucerna {

std::optional<LightPathStart> emit_path(const Scene& scene, Stream& stream) {
    // Draw in a fixed order, so that each kind of number is stratified over the paths.
    const float u_light = stream.next();
    EmitU u;
    u.position = stream.next2();
    u.direction = stream.next2();
    u.salt = stream.bits();

    const auto pick = scene.picker().pick(u_light);
    if (!pick) return std::nullopt;
    const auto emitted = scene.lights()[pick->light]->emit(u);
    if (!emitted || is_black(emitted->weight)) return std::nullopt;
    return LightPathStart{pick->light, emitted->cell, emitted->from, emitted->d,
                          emitted->weight / pick->probability};  // a picked light has probability > 0
}

}  // namespace lucerna
