#include "engine/figures/isolines.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

constexpr int kMostLevels = 8;  // round_numbers() returns at most one more, ends included

// Traces the lines of one level. A vertex is identified by the grid edge on which it lies: first all edges to
// the right of a point, then all edges down from one. The values on both sides determine a line's direction,
// so at most one segment ends and one begins at each edge.
class Tracer {
  public:
    Tracer(const ValueGrid& grid, double level)
        : grid_(grid), level_(level), next_(2 * grid.values.size(), kNone), reached_(next_.size(), false) {}

    void trace(std::vector<Isoline>& lines) {
        for (int row = 0; row + 1 < grid_.rows; ++row) {
            for (int column = 0; column + 1 < grid_.columns; ++column) add_square(column, row);
        }
        for (std::size_t edge = 0; edge < next_.size(); ++edge) {
            if (next_[edge] != kNone && !reached_[edge]) follow(edge, lines);
        }
        for (std::size_t edge = 0; edge < next_.size(); ++edge) {  // rings remain
            if (next_[edge] != kNone) follow(edge, lines);
        }
    }

  private:
    static constexpr std::size_t kNone = ~std::size_t{0};

    std::size_t point(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns) +
               static_cast<std::size_t>(column);
    }

    void add(std::size_t from, std::size_t to) {
        assert(next_[from] == kNone && !reached_[to]);
        next_[from] = to;
        reached_[to] = true;
    }

    void add_square(int column, int row) {
        // Clockwise from the top left, with rows downwards.
        const std::array<double, 4> v{grid_.at(column, row), grid_.at(column + 1, row),
                                      grid_.at(column + 1, row + 1), grid_.at(column, row + 1)};
        if (std::any_of(v.begin(), v.end(), [](double x) { return std::isnan(x); })) return;
        // Side i leads from corner i to the next.
        const std::array<std::size_t, 4> side{
            point(column, row), grid_.values.size() + point(column + 1, row), point(column, row + 1),
            grid_.values.size() + point(column, row)};
        const auto above = [&](std::size_t i) { return v[i % 4] >= level_; };
        const auto enters = [&](std::size_t i) { return !above(i) && above(i + 1); };  // clockwise
        const auto leaves = [&](std::size_t i) { return above(i) && !above(i + 1); };
        const bool two = above(0) == above(2) && above(1) == above(3) && above(0) != above(1);
        const bool joined = two && joins_greater(v);
        for (std::size_t i = 0; i < 4; ++i) {
            if (!enters(i)) continue;
            // Each segment has greater values on its right, from the side where the clockwise walk enters
            // them to where it leaves them. With two such walks, the lines separate either the greater or the
            // smaller corners.
            std::size_t j = i + 1;
            while (!leaves(j % 4)) ++j;
            add(side[joined ? (j + 2) % 4 : j % 4], side[i]);
        }
    }

    // Tells whether the bilinear interpolation connects the two greater corners, which its value at the
    // saddle decides.
    bool joins_greater(const std::array<double, 4>& v) const {
        const double saddle = (v[0] * v[2] - v[1] * v[3]) / (v[0] + v[2] - v[1] - v[3]);  // not 0
        return saddle >= level_;
    }

    Imath::V2d place(std::size_t edge) const {
        const bool down = edge >= grid_.values.size();
        const std::size_t from = down ? edge - grid_.values.size() : edge;
        const std::size_t to = from + (down ? static_cast<std::size_t>(grid_.columns) : 1);
        const double a = grid_.values[from], b = grid_.values[to];
        const double share =
            std::clamp((level_ - a) / (b - a), 0.0, 1.0);  // a != b, as only one is less than the level
        const auto columns = static_cast<std::size_t>(grid_.columns);
        const Imath::V2d at(static_cast<double>(from % columns), static_cast<double>(from / columns));
        return at + (down ? Imath::V2d(0, share) : Imath::V2d(share, 0));
    }

    void follow(std::size_t edge, std::vector<Isoline>& lines) {
        Isoline line{level_, {place(edge)}};
        while (next_[edge] != kNone) {
            const std::size_t to = next_[edge];
            next_[edge] = kNone;
            edge = to;
            // Several edges share a point of exactly the level.
            if (const Imath::V2d at = place(edge); at != line.points.back()) line.points.push_back(at);
        }
        if (line.points.size() > 1) lines.push_back(std::move(line));
    }

    const ValueGrid& grid_;
    double level_;
    std::vector<std::size_t> next_;  // the next edge of the line, by edge
    std::vector<bool> reached_;
};

// Applies a Gaussian along lines of `count` values that are `step` apart.
void blur_lines(std::vector<double>& data, int lines, std::size_t line_step, int count, std::size_t step,
                const std::vector<double>& kernel) {
    const int reach = static_cast<int>(kernel.size()) - 1;
    std::vector<double> line(static_cast<std::size_t>(count));
    for (int l = 0; l < lines; ++l) {
        double* const first = &data[static_cast<std::size_t>(l) * line_step];
        for (int i = 0; i < count; ++i)
            line[static_cast<std::size_t>(i)] = first[static_cast<std::size_t>(i) * step];
        for (int i = 0; i < count; ++i) {
            double sum = 0;
            for (int k = std::max(-reach, -i); k <= std::min(reach, count - 1 - i); ++k)
                sum += kernel[static_cast<std::size_t>(std::abs(k))] * line[static_cast<std::size_t>(i + k)];
            first[static_cast<std::size_t>(i) * step] = sum;
        }
    }
}

}  // namespace

double ValueGrid::between(double x, double y) const {
    const auto split = [](double v, int count) {
        const double held = std::clamp(v, -0.5, count - 0.5);
        const int below = std::clamp(static_cast<int>(held), 0, std::max(count - 2, 0));
        return std::pair(below, held - below);
    };
    const auto [column, s] = split(x, columns);
    const auto [row, t] = split(y, rows);
    const int right = std::min(column + 1, columns - 1), down = std::min(row + 1, rows - 1);
    // On the border of two cells, the one with a value counts.
    for (const int c : {s > 0.5 ? right : column, s < 0.5 ? column : right}) {
        for (const int r : {t > 0.5 ? down : row, t < 0.5 ? row : down}) {
            if (std::isnan(at(c, r))) continue;
            const auto mixed = [](double p, double q, double part) { return (1 - part) * p + part * q; };
            const auto seen = [&, c = c, r = r](int i, int j) { return at_or_beyond(i, j, c, r); };
            return mixed(mixed(seen(column, row), seen(right, row), s),
                         mixed(seen(column, down), seen(right, down), s), t);
        }
    }
    return std::numeric_limits<double>::quiet_NaN();
}

double ValueGrid::at_or_beyond(int column, int row, int from_column, int from_row) const {
    if (const double value = at(column, row); !std::isnan(value)) return value;
    const double from = at(from_column, from_row);
    if (column != from_column && row != from_row) {
        return at_or_beyond(column, from_row, from_column, from_row) +
               at_or_beyond(from_column, row, from_column, from_row) - from;
    }
    const int c = 2 * from_column - column, r = 2 * from_row - row;  // on the other side
    const bool is_inside = c >= 0 && c < columns && r >= 0 && r < rows;
    return is_inside && !std::isnan(at(c, r)) ? 2 * from - at(c, r) : from;
}

ValueGrid refined(const ValueGrid& grid, int parts) {
    ValueGrid fine{grid.columns * parts + 1, grid.rows * parts + 1, {}};
    fine.values.reserve(static_cast<std::size_t>(fine.columns) * static_cast<std::size_t>(fine.rows));
    for (int row = 0; row < fine.rows; ++row) {
        for (int column = 0; column < fine.columns; ++column)
            fine.values.push_back(grid.between(static_cast<double>(column) / parts - 0.5,
                                               static_cast<double>(row) / parts - 0.5));
    }
    return fine;
}

std::vector<Isoline> isolines(const ValueGrid& grid, std::span<const double> levels) {
    std::vector<Isoline> lines;
    for (const double level : levels) Tracer(grid, level).trace(lines);
    return lines;
}

std::vector<double> isoline_levels(const ScaleRange& range, Scaling scaling) {
    std::vector<double> levels = round_numbers(range, scaling, kMostLevels);
    std::erase_if(levels, [&](double level) { return !(level > range.low && level < range.high); });
    return levels;
}

ValueGrid smoothed_for(std::span<const double> levels, const ValueGrid& grid, double deviation) {
    if (!(deviation > 0) || levels.empty()) return grid;
    const auto [least, most] = std::minmax_element(levels.begin(), levels.end());
    std::vector<double> kernel;
    for (int i = 0; i <= std::max(1, static_cast<int>(std::ceil(3 * deviation))); ++i)
        kernel.push_back(exp(-sqr(i / deviation) / 2));
    std::vector<double> sums, weights;
    for (const double v : grid.values) {
        const double held = *least > 0 ? std::clamp(v, *least / 2, 2 * *most) : v;
        sums.push_back(std::isfinite(held) ? held : 0);
        weights.push_back(std::isfinite(held) ? 1 : 0);
    }
    const auto columns = static_cast<std::size_t>(grid.columns);
    for (std::vector<double>* data : {&sums, &weights}) {
        blur_lines(*data, grid.rows, columns, grid.columns, 1, kernel);
        blur_lines(*data, grid.columns, 1, grid.rows, columns, kernel);
    }
    ValueGrid result = grid;
    for (std::size_t i = 0; i < result.values.size(); ++i) {
        if (!std::isnan(grid.values[i])) result.values[i] = sums[i] / weights[i];
    }
    return result;
}

}  // namespace lucerna
