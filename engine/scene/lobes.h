// Declares the parameters of every lobe of a BSDF. bsdf_*.cpp implements their behaviour.
#pragma once

#include <variant>

#include "engine/base/vec.h"

namespace lucerna {

class CoatTable;

// A surface counts as smooth if both alphas are below kSmoothAlpha, because float32 directions cannot resolve
// a narrower lobe. The smaller of two different alphas counts as at least kLeastAlpha. Alphas are GGX's,
// finite, >= 0, and may exceed 1.
inline constexpr float kSmoothAlpha = 1e-3F;
inline constexpr float kLeastAlpha = 1e-4F;
// Rough glass that bends light less than this (|eta - 1|) scatters like smooth glass of the same eta.
inline constexpr float kLeastBend = 1e-3F;

// Reflects by Lambert's law on both sides. The albedo is in [0,1] per channel.
struct DiffuseLobe {
    Rgb albedo;
};
// Models a perfect mirror with constant reflectance.
struct MirrorLobe {
    Rgb reflectance;
};
// Models a smooth or rough (GGX, Walter et al. 2007; visible normals, Heitz 2018) conductor, with Fresnel
// from eta and k. Both sides reflect alike. Facets reflect once: light that would bounce again is lost.
struct ConductorLobe {
    Rgb eta, k;                      // relative to the outside, >= 0
    Rgb tint{1.0F};                  // multiplies the Fresnel reflectance
    float alpha_x = 0, alpha_y = 0;  // 0: smooth
};
// Models a smooth or rough glass boundary. The geometric normal's side is outside. With eta = 1 light goes
// straight on, whatever the normals and alphas.
struct DielectricLobe {
    float eta = 1.5F;  // inside over outside, > 0
    Rgb reflect{1.0F}, transmit{1.0F};
    float alpha_x = 0, alpha_y = 0;  // 0: smooth
};
// Absorbs everything.
struct BlackLobe {};
// Transmits by Lambert's law: light that arrives on one side leaves the other. The albedo is in [0,1] per
// channel.
struct DiffuseTransmitLobe {
    Rgb albedo;
};
// Models the "qualitative" model of [Oren and Nayar 1994, (30)]: f = albedo/π (a + b max(0, cos Δφ) sin α tan
// β). oren_nayar() makes it and keeps its albedo at grazing, albedo (a + b/2), at 1 or less.
struct OrenNayarLobe {
    Rgb albedo;
    float a = 1, b = 0;
};
// `albedo` is in [0,1], `sigma` is the facets' standard deviation in radians, >= 0. Where the model would
// reflect more than arrives (by 1.5 percent at grazing angles for white with 11 degrees), the albedo is
// lowered accordingly.
OrenNayarLobe oren_nayar(const Rgb& albedo, float sigma);

// Models the reflection of a dielectric's surface (varnish), smooth or rough as ConductorLobe; both sides
// behave as seen from outside. Other lobes handle the light that it does not reflect.
struct GlossLobe {
    float eta = 1.5F;  // varnish over outside, > 0
    Rgb tint{1.0F};    // multiplies the Fresnel reflectance
    float alpha_x = 0, alpha_y = 0;
};

// Describes the layer above a diffuse base. At the cosine μ it removes reach(μ) = gloss E(μ, alpha) + reflect
// F(μ) + transmit (1 - F(μ)) of the base's light, with E the albedo of a rough dielectric's surface and F
// that of a smooth one. The sum is at most 1 in every channel. The table is borrowed; without it E is 1.
struct Cover {
    const CoatTable* table = nullptr;
    float alpha = 0;
    Rgb gloss{0.0F}, reflect{0.0F}, transmit{0.0F};
};
// Models a Lambertian base lit and seen through a cover: f = albedo/π (1 - reach(o)) (1 - reach(i)). It is
// reciprocal; with albedo <= 1 it returns no more, in the mean over wi, than the cover lets through. `albedo`
// may exceed 1, up to 1/(1 - mean reach), as far as light held between base and cover makes up for what the
// cover removes.
struct CoveredDiffuseLobe {
    Rgb albedo;
    Cover cover;
};

// Models a metal under varnish, seen through the varnish's surface: T(o) T(i) R/(1 - R min(E(o), E(i))) times
// the facets' distribution, T = 1 - E. For smooth surfaces this is exactly the sum over all bounces between
// the two; for rough ones it is reciprocal and never returns more than min(T(o), T(i)). A separate GlossLobe
// models the varnish's own reflection.
struct CoatedConductorLobe {
    Rgb eta, k;                        // metal over varnish
    Rgb tint{1.0F};                    // multiplies everything, in [0,1]
    float coat_eta = 1.5F;             // varnish over outside, > 0
    float coat_alpha = 0;              // of the varnish's surface
    const CoatTable* table = nullptr;  // borrowed, made for coat_eta; not null
    float alpha_x = 0, alpha_y = 0;    // as seen from outside
};

// Models a pane of glass too thin to displace the light that passes it. It includes all bounces between its
// two faces, which transmit straight on or reflect as a mirror, and absorption between them.
struct ThinDielectricLobe {
    float eta = 1.5F;  // > 0
    Rgb tint{1.0F};    // multiplies everything, in [0,1]
    float inside = 1;  // transmittance from face to face at normal incidence, in (0,1]
};

// These model [Ashikhmin and Shirley 2000] with GGX facets, as pbrt-v3's "FresnelBlend": gloss of reflectance
// `specular` at normal incidence over a diffuse base that fades as the gloss grows. Each is a lobe of its
// own. Alphas are at most 1, because above that the model would reflect more than arrives.
struct SubstrateBaseLobe {
    Rgb diffuse, specular;
    Rgb tint{1.0F};  // multiplies the lobe, in [0,1]
};
struct SubstrateGlossLobe {
    Rgb specular;
    float alpha_x = 0.1F, alpha_y = 0.1F;  // at least kLeastAlpha is used
    Rgb tint{1.0F};                        // multiplies the lobe, in [0,1]
};

using Lobe = std::variant<BlackLobe, DiffuseLobe, MirrorLobe, ConductorLobe, DielectricLobe,
                          DiffuseTransmitLobe, OrenNayarLobe, GlossLobe, CoveredDiffuseLobe,
                          CoatedConductorLobe, ThinDielectricLobe, SubstrateBaseLobe, SubstrateGlossLobe>;

}  // namespace lucerna
