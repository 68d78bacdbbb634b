// Participating media: what absorbs, scatters and emits between surfaces.
//
// A medium's coefficients per channel, times its density, hold per scene unit of length, whatever the
// transformation of its own space. A medium fills everything (no box) or a box of its own space. There are
// two ways in which it is placed, and a path may be in media of both at once; what overlaps adds up:
//   by borders   surfaces say what lies on either side (pbrt 3 and 4); a path carries the medium it is in
//   as a region  the box stands in space, whatever surfaces there are (pbrt 1 and 2)
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/vec.h"
#include "engine/scene/density.h"
#include "engine/scene/mesh.h"

namespace lucerna {

struct Medium {
    std::string name;
    Rgb sigma_a{0.0F}, sigma_s{0.0F};  // absorption and scattering at density 1, per scene unit, >= 0
    Rgb emission{0.0F};                // at density 1, radiance per scene unit, W/(m² sr) per unit, >= 0
    float g = 0;                       // Henyey and Greenstein's, |g| <= kLargestG
    Density density = UniformDensity{};
    std::optional<Box3d> box;  // in the medium's own space; not flat
    M44d medium_from_scene;    // affine; row vectors

    Rgb sigma_t() const { return sigma_a + sigma_s; }
    bool is_uniform() const { return std::holds_alternative<UniformDensity>(density); }
    bool emits() const { return !is_black(emission); }
};

// All media of a scene.
struct SceneMedia {
    std::vector<Medium> all;
    std::vector<std::uint32_t> regions;  // those that stand in space
    std::int32_t camera = kNoMedium;     // around the camera

    // True if no path can ever be in a medium.
    bool empty() const { return all.empty(); }
};

// The part of a ray within one medium.
struct MediumCrossing {
    const Medium* medium;
    double entry, exit;  // along the ray, scene units; entry < exit
    DensityTraversal traversal;
};

// None if the ray misses the medium's box before `end`.
std::optional<MediumCrossing> crossing(const Medium& medium, const Ray& ray, double end);

// Scattering coefficient of all media at a point, of which the borders put it in `inside`; per scene unit.
Rgb scattering_at(const SceneMedia& media, std::int32_t inside, const V3f& p);
// Whether any medium scatters anywhere.
bool scatters(const SceneMedia& media);
// The first that emits light; null if none does.
const Medium* emitting_medium(const SceneMedia& media);

// A box around all media that have bounds; empty if there are none.
Box3d bounds_of(const SceneMedia& media);
// The share of light, per channel, that comes through what fills everything: 0 or 1.
Rgb passes_without_end(const SceneMedia& media, std::int32_t inside);

// What a path is in, behind the surface that `media` belongs to, as it leaves towards w; `n` as Hit has it.
inline std::int32_t medium_towards(const MediumInterface& media, const V3f& n, const V3f& w,
                                   std::int32_t present) {
    if (!media.border) return present;
    return n.dot(w) > 0 ? media.outside : media.inside;
}

// How a medium turns light: the phase function of [Henyey and Greenstein 1941].
//
// Directions are unit vectors that point away from the scattering point, as at a surface: `wo` towards the
// eye, `wi` towards the light. Light that goes straight on has wo·wi = -1. g is the mean cosine between the
// directions of travel before and after: 0 is the same everywhere, towards 1 more and more forward.

// Beyond this a float32 cannot resolve the peak.
inline constexpr float kLargestG = 0.999F;

class HenyeyGreenstein {
  public:
    // |g| <= kLargestG.
    explicit HenyeyGreenstein(float g) : g_(g) {}

    float g() const { return g_; }

    // Density per solid angle of scattering from one direction to the other; also what sample() draws with,
    // so a sample's weight is 1.
    float value(const V3f& wo, const V3f& wi) const { return at_cosine(-wo.dot(wi)); }

    // Of the cosine between the directions of travel; in 1/sr.
    float at_cosine(float cosine) const {
        // At least (1 - |g|)², so the power is never of 0.
        const float d = std::max(sqr(1 - std::fabs(g_)), 1 + g_ * g_ - 2 * g_ * cosine);
        return 0.25F * kInvPi * (1 - g_ * g_) / (d * std::sqrt(d));
    }

    V3f sample(const V3f& wo, const V2f& u) const {
        // The usual inverse of the distribution divides by g. With x = 2u - 1 and that division carried out:
        // cosθ = (x + g(x² + 3)/2 + g²x + g³(x² - 1)/2) / (1 + gx)², good for every g; 1 + gx >= 1 - |g|.
        const float x = 2 * u.x - 1;
        const float g = g_;
        const float above = x + g * (x * x + 3) / 2 + g * g * x + g * g * g * (x * x - 1) / 2;
        const float cosine = std::clamp(above / sqr(1 + g * x), -1.0F, 1.0F);
        const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
        const float phi = 2 * kPi * u.y;
        const Frame along(-wo);
        return along.to_world({sine * std::cos(phi), sine * std::sin(phi), cosine}).normalized();
    }

  private:
    float g_;
};

}  // namespace lucerna
