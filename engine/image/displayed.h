// Applies a picture's look to an image, and chooses an exposure for it.
#pragma once

#include "engine/colour/tone.h"
#include "engine/image/image.h"

namespace lucerna {

// Returns R, G and B of every pixel as display-referred values.
Image displayed(const Image& image, const PictureLook& look);

// Returns the exposure for which the mean luminance of the displayed picture is middle grey, 0.18 of white,
// and 1 for a black image. It is the default where the user chooses none.
//
// The mean is over the pixels that are lit and do not glare, each counted as white at most. A pixel is lit if
// it is finite and has at least 2^-12 of the luminance that the brightest hundredth of the pixels above 0
// reaches; less is black beside it on any display. The brightest twentieth of the lit pixels glare: visible
// lamps and fireflies. At most 0.05 + 0.95 * 0.18 = 22 % of the lit pixels are therefore beyond white, and
// k times the light gets 1/k of the exposure.
float auto_exposure(const Image& image);

}  // namespace lucerna
