// FLIP: how different two pictures look to somebody who flips between them. A map of errors in [0, 1].
//
// Sources: [Andersson 2020]; [Andersson 2021] for images of high dynamic range. Colours are blurred as the
// eye blurs them at the viewing distance and compared in a uniform space; where one picture has an edge or a
// point that the other has not, the error grows.
#pragma once

#include <optional>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/image/image.h"

namespace lucerna {

// Pixels per degree of the eye's angle for a screen of `width` metres and `pixels` columns seen from
// `distance` metres; all positive.
double pixels_per_degree(double distance, double width, double pixels);

// The papers' viewer: 0.7 m before a screen 0.7 m wide of 3840 columns.
inline constexpr double kUsualPixelsPerDegree = 67.0206432765823;

// A map with one channel, "flip". Both pictures: display-referred sRGB in [0, 1] in their first three
// channels (what lies outside is clamped), of one size. `pixels_per_degree` > 0.
Image flip(const Image& picture, const Image& reference, double pixels_per_degree,
           const Workers& workers = {});

// Exposures, in stops (factors 2^stop), between which a viewer of a picture of high dynamic range would move.
struct ExposureRange {
    double start = 0, stop = 0;
    int count = 2;  // at least two, at equal steps from start to stop

    double exposure(int i) const { return start + (stop - start) * i / (count - 1); }
};

// [Andersson 2021]'s range: from where the brightest luminance of the reference comes out at 0.85 of white to
// where its median does. The median is of the pixels that are lit at all: a dark half must not send it to
// infinity. None if no pixel is lit.
std::optional<ExposureRange> flip_exposures(const Image& reference);

struct HdrFlip {
    Image map;               // one channel, "flip": the largest over all exposures
    std::vector<int> worst;  // the number of the exposure that it comes from, per pixel
};
// Both images: radiance in any one unit, finite (negative values count as 0), in their first three channels,
// of one size.
HdrFlip hdr_flip(const Image& image, const Image& reference, const ExposureRange& range,
                 double pixels_per_degree, const Workers& workers, Monitor& monitor);

// The two families of filters that FLIP looks through, as products of filters along rows and columns.

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

// The plane filtered along its rows, or its columns; beyond the border the border's pixel goes on.
FlipPlane along_rows(const FlipPlane& plane, const Kernel& kernel, const Workers& workers);
FlipPlane along_columns(const FlipPlane& plane, const Kernel& kernel, const Workers& workers);

// The eye's blur of one opponent channel: a sum of Gaussians, each the product of its kernel along rows and
// columns.
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
// [FLIP (6), table 1], as filters of pixels.
EyeBlurs eye_blurs(double pixels_per_degree);
FlipPlane blurred(const FlipPlane& plane, const Blur& blur, const Workers& workers);

// A Gaussian and its derivatives: positive weights of a derivative add up to 1, negative ones to -1
// [FLIP 4.2].
struct FeatureKernels {
    Kernel smooth, edge, point;
};
FeatureKernels feature_kernels(double pixels_per_degree);

}  // namespace lucerna
