// Estimates what VPLs send to a place before their visibility is known: sixteen at once, in loops that
// compilers vectorise.
//
// A contribution estimate is close to the luminance that a light adds there, up to a factor that all lights
// share. Lights are chosen by it. It is positive wherever the light's contribution can be.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/vpl/vpl_store.h"
#include "kdtree/box_tree.h"

namespace lucerna {

// Describes a place that VPLs light.
struct LightReceiver {
    enum class Kind : std::uint8_t { surface, medium } kind = Kind::surface;
    V3f x{0, 0, 0};
    // On a surface: the shading normal, and the geometric one, which is 0 if the surface transmits light.
    // Both are on the eye's side.
    V3f ns{0, 0, 0}, ng{0, 0, 0};
    bool through = false;     // the surface transmits light from the other side
    float below = 0;          // -1: a light below the shading horizon counts like one above; 0: not at all
    V3f wo{0, 0, 0};          // in a medium: towards the eye
    float phase_g = 0;        // in a medium
    Rgb weight{1.0F};         // of each channel: luminance, the store's unit, f if Lambertian
    float mindist = 0;        // distance of the fade [Pharr 2004], scene units
    float glimit = INFINITY;  // bound of cosθ_x cosθ_y / d² [Kollig and Keller 2004], 1/(scene unit)²
    // If true, the estimates are the added luminances, up to one factor. If false, they lack f.
    bool exact = true;
};

using ContributionEstimates = std::array<float, kBlock>;

namespace contribution_detail {

// Returns HenyeyGreenstein::at_cosine in a form that compilers vectorise.
inline float phase(float g, float cosine) {
    const float a = 1 - std::fabs(g);
    const float d = std::max(a * a, 1 + g * g - 2 * g * cosine);
    return 0.25F * kInvPi * (1 - g * g) / (d * std::sqrt(d));
}

// A light at a smaller squared distance cannot be told from the place itself. Its inverse is a finite float.
inline constexpr float kLeastD2 = 1e-30F;

}  // namespace contribution_detail

template <LightReceiver::Kind kind, bool in_medium>
ContributionEstimates estimate_contributions(const VplBlock& block, const LightReceiver& at) {
    const float min2 = at.mindist * at.mindist, low = 0.8F * min2, high = 1.2F * min2;
    // Without mindist nothing fades: every squared distance above kLeastD2 gives t = 1.
    const float fade_scale = high > low ? 1 / (high - low) : 3e38F;
    const float side_least = at.through ? -1.0F : 0.0F;
    ContributionEstimates result;
    for (std::size_t i = 0; i < kBlock; ++i) {
        const float dx = block.x[i] - at.x.x, dy = block.y[i] - at.x.y, dz = block.z[i] - at.x.z;
        const float d2 = dx * dx + dy * dy + dz * dz;
        const float inv = 1 / std::max(d2, contribution_detail::kLeastD2);
        const float inv_d = std::sqrt(inv);
        // Evaluate what leaves towards the place, per solid angle.
        const float along = (block.nx[i] * dx + block.ny[i] * dy + block.nz[i] * dz) * inv_d;
        float value, cosines = 1;
        if constexpr (in_medium) {
            value = contribution_detail::phase(block.more[i], -along);
        } else {
            value = cosines = std::max(0.0F, -along);
        }
        // Evaluate what the place scatters of it.
        if constexpr (kind == LightReceiver::Kind::medium) {
            const float cosine = (at.wo.x * dx + at.wo.y * dy + at.wo.z * dz) * inv_d;
            value *= contribution_detail::phase(at.phase_g, -cosine);
        } else {
            const float cosine = (at.ns.x * dx + at.ns.y * dy + at.ns.z * dz) * inv_d;
            const float side = at.ng.x * dx + at.ng.y * dy + at.ng.z * dz;
            value *= std::max(cosine, at.below * cosine);
            value = side > side_least ? value : 0.0F;
            cosines *= std::fabs(cosine);
        }
        const float t = std::min(std::max((d2 - low) * fade_scale, 0.0F), 1.0F);
        const float luminance =
            at.weight.x * block.r[i] + at.weight.y * block.g[i] + at.weight.z * block.b[i];
        const float clamped = std::min(1.0F, at.glimit * d2 / std::max(cosines, 1e-30F));
        value *= luminance * inv * (t * t * (3 - 2 * t)) * clamped;
        result[i] = d2 > contribution_detail::kLeastD2 ? value : 0.0F;
    }
    return result;
}

inline ContributionEstimates estimate_contributions(const VplBlock& block, bool in_medium,
                                                    const LightReceiver& at) {
    using Kind = LightReceiver::Kind;
    if (at.kind == Kind::surface) {
        return in_medium ? estimate_contributions<Kind::surface, true>(block, at)
                         : estimate_contributions<Kind::surface, false>(block, at);
    }
    return in_medium ? estimate_contributions<Kind::medium, true>(block, at)
                     : estimate_contributions<Kind::medium, false>(block, at);
}

// Adds up in an order that suits vector registers.
inline double sum_of(const ContributionEstimates& estimates) {
    static_assert(kBlock == 16);
    std::array<float, kBlock / 2> eight;
    for (std::size_t i = 0; i < eight.size(); ++i) eight[i] = estimates[i] + estimates[i + eight.size()];
    std::array<float, kBlock / 4> four;
    for (std::size_t i = 0; i < four.size(); ++i) four[i] = eight[i] + eight[i + four.size()];
    return static_cast<double>((four[0] + four[2]) + (four[1] + four[3]));
}

}  // namespace lucerna
