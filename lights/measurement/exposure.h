// Merges a series of exposures into one image: long ones resolve dark places, short ones bright ones.
//
// The camera is linear ("calibrated"): above its dark level, a pixel's count is proportional to irradiance
// and time. For each pixel, the exposures that are neither full nor empty are averaged with inverse-variance
// weights, which minimises noise. The variance is that expected for the mean signal, not that of each sample,
// because the latter would favour samples that came out low.
//
// A pixel that is too bright for the shortest exposure gives a lower bound, and is counted.
//
// Sources: weighted merging [Debevec and Malik 1997], weights by noise [Robertson 1999], the 5 x 5 median of
// the dark frames [Goesele 2003, 6.2].
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

// Describes the counts of a photograph.
struct CountNoise {
    double gain = 1;        // counts per electron, >= 0; the variance of shot noise is gain times the signal
    double read_noise = 0;  // standard deviation of a count without light, counts
    double step = 1;        // to which counts are rounded; 0: not rounded
    double saturated = std::numeric_limits<double>::infinity();  // counts at or above are only lower bounds
    double black = -std::numeric_limits<double>::infinity();     // counts at or below are only upper bounds

    // Returns the variance of a count with an expected `signal` above the dark level, of which `dark` counts
    // are electrons, too.
    double variance(double signal, double dark) const;
};

// Holds what the sensor counts without light in one exposure time.
struct DarkFrame {
    std::vector<float> level;        // counts
    std::vector<float> variance;     // of level, counts²
    std::vector<std::uint32_t> hot;  // indices of pixels that exceed their surroundings; ascending
};

// Averages one or more dark photographs. Dark current varies slowly over a sensor, so the level is the median
// of the 5 x 5 window, which also removes most of the frame's own noise [Goesele 2003, 6.2]. A pixel is hot
// if it differs from the median by more than kHotDeviations standard deviations of the frame's noise
// (estimated from the median of all differences, so that hot pixels do not mask themselves) and by more than
// a rounding step. A hot pixel responds to light normally, so it is kept: its level is its own mean, which is
// noisier. The frames are not empty and have one size.
DarkFrame dark_frame(std::span<const std::vector<float>> frames, const V2i& size, const CountNoise& noise,
                     double pedestal, const Workers& workers);
inline constexpr double kHotDeviations = 8;

// Returns a known dark level that is the same everywhere.
DarkFrame flat_dark(const V2i& size, float level);

// Sets each of these pixels to the median of the other pixels in the 5 x 5 window around it.
void mend(std::vector<float>& image, const V2i& size, std::span<const std::uint32_t> pixels);

struct Exposure {
    double seconds = 1;  // > 0
    std::span<const float> counts;
    std::span<const float> dark, dark_variance;  // of DarkFrame
    double pedestal = 0;                         // part of the dark level that is not electrons, counts
};

struct MergedExposures {
    std::vector<float> rate;      // counts per second above the dark level
    std::vector<float> variance;  // variance of rate
    std::vector<std::uint32_t>
        saturated;  // pixels full in every exposure, whose rate is a lower bound; ascending
};

// The exposures are not empty, have one size, and ascend in time.
MergedExposures merge_exposures(std::span<const Exposure> exposures, const CountNoise& noise);

// Returns the median of the 5 x 5 window around each pixel (row-major, finite): a smooth background without
// single outliers. The window is clipped at the edges; an even number of values gives the mean of the middle
// two.
std::vector<float> median_5x5(std::span<const float> image, const V2i& size, const Workers& workers);

// As above at one pixel, over the neighbours (and the pixel itself) whose index `good` accepts; `fallback` if
// there are none.
template <typename Good>
float median_around(std::span<const float> image, const V2i& size, const V2i& at, float fallback,
                    Good&& good);

// Returns the median of values, which are reordered; 0 for no values.
float median_of(std::span<float> values);

template <typename Good>
float median_around(std::span<const float> image, const V2i& size, const V2i& at, float fallback,
                    Good&& good) {
    float window[25];
    std::size_t count = 0;
    for (int y = std::max(at.y - 2, 0); y <= std::min(at.y + 2, size.y - 1); ++y) {
        for (int x = std::max(at.x - 2, 0); x <= std::min(at.x + 2, size.x - 1); ++x) {
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(x);
            if (good(i)) window[count++] = image[i];
        }
    }
    return count == 0 ? fallback : median_of({window, count});
}

}  // namespace lucerna
