// What a surface's scattering is made of: the parameters of every lobe. What they do is in bsdf_*.cpp.
#pragma once

#include <variant>

#include "engine/base/vec.h"

namespace lucerna {

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

}  // namespace lucerna
