// Media for tests of light transport.
#pragma once

#include <utility>
#include <vector>

#include "engine/world/medium.h"

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

// A grid whose density rises from 0 at the lower x face to 1 at the upper one, but for the outer half cells.
inline Medium rising_along_x(Medium medium, const V3d& a, const V3d& b, int cells) {
    std::vector<float> samples;
    for (int i = 0; i < cells; ++i) {
        samples.push_back((static_cast<float>(i) + 0.5F) / static_cast<float>(cells));
    }
    medium.box = Box3d(a, b);
    medium.density = DensityGrid({cells, 1, 1}, samples, *medium.box, DensityGrid::Border::hold);
    return medium;
}

// The same density everywhere, from a grid.
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

}  // namespace lucerna::testing
