// What share of an estimate's kernel lies where photons could have been counted [Jensen 2001, 7].
//
// At the edge of a surface the disc hangs over: no photon rests there, and the estimate is too dark by the
// part of the kernel that hangs over (half of it on a straight edge, three quarters at a right corner).
// Divided by the share that does not, it is right again as far as the light is even over the disc. Two ways
// to find the share:
//
//   hull     the convex hull of the photons where they cross the disc [Jensen 2001, 7.2], of which
//            the kernel is integrated exactly. Needs nothing but the photons; sees no hole and no inner
//            corner.
//   probes   a few photons' paths, moved across the disc as the kernel has it, are traced: does each end
//            where the metric would have counted it? Sees what the scene is; costs short rays.
//
// Where a neighbouring wall fills the disc (a concave corner) neither corrects anything, as photons are found
// all over it.
#pragma once

#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/scene/scene.h"
#include "photon/kernel.h"
#include "photon/tangent_metric.h"

namespace lucerna {

// Where a photon at x_i, on its way along d, crosses the plane through x: the offset from x. Agrees with
// TangentMetric about grazing photons.
V3f crossing(const V3f& x, const V3f& n, const V3f& x_i, const V3f& d, MetricKind metric);

// Share of the kernel over the convex hull of `points` and the disc's centre, > 0; `points` are in the
// tangent plane, in units of the radius, and are reordered. Over what the hull of as many points of a whole
// disc holds in the mean, so that there the correction is right in the mean, and a little more than 1 may
// come out. 1 for fewer than eight points, which say little, and for a hull of no area.
float hull_share(KernelShape kernel, std::vector<V2f>& points);

}  // namespace lucerna
