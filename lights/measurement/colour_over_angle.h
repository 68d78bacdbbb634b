// A lamp's colour by direction, as makers of LEDs state it: chromaticity, its distance Δu'v' in the CIE 1976
// diagram from that of a reference, colour temperature and Duv, over the angle from the axis.
//
// It is computed from the far field of X, Y and Z each (plane_irradiance.h), so that directions are averaged
// as light adds. The reference of colour uniformity over angle is the lamp's mean colour, that of all its
// light: the sum over directions weighted by intensity and solid angle [CIE 15:2004].
#pragma once

#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/lumigraph.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/ray_set.h"

namespace lucerna {

// Returns Δu'v' of two colours in XYZ; the sums of their components are positive.
double delta_uv(const V3d& xyz, const V3d& reference);

struct AngularColours {
    std::vector<double> polar, azimuth;  // degrees, as in PhotometricGrid, without the azimuth 360
    std::vector<V3d> xyz;  // [azimuth][polar]; Y is the intensity, flux unit / sr; none negative
    V3d mean{0, 0, 0};     // XYZ of the total flux, flux unit

    const V3d& at(std::size_t azimuth_index, std::size_t polar_index) const {
        return xyz[azimuth_index * polar.size() + polar_index];
    }
    const V3d& on_axis() const { return xyz[0]; }
    V3d over_planes(std::size_t polar_index) const;  // the mean over all C
    double peak() const;                             // of intensity
    // Returns the largest Δu'v' from the mean over directions with at least this share of the peak intensity.
    double largest_delta(double share) const;
};

// A lamp of one colour has it everywhere. Throw InputError as far_field() does.
AngularColours colours_over_angle(const Lumigraph& lamp, const FarFieldGrid& grid, const Workers& workers,
                                  Monitor& monitor);
AngularColours colours_over_angle(const RaySet& rays, const FarFieldGrid& grid);

// Returns one row for each direction: angles, intensity, x, y, u', v', Δu'v' from the axis and from the mean,
// CCT and Duv; lines about the lamp begin with `#`. Undefined numbers are left empty.
std::string colours_csv(const AngularColours& colours, std::string_view title, std::string_view unit);

}  // namespace lucerna
