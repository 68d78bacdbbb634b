// Filters both halves of an image in several scales, so that noise of low frequency is removed, too.
//
// Every coarser scale has means over 2 x 2 pixels of the light and the features. Its regression replaces the
// low frequencies of the finer one [Delbracio et al. 2014]:
//     fine + upsampled(coarse - means over 2 x 2 pixels of fine).
// Where the coarser scale is darker, fine pixels are multiplied by the ratio instead, so that dark ones
// beside the edge of a shadow do not become black. Upsampling is bilinear, with weights by the likeness of
// features, so that nothing leaks over edges.
#pragma once

#include <array>

#include "engine/denoise/regression.h"

namespace lucerna {

// Returns the value by which light is compared, a rough luminance.
inline float guide_of(const std::array<float, 3>& rgb) {
    return 0.25F * (rgb[0] + rgb[2]) + 0.5F * rgb[1];
}
// Write a row of it, and of its standard deviation. The noise of all colours is taken to be the same.
void guide_of(const ColourPlanes& value, int y, float* guide);
void guide_deviation(const ColourPlanes& variance, int y, float* deviation);
// Sets the trust, the guide and its noise, which the value, the variance, what is sampled and the features
// determine.
void set_guides(const FeaturePlanes& features, std::array<HalfPlanes, 2>& halves, const Workers& workers);

// Gives the sums over 3 x 3 pixels about those of a row. The plane's rim must be filled.
class Around {
  public:
    Around(const Plane& plane, int y)
        : above_(plane.row(y - 1)), row_(plane.row(y)), below_(plane.row(y + 1)) {}
    float operator()(int x) const { return column(x - 1) + column(x) + column(x + 1); }

  private:
    float column(int x) const { return above_[x] + row_[x] + below_[x]; }
    const float *above_, *row_, *below_;
};

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, const Workers& workers);

}  // namespace lucerna
