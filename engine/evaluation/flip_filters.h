// The two families of filters that FLIP looks through, as products of filters along rows and columns.
#pragma once

#include <vector>

#include "engine/base/parallel.h"

namespace lucerna {

// One number per pixel, row-major.
struct Plane {
    int width = 0, height = 0;
    std::vector<float> data;

    Plane(int w, int h)
        : width(w), height(h), data(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
    float* row(int y) { return &data[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)]; }
    const float* row(int y) const {
        return &data[static_cast<std::size_t>(y) * static_cast<std::size_t>(width)];
    }
};

// Weights at -radius … radius.
using Kernel = std::vector<float>;

// The plane filtered along its rows, or its columns; beyond the border the border's pixel goes on.
Plane along_rows(const Plane& plane, const Kernel& kernel, const Workers& workers);
Plane along_columns(const Plane& plane, const Kernel& kernel, const Workers& workers);

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
Plane blurred(const Plane& plane, const Blur& blur, const Workers& workers);

// A Gaussian and its derivatives: positive weights of a derivative add up to 1, negative ones to -1
// [FLIP 4.2].
struct FeatureKernels {
    Kernel smooth, edge, point;
};
FeatureKernels feature_kernels(double pixels_per_degree);

}  // namespace lucerna
