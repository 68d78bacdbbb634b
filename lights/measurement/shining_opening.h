// The luminous opening of a measured lamp: the part of its plane S, or of its box, that shines.
//
// The luminous part in a direction w is the smallest area that emits a share kLuminousShare of the light
// along w, divided by that share. For an even lamp it is all of it, without the faint light around it that a
// field blurs over a cell. Places are taken in the order of their light towards the nearest eighth of the
// other directions: by the noise of the direction itself, which is large in a field of few rays, the area
// would come out too small. A file states one body, a flat rectangle or a box. It is chosen such that the
// integral of its luminance I/A, squared over its solid angle as in UGR, equals that of the luminous part
// over all directions. With the projected area A₀ of the plane or box, and A of the luminous part, it is the
// plane or box times k,
//
//     k² = ∫ I²/A₀ dω / ∫ I²/A dω
#pragma once

#include <span>

#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/luminous_opening.h"
#include "lights/photometric.h"

namespace lucerna {

struct SlabView {
    const SlabAxes& axes;
    const LightField& field;  // of luminance: one colour
};

// `box` has the sizes of the lamp's box, in its frame, or of S with height 0; in the latter case the
// rectangle has the proportions of the luminous part, by its second moments. `web` is the lamp's far field.
// Returns no opening for a lamp without light.
LuminousOpening shining_opening(std::span<const SlabView> slabs, const V3d& box, const PhotometricWeb& web,
                                const Workers& workers);

}  // namespace lucerna
