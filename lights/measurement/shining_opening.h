// The luminous opening of a measured lamp: the part of its plane S, or of its box, that shines.
//
// Seen from afar along w, the lamp is evenly bright in no more than its luminous part: the smallest area from
// which a share of kLuminousShare of its light comes, over that share. It is all of an even lamp, without the
// faint light around it that a field smears over a cell. A file states one body, a flat rectangle or a box:
// that of which the luminance I/A, squared over its solid angle as in UGR, is the luminous part's over all
// directions together. With the projected area A₀ of the plane or box and A of the luminous part, it is the
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
    const LightField& field;  // of luminance: of one colour
};

// `box` has the sizes of the lamp's box, in its frame, or of S with a height of 0: then the rectangle has the
// proportions of the luminous part, by its second moments. `web` is the lamp's far field. Without light: no
// opening.
LuminousOpening shining_opening(std::span<const SlabView> slabs, const V3d& box, const PhotometricWeb& web,
                                const Workers& workers);

}  // namespace lucerna
