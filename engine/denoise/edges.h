// The light of pixels at edges, which see two surfaces: few other pixels resemble them, so that a regression
// leaves most of their noise. But their features are those of the two surfaces, mixed in the shares in which
// the pixel sees them, and their light is mixed in the same shares.
#pragma once

#include "engine/base/parallel.h"
#include "engine/denoise/regression.h"

namespace lucerna {

// Blends the filtered light of the pixels whose `support` (Regression) is below kSupported with such a
// mixture of pixels on either side, as far as that is likely to have the smaller error. `half` is what was
// filtered.
void mix_edges(const FeaturePlanes& features, const HalfPlanes& half, const Plane& support,
               ColourPlanes& light, const Workers& workers);

}  // namespace lucerna
