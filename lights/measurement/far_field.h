// A lamp from afar: the photometric web that a goniophotometer would measure of it.
//
// Far away only the direction counts. All rays of direction (a, b, 1) pass S at (u, v) and M at
// (u + a D, v + b D), so the intensity is
//
//     I = cos θ ∫∫ L du dv = D²/cos³θ ∫∫ h(u, v, u + a D, v + b D) du dv              [Goesele 2003, 3.2]
//
// because L = h R⁴/D² and R = D/cos θ. As h is a sum of products, each coefficient adds a product of two
// one-dimensional integrals of the bell, which have a closed form. Coefficients are taken as measured,
// negative ones included.
//
// A web is made from directions as a field is from rays: each node of its grid holds the mean of the
// intensity under its hat, the bilinear function that is 1 there and 0 at its neighbours. Hats add up to 1,
// so the web has the lamp's flux, whatever the grid. What is smaller than a step of the grid is smoothed.
//
// In a web radiance is taken to be even over a pixel of M as seen from a filter, with the pixel's flux (the
// approximate reconstruction of appendix A, in which that flux is kept). The flux density, which is even
// there by the field's definition, would make of each pixel a tooth: a pixel in the middle of a wide lamp's M
// may span 17°, over which cos³ falls by an eighth.
#pragma once

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/light_field.h"
#include "lights/photometric.h"
#include "lights/ray_set.h"

namespace lucerna {

// Steps of the grid, degrees; polar_step divides 90 and azimuth_step 360. At least 0.05.
struct FarFieldGrid {
    double polar_step = 1;
    double azimuth_step = 5;
};

// Towards (a, b, 1), in the field's frame [flux unit/sr]. May be negative where noise exceeds the light.
double far_intensity(const LightField& field, const V2d& slope);

// The web of the whole field; of its measured flux (scaled to it, after what is negative was cut off). Angles
// γ from 0 to 90. In the field's unit per sr: candela if it is in lm. Throws InputError for steps that do not
// divide, for a field without flux, and when the user stops it.
PhotometricWeb far_field(const LightField& field, const FarFieldGrid& grid, const Workers& workers,
                         Monitor& monitor);

// The web of a ray file, backward rays included; of the flux of all its rays.
PhotometricWeb far_field(const RaySet& rays, const FarFieldGrid& grid);

}  // namespace lucerna
