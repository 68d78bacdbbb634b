// The luminous opening of a measured lamp: what of its plane S, or of its box, shines.
//
// A photometric file says how large its lamp is by one body that is evenly bright from afar: seen along w, of
// the luminance I(w)/A(w). UGR adds up L² over solid angle, for a lamp that is seen as it is ∫ L² cos θ dA /
// d², and for the body I²/A / d². So that the two are the same over all directions together, the body is a
// flat rectangle or the lamp's box, of projected area A₀, times k with
//
//     k² = ∫ I²/A₀ dω / ∫∫ L² cos θ dA dω
//
// It is the lamp's own size where the lamp is evenly bright, and less where it has brighter parts.
#pragma once

#include <span>

#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/luminous_opening.h"
#include "lights/photometric.h"

namespace lucerna {

struct SlabView {
    const SlabAxes& axes;
    const LightField& field;  // of luminance: of one colour
};

// `box` has the sizes of the lamp's box, in its frame, or of S with a height of 0: then the rectangle has the
// proportions of the light on S, by its second moments. `web` is the lamp's far field. Without light: no
// opening.
LuminousOpening shining_opening(std::span<const SlabView> slabs, const V3d& box, const PhotometricWeb& web,
                                const Workers& workers);

}  // namespace lucerna
