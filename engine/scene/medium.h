// Participating media: what absorbs, scatters and emits between surfaces.
//
// A medium's coefficients per channel, times its density, hold per scene unit of length, whatever the
// transformation of its own space. A medium fills everything (no box) or a box of its own space. There are
// two ways in which it is placed, and a path may be in media of both at once; what overlaps adds up:
//   by borders   surfaces say what lies on either side (pbrt 3 and 4); a path carries the medium it is in
//   as a region  the box stands in space, whatever surfaces there are (pbrt 1 and 2)
#pragma once

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
    DensityWalk walk;
};

// None if the ray misses the medium's box before `end`.
std::optional<MediumCrossing> crossing(const Medium& medium, const Ray& ray, double end);

// Scattering coefficient of all media at a point, of which the borders put it in `inside`; per scene unit.
Rgb scattering_at(const SceneMedia& media, std::int32_t inside, const V3f& p);
// Whether any medium scatters anywhere.
bool scatters(const SceneMedia& media);

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

}  // namespace lucerna
