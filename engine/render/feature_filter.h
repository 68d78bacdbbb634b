// Completes an image of few samples by the features of visible surfaces (engine/denoise/denoise.h).
//
// A pixel without a sample gets the light of nearby pixels that see similar surfaces, by joint bilateral
// upsampling [Kopf et al. 2007]. An image of about one sample per pixel, whose halves cannot be compared, is
// smoothed by an edge-avoiding wavelet transform [Dammertz et al. 2010]. Light is divided by the albedo of
// its own pixel and multiplied by that of the pixel that gets it, so that textures stay sharp.
#pragma once

#include <vector>

#include "engine/base/parallel.h"
#include "engine/image/image.h"
#include "engine/render/film.h"

namespace lucerna {

class FeatureFilter {
  public:
    // Pixels on a lattice of `spacing` have samples, except for single ones. `features` are of
    // feature_channels(), or have no pixels: then distance alone decides. They must outlive the filter.
    FeatureFilter(const Film& film, int spacing, const Image& features, const Workers& workers);

    // Fills the pixels without a sample, in all channels of an image of the film. Channels whose names end in
    // R, G or B are light, and those with "variance." in their names squares of light; "samples" are counts,
    // which stay.
    void fill(Image& image) const;
    // Returns the smoothed R G B of an image that is filled.
    Image smooth(const Image& image) const;

  private:
    float alike(std::size_t p, std::size_t q) const;
    // Calls tap(pixel, weight) for the sampled pixels around a pixel without a sample.
    template <typename Tap>
    void for_each_sample(const V2i& at, Tap&& tap) const;
    std::vector<Rgb> without_fireflies(const std::vector<Rgb>& light) const;
    std::vector<Rgb> pass(const std::vector<Rgb>& light, int step) const;
    Rgb albedo(std::size_t pixel) const;
    std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x) + static_cast<std::size_t>(x);
    }

    V2i size_;
    std::vector<bool> sampled_;  // by pixel
    int spacing_;                // pixels
    const Image& features_;
    bool has_features_;
    Workers workers_;
};

}  // namespace lucerna
