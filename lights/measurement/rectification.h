// Resampling from a photograph's pixels to those of the measurement plane M, by area.
//
// Four points of the photograph are M's corners. If the sensor itself lies in M (Setup A), they form a
// rectangle. If a camera looks at a screen (Setup B), they form any convex quadrilateral, and a homography
// maps M to the photograph. It preserves straight lines, so a pixel of the photograph covers an exact
// quadrilateral of M, and a pixel of M gets the area-weighted mean of what covers it. Mean irradiance is
// conserved: a constant photograph gives that constant, and flux is neither gained nor lost.
//
// The photograph must be free of lens distortion.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

using V2d = Imath::V2d;

// A projective map of the plane: (x, y, 1) · M up to scale, row vectors.
class Homography {
  public:
    // Maps the corners (0, 0), (w, 0), (w, h), (0, h) of a rectangle to the given points. Throws InputError
    // unless these form a convex quadrilateral with an area.
    static Homography of_rectangle(const V2d& size, const std::array<V2d, 4>& to);

    V2d operator()(const V2d& p) const;
    // Returns true if p lies on the rectangle's side of the horizon; elsewhere the map is meaningless.
    bool reaches(const V2d& p) const { return weight(p) > 0; }
    Homography inverse() const;

  private:
    double weight(const V2d& p) const { return p.x * m_[0][2] + p.y * m_[1][2] + m_[2][2]; }
    Imath::M33d m_;
    V2d inside_;  // a point of the rectangle
};

// The position of M's corners in the photograph, in pixels: x to the right and y down from the upper left
// corner of the upper left pixel. The order in (s, t) is least-least, most-least, most-most, least-most:
// lower left, lower right, upper right and upper left of M if s grows to the right and t upwards.
using Corners = std::array<V2d, 4>;

// Returns the corners of an M that fills this rectangle of the photograph, s to the right, t upwards.
Corners corners_of_crop(const V2d& upper_left, const V2d& size);

// A grid of unit cells and the layout of its values.
struct Grid {
    V2i size;
    bool columns = false;  // column by column, as Rig::index; else row by row
    std::size_t cells() const { return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y); }
    std::size_t index(int x, int y) const {
        return columns ? static_cast<std::size_t>(x) * static_cast<std::size_t>(size.y) +
                             static_cast<std::size_t>(y)
                       : static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
                             static_cast<std::size_t>(x);
    }
};

// Computes means over the cells of one grid of values that are constant in each cell of another. The weight
// of a source cell is the exact area of the target cell that it covers, by polygon clipping. Uncovered area
// adds nothing.
class AreaMap {
  public:
    AreaMap(const Grid& target, const Grid& source, const Homography& to_source);

    void means(std::span<const float> source, std::span<float> target) const;
    // Computes the variance of each mean from the variances of independent source cells.
    void variances(std::span<const float> source, std::span<float> target) const;
    // Returns the covered share of a target cell, in [0, 1].
    double covered(std::size_t target) const;
    // Returns the same map with means over the covered area only.
    AreaMap of_covered() &&;
    // Returns true if any target cell uses the source cell.
    bool uses(std::size_t source) const { return used_[source]; }

  private:
    struct Share {
        std::uint32_t cell;
        float area;
    };
    template <typename WeightOf>
    void sums(std::span<const float> source, std::span<float> target, WeightOf&& weight_of) const;
    void add_cell(const Grid& source, const V2i& cell, const Homography& to_source,
                  const Homography& to_target);

    std::vector<std::size_t> first_;  // index of each target cell's first share, and the end
    std::vector<Share> shares_;
    std::vector<bool> used_;
};

// Returns the map from photographs to M, whose pixels are laid out by Rig::index. Throws InputError if the
// corners form no convex quadrilateral or lie outside the photograph.
AreaMap photograph_to_plane(const V2i& photograph, const V2i& plane, const Corners& corners);
// Returns the inverse map: what a camera sees of a screen whose pixels are M's. Outside them it is dark. A
// pixel at their edge sees the mean of its part of M, because a real screen's light does not end there.
AreaMap plane_to_photograph(const V2i& plane, const V2i& photograph, const Corners& corners);

}  // namespace lucerna
