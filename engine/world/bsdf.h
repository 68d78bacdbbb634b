// How a surface scatters: a value made for one hit, a closed set of lobes, no heap.
//
// All directions are unit vectors in world space and point away from the surface. `wo` is the side that is known
// (towards the eye for radiance, towards the light for particles), `wi` the other.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "engine/base/frame.h"
#include "engine/base/vec.h"

namespace lucerna {

// What travels along the path. Radiance is compressed by η² where it enters glass; particles' power is not
// (Veach 1997, section 5.2).
enum class Transport : std::uint8_t { radiance, particles };

// Lambertian reflection on both sides. Albedo per channel in [0,1].
struct DiffuseLobe {
    Rgb albedo;
};
// Perfect mirror with constant reflectance.
struct MirrorLobe {
    Rgb reflectance;
};
// Smooth or rough (GGX, Walter et al. 2007; visible normals, Heitz 2018) conductor; Fresnel from eta and k.
struct ConductorLobe {
    Rgb eta, k;      // relative to the outside
    Rgb tint{1.0F};  // multiplies the Fresnel reflectance
    float alpha_x = 0, alpha_y = 0;  // 0: smooth
};
// Smooth or rough glass boundary. The geometric normal's side is outside.
struct DielectricLobe {
    float eta = 1.5F;  // inside over outside, > 0
    Rgb reflect{1.0F}, transmit{1.0F};
    float alpha_x = 0, alpha_y = 0;  // 0: smooth
};
// No scattering at all: absorbs everything.
struct BlackLobe {};

using Lobe = std::variant<BlackLobe, DiffuseLobe, MirrorLobe, ConductorLobe, DielectricLobe>;

struct BsdfU {
    float lobe;  // chooses between lobes, or between reflection and transmission
    V2f direction;
};

struct BsdfSample {
    V3f wi;
    Rgb weight;         // f |cosθ_i| / pdf
    float pdf_w;        // per solid angle; 0 for a delta lobe
    bool delta;         // a perfect mirror or smooth glass: nothing else can find this direction
    bool transmission;  // wi lies on the other side of the surface
    float eta_scale = 1;  // (η_i/η_t)² change of radiance this sample carries; lets roulette ignore it
};

class Bsdf {
  public:
    // `ns` shading normal and `ng` geometric normal, unit, in the same hemisphere. `dpdu` orients anisotropy.
    Bsdf(const Lobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu);

    // The BSDF's value, without the cosine, without delta parts. Which side wi and wo are on is decided by ng.
    Rgb f(const V3f& wo, const V3f& wi, Transport transport) const;
    // Density per solid angle of sample() choosing wi, delta parts left out.
    float pdf_w(const V3f& wo, const V3f& wi) const;
    // No sample: the light is absorbed.
    std::optional<BsdfSample> sample(const V3f& wo, const BsdfU& u, Transport transport) const;
    // Share of the light from (or to) wo that is scattered, delta parts included. In [0,1]; exact for diffuse and
    // smooth lobes, a fitted or tabulated value for rough ones (say which, and its error).
    Rgb albedo(const V3f& wo) const;

    // True if all it does is delta: no direct light, no photon stored.
    bool is_delta() const;
    // True if it is exactly Lambertian: then f = albedo/π, whatever the directions on one side.
    bool is_diffuse() const { return std::holds_alternative<DiffuseLobe>(lobe_); }
    bool is_black() const { return std::holds_alternative<BlackLobe>(lobe_); }

    const V3f& shading_normal() const { return frame_.n; }
    const V3f& geometric_normal() const { return ng_; }

  private:
    Lobe lobe_;
    Frame frame_;
    V3f ng_;
};

}  // namespace lucerna
