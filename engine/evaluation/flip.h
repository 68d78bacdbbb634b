// FLIP, the visible difference of two pictures to an observer who flips between them, as a map of errors in
// [0, 1].
//
// Sources: [Andersson 2020]; [Andersson 2021] for images of high dynamic range. Colours are blurred as the
// eye blurs them at the viewing distance and compared in a uniform space; edges and points that only one
// picture has increase the error.
#pragma once

#include <optional>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/image/image.h"

namespace lucerna {

// Returns the pixels per degree of visual angle for a screen of `width` metres and `pixels` columns seen from
// `distance` metres; all are positive.
double pixels_per_degree(double distance, double width, double pixels);

// The papers' observer: 0.7 m before a screen 0.7 m wide of 3840 columns.
inline constexpr double kUsualPixelsPerDegree = 67.0206432765823;

// Returns a map with one channel, "flip". Both pictures have one size and display-referred sRGB in [0, 1] in
// their first three channels (other values are clamped). `pixels_per_degree` > 0.
Image flip(const Image& picture, const Image& reference, double pixels_per_degree,
           const Workers& workers = {});

// Exposures, in stops (factors 2^stop), at which an observer would view a picture of high dynamic range.
struct ExposureRange {
    double start = 0, stop = 0;
    int count = 2;  // at least two, at equal steps from start to stop

    double exposure(int i) const { return start + (stop - start) * i / (count - 1); }
};

// Returns the range of [Andersson 2021], from the exposure that maps the brightest luminance of the reference
// to 0.85 of white to the one that does so with its median. The median excludes black pixels, as a dark half
// would send the exposure to infinity. Returns nothing if all pixels are black.
std::optional<ExposureRange> flip_exposures(const Image& reference);

struct HdrFlip {
    Image map;               // one channel, "flip", the largest over all exposures
    std::vector<int> worst;  // index of the exposure with the largest error, per pixel
};
// Both images have one size and radiance in one unit in their first three channels, finite; negative values
// count as 0.
HdrFlip hdr_flip(const Image& image, const Image& reference, const ExposureRange& range,
                 double pixels_per_degree, const Workers& workers, Monitor& monitor);

// The two families of FLIP's filters, separated into filters along rows and columns.

// One number per pixel, row-major.
struct FlipPlane {
    int width = 0, height = 0;
    std::vector<float> data;

    FlipPlane(int w, int h)
        : width(w), height(h), data(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
    float* row(int y) { return &data[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)]; }
    const float* row(int y) const {
        return &data[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
    }
};

// Weights at -radius … radius.
using Kernel = std::vector<float>;

// Filter the plane along its rows or its columns. Pixels beyond the border repeat the border.
FlipPlane along_rows(const FlipPlane& plane, const Kernel& kernel, const Workers& workers);
FlipPlane along_columns(const FlipPlane& plane, const Kernel& kernel, const Workers& workers);

// The eye's blur of one opponent channel, a sum of Gaussians that are separable into equal kernels along rows
// and columns.
struct Blur {
    struct Part {
        float weight;   // the weights add up to 1
        Kernel kernel;  // adds up to 1
    };
    std::vector<Part> parts;
};
struct EyeBlurs {
    Blur achromatic, red_green, blue_yellow;
};
// Returns the filters of [FLIP (6), table 1] in pixels.
EyeBlurs eye_blurs(double pixels_per_degree);
FlipPlane blurred(const FlipPlane& plane, const Blur& blur, const Workers& workers);

// A Gaussian and its derivatives, with positive weights of a derivative adding up to 1 and negative ones to
// -1 [FLIP 4.2].
struct FeatureKernels {
    Kernel smooth, edge, point;
};
FeatureKernels feature_kernels(double pixels_per_degree);

}  // namespace lucerna
