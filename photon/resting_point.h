// Where a photon rests, as a surface point: a map keeps its place and normal, and rays that leave from there
// must know how far it may lie off its surface.
#pragma once

#include "engine/scene/scene.h"

namespace lucerna {

// That bound goes by what the surface is: a corner of it may be far away though the place is near the scene's
// middle, and curves and instances have more of their own. So the surface is looked for, along n, and asked.
// If it is not found, the error is that of p alone.
SurfacePoint resting_point(const Scene& scene, const V3f& p, const V3f& n);

}  // namespace lucerna
