#include "lights/field_pyramid.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "lights/bell_cell.h"

namespace lucerna {
namespace {

constexpr float kBelowOne = 0x1.fffffep-1F;
constexpr int kTaps = 4;          // texels looked at, each way
constexpr float kReach = 0.501F;  // columns by which a rectangle is widened on each side
// A level of M whose texels are so many to a rectangle at most. No round number: rectangles that a scene's
// round numbers make do not lie on the border between two levels.
constexpr float kTexels = 2.9417F;
// Within an interval, down to blocks that see so many columns; at most kWithin halvings.
constexpr double kFinest = 10.937;
constexpr int kWithin = 6;
// Then h itself at the middles of kGrid x kGrid squares, and everywhere this share of their mean.
constexpr std::size_t kGrid = 8;
constexpr float kUneven = 0.1F;

// The upper half of a float: its range with 8 bits. What is not 0 stays so.
std::uint16_t packed(float x) {
    if (!(x > 0)) return 0;
    const auto bits = std::bit_cast<std::uint32_t>(std::max(x, 0x1p-120F));
    return static_cast<std::uint16_t>((bits + 0x7fff + (bits >> 16 & 1)) >> 16);
}
float unpacked(std::uint16_t x) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(x) << 16);
}

// The first of kGrid whose running sum exceeds u of the total; leaves u uniform again. All are above 0.
std::size_t choose_of(const float* weights, float total, float& u) {
    float rest = u * total;
    std::size_t i = 0;
    while (i + 1 < kGrid && rest >= weights[i]) rest -= weights[i++];
    u = std::clamp(rest / weights[i], 0.0F, kBelowOne);
    return i;
}

}  // namespace

// h at the middles of the squares of a block within an interval, rows along u; and the sums.
struct FieldPyramid::Grid {
    float value[kGrid][kGrid];
    float row[kGrid];
    float total;
};

// What a descent came to.
struct FieldPyramid::Path {
    int n = 0, o = 0;        // interval
    double low[2], high[2];  // of the block within it [m]
    double whole = 1;        // probability of the block
    double part = 1;         // the same, given its part
};

FieldPyramid::FieldPyramid(const LightField& field, const CellTable& table, int parts_across,
                           const Workers& workers)
    : field_(&field), distance_(field.rig().distance) {
    const Rig& rig = field.rig();
    for (int a = 0; a < 2; ++a) {
        Axis& axis = axes_[static_cast<std::size_t>(a)];
        axis.intervals = rig.intervals(a);
        axis.columns = rig.columns(a);
        axis.travels = rig.shift[a] > 0;
        for (int n = 0; n <= axis.intervals; ++n) axis.edge.push_back(rig.interval_edge(a, n));
        for (int n = 0; n < axis.intervals; ++n) axis.first_column.push_back(rig.column_edge(a, n, 0));
        axis.per_column = axis.columns / (rig.column_edge(a, 0, axis.columns) - rig.column_edge(a, 0, 0));
    }
    const auto most = static_cast<unsigned>(std::max(axes_[0].intervals, axes_[1].intervals));
    levels_ = std::bit_width(most - 1);
    while (across(part_level_, 0) > parts_across || across(part_level_, 1) > parts_across) ++part_level_;
    Level level{0, {axes_[0].columns, axes_[1].columns}};
    for (;;) {
        of_m_.push_back(level);
        level.begin += static_cast<std::size_t>(level.size[0]) * static_cast<std::size_t>(level.size[1]);
        if (level.size[0] == 1 && level.size[1] == 1) break;
        for (int& size : level.size) size = (size + 1) / 2;
    }
    image_ = level.begin;
    std::size_t nodes = 0;
    for (int k = 0; k <= levels_; ++k) {
        first_node_.push_back(nodes);
        nodes += static_cast<std::size_t>(across(k, 0)) * static_cast<std::size_t>(across(k, 1));
    }
    flux_.resize(nodes);
    texels_.resize(nodes * image_ + kTaps);  // the last row is read past its end
    build(field, table, workers);
}

void FieldPyramid::build(const LightField& field, const CellTable& table, const Workers& workers) {
    const Rig& rig = field.rig();
    const auto length = [&](int a, int begin, int end) {
        const auto& edge = axes_[static_cast<std::size_t>(a)].edge;
        end = std::min(end, axes_[static_cast<std::size_t>(a)].intervals);
        return edge[static_cast<std::size_t>(end)] - edge[static_cast<std::size_t>(begin)];
    };
    // Densities are relative to their mean over all cells.
    double all = 1;
    std::vector<double> per_length[2];  // of columns
    for (int a = 0; a < 2; ++a) {
        const int columns = axes_[static_cast<std::size_t>(a)].columns;
        const double seen = rig.column_edge(a, 0, columns) - rig.column_edge(a, 0, 0);
        all *= length(a, 0, rig.intervals(a)) * seen;
        for (int p = 0; p < columns; ++p) {
            per_length[a].push_back(1 / (rig.column_edge(a, 0, p + 1) - rig.column_edge(a, 0, p)));
        }
    }
    const auto columns = [&](int a) {
        return static_cast<std::size_t>(axes_[static_cast<std::size_t>(a)].columns);
    };
    // The finest image of a node is there: the coarser ones, from it.
    const auto reduce = [&](std::size_t at, std::vector<float>& fine, std::vector<float>& coarse) {
        for (std::size_t l = 0; l < of_m_.size(); ++l) {
            const Level& level = of_m_[l];
            std::uint16_t* const out = &texels_[at * image_ + level.begin];
            const auto texels =
                static_cast<std::size_t>(level.size[0]) * static_cast<std::size_t>(level.size[1]);
            for (std::size_t i = 0; i < texels; ++i) out[i] = packed(fine[i]);
            if (l + 1 == of_m_.size()) break;
            const Level& next = of_m_[l + 1];
            coarse.resize(static_cast<std::size_t>(next.size[0]) * static_cast<std::size_t>(next.size[1]));
            const auto stride = static_cast<std::size_t>(level.size[1]);
            for (int p = 0; p < next.size[0]; ++p) {
                const int rows = std::min(2, level.size[0] - 2 * p);
                for (int q = 0; q < next.size[1]; ++q) {
                    const int in_row = std::min(2, level.size[1] - 2 * q);
                    float sum = 0;
                    for (int i = 0; i < rows; ++i) {
                        for (int j = 0; j < in_row; ++j)
                            sum += fine[static_cast<std::size_t>(2 * p + i) * stride +
                                        static_cast<std::size_t>(2 * q + j)];
                    }
                    coarse[static_cast<std::size_t>(p) * static_cast<std::size_t>(next.size[1]) +
                           static_cast<std::size_t>(q)] = sum / static_cast<float>(rows * in_row);
                }
            }
            std::swap(fine, coarse);
        }
    };
    // The intervals themselves.
    parallel_chunks(workers, std::int64_t{rig.intervals(0)} * rig.intervals(1), [&](std::int64_t at) {
        const int n = static_cast<int>(at / rig.intervals(1)), o = static_cast<int>(at % rig.intervals(1));
        std::vector<float> fine(columns(0) * columns(1)), coarse;
        table.probabilities(n, o, fine);
        const std::size_t here = node(0, n, o);
        flux_[here] = table.interval_probability(n, o);
        const double scale = all / (length(0, n, n + 1) * length(1, o, o + 1));
        for (std::size_t p = 0; p < columns(0); ++p) {
            for (std::size_t q = 0; q < columns(1); ++q) {
                float& x = fine[p * columns(1) + q];
                x = static_cast<float>(double{x} * scale * per_length[0][p] * per_length[1][q]);
            }
        }
        reduce(here, fine, coarse);
    });
    // Blocks of them, from those of half their size.
    for (int k = 1; k <= levels_; ++k) {
        const int wide = across(k, 1);
        parallel_chunks(workers, std::int64_t{across(k, 0)} * wide, [&](std::int64_t at) {
            const int i = static_cast<int>(at / wide), j = static_cast<int>(at % wide);
            std::vector<float> fine(columns(0) * columns(1)), coarse;
            const std::size_t here = node(k, i, j);
            const double area = length(0, i << k, (i + 1) << k) * length(1, j << k, (j + 1) << k);
            double flux = 0;
            for (int a = 2 * i; a < std::min(2 * i + 2, across(k - 1, 0)); ++a) {
                for (int b = 2 * j; b < std::min(2 * j + 2, across(k - 1, 1)); ++b) {
                    const std::size_t child = node(k - 1, a, b);
                    flux += double{flux_[child]};
                    const auto share = static_cast<float>(length(0, a << (k - 1), (a + 1) << (k - 1)) *
                                                          length(1, b << (k - 1), (b + 1) << (k - 1)) / area);
                    const std::uint16_t* const image = &texels_[child * image_];
                    for (std::size_t t = 0; t < fine.size(); ++t) fine[t] += share * unpacked(image[t]);
                }
            }
            flux_[here] = static_cast<float>(flux);
            reduce(here, fine, coarse);
        });
    }
}

FieldPyramid::Range FieldPyramid::range_of(int axis, double x, double stretch, int begin, int end) const {
    const Axis& a = axes_[static_cast<std::size_t>(axis)];
    const auto seen = [&](int n, int edge) {
        const double u = a.edge[static_cast<std::size_t>(edge)];
        return a.column_at(n, u + (x - u) * stretch);
    };
    double low = seen(begin, begin), high = seen(end - 1, end);
    if (low > high) std::swap(low, high);
    if (a.travels) {
        const double other = seen(begin, begin + 1), another = seen(end - 1, end - 1);
        low = std::min({low, other, another});
        high = std::max({high, other, another});
    }
    return {static_cast<float>(low) - kReach, static_cast<float>(high) + kReach};
}

FieldPyramid::Halves FieldPyramid::halves_of_block(int axis, double x, double stretch, int level,
                                                   int index) const {
    const Axis& a = axes_[static_cast<std::size_t>(axis)];
    Halves halves{};
    for (int c = 0; c < 2; ++c) {
        const int begin = (2 * index + c) << level;
        if (begin >= a.intervals) break;
        const int end = std::min(begin + (1 << level), a.intervals);
        halves.seen[static_cast<std::size_t>(c)] = range_of(axis, x, stretch, begin, end);
        halves.length[static_cast<std::size_t>(c)] = static_cast<float>(
            a.edge[static_cast<std::size_t>(end)] - a.edge[static_cast<std::size_t>(begin)]);
    }
    return halves;
}

// Mean density over each quarter and the rectangle it sees, times its area.
FieldPyramid::Quarters FieldPyramid::light_of(const std::array<const std::uint16_t*, 4>& images,
                                              const Halves& rows, const Halves& columns) const {
    // The level of M.
    float widest = 1;
    float low[2][2], high[2][2], per_width[2][2];
    const Halves* const both[2] = {&rows, &columns};
    for (std::size_t a = 0; a < 2; ++a) {
        const auto last = static_cast<float>(axes_[a].columns);
        for (std::size_t c = 0; c < 2; ++c) {
            const Range& range = both[a]->seen[c];
            low[a][c] = std::clamp(range.low, 0.0F, last);
            high[a][c] = std::clamp(range.high, 0.0F, last);
            widest = std::max(widest, high[a][c] - low[a][c]);
            // Times the length: what is missing weighs nothing.
            per_width[a][c] = both[a]->length[c] / (range.high - range.low + 1e-30F);
        }
    }
    const auto bits = std::bit_cast<std::uint32_t>(widest * (1 / kTexels));
    const int wanted = static_cast<int>(bits >> 23) - 126;
    const auto l = static_cast<std::size_t>(std::clamp(wanted, 0, static_cast<int>(of_m_.size()) - 1));
    const Level& level = of_m_[l];
    const float scale = std::bit_cast<float>(static_cast<std::uint32_t>(127 - l) << 23);

    // Four texels from `first`, and the share of each that is seen.
    int first[2][2];
    float share[2][2][kTaps];
    for (std::size_t a = 0; a < 2; ++a) {
        for (std::size_t c = 0; c < 2; ++c) {
            const float from = low[a][c] * scale, to = high[a][c] * scale;
            first[a][c] = std::min(static_cast<int>(from), level.size[a] - 1);
            const auto base = static_cast<float>(first[a][c]);
            for (int t = 0; t < kTaps; ++t) {
                const float at = base + static_cast<float>(t);
                share[a][c][t] = std::max(0.0F, std::min(to, at + 1) - std::max(from, at));
            }
        }
    }
    Quarters light;
    const float back = sqr(1 / scale);  // areas in columns
    for (std::size_t a = 0; a < 2; ++a) {
        for (std::size_t b = 0; b < 2; ++b) {
            const std::uint16_t* const image = images[2 * a + b] + level.begin;
            float sum[kTaps] = {0, 0, 0, 0};
            for (int r = 0; r < kTaps; ++r) {
                const int row = std::min(first[0][a] + r, level.size[0] - 1);
                const std::uint16_t* const texel =
                    image + static_cast<std::ptrdiff_t>(row) * level.size[1] + first[1][b];
                for (int t = 0; t < kTaps; ++t) sum[t] += share[0][a][r] * unpacked(texel[t]);
            }
            float mean = 0;
            for (int t = 0; t < kTaps; ++t) mean += sum[t] * share[1][b][t];
            light[a][b] = mean * back * per_width[0][a] * per_width[1][b];
        }
    }
    return light;
}

FieldPyramid::Quarters FieldPyramid::flux_of(int level, int i, int o) const {
    Quarters flux{};
    for (int a = 0; a < 2; ++a) {
        for (int b = 0; b < 2; ++b) {
            if (2 * i + a < across(level, 0) && 2 * o + b < across(level, 1)) {
                flux[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] =
                    flux_[node(level, 2 * i + a, 2 * o + b)];
            }
        }
    }
    return flux;
}

int FieldPyramid::levels_within(double stretch) const {
    double widest = 0;
    for (const Axis& axis : axes_) {
        widest = std::max(widest, (axis.edge.back() - axis.edge.front()) / axis.intervals * axis.per_column);
    }
    widest *= std::fabs(1 - stretch);
    int levels = 0;
    while (levels < kWithin && widest > kFinest) widest *= 0.5, ++levels;
    return levels;
}

// choose(quarters, level, middle): one of four, as two bits; level -1 and below within an interval, where
// `middle` [m] is the border.
template <typename Choose>
FieldPyramid::Path FieldPyramid::descend(const V3d& x, Choose&& choose) const {
    const double stretch = distance_ / x.z;
    Path path;
    int i = 0, o = 0;
    const auto follow = [&](const Quarters& light, int chosen, int level) {
        const float total = (light[0][0] + light[0][1]) + (light[1][0] + light[1][1]);
        const double p =
            double{light[static_cast<std::size_t>(chosen >> 1)][static_cast<std::size_t>(chosen & 1)]} /
            double{total};
        path.whole *= p;
        if (level < part_level_) path.part *= p;
    };
    const auto dark = [](const Quarters& light) {
        return !((light[0][0] + light[0][1]) + (light[1][0] + light[1][1]) > 0);
    };
    for (int k = levels_ - 1; k >= 0; --k) {
        std::array<const std::uint16_t*, 4> images;
        const int last[2] = {across(k, 0) - 1, across(k, 1) - 1};
        for (int c = 0; c < 4; ++c) {
            images[static_cast<std::size_t>(c)] =
                &texels_[node(k, std::min(2 * i + (c >> 1), last[0]), std::min(2 * o + (c & 1), last[1])) *
                         image_];
        }
        Quarters light =
            light_of(images, halves_of_block(0, x.x, stretch, k, i), halves_of_block(1, x.y, stretch, k, o));
        if (dark(light)) light = flux_of(k, i, o);
        const int chosen = choose(light, k, nullptr);
        follow(light, chosen, k);
        i = 2 * i + (chosen >> 1);
        o = 2 * o + (chosen & 1);
    }
    path.n = i, path.o = o;
    const int index[2] = {i, o};
    double at[2][2];  // columns seen at the edges
    for (std::size_t a = 0; a < 2; ++a) {
        const auto n = static_cast<std::size_t>(index[a]);
        path.low[a] = axes_[a].edge[n];
        path.high[a] = axes_[a].edge[n + 1];
        const double x_a = a == 0 ? x.x : x.y;
        at[a][0] = axes_[a].column_at(index[a], path.low[a] + (x_a - path.low[a]) * stretch);
        at[a][1] = axes_[a].column_at(index[a], path.high[a] + (x_a - path.high[a]) * stretch);
    }
    const std::uint16_t* const image = &texels_[node(0, i, o) * image_];
    for (int k = levels_within(stretch); k > 0; --k) {
        Halves halves[2];
        double middle[2], column[2];
        for (std::size_t a = 0; a < 2; ++a) {
            middle[a] = 0.5 * (path.low[a] + path.high[a]);
            const double x_a = a == 0 ? x.x : x.y;
            column[a] = axes_[a].column_at(index[a], middle[a] + (x_a - middle[a]) * stretch);
            const double edge[3] = {at[a][0], column[a], at[a][1]};
            for (std::size_t c = 0; c < 2; ++c) {
                halves[a].seen[c] = {static_cast<float>(std::min(edge[c], edge[c + 1])) - kReach,
                                     static_cast<float>(std::max(edge[c], edge[c + 1])) + kReach};
                halves[a].length[c] = 1;
            }
        }
        Quarters light = light_of({image, image, image, image}, halves[0], halves[1]);
        if (dark(light)) light = {{{1, 1}, {1, 1}}};
        const int chosen = choose(light, -1, middle);
        follow(light, chosen, -1);
        for (std::size_t a = 0; a < 2; ++a) {
            const bool upper = (chosen >> (1 - a) & 1) != 0;
            (upper ? path.low : path.high)[a] = middle[a];
            at[a][upper ? 0 : 1] = column[a];
        }
    }
    return path;
}

// Four views reach into an interval; a square's middle sees one pixel of each.
FieldPyramid::Grid FieldPyramid::grid_of(const Path& path, const V3d& x, double stretch) const {
    const Rig& rig = field_->rig();
    const int interval[2] = {path.n, path.o};
    float weight[2][2][kGrid];        // axis, view; 0 for what the view does not see
    std::int32_t pixel[2][2][kGrid];  // the same
    float way2[2][kGrid];             // squared, from the middle to x
    int view[2][2];
    for (std::size_t a = 0; a < 2; ++a) {
        const int axis = static_cast<int>(a);
        const int n = interval[a];
        const double edge = axes_[a].edge[static_cast<std::size_t>(n)];
        const double per_length = 1 / (axes_[a].edge[static_cast<std::size_t>(n) + 1] - edge);
        const double x_a = axis == 0 ? x.x : x.y;
        const double step = (path.high[a] - path.low[a]) / kGrid;
        for (int v = 0; v < 2; ++v) view[a][v] = std::clamp(n - 1 + v, 0, rig.views[axis] - 1);
        const float seen[2] = {n > 0 ? 1.0F : 0.0F, n < rig.views[axis] ? 1.0F : 0.0F};
        const auto last = static_cast<double>(axes_[a].columns);
        for (std::size_t c = 0; c < kGrid; ++c) {
            const double u = path.low[a] + (static_cast<double>(c) + 0.5) * step;
            way2[a][c] = static_cast<float>(sqr(x_a - u));
            const float lower = bell(static_cast<float>((u - edge) * per_length));
            const double column = axes_[a].column_at(n, u + (x_a - u) * stretch);
            const int p = static_cast<int>(std::clamp(column, -1.0, last) + 1) - 1;  // floor
            for (int v = 0; v < 2; ++v) {
                const int k = v == 0 ? p : p - rig.shift[axis];
                const bool inside = (k >= 0) & (k < rig.pixels[axis]);
                weight[a][v][c] = inside ? seen[v] * (v == 0 ? lower : 1 - lower) : 0.0F;
                pixel[a][v][c] = std::clamp(k, 0, rig.pixels[axis] - 1);
            }
        }
    }
    const float* const coefficients = field_->coefficients().data();
    const auto z2 = static_cast<float>(sqr(x.z));
    Grid grid;
    float sum = 0;
    for (std::size_t r = 0; r < kGrid; ++r) {
        float value[kGrid] = {};
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                const float* const pixels =
                    coefficients + rig.index(view[0][i], view[1][j], pixel[0][i][r], 0);
                for (std::size_t c = 0; c < kGrid; ++c)
                    value[c] += weight[0][i][r] * weight[1][j][c] * pixels[pixel[1][j][c]];
            }
        }
        float in_row = 0;
        for (std::size_t c = 0; c < kGrid; ++c) {
            grid.value[r][c] = std::max(0.0F, value[c]) * std::sqrt(way2[0][r] + way2[1][c] + z2);
            in_row += grid.value[r][c];
        }
        grid.row[r] = in_row;
        sum += in_row;
    }
    const float least = sum > 0 ? kUneven * sum / (kGrid * kGrid) : 1.0F;
    grid.total = 0;
    for (std::size_t r = 0; r < kGrid; ++r) {
        for (std::size_t c = 0; c < kGrid; ++c) grid.value[r][c] += least;
        grid.row[r] += kGrid * least;
        grid.total += grid.row[r];
    }
    return grid;
}

void FieldPyramid::enter(Path& path, const Grid& grid, std::size_t row, std::size_t column) {
    const double p = double{grid.value[row][column]} / double{grid.total};
    path.whole *= p;
    path.part *= p;
    const std::size_t at[2] = {row, column};
    for (std::size_t a = 0; a < 2; ++a) {
        const double step = (path.high[a] - path.low[a]) / kGrid;
        path.low[a] += static_cast<double>(at[a]) * step;
        path.high[a] = path.low[a] + step;
    }
}

// Both strategies.
FieldPyramid::Density FieldPyramid::mixed(const Path& path) const {
    const double block = (path.high[0] - path.low[0]) * (path.high[1] - path.low[1]);
    const auto n = static_cast<std::size_t>(path.n), o = static_cast<std::size_t>(path.o);
    const double interval =
        (axes_[0].edge[n + 1] - axes_[0].edge[n]) * (axes_[1].edge[o + 1] - axes_[1].edge[o]);
    const double flux = kDefensive * double{flux_[node(0, path.n, path.o)]} / interval;
    const double part = double{flux_[node(part_level_, part_index(path.n), part_index(path.o))]};
    return {(1 - kDefensive) * path.whole / block + flux / double{flux_.back()},
            part > 0 ? (1 - kDefensive) * path.part / block + flux / part : 0.0};
}

void FieldPyramid::draw_by_flux(V2f& u, std::optional<V2i> interval, int& n, int& o) const {
    n = 0, o = 0;
    int k = levels_ - 1;
    if (interval) n = part_index(interval->x), o = part_index(interval->y), k = part_level_ - 1;
    for (; k >= 0; --k) {
        const Quarters flux = flux_of(k, n, o);
        const bool row = !choose_first(u.x, flux[0][0] + flux[0][1], flux[1][0] + flux[1][1]);
        const auto& in_row = flux[row ? 1 : 0];
        const bool column = !choose_first(u.y, in_row[0], in_row[1]);
        n = 2 * n + (row ? 1 : 0);
        o = 2 * o + (column ? 1 : 0);
    }
}

std::optional<FieldPyramid::Draw> FieldPyramid::draw(const V3d& x, const V2f& u,
                                                     std::optional<V2i> interval) const {
    assert(x.z != 0);
    constexpr auto kShare = static_cast<float>(kDefensive);
    if (interval && !(flux_[node(part_level_, part_index(interval->x), part_index(interval->y))] > 0))
        return std::nullopt;
    Draw draw{};
    V2f rest = u;
    if (u.x < kShare) {
        rest.x = std::min(u.x / kShare, kBelowOne);
        draw_by_flux(rest, interval, draw.n, draw.o);
        const auto n = static_cast<std::size_t>(draw.n), o = static_cast<std::size_t>(draw.o);
        draw.on_s = {axes_[0].edge[n] + double{rest.x} * (axes_[0].edge[n + 1] - axes_[0].edge[n]),
                     axes_[1].edge[o] + double{rest.y} * (axes_[1].edge[o + 1] - axes_[1].edge[o])};
        draw.density = density(x, draw.n, draw.o, draw.on_s);
        return draw;
    }
    rest.x = std::min((u.x - kShare) / (1 - kShare), kBelowOne);
    Path path = descend(x, [&](const Quarters& light, int level, const double*) {
        if (interval && level >= part_level_)
            return (interval->x >> level & 1) << 1 | (interval->y >> level & 1);
        const bool row = !choose_first(rest.x, light[0][0] + light[0][1], light[1][0] + light[1][1]);
        const auto& in_row = light[row ? 1 : 0];
        const bool column = !choose_first(rest.y, in_row[0], in_row[1]);
        return (row ? 2 : 0) | (column ? 1 : 0);
    });
    const Grid grid = grid_of(path, x, distance_ / x.z);
    const std::size_t row = choose_of(grid.row, grid.total, rest.x);
    const std::size_t column = choose_of(grid.value[row], grid.row[row], rest.y);
    enter(path, grid, row, column);
    draw.n = path.n, draw.o = path.o;
    draw.on_s = {path.low[0] + double{rest.x} * (path.high[0] - path.low[0]),
                 path.low[1] + double{rest.y} * (path.high[1] - path.low[1])};
    draw.density = mixed(path);
    return draw;
}

FieldPyramid::Density FieldPyramid::density(const V3d& x, int n, int o, const V2d& on_s) const {
    Path path = descend(x, [&](const Quarters&, int level, const double* middle) {
        if (level >= 0) return (n >> level & 1) << 1 | (o >> level & 1);
        return (on_s.x >= middle[0] ? 2 : 0) | (on_s.y >= middle[1] ? 1 : 0);
    });
    const Grid grid = grid_of(path, x, distance_ / x.z);
    std::size_t at[2];
    for (std::size_t a = 0; a < 2; ++a) {
        const double within = (on_s[static_cast<int>(a)] - path.low[a]) / (path.high[a] - path.low[a]);
        at[a] = static_cast<std::size_t>(std::clamp(within * kGrid, 0.0, kGrid - 1.0));
    }
    enter(path, grid, at[0], at[1]);
    return mixed(path);
}

}  // namespace lucerna
