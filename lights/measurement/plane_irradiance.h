// What a lamp casts on a plane that faces it: from its coefficients alone, without a renderer.
//
// On a plane parallel to S at distance z all cosines and distances cancel: a bundle of rays that is du dv
// wide on S and ds dt wide on M is (z/D)² ds dt wide at a point that all of it passes, so that
//
//     E(x, y, z) = (D/z)² ∫∫ h(u, v, u + (x - u) D/z, v + (y - v) D/z) du dv            [Goesele 2003, 3.2]
//
// and, h being a sum of products, each coefficient adds a product of two one-dimensional integrals of the
// bell over the part of S from which the point is seen through a pixel (basis_shares.h).
//
// Coefficients are taken as measured, negative ones included: that is the unbiased estimate, and it conserves
// the measured flux. (A renderer's particles follow max(0, h), scaled back to the same flux; where the field
// is smooth the two agree.)
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
    // Why this is no patch, in words; empty if it is one.
    std::string fault() const;
};

// Mean irradiance of every pixel [flux unit/m²], rows from the least y upwards: [y * pixels.x + x]. May be
// negative where the light is weaker than the noise. Throws InputError for a patch that is none.
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

// In the field's frame: S is z = 0, its centre on the axis. distance >= 0; 0 is S itself. By the approximate
// reconstruction the geometric terms do not cancel: a quadrature over S, at the middle of each pixel.
PlaneIrradiance project(const LightField& field, const PlanePatch& patch, const Workers& workers,
                        Monitor& monitor, Reconstruction reconstruction = Reconstruction::exact);
// The irradiance at one point of the plane z = point.z >= 0, facing the lamp.
double irradiance(const LightField& field, const V3d& point,
                  Reconstruction reconstruction = Reconstruction::exact);

// What a whole lamp casts on a plane across the normal of `side`: patch.distance and patch.centre are along
// its axes, in the lamp's frame. A slab that looks elsewhere sends light there too, at E times the cosine to
// the side over that to S, which is linear along one axis of S. A plane that cuts the lamp's box, slabs that
// do not look along the side's axes: InputError.
PlaneIrradiance project(const Lumigraph& lamp, const SlabAxes& side, const PlanePatch& patch,
                        const Workers& workers, Monitor& monitor);
// A square about its light there.
PlanePatch frame_light(const Lumigraph& lamp, const SlabAxes& side, double distance, int pixels,
                       const Workers& workers, Monitor& monitor);
// The square about what is bright in a wide projection.
PlanePatch frame_of(const PlaneIrradiance& wide, int pixels);

// Rays counted into the pixels, in the frame of the rays. As in a light field they are whole lines: one that
// starts beyond the plane counts where its line passes it. Those that do not go towards +z are left out.
PlaneIrradiance project(const RaySet& rays, const PlanePatch& patch);

// A square about the light on the plane z = distance, that leaves out about 2 % of it on each side.
PlanePatch frame_light(const LightField& field, double distance, int pixels, const Workers& workers,
                       Monitor& monitor);
PlanePatch frame_light(const RaySet& rays, double distance, int pixels);

// A lamp from afar: the photometric web that a goniophotometer would measure of it.
//
// Far away only the direction counts. All rays of direction (a, b, 1) pass S at (u, v) and M at
// (u + a D, v + b D), so the intensity is
//
//     I = cos θ ∫∫ L du dv = D²/cos³θ ∫∫ h(u, v, u + a D, v + b D) du dv              [Goesele 2003, 3.2]
//
// because L = h R⁴/D² and R = D/cos θ. As h is a sum of products, each coefficient adds a product of two
// one-dimensional integrals of the bell (basis_shares.h). Coefficients are taken as measured, negative ones
// included.
//
// A web is made from directions as a field is from rays: each node of its grid holds the mean of the
// intensity under its hat, the bilinear function that is 1 there and 0 at its neighbours. Hats add up to 1,
// so the web has the lamp's flux, whatever the grid. What is smaller than a step of the grid is smoothed.
//
// Where pixels are boxes, radiance is taken to be even over a pixel of M as seen from a filter, with the
// pixel's flux (the approximate reconstruction of appendix A, in which that flux is kept). The flux density,
// which is even there by the field's definition, would make of each pixel a tooth: a pixel in the middle of a
// wide lamp's M may span 17°, over which cos³ falls by an eighth.

// Steps of the grid, degrees; polar_step divides 90 and azimuth_step 360. At least 0.05.
struct FarFieldGrid {
    double polar_step = 1;
    double azimuth_step = 5;
    // The intensity of the light field's radiance as it is rendered: clamped at 0, and even in flux density
    // over a pixel that is a box. It is what to compare the rendered near field with. Otherwise it is that of
    // the coefficients as measured.
    bool as_rendered = false;
};

// Towards (a, b, 1), in the field's frame [flux unit/sr]. May be negative where noise exceeds the light.
double far_intensity(const LightField& field, const V2d& slope);

// The web of the whole field; of its measured flux (scaled to it, after what is negative was cut off). Angles
// γ from 0 to 90. In the field's unit per sr: candela if it is in lm. Throws InputError for steps that do not
// divide, for a field without flux, and when the user stops it. Of a field of several colours that of Y. The
// luminous opening is what of the lamp shines (shining_opening.h).
PhotometricWeb far_field(const LightField& field, const FarFieldGrid& grid, const Workers& workers,
                         Monitor& monitor);

// The same of a whole lamp, in its frame: angles to 180 if it has slabs that look to other sides than +z.
PhotometricWeb far_field(const Lumigraph& lamp, const FarFieldGrid& grid, const Workers& workers,
                         Monitor& monitor);

// The web of a ray file, backward rays included; of the flux of all its rays, of several colours that of Y.
PhotometricWeb far_field(const RaySet& rays, const FarFieldGrid& grid);

}  // namespace lucerna
