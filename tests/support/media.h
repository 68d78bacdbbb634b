// Media for tests of light transport.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "engine/scene/medium.h"

namespace lucerna::testing {

inline Medium homogeneous(const Rgb& sigma_a, const Rgb& sigma_s, float g = 0) {
    Medium medium;
    medium.sigma_a = sigma_a;
    medium.sigma_s = sigma_s;
    medium.g = g;
    return medium;
}

inline Medium in_box(Medium medium, const V3d& a, const V3d& b) {
    medium.box = Box3d(a, b);
    return medium;
}

// Returns a medium with a grid whose density rises from 0 at the lower x face to 1 at the upper one, constant
// in the outer half cells.
inline Medium rising_along_x(Medium medium, const V3d& a, const V3d& b, int cells) {
    std::vector<float> samples;
    for (int i = 0; i < cells; ++i) {
        samples.push_back((static_cast<float>(i) + 0.5F) / static_cast<float>(cells));
    }
    medium.box = Box3d(a, b);
    medium.density = DensityGrid({cells, 1, 1}, samples, *medium.box, DensityGrid::Border::hold);
    return medium;
}

// Returns a medium of constant density given by a grid.
inline Medium even_grid(Medium medium, const V3d& a, const V3d& b, float density) {
    medium.box = Box3d(a, b);
    medium.density =
        DensityGrid({7, 6, 5}, std::vector<float>(210, density), *medium.box, DensityGrid::Border::hold);
    return medium;
}

inline SceneMedia regions(std::vector<Medium> media) {
    SceneMedia result;
    for (Medium& medium : media) {
        result.regions.push_back(static_cast<std::uint32_t>(result.all.size()));
        result.all.push_back(std::move(medium));
    }
    return result;
}

// A ray through the cube [-1, 1]³, inside it from t = 2 to t = 4.
inline const Ray kThroughFog{{-3, 0.2F, 0.1F}, {1, 0, 0}};

// Returns the radiance along kThroughFog of a point light of 1 W/sr in the cube, which is full of a medium
// that scatters it once: a line integral.
inline double single_scattering(double sigma_s, double sigma_t, double g, const V3d& light) {
    constexpr int kSteps = 20'000;
    const HenyeyGreenstein phase(static_cast<float>(g));
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = 2 + (i + 0.5) * 2 / kSteps;
        const V3d p(-3 + t, V3d(kThroughFog.o).y, V3d(kThroughFog.o).z), way = light - p;
        const double d = way.length();
        const auto cosine = static_cast<float>(way.x / d);  // of the scattering angle, between -way and -x
        sum += std::exp(-sigma_t * (t - 2 + d)) * sigma_s * static_cast<double>(phase.at_cosine(cosine)) /
               (d * d) * 2 / kSteps;
    }
    return sum;
}

}  // namespace lucerna::testing
