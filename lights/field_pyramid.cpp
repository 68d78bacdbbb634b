#include "lights/field_pyramid.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <tuple>

#include "lights/bell.h"
#include "lights/eight_lanes.h"

namespace lucerna {
namespace {

// d4 has four lanes, the lower and upper half (or edge) along u, then along v. d8 holds a row of the grid's
// squares.
constexpr D4 d4;
constexpr D8 d8;
constexpr I4 i4;
constexpr I8 i8;

F4 four(float a, float b, float c, float d) {
    alignas(16) const float lanes[4] = {a, b, c, d};
    return Load(d4, lanes);
}
F4 all4(float x) {
    return Set(d4, x);
}
F8 all8(float x) {
    return Set(d8, x);
}

constexpr int kTaps = 4;          // texels read along each axis
constexpr float kReach = 0.501F;  // columns by which a rectangle is widened on each side
// A rectangle covers at most this many texels of the chosen level of M, along each axis. The number is not
// round, so that a scene's round numbers do not give rectangles at the switch between two levels.
constexpr float kTexels = 2.9417F;
// Within an interval, the descent goes to blocks that see this many columns, in at most kWithin halvings.
constexpr double kFinest = 7;
constexpr int kWithin = 6;
// Below that, h itself is evaluated at the centres of kGrid x kGrid squares. It may be larger elsewhere in a
// square, above all where negative coefficients clamp it. So this share of h without its negative
// coefficients is added, and everywhere a share of the mean.
constexpr std::size_t kGrid = 8;
constexpr float kPositive = 0.25F;
constexpr float kUneven = 0.03F;

// Returns the upper half of a float: its range with 8 bits of precision. Positive values stay positive.
std::uint16_t packed(float x) {
    if (!(x > 0)) return 0;
    const auto bits = std::bit_cast<std::uint32_t>(std::max(x, 0x1p-120F));
    return static_cast<std::uint16_t>((bits + 0x7fff + (bits >> 16 & 1)) >> 16);
}
float unpacked(std::uint16_t x) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(x) << 16);
}

// Chooses one of kGrid in proportion to positive weights; makes u uniform again.
std::size_t choose_of(F8 weights, float total, float& u) {
    // Computes prefix sums: of the four lanes of each half, then over both.
    F8 upto = weights;
    upto = upto + ShiftLeftLanes<1>(d8, upto);
    upto = upto + ShiftLeftLanes<2>(d8, upto);
    upto = upto + Combine(d8, Broadcast<3>(LowerHalf(upto)), Zero(d4));
    alignas(32) float weight[kGrid];
    alignas(32) float sums[kGrid + 8] = {};
    Store(weights, d8, weight);
    Store(upto, d8, sums + 8);
    const float at = u * total;
    const std::size_t i = CountTrue(d8, And(upto <= all8(at), FirstN(d8, kGrid - 1)));
    u = std::clamp((at - sums[7 + i]) / weight[i], 0.0F, kBelowOne);
    return i;
}

// Chooses one of two likewise; requires weights[0] + weights[1] > 0.
std::size_t choose_of_two(const float* weights, float& u) {
    const float at = u * (weights[0] + weights[1]);
    const auto i = static_cast<std::size_t>((at >= weights[0]) & (weights[1] > 0));
    const float before[2] = {0, weights[0]};
    u = std::min((at - before[i]) / weights[i], kBelowOne);
    return i;
}

using Quarters = std::array<float, 4>;

float total_of(const Quarters& light) {
    return (light[0] + light[1]) + (light[2] + light[3]);
}

int choose_quarter(const Quarters& light, V2f& u) {
    const float half[2] = {light[0] + light[1], light[2] + light[3]};
    const std::size_t upper = choose_of_two(half, u.x);
    return static_cast<int>(2 * upper + choose_of_two(&light[2 * upper], u.y));
}

// Returns the quarter around (middle[0], middle[2]) that holds a point.
int towards(const V2d& on_s, const float* middle) {
    return (on_s.x >= double{middle[0]} ? 2 : 0) | (on_s.y >= double{middle[2]} ? 1 : 0);
}

}  // namespace

// A place x, as seen through S: the line from x through point u of S passes M at x_seen + u rest.
struct FieldPyramid::Seeing {
    F4 x_seen, rest;      // for u, u, v, v: x D / z; 1 - D / z, or -D / z where the sensor moves
    F4 first, per_metre;  // lower edge of the first column, and columns per metre [M's coordinate]
    F4 per_c;             // 1 / PlaneCoordinate::c of M; 0: uniform

    // Returns the column of M that an edge of S sees, by PlaneCoordinate::of, which is s itself for 1/c = 0.
    F4 column_at(F4 edge) const {
        const F4 s = x_seen + edge * rest, t = s * per_c, one = all4(1);
        return ((s + s) / (one + Sqrt(one + t * t)) - first) * per_metre;
    }
    // Returns PlaneCoordinate::slope there: the density of M's coordinate relative to the middle.
    F4 slope_at(F4 column) const {
        const F4 one = all4(1);
        const F4 half = all4(0.5F) * per_c * (first + column / per_metre);
        const F4 tau2 = Min(half * half, one), rest_of_one = one - tau2;
        return rest_of_one * rest_of_one / (one + tau2);
    }
};
// The two halves of a block along u, and the two along v.
struct FieldPyramid::Halves {
    F4 low, high;  // range of columns of M that they see
    F4 length;     // in S's coordinate [m], times M's slope; 0: no such half
};

// Holds h at the centres of the squares of a block within an interval, and the sums of its columns along v.
struct FieldPyramid::Grid {
    alignas(32) float value[kGrid][kGrid];
    alignas(32) float column[kGrid];
    float total;

    F8 along_u(std::size_t c) const {
        alignas(32) const float lanes[kGrid] = {value[0][c], value[1][c], value[2][c], value[3][c],
                                                value[4][c], value[5][c], value[6][c], value[7][c]};
        return Load(d8, lanes);
    }
};

// The result of a descent.
struct FieldPyramid::Path {
    int n = 0, o = 0;           // interval
    alignas(16) float edge[4];  // of the block within the interval, lower and upper of u and v [m]
    double whole = 1;           // probability of the block
    double part = 1;            // the same, restricted to its part

    V2d low() const { return {double{edge[0]}, double{edge[2]}}; }
    V2d size() const { return {double{edge[1]} - double{edge[0]}, double{edge[3]} - double{edge[2]}}; }
};

FieldPyramid::FieldPyramid(const LightField& field, const CellTable& table, int parts_across,
                           const Workers& workers)
    : field_(&field), distance_(field.rig().distance) {
    const Rig& rig = field.rig();
    for (int a = 0; a < 2; ++a) {
        const auto at = static_cast<std::size_t>(a);
        Axis& axis = axes_[at];
        axis.intervals = rig.intervals(a);
        // Columns are counted from the sensor's position, with a margin as wide as its bell spreads light.
        // With a fixed sensor all intervals share one position.
        axis.margin = rig.shift[a];
        axis.columns = rig.pixels[a] + 2 * axis.margin;
        const double pixel = rig.pixel[a], width = pixel * rig.pixels[a];
        first_column_[at] = -0.5 * width - axis.margin * pixel;
        columns_[at] = static_cast<float>(axis.columns);
        per_metre_[at] = static_cast<float>(1 / pixel);
    }
    if (rig.m_coordinate.c > 0) per_c_ = static_cast<float>(1 / rig.m_coordinate.c);
    const auto most = static_cast<unsigned>(std::max(axes_[0].intervals, axes_[1].intervals));
    levels_ = std::bit_width(most - 1);
    // Beyond the last interval the edges coincide.
    for (int a = 0; a < 2; ++a) {
        Axis& axis = axes_[static_cast<std::size_t>(a)];
        for (int n = 0; n <= 1 << levels_; ++n) {
            axis.edge.push_back(static_cast<float>(rig.interval_edge(a, std::min(n, axis.intervals))));
            axis.edge_x.push_back(static_cast<float>(rig.interval_edge_x(a, std::min(n, axis.intervals))));
        }
    }
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
    texels_.resize(nodes * image_ + kTaps);  // reads reach past the last row's end
    build(field, table, workers);
}

// Adds the mean emission of an interval, by the column relative to the interval. A view's columns are offset
// by the distance of the interval's points from its filter, weighted by its bell.
void FieldPyramid::spread_views(int n, int o, float scale, std::vector<float>& out) const {
    const Rig& rig = field_->rig();
    struct Share {
        int offset;
        float weight;
    };
    std::vector<Share> shares[2][2];  // axis, view
    for (int a = 0; a < 2; ++a) {
        const int shift = rig.shift[a];
        if (shift == 0) shares[a][0] = shares[a][1] = {{0, 0.5F}};
        for (int d = 0; d <= shift && shift > 0; ++d) {
            const auto upto = [&](double at) {
                return with_basis(rig.filter_basis,
                                  [&](auto of) { return of.integral(std::clamp(at / shift, 0.0, 1.0)); });
            };
            const auto weight = static_cast<float>(upto(d + 0.5) - upto(d - 0.5));
            shares[a][0].push_back({d, weight});
            shares[a][1].push_back({-d, weight});
        }
    }
    const int size[2] = {axes_[0].columns, axes_[1].columns};
    const int margin[2] = {axes_[0].margin, axes_[1].margin};
    const auto width = static_cast<std::size_t>(rig.pixels.y);
    std::vector<float> rows(static_cast<std::size_t>(size[0]) * width);
    for (int j = 0; j < 2; ++j) {
        const int view_v = o - 1 + j;
        if (view_v < 0 || view_v >= rig.views.y) continue;
        std::fill(rows.begin(), rows.end(), 0.0F);
        for (int i = 0; i < 2; ++i) {
            const int view_u = n - 1 + i;
            if (view_u < 0 || view_u >= rig.views.x) continue;
            for (const auto& [offset, weight] : shares[0][i]) {
                for (int k = 0; k < rig.pixels.x; ++k) {
                    const float* const in = &field_->coefficients()[rig.index(view_u, view_v, k, 0)];
                    float* const row = &rows[static_cast<std::size_t>(k - offset + margin[0]) * width];
                    for (std::size_t l = 0; l < width; ++l) row[l] += weight * std::max(0.0F, in[l]);
                }
            }
        }
        for (const auto& [offset, weight] : shares[1][j]) {
            for (int r = 0; r < size[0]; ++r) {
                const float* const in = &rows[static_cast<std::size_t>(r) * width];
                float* const row = &out[static_cast<std::size_t>(r) * static_cast<std::size_t>(size[1]) +
                                        static_cast<std::size_t>(margin[1] - offset)];
                for (std::size_t l = 0; l < width; ++l) row[l] += scale * weight * in[l];
            }
        }
    }
}

void FieldPyramid::build(const LightField& field, const CellTable& table, const Workers& workers) {
    const Rig& rig = field.rig();
    const auto length = [&](int a, int begin, int end) {
        const auto& edge = axes_[static_cast<std::size_t>(a)].edge_x;
        end = std::min(end, axes_[static_cast<std::size_t>(a)].intervals);
        return double{edge[static_cast<std::size_t>(end)]} - double{edge[static_cast<std::size_t>(begin)]};
    };
    // Densities are relative to their mean.
    mean_ = 1 / (rig.cell_volume() * static_cast<double>(table.cells()));  // a field has cells
    const double mean = table.flux() * mean_;
    const auto columns = [&](int a) {
        return static_cast<std::size_t>(axes_[static_cast<std::size_t>(a)].columns);
    };
    // Stores the finest image of a node and derives the coarser ones from it.
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
    // Builds the images of the intervals.
    parallel_chunks(workers, std::int64_t{rig.intervals(0)} * rig.intervals(1), [&](std::int64_t at) {
        const int n = static_cast<int>(at / rig.intervals(1)), o = static_cast<int>(at % rig.intervals(1));
        std::vector<float> fine(columns(0) * columns(1)), coarse;
        const std::size_t here = node(0, n, o);
        flux_[here] = table.interval_probability(n, o);
        if (axes_[0].margin > 0 || axes_[1].margin > 0) {
            spread_views(n, o, static_cast<float>(1 / mean), fine);
        } else {
            table.probabilities(n, o, fine);
            const double cell = rig.cell_volume() * mean / table.flux();
            for (float& x : fine) x = static_cast<float>(double{x} / cell);
        }
        reduce(here, fine, coarse);
    });
    // Builds the images of larger blocks from those of half their size.
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

// Returns the halves of a block whose quarters are on `level`.
FieldPyramid::Halves FieldPyramid::halves_of_block(const Seeing& seeing, int level, int i, int o) const {
    const auto size = std::size_t{1} << level;
    const std::size_t u = static_cast<std::size_t>(i) * 2 * size, v = static_cast<std::size_t>(o) * 2 * size;
    // Gathers, for the four halves u, u, v, v, the table's entry `ahead` of their first interval or edge.
    const auto of = [&](const std::vector<float>& u_table, const std::vector<float>& v_table,
                        std::size_t ahead) {
        return four(u_table[u + ahead], u_table[u + size + ahead], v_table[v + ahead],
                    v_table[v + size + ahead]);
    };
    const auto edges = [&](std::size_t ahead) { return of(axes_[0].edge, axes_[1].edge, ahead); };
    const F4 lower = edges(0), upper = edges(size);
    const F4 one = seeing.column_at(lower), other = seeing.column_at(upper);
    const F4 reach = all4(kReach);
    const F4 length = of(axes_[0].edge_x, axes_[1].edge_x, size) - of(axes_[0].edge_x, axes_[1].edge_x, 0);
    return {Min(one, other) - reach, Max(one, other) + reach,
            length * seeing.slope_at(all4(0.5F) * (one + other))};
}

// Returns the mean density over each quarter and the rectangle it sees, times the quarter's area.
FieldPyramid::Quarters FieldPyramid::light_of(const std::array<const std::uint16_t*, 4>& images,
                                              const Halves& halves) const {
    const F4 none = Zero(d4);
    const F4 last = four(columns_[0], columns_[0], columns_[1], columns_[1]);
    const F4 from = Min(Max(halves.low, none), last);
    const F4 to = Min(Max(halves.high, none), last);
    // The factor includes the length, so that missing halves weigh nothing.
    const F4 per_width = halves.length / (halves.high - halves.low);

    // Chooses the level of M.
    const float widest = std::max(GetLane(hn::MaxOfLanes(d4, to - from)), 1.0F);
    const int wanted = static_cast<int>(std::bit_cast<std::uint32_t>(widest * (1 / kTexels)) >> 23) - 126;
    const auto l = static_cast<std::size_t>(std::clamp(wanted, 0, static_cast<int>(of_m_.size()) - 1));
    const Level& level = of_m_[l];
    const F4 scale = all4(std::bit_cast<float>(static_cast<std::uint32_t>(127 - l) << 23));

    // Finds the first of four texels that each half sees, and the share of each texel.
    alignas(16) const std::int32_t ends[4] = {level.size[0] - 1, level.size[0] - 1, level.size[1] - 1,
                                              level.size[1] - 1};
    const hn::Vec<I4> first = Min(ConvertTo(i4, from * scale), Load(i4, ends));
    const F4 base = ConvertTo(d4, first);
    const F4 begin = from * scale - base, end = to * scale - base;
    const F4 factor = per_width / scale;
    // The share of one texel for each half, times length over width.
    const auto share = [&](float texel) {
        return Max(none, Min(end, all4(texel + 1)) - Max(begin, all4(texel))) * factor;
    };
    const F4 shares[kTaps] = {share(0), share(1), share(2), share(3)};
    // Transposes to the shares of all texels for each half.
    const F4 lower01 = hn::InterleaveLower(d4, shares[0], shares[1]);
    const F4 lower23 = hn::InterleaveLower(d4, shares[2], shares[3]);
    const F4 upper01 = hn::InterleaveUpper(d4, shares[0], shares[1]);
    const F4 upper23 = hn::InterleaveUpper(d4, shares[2], shares[3]);
    alignas(16) float of_row[2][kTaps];
    Store(hn::ConcatLowerLower(d4, lower23, lower01), d4, of_row[0]);
    Store(hn::ConcatUpperUpper(d4, lower23, lower01), d4, of_row[1]);
    const F8 of_column =
        Combine(d8, hn::ConcatUpperUpper(d4, upper23, upper01), hn::ConcatLowerLower(d4, upper23, upper01));
    alignas(16) std::int32_t start[4];
    Store(first, i4, start);

    // Sums four rows of four texels, two quarters side by side.
    const hn::FixedTag<std::uint16_t, 4> texel_lanes;
    const hn::FixedTag<std::uint32_t, 4> wide_lanes;
    const auto unpacked_four = [&](const std::uint16_t* texels) {
        return BitCast(d4, hn::ShiftLeft<16>(PromoteTo(wide_lanes, LoadU(texel_lanes, texels))));
    };
    Quarters light;
    for (std::size_t a = 0; a < 2; ++a) {
        const std::uint16_t* const lower = images[2 * a] + level.begin + start[2];
        const std::uint16_t* const upper = images[2 * a + 1] + level.begin + start[3];
        F8 sum = Zero(d8);
        for (int r = 0; r < kTaps; ++r) {
            const int row = std::min(start[a] + r, level.size[0] - 1);
            const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(row) * level.size[1];
            const F8 values = Combine(d8, unpacked_four(upper + offset), unpacked_four(lower + offset));
            sum = sum + values * all8(of_row[a][r]);
        }
        sum = sum * of_column;
        sum = sum + Shuffle2301(sum);
        sum = sum + Shuffle1032(sum);
        light[2 * a] = GetLane(sum);
        light[2 * a + 1] = GetLane(UpperHalf(d4, sum));
    }
    return light;
}

FieldPyramid::Quarters FieldPyramid::flux_of(int level, int i, int o) const {
    Quarters flux{};
    for (int c = 0; c < 4; ++c) {
        const int u = 2 * i + (c >> 1), v = 2 * o + (c & 1);
        if (u < across(level, 0) && v < across(level, 1))
            flux[static_cast<std::size_t>(c)] = flux_[node(level, u, v)];
    }
    return flux;
}

int FieldPyramid::levels_within(double stretch) const {
    double widest = 0;
    for (std::size_t a = 0; a < 2; ++a) {
        const auto& edge = axes_[a].edge;
        widest =
            std::max(widest, double{edge.back() - edge.front()} / axes_[a].intervals * double{per_metre_[a]});
    }
    widest *= std::fabs(1 - stretch);
    int levels = 0;
    while (levels < kWithin && widest > kFinest) widest *= 0.5, ++levels;
    return levels;
}

FieldPyramid::Seeing FieldPyramid::seeing_from(const V3d& x) const {
    const double stretch = distance_ / x.z;
    const auto seen = [&](double x_a) { return static_cast<float>(x_a * stretch); };
    const auto rest = [&](std::size_t a) {
        return static_cast<float>((axes_[a].margin > 0 ? 0 : 1) - stretch);
    };
    const auto twice = [](float u, float v) { return four(u, u, v, v); };
    return {twice(seen(x.x), seen(x.y)), twice(rest(0), rest(1)),
            twice(static_cast<float>(first_column_[0]), static_cast<float>(first_column_[1])),
            twice(per_metre_[0], per_metre_[1]), all4(per_c_)};
}

FieldPyramid::Quarters FieldPyramid::light_of_block(const Seeing& seeing, int level, int i, int o) const {
    // A missing quarter is read as its neighbour; it weighs nothing.
    const std::size_t u = node(level, 2 * i, 0), v = static_cast<std::size_t>(2 * o);
    const std::size_t next_u = 2 * i + 1 < across(level, 0) ? static_cast<std::size_t>(across(level, 1)) : 0;
    const std::size_t next_v = 2 * o + 1 < across(level, 1) ? 1 : 0;
    const std::uint16_t* const first = texels_.data() + (u + v) * image_;
    return light_of(
        {first, first + next_v * image_, first + next_u * image_, first + (next_u + next_v) * image_},
        halves_of_block(seeing, level, i, o));
}

// Sums radiance times the geometric term over u: h R D² / z³. R is the distance to the nearest point of S,
// because close to S the light comes from there.
double FieldPyramid::arriving(const V3d& x) const {
    assert(x.z != 0);
    const Quarters light = light_of_block(seeing_from(x), levels_ - 1, 0, 0);
    constexpr double kNearest = 1e-6;  // in units of D; it bounds 1 / z³
    const double z = std::max(std::fabs(x.z), kNearest * distance_);
    const auto beside = [&](double at, const Axis& axis) {
        return std::max({0.0, at - double{axis.edge.back()}, double{axis.edge.front()} - at});
    };
    const double r = V3d(beside(x.x, axes_[0]), beside(x.y, axes_[1]), z).length();
    return mean_ * double{total_of(light)} * r * sqr(distance_) / (z * z * z);
}

// choose(quarters, level, middle) returns one of four quarters as two bits. Their common corner is
// (middle[0], middle[2]) [m]; within an interval the level is -1.
template <typename Choose>
FieldPyramid::Path FieldPyramid::descend(const V3d& x, Choose&& choose) const {
    const double stretch = distance_ / x.z;
    const Seeing seeing = seeing_from(x);
    const F4 reach = all4(kReach);
    Path path;
    int i = 0, o = 0;
    const auto follow = [&](const Quarters& light, int chosen, int level) {
        const float total = total_of(light);
        const float p =
            total > 0 ? light[static_cast<std::size_t>(chosen)] / total : 0.0F;  // 0 without any flux
        path.whole *= double{p};
        if (level < part_level_) path.part *= double{p};
    };
    for (int k = levels_ - 1; k >= 0; --k) {
        Quarters light = light_of_block(seeing, k, i, o);
        if (!(total_of(light) > 0)) light = flux_of(k, i, o);
        const float middle[4] = {axes_[0].edge[static_cast<std::size_t>(2 * i + 1) << k], 0,
                                 axes_[1].edge[static_cast<std::size_t>(2 * o + 1) << k], 0};
        const int chosen = choose(light, k, middle);
        follow(light, chosen, k);
        i = 2 * i + (chosen >> 1);
        o = 2 * o + (chosen & 1);
    }
    path.n = i, path.o = o;

    // Continues within the interval; `edges` holds the lower and upper edge of u and v.
    const std::size_t n[2] = {static_cast<std::size_t>(i), static_cast<std::size_t>(o)};
    const auto& u_edge = axes_[0].edge;
    const auto& v_edge = axes_[1].edge;
    F4 edges = four(u_edge[n[0]], u_edge[n[0] + 1], v_edge[n[1]], v_edge[n[1] + 1]);
    const std::uint16_t* const image = texels_.data() + node(0, i, o) * image_;
    for (int k = levels_within(stretch); k > 0; --k) {
        const F4 middles = all4(0.5F) * (edges + Shuffle2301(edges));
        const F4 at_edges = seeing.column_at(edges);
        const F4 at_middles = seeing.column_at(middles);
        Quarters light = light_of({image, image, image, image},
                                  {Min(at_edges, at_middles) - reach, Max(at_edges, at_middles) + reach,
                                   seeing.slope_at(all4(0.5F) * (at_edges + at_middles))});
        if (!(total_of(light) > 0)) light = {1, 1, 1, 1};
        alignas(16) float middle[4];
        Store(middles, d4, middle);
        const int chosen = choose(light, -1, middle);
        follow(light, chosen, -1);
        // The middle becomes the lower edge of an upper half, or the upper edge of a lower one.
        alignas(16) const std::int32_t upper[4] = {-(chosen >> 1), (chosen >> 1) - 1, -(chosen & 1),
                                                   (chosen & 1) - 1};
        edges = IfThenElse(hn::MaskFromVec(hn::BitCast(d4, Load(i4, upper))), middles, edges);
    }
    Store(edges, d4, path.edge);
    return path;
}

// Returns the square of a block's grid that holds a point.
std::pair<std::size_t, std::size_t> FieldPyramid::square_of(const Path& path, const V2d& on_s) {
    const V2d within = (on_s - path.low()) / path.size() * double{kGrid};
    const auto index = [](double at) { return static_cast<std::size_t>(std::clamp(at, 0.0, kGrid - 1.0)); };
    return {index(within.x), index(within.y)};
}

namespace {

// The lower edges, or the middles, of kGrid equal parts of [from, to].
F8 lower_edges(float from, float to) {
    return all8(from) + Iota(d8, 0.0F) * all8((to - from) * (1.0F / kGrid));
}
F8 middles(float from, float to) {
    const float step = (to - from) * (1.0F / kGrid);
    return all8(from + 0.5F * step) + Iota(d8, 0.0F) * all8(step);
}

// PlaneCoordinate::slope, the density of a plane's coordinate, where tau = coordinate / (2 c).
F8 slope_of(F8 tau) {
    const F8 one = all8(1), tau2 = Min(tau * tau, one), rest_of_one = one - tau2;
    return rest_of_one * rest_of_one / (one + tau2);
}

// The filter of the lower view, which falls from 1 to 0 within the interval.
F8 lower_filter(FilterBasis basis, F8 f) {
    const F8 one = all8(1), half = all8(0.5F), rest = one - f;
    return basis == FilterBasis::hat ? rest : IfThenElse(f <= half, one - (f + f) * f, (rest + rest) * rest);
}

// The pixel columns that kGrid squares see along one axis.
struct SeenColumns {
    F8 first;   // number of the first column, a whole number
    F8 next;    // share of the square in the column after it, in [0, 1]
    F8 centre;  // of the square, in columns
};
// The squares see the columns from `begin` to `end`, real numbers, in either direction.
SeenColumns columns_between(float begin, float end, PixelBasis basis) {
    const float width = std::fabs(end - begin) * (1.0F / kGrid);
    const F8 column = lower_edges(begin, end) - all8(end < begin ? width : 0.0F);
    const F8 centre = column + all8(0.5F * width), half = all8(0.5F), one = all8(1);
    const bool hat = basis == PixelBasis::hat;
    const F8 first = Floor(hat ? centre - half : column);
    const F8 beyond =
        hat ? centre - half - first : (column - first + all8(width) - one) * all8(1 / std::max(width, 1e-6F));
    return {first, Min(Max(beyond, Zero(d8)), one), centre};
}

float total_of(F8 v) {
    F4 sum = LowerHalf(v) + UpperHalf(d4, v);
    sum = sum + Shuffle1032(sum);
    return GetLane(sum + Shuffle2301(sum));
}

}  // namespace

// The weights along one axis of the pixels that each square sees. Two views reach into an interval, and a
// square sees one or two pixels of each.
struct FieldPyramid::AxisWeights {
    F8 weight[2][2];  // by view and pixel; 0 for pixels and views that do not exist
    N8 pixel[2][2];
    int view[2];
    F8 way2;  // squared distance from the middles of the squares to x along the axis
};

FieldPyramid::AxisWeights FieldPyramid::axis_weights(int axis, const Path& path, const V3d& x) const {
    const Rig& rig = field_->rig();
    const auto a = static_cast<std::size_t>(axis);
    const int n = axis == 0 ? path.n : path.o;
    const float low = path.edge[2 * a], high = path.edge[2 * a + 1];
    const float edge = axes_[a].edge[static_cast<std::size_t>(n)];
    const float per_length = 1 / (axes_[a].edge[static_cast<std::size_t>(n) + 1] - edge);
    const F8 one = all8(1), half = all8(0.5F);
    const double x_of_axis = axis == 0 ? x.x : x.y;
    const auto x_a = static_cast<float>(x_of_axis);
    AxisWeights result;
    const F8 way = middles(low - x_a, high - x_a);
    result.way2 = way * way;

    // Find where the middles lie within the interval, in S's coordinate. Even planes keep their own numbers,
    // which lose nothing by cancellation.
    const float c_s = static_cast<float>(rig.s_coordinate.c), per_c_s = c_s > 0 ? 1 / c_s : 0.0F;
    const F8 u_middle = middles(low, high), u_per_c = u_middle * all8(per_c_s);
    const F8 to_x = all8(2) / (one + Sqrt(one + u_per_c * u_per_c));
    const float edge_x = axes_[a].edge_x[static_cast<std::size_t>(n)];
    const float per_spacing = static_cast<float>(1 / rig.spacing[axis]);
    const F8 f = c_s > 0 ? (u_middle * to_x - all8(edge_x)) * all8(per_spacing)
                         : middles((low - edge) * per_length, (high - edge) * per_length);
    const F8 filter = lower_filter(rig.filter_basis, f);
    const F8 filters[2] = {filter, one - filter};

    // Find the columns that the squares see, as the interval numbers them.
    const double stretch = distance_ / x.z;
    const auto seen_from = [&](float u) {
        return static_cast<float>(rig.columns_to(axis, n, double{u} + (x_of_axis - double{u}) * stretch));
    };
    const SeenColumns seen = columns_between(seen_from(low), seen_from(high), rig.basis);
    // Weigh them by what even steps in the coordinates are on the planes.
    const F8 on_m = all8(static_cast<float>(rig.column_edge_x(axis, n, 0))) +
                    seen.centre * all8(static_cast<float>(rig.pixel[axis]));
    const F8 slope = slope_of(half * u_per_c * to_x) * slope_of(half * on_m * all8(per_c_));
    const F8 shares[2] = {slope * (one - seen.next), slope * seen.next};
    const F8 last = all8(static_cast<float>(rig.columns(axis)));
    const N8 p = ConvertTo(i8, Min(Max(seen.first, all8(-2)), last));
    const N8 pixels = Set(i8, rig.pixels[axis]), unit = Set(i8, 1), zero = Zero(i8);
    for (int v = 0; v < 2; ++v) {
        const bool there = v == 0 ? n > 0 : n < rig.views[axis];
        result.view[v] = std::clamp(n - 1 + v, 0, rig.views[axis] - 1);
        N8 k = v == 0 ? p : p - Set(i8, rig.shift[axis]);
        for (int t = 0; t < 2; ++t, k = k + unit) {
            const auto inside = RebindMask(d8, AndNot(k < zero, k < pixels));
            result.weight[v][t] = there ? IfThenElseZero(inside, filters[v] * shares[t]) : Zero(d8);
            result.pixel[v][t] = Max(Min(k, pixels - unit), zero);
        }
    }
    return result;
}

namespace {

// h over a row of squares, and h without the field's negative coefficients.
struct RowOfField {
    std::int32_t pixel = -1;  // along u
    F8 h, positive;
};

}  // namespace

// Sums rows of pixels along v for the eight squares of a row at once. The pixels of a row are next to each
// other: each of the two views is read once, and every square picks its own pixels from what was read.
struct FieldPyramid::RowReader {
    const FieldPyramid& of;
    const AxisWeights &along_u, &along_v;
    std::int32_t window[2];  // first pixel that is read, by view
    N8 lane[2][2];           // that a square picks from what was read
    M8 there[2];             // pixels that exist

    RowReader(const FieldPyramid& pyramid, const AxisWeights& u, const AxisWeights& v)
        : of(pyramid), along_u(u), along_v(v) {
        for (std::size_t j = 0; j < 2; ++j) {
            alignas(32) std::int32_t pixel[kGrid];
            Store(v.pixel[j][0], i8, pixel);
            window[j] = std::min(pixel[0], pixel[kGrid - 1]);
            for (std::size_t t = 0; t < 2; ++t) lane[j][t] = v.pixel[j][t] - Set(i8, window[j]);
            there[j] = FirstN(d8, static_cast<std::size_t>(of.field_->rig().pixels.y - window[j]));
        }
    }
    RowOfField read(std::size_t view, std::int32_t pixel) const {
        const F8 none = Zero(d8);
        RowOfField row{pixel, none, none};
        for (std::size_t j = 0; j < 2; ++j) {
            const std::size_t first =
                of.field_->rig().index(along_u.view[view], along_v.view[j], pixel, window[j]);
            const F8 e = MaskedLoad(there[j], d8, of.field_->coefficients().data() + first);
            const F8 positive = Max(e, none);
            for (std::size_t s = 0; s < 2; ++s) {
                const auto picked = IndicesFromVec(d8, lane[j][s]);
                row.h = row.h + along_v.weight[j][s] * TableLookupLanes(e, picked);
                row.positive = row.positive + along_v.weight[j][s] * TableLookupLanes(positive, picked);
            }
        }
        return row;
    }
};

FieldPyramid::Grid FieldPyramid::grid_of(const Path& path, const V3d& x) const {
    const AxisWeights along_u = axis_weights(0, path, x), along_v = axis_weights(1, path, x);
    const RowReader reader(*this, along_u, along_v);
    alignas(32) std::int32_t pixel[2][2][kGrid];
    alignas(32) float weight[2][2][kGrid];
    alignas(32) float way2[kGrid];
    for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t t = 0; t < 2; ++t) {
            Store(along_u.pixel[i][t], i8, pixel[i][t]);
            Store(along_u.weight[i][t], d8, weight[i][t]);
        }
    }
    Store(along_u.way2, d8, way2);
    const F8 way2_column = along_v.way2 + all8(static_cast<float>(sqr(x.z)));
    const F8 none = Zero(d8);
    F8 value[kGrid];
    F8 sums = none;
    RowOfField rows[2][2];  // the last two rows of each view
    for (std::size_t r = 0; r < kGrid; ++r) {
        F8 h = none, bound = none;
        for (std::size_t i = 0; i < 2; ++i) {
            for (std::size_t t = 0; t < 2; ++t) {
                if (!(weight[i][t][r] > 0)) continue;
                RowOfField& row = rows[i][pixel[i][t][r] & 1];
                if (row.pixel != pixel[i][t][r]) row = reader.read(i, pixel[i][t][r]);
                const F8 share = all8(weight[i][t][r]);
                h = h + share * row.h;
                bound = bound + share * row.positive;
            }
        }
        h = Max(h, none);
        const F8 way = Sqrt(way2_column + all8(way2[r]));
        value[r] = (h + all8(kPositive) * Max(bound, none)) * way;
        sums = sums + value[r];
    }
    Grid grid;
    const float sum = total_of(sums);
    const float least = sum > 0 ? sum * (kUneven / (kGrid * kGrid)) : 1.0F;
    sums = sums + all8(kGrid * least);
    for (std::size_t r = 0; r < kGrid; ++r) Store(value[r] + all8(least), d8, grid.value[r]);
    Store(sums, d8, grid.column);
    grid.total = total_of(sums);
    return grid;
}

// Returns the density of a point in one square of the grid.
FieldPyramid::Density FieldPyramid::mixed(const Path& path, const Grid& grid, std::size_t row,
                                          std::size_t column) const {
    const auto n = static_cast<std::size_t>(path.n), o = static_cast<std::size_t>(path.o);
    const auto size = [](const Axis& axis, std::size_t i) {
        return double{axis.edge[i + 1]} - double{axis.edge[i]};
    };
    const double flux =
        kDefensive * double{flux_[node(0, path.n, path.o)]} / (size(axes_[0], n) * size(axes_[1], o));
    const double part = double{flux_[node(part_level_, part_index(path.n), part_index(path.o))]};
    const V2d block = path.size();
    const double per_area = (1 - kDefensive) * kGrid * kGrid * double{grid.value[row][column]} /
                            (double{grid.total} * block.x * block.y);
    return {path.whole * per_area + flux / double{flux_.back()},
            part > 0 ? path.part * per_area + flux / part : 0.0};
}

V2d FieldPyramid::draw_by_flux(V2f u, std::optional<V2i> interval) const {
    int n = 0, o = 0;
    int k = levels_ - 1;
    if (interval) n = part_index(interval->x), o = part_index(interval->y), k = part_level_ - 1;
    for (; k >= 0; --k) {
        const int chosen = choose_quarter(flux_of(k, n, o), u);
        n = 2 * n + (chosen >> 1);
        o = 2 * o + (chosen & 1);
    }
    const auto at = [](const Axis& axis, int i, float part) {
        const double edge = double{axis.edge[static_cast<std::size_t>(i)]};
        return edge + double{part} * (double{axis.edge[static_cast<std::size_t>(i) + 1]} - edge);
    };
    return {at(axes_[0], n, u.x), at(axes_[1], o, u.y)};
}

std::optional<FieldPyramid::Draw> FieldPyramid::draw(const V3d& x, const V2f& u,
                                                     std::optional<V2i> interval) const {
    assert(x.z != 0);
    constexpr auto kShare = static_cast<float>(kDefensive);
    if (interval && !(flux_[node(part_level_, part_index(interval->x), part_index(interval->y))] > 0))
        return std::nullopt;
    V2f rest = u;
    const bool by_flux = u.x < kShare;
    rest.x = std::min(by_flux ? u.x / kShare : (u.x - kShare) / (1 - kShare), kBelowOne);
    Draw draw{};
    if (by_flux) draw.on_s = draw_by_flux(rest, interval);
    // Descends to the point drawn by flux, or draws one by descent.
    const Path path = descend(x, [&](const Quarters& light, int level, const float* middle) {
        if (by_flux) return towards(draw.on_s, middle);
        if (interval && level >= part_level_)
            return (interval->x >> level & 1) << 1 | (interval->y >> level & 1);
        return choose_quarter(light, rest);
    });
    const Grid grid = grid_of(path, x);
    std::size_t row = 0, column = 0;
    if (by_flux) {
        std::tie(row, column) = square_of(path, draw.on_s);
    } else {
        column = choose_of(Load(d8, grid.column), grid.total, rest.y);
        row = choose_of(grid.along_u(column), grid.column[column], rest.x);
        const V2d low = path.low(), step = path.size() / double{kGrid};
        draw.on_s = {low.x + (static_cast<double>(row) + double{rest.x}) * step.x,
                     low.y + (static_cast<double>(column) + double{rest.y}) * step.y};
    }
    draw.n = path.n, draw.o = path.o;
    draw.density = mixed(path, grid, row, column);
    return draw;
}

FieldPyramid::Density FieldPyramid::density(const V3d& x, const V2d& on_s) const {
    const Path path =
        descend(x, [&](const Quarters&, int, const float* middle) { return towards(on_s, middle); });
    const auto [row, column] = square_of(path, on_s);
    return mixed(path, grid_of(path, x), row, column);
}

}  // namespace lucerna
