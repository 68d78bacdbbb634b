// Fits the light of both halves of an image by weighted linear regression on features [Moon et al. 2014;
// Bitterli et al. 2016].
//
// About a centre, the light of the pixels of a window is fitted by a constant plus a linear function of the
// features. A pixel's weight is the likeness of its features and of its patch of light to the centre's
// [Rousselle et al. 2012; 2013]. The fit is evaluated at all pixels of the window, so that one fit serves
// many pixels; a pixel's result is the mean of all fits that reach it, by those weights. Centres lie four
// pixels apart; where no centre that resembles a pixel has many like it, at edges and small objects, the
// pixel becomes a centre itself.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/denoise/plane.h"

namespace lucerna {

// Holds the planes that both halves share.
struct FeaturePlanes {
    ColourPlanes albedo, normal, geometric_normal, position;
    Plane emitter;
    // Holds the inverse distance between the surface points of a pixel and its nearest neighbour; 0 without
    // one.
    Plane inverse_footprint;
    // Grows with the inverse albedo, to which gloss divided by albedo is proportional.
    Plane inverse_albedo;
    // `inside` is 1 in the image and 0 in the rim.
    Plane inside;
};
// kLeastAlbedo is added to albedos before light is divided by them, so that black surfaces cause no division
// by 0.
inline constexpr float kLeastAlbedo = 0.01F;
// A half's light divided by the albedo.
struct HalfPlanes {
    ColourPlanes value, variance;
    // The guide of the pixel alone, and its variance.
    Plane own, own_noise;
    Plane guide;  // luminance, mean over 3 x 3 pixels
    Plane noise;  // variance of the guide
    // Is 1, or much less for pixels without a sample, which have been filled from others.
    Plane sampled;
    Plane trust;  // weight of a pixel in fits, in (0, 1]
};

enum class Candidate : std::uint8_t { linear, constant };
inline constexpr std::size_t kCandidates = 2;
// Holds the filtered planes of one half, one for each candidate.
using Filtered = std::array<ColourPlanes, kCandidates>;

// Approximates exp(-d) for small d; 0 from d = 4 on.
inline float weight_of(float d) {
    const float t = std::max(0.0F, 1 - 0.25F * std::max(0.0F, d));
    return sqr(sqr(t));
}

// These differences of features count as 1.
inline constexpr float kAlbedoStep = 0.7F, kNormalStep = 0.7F, kEmitterStep = 0.3F, kPlaneStep = 4;
// Returns the distance of two pixels by their features: by the squared differences of their albedos and
// normals, by the distance, in footprints, of one position from the other's tangent plane, and by the
// difference of their shares of emitters. weight_of() of it is 1 where they are the same.
inline float feature_distance(float albedo2, float normal2, float plane, float emitter) {
    return albedo2 * (1 / sqr(kAlbedoStep)) + normal2 * (1 / sqr(kNormalStep)) +
           sqr(plane) * (1 / sqr(kPlaneStep)) + sqr(emitter) * (1 / sqr(kEmitterStep));
}

struct Regression {
    std::array<Filtered, 2> light;
    // The sums of the weights of the fits about centres four pixels apart that reach a pixel. Below
    // kSupported the pixel became a centre itself: few others resemble it.
    std::array<Plane, 2> support;
};
inline constexpr float kSupported = 0.5F;

// Each half's result depends on that half and the features alone.
Regression regress(int width, int height, const FeaturePlanes& features,
                   const std::array<HalfPlanes, 2>& halves, const Workers& workers);

}  // namespace lucerna
