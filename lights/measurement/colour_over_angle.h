// A lamp's colour by direction, as makers of LEDs state it: chromaticity, its distance Δu'v' in the diagram
// of CIE 1976 from that of a reference, colour temperature and Duv, over the angle from the axis.
//
// The far field of X, Y and Z each (plane_irradiance.h), so that directions are averaged as light is added.
// The lamp's mean is that of all its light, the sum over directions weighed by intensity and solid angle:
// the reference of colour uniformity over angle [CIE 15:2004].
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

// Δu'v' of two colours by their XYZ; the sums of components are positive.
double delta_uv(const V3d& xyz, const V3d& reference);

struct AngularColours {
    std::vector<double> polar, azimuth;  // degrees, as PhotometricGrid's, without the azimuth 360
    std::vector<V3d> xyz;  // [azimuth][polar]: Y is the intensity, flux unit / sr; none negative
    V3d mean{0, 0, 0};     // of all light: XYZ of the flux, flux unit

    const V3d& at(std::size_t azimuth_index, std::size_t polar_index) const {
        return xyz[azimuth_index * polar.size() + polar_index];
    }
    const V3d& on_axis() const { return xyz[0]; }
    V3d over_planes(std::size_t polar_index) const;  // the mean over all C
    double peak() const;                             // of intensity
    // The largest Δu'v' from the mean over directions of at least this share of the peak intensity.
    double largest_delta(double share) const;
};

// Of a lamp of one colour, that everywhere. Throw InputError as far_field() does.
AngularColours colours_over_angle(const Lumigraph& lamp, const FarFieldGrid& grid, const Workers& workers,
                                  Monitor& monitor);
AngularColours colours_over_angle(const RaySet& rays, const FarFieldGrid& grid);

// One row for each direction: angles, intensity, x, y, u', v', Δu'v' from the axis and from the mean, CCT and
// Duv; with `#` before lines about the lamp. A number that is none is left empty.
std::string colours_csv(const AngularColours& colours, std::string_view title, std::string_view unit);

}  // namespace lucerna
