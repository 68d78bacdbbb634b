// Completes an image of few samples by the features of visible surfaces (engine/denoise/denoise.h).
//
// A pixel without a sample gets the light of nearby pixels that see similar surfaces, by joint bilateral
// upsampling [Kopf et al. 2007]. Light is divided by the albedo of its own pixel and multiplied by that of
// the pixel that gets it, so that textures stay sharp.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/denoise/denoise.h"
#include "engine/image/image.h"
#include "engine/render/film.h"

namespace lucerna {

class FeatureFilter {
  public:
    // `sampled` states, row by row, which pixels have a sample (1, else 0): those on a lattice of `spacing`,
    // or every second one of these, and single ones more or less. `features` are of feature_channels(), or
    // have no pixels: then distance alone decides. They must outlive the filter.
    FeatureFilter(const V2i& size, std::vector<std::uint8_t> sampled, int spacing, const Image& features,
                  const Workers& workers);

    // Fills the pixels without a sample, in all channels of images of the film. Channels whose names end in
    // R, G or B are light, and those with "variance." in their names squares of light; "samples" are counts,
    // which stay.
    void fill(const std::vector<Image*>& images) const;

  private:
    // The power of the albedo that a channel is proportional to, and which of R, G, B it is.
    struct OfAlbedo {
        int power = 0, component = 0;
    };
    static OfAlbedo of_albedo(const std::string& channel);
    template <typename Body>
    void for_each_channel(const std::vector<OfAlbedo>& channels, std::size_t pixel, Body&& body) const;
    static float alike(const float* f, const float* g);
    const float* features_of(std::size_t pixel) const { return &features_.data[kFeatureChannels * pixel]; }
    ZeroedVector<float> divided(const Image& image, const std::vector<OfAlbedo>& channels) const;
    // Calls tap(pixel, weight) for the sampled pixels around a pixel without a sample.
    template <typename Tap>
    void for_each_sample(const V2i& at, Tap&& tap) const;
    Rgb albedo(std::size_t pixel) const;
    std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x) + static_cast<std::size_t>(x);
    }

    V2i size_;
    std::vector<std::uint8_t> sampled_;
    int spacing_;  // pixels
    const Image& features_;
    bool has_features_;
    Workers workers_;
};

// Returns which pixels have a sample.
std::vector<std::uint8_t> sampled_pixels(const Film& film, const Workers& workers);

// Completes two halves of an image (half_channels()) in which many pixels have samples in one half alone, as
// all have after the first sample. Every second of these pixels on the lattice of `spacing` gives them to the
// other half. Each half's empty pixels are then filled from that half alone, so that the halves stay
// independent.
void complete_halves(std::array<Image, 2>& halves, int spacing, const Image& features,
                     const Workers& workers);

}  // namespace lucerna
