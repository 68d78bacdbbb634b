// Irradiance that a lamp casts on a plane that faces it, from its coefficients alone, without a renderer.
//
// On a plane parallel to S at distance z all cosines and distances cancel. A bundle of rays that is du dv
// wide on S and ds dt wide on M is (z/D)² ds dt wide at a point that all of it passes, so that
//
//     E(x, y, z) = (D/z)² ∫∫ h(u, v, u + (x - u) D/z, v + (y - v) D/z) du dv            [Goesele 2003, 3.2]
//
// and, since h is a sum of products, each coefficient adds a product of two one-dimensional integrals of the
// bell over the part of S from which the point is seen through a pixel (basis_shares.h).
//
// Coefficients are used as measured, negative ones included, which is unbiased and conserves the measured
// flux. (A renderer's particles follow max(0, h), scaled back to the same flux; the two agree where the field
// is smooth.)
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/photometric.h"
#include "lights/ray_set.h"

namespace lucerna {

// A rectangle on a plane parallel to S, in pixels. Lengths in metres.
struct PlanePatch {
    double distance = 0;  // of the plane from the frame's z = 0, towards +z
    V2d centre{0, 0};
    V2d size{0, 0};
    V2i pixels{0, 0};

    double pixel_area() const { return size.x / pixels.x * (size.y / pixels.y); }  // pixels >= 1
    // Says why this is not a valid patch; empty if it is one.
    std::string fault() const;
};

// The mean irradiance of every pixel [flux unit/m²], rows from the least y upwards: [y * pixels.x + x]. It
// may be negative where the light is weaker than the noise.
struct PlaneIrradiance {
    PlanePatch patch;
    std::vector<double> values;

    double at(int x, int y) const {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(patch.pixels.x) +
                      static_cast<std::size_t>(x)];
    }
    double flux() const;  // through the patch
    double peak() const;
};

// Projects a field, in its own frame: S is z = 0 and centred on the axis. The distance is >= 0, where 0 is S
// itself. With the approximate reconstruction the geometric terms do not cancel, so a quadrature over S is
// made for the centre of each pixel. Throws InputError for an invalid patch.
PlaneIrradiance project(const LightField& field, const PlanePatch& patch, const Workers& workers,
                        Monitor& monitor, Reconstruction reconstruction = Reconstruction::exact);
// Returns the irradiance at a point on the plane z = point.z >= 0, facing the lamp.
double irradiance(const LightField& field, const V3d& point,
                  Reconstruction reconstruction = Reconstruction::exact);

// Projects a whole lamp on a plane perpendicular to the normal of `side`; patch.distance and patch.centre are
// along the side's axes, in the lamp's frame. A slab that faces elsewhere lights the plane, too, with E times
// the ratio of the cosines to the side and to S, which is linear along one axis of S. Throws InputError for a
// plane that cuts the lamp's box, and for slabs that are not aligned with the side's axes.
PlaneIrradiance project(const Lumigraph& lamp, const SlabAxes& side, const PlanePatch& patch,
                        const Workers& workers, Monitor& monitor);
// Returns a square around the lamp's light on that plane.
PlanePatch frame_light(const Lumigraph& lamp, const SlabAxes& side, double distance, int pixels,
                       const Workers& workers, Monitor& monitor);
// Returns the square around what is bright in a wide projection.
PlanePatch frame_of(const PlaneIrradiance& wide, int pixels);

// Counts rays into the pixels, in the frame of the rays. As in a light field they are whole lines: a ray that
// starts beyond the plane counts, too. Rays that do not leave towards +z are left out.
PlaneIrradiance project(const RaySet& rays, const PlanePatch& patch);

// Returns a square around the light on the plane z = distance, which leaves out about 2 % of it on each side.
PlanePatch frame_light(const LightField& field, double distance, int pixels, const Workers& workers,
                       Monitor& monitor);
PlanePatch frame_light(const RaySet& rays, double distance, int pixels);

// The far field of a lamp: the photometric web that a goniophotometer would measure.
//
// Far away only the direction matters. All rays of direction (a, b, 1) pass S at (u, v) and M at (u + a D, v
// + b D), so the intensity is
//
//     I = cos θ ∫∫ L du dv = D²/cos³θ ∫∫ h(u, v, u + a D, v + b D) du dv              [Goesele 2003, 3.2]
//
// because L = h R⁴/D² and R = D/cos θ. Since h is a sum of products, each coefficient adds a product of two
// one-dimensional integrals of the bell (basis_shares.h). Coefficients are used as measured, negative ones
// included.
//
// A web is made from directions as a field is made from rays: each node of its grid holds the mean intensity
// under its hat, the bilinear function that is 1 there and 0 at its neighbours. Hats add up to 1, so the web
// has the lamp's flux on any grid. Details smaller than a grid step are smoothed.
//
// Where pixels are boxes, radiance is taken as constant over a pixel of M as seen from a filter, with the
// pixel's flux (the approximate reconstruction of appendix A, with that flux kept). The flux density, which
// is constant there by definition, would give each pixel a tooth: a pixel in the middle of a wide lamp's M
// may span 17°, over which cos³ falls by an eighth.

// The steps of the grid in degrees, at least 0.05; polar_step divides 90 and azimuth_step 360.
struct FarFieldGrid {
    double polar_step = 1;
    double azimuth_step = 5;
    // If set, computes the intensity of the light field's radiance as it is rendered, clamped at 0 and with
    // constant flux density over a box pixel, to be compared with the rendered near field. Otherwise computes
    // that of the coefficients as measured.
    bool as_rendered = false;
    // Radius of the caps over which the intensities of rays are averaged [degrees]; 0: smoothing_cap().
    double cap = 0;
};

// Returns the intensity towards (a, b, 1), field's frame [flux unit/sr]; noise may make it negative.
double far_intensity(const LightField& field, const V2d& slope);

// Returns the web of the whole field, with angles γ from 0 to 90, scaled to the measured flux after negative
// values were set to 0. It is in the field's unit per sr: candela if that is lm. A field of several colours
// gives the web of Y. The luminous opening is the shining part of the lamp (shining_opening.h). Throws
// InputError for steps that do not divide, for a field without flux, and when the user stops it.
PhotometricWeb far_field(const LightField& field, const FarFieldGrid& grid, const Workers& workers,
                         Monitor& monitor);

// As above for a whole lamp, in its frame; angles go to 180 for several slabs.
PhotometricWeb far_field(const Lumigraph& lamp, const FarFieldGrid& grid, const Workers& workers,
                         Monitor& monitor);

// Returns the web of a ray file, backward rays included, with the flux of all its rays (of Y, if coloured).
// Intensities are means over caps around each direction.
PhotometricWeb far_field(const RaySet& rays, const FarFieldGrid& grid);
// Returns the radius of these caps [degrees]: the smallest of 0.1 to 10 degrees that holds 400 rays where
// they are densest, so that the peak has a standard error of 5 % or less.
double smoothing_cap(const RaySet& rays, const FarFieldGrid& grid);

}  // namespace lucerna
