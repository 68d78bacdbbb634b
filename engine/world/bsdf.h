// How a surface scatters: a value made for one hit, a closed set of lobes, no heap.
//
// All directions are unit vectors in world space and point away from the surface. `wo` is the side that is
// known (towards the eye for radiance, towards the light for particles), `wi` the other.
//
// Two normals. The geometric normal ng decides which side of the surface a direction is on, and so whether
// light is reflected or transmitted: no light leaks through a wall, however its shading normal is bent. The
// shading normal ns, turned to wo's side, shapes the lobes and gives the cosine. A direction that the two
// normals put on different sides carries nothing, except that a Lambertian surface is still seen from below
// its shading horizon.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "engine/base/frame.h"
#include "engine/base/vec.h"

namespace lucerna {

// What travels along the path. Radiance is compressed by η² where it enters glass; particles' power is not
// (Veach 1997, section 5.2). In numbers: let η_o and η_i be the absolute indices on wo's and on wi's side.
// Transmitted radiance arrives from wi and leaves towards wo with (1 - F) (η_o/η_i)²; particles arrive from
// wo and go on towards wi with (1 - F). So f(wo, wi, particles) = f(wi, wo, radiance).
enum class Transport : std::uint8_t { radiance, particles };

// Two alphas under this are a smooth surface: a rougher lobe is the least that float32 directions can
// resolve. Of two different ones the smaller counts as kLeastAlpha at least. Alphas are GGX's, finite, >= 0,
// and may exceed 1.
inline constexpr float kSmoothAlpha = 1e-3F;
inline constexpr float kLeastAlpha = 1e-4F;
// Rough glass that bends light less than this (|eta - 1|) scatters like smooth glass of the same eta.
inline constexpr float kLeastBend = 1e-3F;

// Lambertian reflection on both sides. Albedo per channel in [0,1].
struct DiffuseLobe {
    Rgb albedo;
};
// Perfect mirror with constant reflectance.
struct MirrorLobe {
    Rgb reflectance;
};
// Smooth or rough (GGX, Walter et al. 2007; visible normals, Heitz 2018) conductor; Fresnel from eta and k.
// Both sides reflect alike. A single bounce between facets: what would bounce again is lost.
struct ConductorLobe {
    Rgb eta, k;                      // relative to the outside, >= 0
    Rgb tint{1.0F};                  // multiplies the Fresnel reflectance
    float alpha_x = 0, alpha_y = 0;  // 0: smooth
};
// Smooth or rough glass boundary. The geometric normal's side is outside. eta = 1 is no boundary: light goes
// straight on, whatever the normals and alphas.
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
    // What `weight` holds of the change of radiance, (η_o/η_i)² with the indices on wo's and wi's side; lets
    // roulette ignore it. 1 for particles and for reflection.
    float eta_scale = 1;
};

class Bsdf {
  public:
    // `ns` shading normal and `ng` geometric normal, unit, in the same hemisphere. `dpdu` orients anisotropy:
    // alpha_x belongs to its part across ns. Asserts that colours lie in [0,1] and the other parameters where
    // the lobes say.
    Bsdf(const Lobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu);

    // The BSDF's value, without the cosine, without delta parts. Which side wi and wo are on is decided by
    // ng.
    Rgb f(const V3f& wo, const V3f& wi, Transport transport) const;
    // Density per solid angle of sample() choosing wi, delta parts left out. (Particles that arrive from
    // below a Lambertian surface's shading horizon are absorbed; this is the density as radiance has it.)
    float pdf_w(const V3f& wo, const V3f& wi) const;
    // No sample: the light is absorbed. A cosine of exactly 0 is absorbed by every lobe but the diffuse one.
    std::optional<BsdfSample> sample(const V3f& wo, const BsdfU& u, Transport transport) const;
    // Share of the power arriving from wo that is scattered (so without any (η_o/η_i)²), delta parts
    // included, in [0,1]; the mean weight of particle samples. Exact for diffuse and smooth lobes (as long as
    // ns = ng); for rough ones a mean over 256 fixed facets, within 0.01 of the exact value (alphas 0.001 to
    // 1, any angle); some 10 microseconds.
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
