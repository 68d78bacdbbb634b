// One image of light out of a series of exposures: long ones see the dark places, short ones the bright ones.
//
// The camera is linear ("calibrated"): above its dark level a pixel counts in proportion to irradiance and
// time. Of each pixel the exposures that are neither full nor empty are averaged by their noise, which is
// what makes the best of them; the expected noise is that of the mean signal, not of each sample, since
// weighing by a sample's own noise would favour the samples that came out low.
//
// A pixel that is brighter than the shortest exposure can say is a lower bound, and counted.
//
// Sources: merging by weights [Debevec and Malik 1997], weights by noise [Robertson 1999], the 5 x 5 median
// of the dark frames [Goesele 2003, 6.2].
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

// What a photograph's counts mean.
struct CountNoise {
    double gain = 1;        // counts per electron, >= 0; the variance of shot noise is gain times the signal
    double read_noise = 0;  // standard deviation of a count without light, counts
    double step = 1;        // to which counts are rounded; 0: not
    double saturated = std::numeric_limits<double>::infinity();  // counts at or above say nothing but "more"
    double black = -std::numeric_limits<double>::infinity();     // counts at or below say nothing but "less"

    // Of a count whose part above the dark level is expected to be `signal`, where `dark` counts of the dark
    // level are electrons too.
    double variance(double signal, double dark) const;
};

// What the sensor counts without light in one exposure time.
struct DarkFrame {
    std::vector<float> level;        // counts
    std::vector<float> variance;     // of level, counts²
    std::vector<std::uint32_t> hot;  // pixels that stand out of those around them; rising
};

// From one or more photographs of nothing, averaged. Dark current varies slowly over a sensor, so the level
// is the median of the 5 x 5 window, which also takes out most of the frame's own noise [Goesele 2003, 6.2].
// Some pixels are hot: those that differ from the median by more than kHotDeviations standard deviations of
// the frame's noise (that from the median of all differences, so that the hot ones do not hide themselves)
// and by more than a step of rounding. A hot pixel sees light as well as any other, so it is not thrown away:
// its level is its own mean, which is noisier. The frames are not empty and of one size.
DarkFrame dark_frame(std::span<const std::vector<float>> frames, const V2i& size, const CountNoise& noise,
                     double pedestal, const Workers& workers);
inline constexpr double kHotDeviations = 8;

// A dark level that is the same everywhere, and known.
DarkFrame flat_dark(const V2i& size, float level);

// Sets each of these pixels to the median of the others in the 5 x 5 window around it.
void mend(std::vector<float>& image, const V2i& size, std::span<const std::uint32_t> pixels);

struct Exposure {
    double seconds = 1;  // > 0
    std::span<const float> counts;
    std::span<const float> dark, dark_variance;  // of DarkFrame
    double pedestal = 0;                         // what of the dark level is no electrons, counts
};

struct MergedExposures {
    std::vector<float> rate;      // counts per second above the dark level
    std::vector<float> variance;  // of it
    std::vector<std::uint32_t>
        saturated;  // pixels full in every exposure: their rate is a lower bound; rising
};

// The exposures are not empty, of one size, and rise in time.
MergedExposures merge_exposures(std::span<const Exposure> exposures, const CountNoise& noise);

// The median of a small window of an image: a smooth background, without the single pixels that stand out of
// it.

// The median of the 5 x 5 window around each pixel (row-major, finite). At the border the window is what lies
// inside the image; of an even number it is the mean of the two in the middle.
std::vector<float> median_5x5(std::span<const float> image, const V2i& size, const Workers& workers);

// The same at one pixel, of those of its neighbours (and itself) that `good` accepts by their index;
// `fallback` if it accepts none.
template <typename Good>
float median_around(std::span<const float> image, const V2i& size, const V2i& at, float fallback,
                    Good&& good);

// The median of values, which are reordered; 0 of none.
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
