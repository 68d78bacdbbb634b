// Isolines, where a grid of values crosses a level. Lines of equal illuminance are isolux lines.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/figures/false_colour.h"

namespace lucerna {

// Values at the points of a grid, row by row from the top. They are finite, or NaN at missing points.
struct ValueGrid {
    int columns = 0, rows = 0;
    std::vector<double> values;  // columns * rows

    double at(int column, int row) const {
        return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                      static_cast<std::size_t>(column)];
    }
    // Interpolates bilinearly, and extrapolates by half a cell to the edges of the outermost points' cells,
    // to which x in columns and y in rows are clamped, and of those beside cells without a value. Returns NaN
    // inside cells without a value.
    double between(double x, double y) const;

  private:
    // Returns the value at a point, or, if it is missing, the extrapolation from a neighbour that has one.
    double at_or_beyond(int column, int row, int from_column, int from_row) const;
};

// Refines the grid to steps of 1 / `parts` from edge to edge, half a cell beyond the outermost points: point
// (i, j) is at (i, j) / parts - 1/2 of the given grid, by ValueGrid::between(). `parts` is even, so that the
// given points remain.
ValueGrid refined(const ValueGrid& grid, int parts);

// A polyline along which the values are `level`; x in columns to the right, y in rows downwards. Greater
// values are on its right, seen with y pointing down. A closed line ends at its first point.
struct Isoline {
    double level = 0;
    std::vector<Imath::V2d> points;  // two or more

    bool closed() const { return points.size() > 2 && points.front() == points.back(); }
};

// Returns the isolines of each level in order, by marching squares. Vertices lie on the grid's lines, where
// linear interpolation between two points meets the level and hence on the isoline of the bilinear
// interpolation; they are joined by straight lines. A point of exactly the level counts as greater. Ambiguous
// squares are joined like the bilinear interpolation [Nielson and Hamann 1991]. Lines end only at the border
// of the grid and of squares with a missing point.
std::vector<Isoline> isolines(const ValueGrid& grid, std::span<const double> levels);

// Returns levels for a scale: round numbers (false_colour.h) inside the range, excluding its ends.
std::vector<double> isoline_levels(const ScaleRange& range, Scaling scaling);

// Smooths noisy values for isolines by a Gaussian with this standard deviation in points; missing values are
// ignored and stay missing. Values are first clamped to [lowest / 2, 2 highest] of the levels, if those are
// positive, so that an outlier such as a visible lamp moves lines no further than its neighbours. A deviation
// of 0 leaves the grid unchanged.
ValueGrid smoothed_for(std::span<const double> levels, const ValueGrid& grid, double deviation);

}  // namespace lucerna
