// What a surface's scattering is made of: the parameters of every lobe. What they do is in bsdf_*.cpp.
#pragma once

#include <variant>

#include "engine/base/vec.h"

namespace lucerna {

class CoatTable;

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
// Lambertian transmission: what arrives on one side leaves the other. Albedo per channel in [0,1].
struct DiffuseTransmitLobe {
    Rgb albedo;
};
// [Oren and Nayar 1994, (30)], their "qualitative" model: f = albedo/π (a + b max(0, cos Δφ) sin α tan β).
// Made by oren_nayar(), which keeps its albedo at grazing, albedo (a + b/2), at 1 or less.
struct OrenNayarLobe {
    Rgb albedo;
    float a = 1, b = 0;
};
// Albedo in [0,1], `sigma` the facets' deviation in radians, >= 0. Where the model would reflect more than
// arrives (by 1.5 percent at grazing angles for white of 11 degrees), the albedo is lowered until it does
// not.
OrenNayarLobe oren_nayar(const Rgb& albedo, float sigma);

// The reflection alone of a dielectric's surface, smooth or rough as ConductorLobe: varnish, seen from either
// side as from outside. What is not reflected is left to other lobes.
struct GlossLobe {
    float eta = 1.5F;  // of the varnish over outside, > 0
    Rgb tint{1.0F};    // multiplies the Fresnel reflectance
    float alpha_x = 0, alpha_y = 0;
};

// What stands above a diffuse base: at the cosine μ it keeps reach(μ) = gloss E(μ, alpha) + reflect F(μ) +
// transmit (1 - F(μ)) of the light from the base, with E the albedo of a rough dielectric's surface and F
// that of a smooth one. Together at most 1 in every channel. A borrowed table; none: E counts as 1.
struct Cover {
    const CoatTable* table = nullptr;
    float alpha = 0;
    Rgb gloss{0.0F}, reflect{0.0F}, transmit{0.0F};
};
// A Lambertian base that only what passes the cover reaches and leaves: f = albedo/π (1 - reach(o)) (1 -
// reach(i)). Reciprocal; with albedo <= 1 it sends back no more than the cover lets through, in the mean over
// wi. `albedo` may exceed 1 as far as the light that is held between base and cover makes up for what the
// cover keeps: 1/(1 - mean reach) is the most.
struct CoveredDiffuseLobe {
    Rgb albedo;
    Cover cover;
};

// A metal under varnish, its surface seen through the varnish's: T(o) T(i) R/(1 - R min(E(o), E(i))) times
// the facets' shape, T = 1 - E. For smooth surfaces this is exactly the sum over all bounces between the two;
// for rough ones it is reciprocal and never returns more than min(T(o), T(i)). The varnish's own reflection
// is a GlossLobe beside it.
struct CoatedConductorLobe {
    Rgb eta, k;                        // of the metal over the varnish
    Rgb tint{1.0F};                    // multiplies it all, in [0,1]
    float coat_eta = 1.5F;             // of the varnish over outside, > 0
    float coat_alpha = 0;              // of the varnish's surface
    const CoatTable* table = nullptr;  // borrowed, of coat_eta; not null
    float alpha_x = 0, alpha_y = 0;    // as seen from outside
};

// A pane of glass too thin to displace what goes through it: all bounces between its two faces, straight on
// or back as from a mirror.
struct ThinDielectricLobe {
    float eta = 1.5F;  // > 0
    Rgb tint{1.0F};    // multiplies it all, in [0,1]
};

// [Ashikhmin and Shirley 2000] with GGX's facets, as pbrt-v3 has it ("FresnelBlend"): gloss of reflectance
// `specular` at normal incidence over a diffuse base that fades as the gloss grows, each a lobe of its own.
// Alphas at most 1: above, the model would reflect more than arrives.
struct SubstrateBaseLobe {
    Rgb diffuse, specular;
    Rgb tint{1.0F};  // multiplies it, in [0,1]
};
struct SubstrateGlossLobe {
    Rgb specular;
    float alpha_x = 0.1F, alpha_y = 0.1F;  // at least kLeastAlpha counts
    Rgb tint{1.0F};                        // multiplies it, in [0,1]
};

using Lobe = std::variant<BlackLobe, DiffuseLobe, MirrorLobe, ConductorLobe, DielectricLobe,
                          DiffuseTransmitLobe, OrenNayarLobe, GlossLobe, CoveredDiffuseLobe,
                          CoatedConductorLobe, ThinDielectricLobe, SubstrateBaseLobe, SubstrateGlossLobe>;

}  // namespace lucerna
