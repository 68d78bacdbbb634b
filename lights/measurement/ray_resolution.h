// How fine a light field a ray set can carry: the noise that so many rays leave in its coefficients, and how
// far the field they make is from the lamp's.
#pragma once

#include <cstddef>
#include <span>

#include "engine/base/monitor.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"

namespace lucerna {

// Sums over rays from which the noise of a projection is told. A coefficient is a sum of rays' contributions,
// so its variance over repetitions of the measurement is estimated by the sum of their squares.
struct CoefficientNoise {
    double variance = 0;  // Σ over coefficients of that sum
    double square = 0;    // Σ E², noise included
    // Root mean square noise of a coefficient over the root mean square of the coefficients without it;
    // INFINITY if nothing but noise is there. 10 %: repeat the measurement with other rays, and the field
    // differs by 14 % of itself, in the mean over its squares.
    double relative() const;
};

// What a field on `rig` from the first or every k-th of these rays would be like, scaled to all of them.
struct ResolutionTrial {
    CoefficientNoise noise;
    // ∫ (ĥ - h)² over the planes, but for ∫ h², which no resolution changes; [flux² / m⁴]. It is estimated
    // by leaving each ray out of the field that it is compared with, so noise does not pass for detail.
    double risk = 0;
};
// Throws nothing; memory: 8 bytes per coefficient.
ResolutionTrial try_resolution(const RaySet& set, std::span<const std::size_t> rays, const Rig& rig);

// Fills in rig.views, rig.pixels, rig.spacing and rig.pixel for the boxes `half_s` and `half_m`: of the
// resolutions whose noise is at most `noise` the one of least risk. `views` and `pixels` are kept where they
// are not 0. Returns false if even the coarsest is too noisy: it is taken then.
struct ResolutionWish {
    V2d half_s, half_m;  // metres
    V2i views, pixels;
    double noise;
};
bool choose_resolution(const RaySet& set, std::span<const std::size_t> rays, const ResolutionWish& wish,
                       Rig& rig, Monitor& monitor);

}  // namespace lucerna
