// Isolines: where a grid of values crosses a level. Lines of equal illuminance are isolux lines.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/figures/false_colour.h"

namespace lucerna {

// Finite values at the points of a grid, row by row, the first row at the top. NaN: there is no point.
struct ValueGrid {
    int columns = 0, rows = 0;
    std::vector<double> values;  // columns * rows

    double at(int column, int row) const {
        return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                      static_cast<std::size_t>(column)];
    }
    // Between points, bilinear; x in columns and y in rows, each held inside the grid. NaN where one of the
    // four points around is missing.
    double between(double x, double y) const;
};

// With `parts` - 1 points more between two neighbours, bilinear.
ValueGrid refined(const ValueGrid& grid, int parts);

// A line along which the values are `level`, as a polyline; x in columns to the right, y in rows downwards.
// What is greater lies to the right of its direction, as it is seen with y pointing down. A closed line's
// last point is its first.
struct Isoline {
    double level = 0;
    std::vector<Imath::V2d> points;  // two or more

    bool closed() const { return points.size() > 2 && points.front() == points.back(); }
};

// The isolines of one level after the other, by marching squares: vertices lie on the grid's lines, where
// linear interpolation between the two points meets the level, and so on the isoline of the bilinear
// interpolation; between them lines are straight. A point of exactly the level counts as greater. Where lines
// might join a square's sides in two ways, they do as those of the bilinear interpolation [Nielson and Hamann
// 1991]. Lines end at the border of the grid and of squares with a missing point, and nowhere else.
std::vector<Isoline> isolines(const ValueGrid& grid, std::span<const double> levels);

// Levels that suit a scale: round numbers (false_colour.h) inside the range, ends excluded.
std::vector<double> isoline_levels(const ScaleRange& range, Scaling scaling);

// The grid for isolines of noisy values: a mean over neighbours, weighted by a Gaussian of this standard
// deviation, in points; missing values have no say and stay missing. Values are first held in [lowest / 2,
// 2 highest] of the levels, if those are positive, so that one that is far off, as of a lamp that is seen,
// moves no line further than its neighbours' values allow. 0: unchanged.
ValueGrid smoothed_for(std::span<const double> levels, const ValueGrid& grid, double deviation);

}  // namespace lucerna
