// An image under a picture's look, and the exposure that suits an image.
#pragma once

#include "engine/colour/tone.h"
#include "engine/image/image.h"

namespace lucerna {

// R, G and B of every pixel as a display is given them.
Image displayed(const Image& image, const PictureLook& look);

// The exposure of a picture that nobody chose one for: the one at which the mean luminance of what is shown
// is middle grey, 0.18 of white.
//
// Over the pixels that are lit and not glaring, each counted as white at most. Lit: finite, and at least
// 2^-12 of the luminance that the brightest hundredth of the pixels above 0 reaches, less than which is black
// beside it on any display. Glaring: the brightest twentieth of those that are lit, lamps that are seen and
// fireflies. So at most 0.05 + 0.95 * 0.18 = 22 % of the lit pixels are beyond white, and k times the light
// gets 1/k the exposure. 1 for a black image.
float auto_exposure(const Image& image);

}  // namespace lucerna
