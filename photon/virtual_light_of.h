// What a hit makes of a light path: a virtual light, if it scatters light that a shadow ray could bring
// [igi 2].
#pragma once

#include <optional>

#include "photon/shading_normals.h"
#include "photon/virtual_lights.h"

namespace lucerna {

// The surface is taken for a Lambertian one on the side on which the light arrives. Of one that lets light
// through a single sample of its BSDF decides which side shines: curtains glow on the other side, too.
inline std::optional<VirtualLight> virtual_light_of(const WalkHit& at, const Stream& stream) {
    constexpr std::uint32_t kSideBranch = 0x51;
    // Mirrors and smooth glass scatter no light that a shadow ray could bring.
    if (at.bsdf.is_delta() || at.bsdf.is_black()) return std::nullopt;
    // Bent normals: what arrives from below their horizon is absorbed, as it is on the path's way on; and a
    // path lands in proportion to the geometric cosine, but is reflected in proportion to the bent one.
    const float side = std::copysign(1.0F, at.bsdf.geometric_normal().dot(-at.d));
    if (!(side * at.bsdf.shading_normal().dot(-at.d) > 0)) return std::nullopt;
    Rgb scattered = at.power * shading_cosine_ratio(at.bsdf, -at.d);

    SurfacePoint lit = at.hit.at;
    if (lit.n.dot(at.d) > 0) lit.n = -lit.n;
    if (at.bsdf.transmits()) {
        Stream draws = stream.split(kSideBranch);
        const BsdfU u{draws.next(), draws.next2()};
        const auto sample = at.bsdf.sample(-at.d, u, Transport::particles);
        if (!sample) return std::nullopt;
        if (sample->transmission) lit.n = -lit.n;
        scattered *= sample->weight;
    } else {
        scattered *= at.bsdf.albedo(-at.d);
    }
    if (is_black(scattered)) return std::nullopt;
    return VirtualLight{.at = lit, .contribution = scattered * kInvPi};
}

}  // namespace lucerna
