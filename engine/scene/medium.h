// Describes participating media, which absorb, scatter and emit between surfaces.
//
// A medium's coefficients per channel, times its density, hold per scene unit of length, whatever the
// transformation of its own space. A medium fills everything (no box) or a box of its own space. There are
// two ways to place it; a path may be in media of both kinds at once, and overlapping media add up:
//   by interfaces  surfaces name the media on both sides (pbrt 3 and 4); a path carries its present medium
//   as a region    the box is at a place in space, independent of surfaces (pbrt 1 and 2)
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/scene/density.h"
#include "engine/scene/mesh.h"

namespace lucerna {

struct Medium {
    std::string name;
    Rgb sigma_a{0.0F}, sigma_s{0.0F};  // absorption and scattering at density 1, per scene unit, >= 0
    Rgb emission{0.0F};                // at density 1, radiance per scene unit, W/(m² sr) per unit, >= 0
    float g = 0;                       // parameter of the Henyey-Greenstein phase function, |g| <= kLargestG
    Density density = UniformDensity{};
    std::optional<Box3d> box;  // in the medium's own space; not flat
    M44d medium_from_scene;    // affine; row vectors

    Rgb sigma_t() const { return sigma_a + sigma_s; }
    bool is_uniform() const { return std::holds_alternative<UniformDensity>(density); }
    bool emits() const { return !is_black(emission); }
};

// Holds all media of a scene.
struct SceneMedia {
    std::vector<Medium> all;
    std::vector<std::uint32_t> regions;  // media placed as regions
    std::int32_t camera = kNoMedium;     // around the camera

    // Tells whether no path can ever be in a medium.
    bool empty() const { return all.empty(); }
};

// Describes the part of a ray within one medium.
struct MediumCrossing {
    const Medium* medium;
    double entry, exit;  // along the ray, scene units; entry < exit
    DensityTraversal traversal;
};

// Returns none if the ray misses the medium's box before `end`.
std::optional<MediumCrossing> crossing(const Medium& medium, const Ray& ray, double end);

// Returns the scattering coefficient of all media at a point in interface medium `inside`, per scene unit.
Rgb scattering_at(const SceneMedia& media, std::int32_t inside, const V3f& p);
// Tells whether any medium scatters anywhere.
bool scatters(const SceneMedia& media);
// Returns the first medium that emits light; null if none does.
const Medium* emitting_medium(const SceneMedia& media);

// Returns a box around all media that have bounds; empty if there are none.
Box3d bounds_of(const SceneMedia& media);
// Returns the share of light, per channel, that passes the unbounded media to infinity: 0 or 1.
Rgb passes_without_end(const SceneMedia& media, std::int32_t inside);

// Returns the medium beyond the surface that `media` belongs to, for a path that leaves towards w. `n` is
// Hit's normal; `present` is the medium that the path is in.
inline std::int32_t medium_towards(const MediumInterface& media, const V3f& n, const V3f& w,
                                   std::int32_t present) {
    if (!media.is_interface) return present;
    return n.dot(w) > 0 ? media.outside : media.inside;
}

// Implements the phase function of [Henyey and Greenstein 1941].
//
// Directions are unit vectors that point away from the scattering point, as at a surface: `wo` towards the
// eye, `wi` towards the light. Light that goes straight on has wo·wi = -1. g is the mean cosine between the
// directions of travel before and after: 0 is isotropic, values towards 1 are increasingly forward.

// Float32 cannot resolve the peak of a larger value.
inline constexpr float kLargestG = 0.999F;

class HenyeyGreenstein {
  public:
    // Requires |g| <= kLargestG.
    explicit HenyeyGreenstein(float g) : g_(g) {}

    float g() const { return g_; }

    // Returns the density per solid angle of scattering from one direction to the other. sample() draws by
    // the same density, so that a sample's weight is 1.
    float value(const V3f& wo, const V3f& wi) const { return at_cosine(-wo.dot(wi)); }

    // Returns the value for the cosine between the directions of travel, 1/sr.
    float at_cosine(float cosine) const {
        // The lower limit (1 - |g|)² keeps the argument of the power from 0.
        const float d = std::max(sqr(1 - std::fabs(g_)), 1 + g_ * g_ - 2 * g_ * cosine);
        return 0.25F * kInvPi * (1 - g_ * g_) / (d * std::sqrt(d));
    }

    V3f sample(const V3f& wo, const V2f& u) const {
        // The usual inverse of the distribution divides by g. With x = 2u - 1 and that division carried out,
        // cosθ = (x + g(x² + 3)/2 + g²x + g³(x² - 1)/2) / (1 + gx)² holds for every g; 1 + gx >= 1 - |g|.
        const float x = 2 * u.x - 1;
        const float g = g_;
        const float above = x + g * (x * x + 3) / 2 + g * g * x + g * g * g * (x * x - 1) / 2;
        const float cosine = std::clamp(above / sqr(1 + g * x), -1.0F, 1.0F);
        const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
        const float phi = 2 * kPi * u.y;
        const Frame along(-wo);
        return along.to_world({sine * cos(phi), sine * sin(phi), cosine}).normalized();
    }

  private:
    float g_;
};

}  // namespace lucerna
