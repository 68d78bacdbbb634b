// Filters both halves of an image in several scales, so that noise of low frequency is removed, too.
//
// Every coarser scale has means over 2 x 2 pixels of the light and the features. Its regression replaces the
// low frequencies of the finer one [Delbracio et al. 2014]:
//     fine + upsampled(coarse - means over 2 x 2 pixels of fine).
// Upsampling is bilinear, with weights by the likeness of features, so that nothing leaks over edges.
#pragma once

#include <array>

#include "engine/denoise/regression.h"

namespace lucerna {

// Return the value by which light is compared, a rough luminance, and its standard deviation. The noise of
// all colours is taken to be the same.
float guide_of(const ColourPlanes& value, int x, int y);
float guide_deviation(const ColourPlanes& variance, int x, int y);
// Sets the trust, the guide and its noise, which the value, the variance and what is sampled determine.
void set_guide(HalfPlanes& half, const Workers& workers);
// Returns sums over 3 x 3 pixels. Beyond the edge of the image, the pixels at the edge count once more.
Plane around(const Plane& plane, const Workers& workers);

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, const Workers& workers);

}  // namespace lucerna
