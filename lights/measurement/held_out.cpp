#include "lights/measurement/held_out.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "engine/base/elementary.h"
#include "engine/base/sampler.h"

namespace lucerna {
namespace {

constexpr std::size_t kFramingRays = 20'000;  // that locate the light on a plane
// Distances of the planes from S, in half widths of the light on S, from contact to the far field.
constexpr double kFarthest = 128;
constexpr double kDistances[] = {0, 0.5, 2, 8, 32, kFarthest, INFINITY};
// The grid's cells compress what lies outside the middle half of a plane's light, times this factor.
constexpr double kGridMiddle = 2;
constexpr int kSteps = 6;  // per basis function of a plane, from which lines are followed

// Maps the ends of a line to its position on a plane: along_s · u + along_m · s.
struct Lever {
    double along_s, along_m;
};
Lever lever(const Rig& rig, double distance) {
    if (std::isinf(distance)) return {-1 / rig.distance, 1 / rig.distance};  // the slope of the line
    return {1 - distance / rig.distance, distance / rig.distance};
}

// upto(x) is the share of a basis function centred at 0 that lies below x; integral(x) is the integral of
// upto() from -∞.
struct Bell {
    static double upto(double x) { return x <= -1 ? 0 : x >= 1 ? 1 : bell_upto(x); }
    static double integral(double x) {
        if (x > 0) return x + integral(-x);
        if (x <= -1) return 0;
        if (x <= -0.5) return sqr(sqr(1 + x)) / 6;
        const auto inner = [](double y) { return y * (0.5 + y * (0.5 - y * y / 6)); };
        return 1.0 / 96 + inner(x) - inner(-0.5);
    }
};
struct Hat {
    static double upto(double x) {
        if (x > 0) return 1 - upto(-x);
        return x <= -1 ? 0 : 0.5 * sqr(1 + x);
    }
    static double integral(double x) {
        if (x > 0) return x + integral(-x);
        return x <= -1 ? 0 : sqr(1 + x) * (1 + x) / 6;
    }
};
struct Box {
    static double upto(double x) { return std::clamp(x + 0.5, 0.0, 1.0); }
    static double integral(double x) {
        if (x > 0) return x + integral(-x);
        return x <= -0.5 ? 0 : 0.5 * sqr(x + 0.5);
    }
};

// Returns the mean of upto() between two places.
template <typename Basis>
double mean_upto(double from, double to) {
    // For closer places the difference of integrals would be rounding error, and the midpoint is as good.
    if (std::fabs(to - from) < 1e-3 || std::fabs(to - from) < 1e-9 * std::fabs(to + from))
        return Basis::upto(0.5 * (from + to));
    return (Basis::integral(to) - Basis::integral(from)) / (to - from);
}

// A plane of the field along one axis, in numbers of its basis functions: the i-th is centred at x = i and
// extends `reach` to either side.
struct BasisAxis {
    const Rig& rig;
    int axis;
    bool on_s;

    int count() const { return on_s ? rig.views[axis] : rig.pixels[axis]; }
    double of(double place) const {
        return on_s ? rig.intervals_to(axis, place) - 1 : rig.columns_to(axis, 0, place) - 0.5;
    }
    double place(double x) const {
        return on_s ? rig.s_coordinate.on_plane(rig.interval_edge_x(axis, 0) + (x + 1) * rig.spacing[axis])
                    : rig.m_coordinate.on_plane(rig.column_edge_x(axis, 0, 0) + (x + 0.5) * rig.pixel[axis]);
    }
    double step() const { return on_s ? rig.spacing[axis] : rig.pixel[axis]; }
    double reach() const { return on_s || rig.basis == PixelBasis::hat ? 1.0 : 0.5; }
    double value(double x) const {
        if (on_s) return bell(x);
        if (rig.basis == PixelBasis::hat) return std::max(0.0, 1 - std::fabs(x));
        return std::fabs(x) < 0.5 ? 1.0 : 0.0;
    }
};

// Computes the share of each coefficient's light that falls into each cell, along one axis: [(filter * pixels
// + pixel) * cells + cell].
//
// Lines are followed from small steps on one of the planes. While a step is crossed, the cells' edges as seen
// on the other plane move uniformly, so the shares are means of integrals.
template <typename Other>
void add_response(const BasisAxis& stepped, double lever_stepped, const BasisAxis& other, double lever_other,
                  double middle, std::span<const double> edges, std::vector<double>& share) {
    const auto cells = edges.size() - 1;
    const int pixels = stepped.on_s ? other.count() : stepped.count();
    const double reach = stepped.reach();
    const int steps = static_cast<int>(std::lround((stepped.count() - 1 + 2 * reach) * kSteps));
    // Returns where the edges are seen on the other plane from a place on the stepped one, clamped far
    // outside where all of its light reaches them or none.
    const auto seen_from = [&](int i) {
        const double at = stepped.place(-reach + static_cast<double>(i) / kSteps);
        std::vector<double> x;
        for (const double edge : edges) {
            const double place = (middle + edge - lever_stepped * at) / lever_other;
            x.push_back(other.of(std::isnan(place) ? 0.0 : std::clamp(place, -1e6, 1e6)));
        }
        return x;
    };
    std::vector<double> from = seen_from(0);
    for (int i = 0; i < steps; ++i) {
        const std::vector<double> to = seen_from(i + 1);
        const double x = -reach + (i + 0.5) / kSteps;
        const int lowest = std::max(0, static_cast<int>(std::ceil(x - reach)));
        const int highest = std::min(stepped.count() - 1, static_cast<int>(std::floor(x + reach)));
        for (std::size_t c = 0; c < cells; ++c) {
            const auto [low, high] = std::minmax({from[c], from[c + 1], to[c], to[c + 1]});
            // Other basis functions lie wholly outside the cell.
            const int first = static_cast<int>(std::ceil(std::max(0.0, low - other.reach())));
            const int last =
                static_cast<int>(std::floor(std::min(other.count() - 1.0, high + other.reach())));
            for (int j = first; j <= last; ++j) {
                const double part = std::fabs(mean_upto<Other>(from[c + 1] - j, to[c + 1] - j) -
                                              mean_upto<Other>(from[c] - j, to[c] - j));
                for (int k = lowest; k <= highest; ++k) {
                    const int filter = stepped.on_s ? k : j, pixel = stepped.on_s ? j : k;
                    share[static_cast<std::size_t>(filter * pixels + pixel) * cells + c] +=
                        stepped.value(x - k) / kSteps * part;
                }
            }
        }
        from = to;
    }
}

std::vector<double> shares_of(const Rig& rig, int axis, const Lever& lever, double middle,
                              std::span<const double> edges) {
    std::vector<double> share(static_cast<std::size_t>(rig.views[axis] * rig.pixels[axis]) *
                              (edges.size() - 1));
    const BasisAxis s{rig, axis, true}, m{rig, axis, false};
    // Steps on the plane whose steps move a line less.
    if (std::fabs(lever.along_s) * s.step() < std::fabs(lever.along_m) * m.step()) {
        if (rig.basis == PixelBasis::hat)
            add_response<Hat>(s, lever.along_s, m, lever.along_m, middle, edges, share);
        else
            add_response<Box>(s, lever.along_s, m, lever.along_m, middle, edges, share);
    } else {
        add_response<Bell>(m, lever.along_m, s, lever.along_s, middle, edges, share);
    }
    return share;
}

// Holds these shares and where they are not 0: each coefficient's light falls into a few cells.
struct Response {
    std::vector<float> share;
    std::vector<std::pair<std::size_t, std::size_t>> cells;  // per coefficient: first, one past the last

    Response() = default;
    Response(const Rig& rig, int axis, const Lever& lever, double middle, std::span<const double> edges) {
        const std::vector<double> shares = shares_of(rig, axis, lever, middle, edges);
        share.assign(shares.begin(), shares.end());
        const std::size_t per_row = edges.size() - 1;
        for (std::size_t row = 0; row < share.size(); row += per_row) {
            std::size_t first = 0, end = per_row;
            while (first < end && share[row + first] == 0) ++first;
            while (end > first && share[row + end - 1] == 0) --end;
            cells.emplace_back(first, end);
        }
    }
};

// Returns what one axis adds to the index of a coefficient in the fields of this file. Coefficients that
// differ along the first axis alone are neighbours, because all of them have the same shares along the
// second.
std::size_t index_along(const Rig& rig, int axis, int filter, int pixel) {
    const auto at = static_cast<std::size_t>(filter * rig.pixels[axis] + pixel);
    return axis == 0 ? at : at * static_cast<std::size_t>(rig.views.x * rig.pixels.x);
}

constexpr std::size_t kColumns = 128;  // of coefficients that are cast together; their rows fit the cache

// Adds what the coefficients of a field, followed by kColumns zeros, cast into the cells of a plane,
// [x * side + y].
void cast_field(const std::vector<float>& flux, const Response& across, const Response& up, std::size_t side,
                std::vector<double>& cells) {
    const std::size_t columns = across.cells.size();
    std::vector<float> rows(side * kColumns);
    for (std::size_t first = 0; first < columns; first += kColumns) {
        std::fill(rows.begin(), rows.end(), 0.0F);
        for (std::size_t i = 0; i < up.cells.size(); ++i) {
            const float* const e = &flux[i * columns + first];
            for (std::size_t y = up.cells[i].first; y < up.cells[i].second; ++y) {
                const float share = up.share[i * side + y];
                float* const __restrict row = &rows[y * kColumns];
                for (std::size_t c = 0; c < kColumns; ++c) row[c] += share * e[c];
            }
        }
        for (std::size_t c = 0; c < std::min(kColumns, columns - first); ++c) {
            const auto [left, right] = across.cells[first + c];
            for (std::size_t x = left; x < right; ++x) {
                const auto share = double{across.share[(first + c) * side + x]};
                for (std::size_t y = 0; y < side; ++y)
                    cells[x * side + y] += share * double{rows[y * kColumns + c]};
            }
        }
    }
}

// Light that negative coefficients should subtract is taken from positive ones near by (round_to_rays.h).
// With 0.7 to 15 % of negative light of an LED, this changed the light on planes by 0.06 to 0.15 of that
// share. Narrow beams have less error far away with 0.2 than with 0.15, and the same with more.
double error_of_moving(double negative, double total) {
    return total > 0 ? sqr(0.2 * negative / total) : 0.0;
}

// Returns the value below which half of the values lie. Requires at least one.
double median(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

HeldOutRays::HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all, double height,
                         std::size_t most)
    : height_(height) {
    const std::size_t step = std::max<std::size_t>(1, (rays.size() + most - 1) / most);
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < rays.size(); i += step) used.push_back(rays[i]);
    if (set.coloured()) {
        V3d sum(0);
        for (const std::size_t r : used) sum += double{set.rays[r].flux} * V3d(set.tristimulus[r]);
        // A channel with hardly any light does not count.
        for (int c = 0; c < 3; ++c) channel_weight_[c] = sum[c] > 0.01 * sum.y ? sum.y / (3 * sum[c]) : 0.0;
    }
    take_rays(set, used, all);
    planes_.push_back(make_plane(0));
    const double unit = std::max(planes_.front().half.x, planes_.front().half.y);
    for (const double d : kDistances) {
        if (d > 0) planes_.push_back(make_plane(d * unit));
    }
    sort_lines();
}

HeldOutRays::HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all,
                         const HeldOutRays& like)
    : height_(like.height_), channel_weight_(like.channel_weight_), planes_(like.planes_) {
    take_rays(set, rays, all);
    for (Plane& plane : planes_) {
        count_rays(plane);
        find_signal(plane);
    }
    sort_lines();
}

void HeldOutRays::take_rays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all) {
    const auto light_of = [&](std::size_t r) {
        const double flux = double{set.rays[r].flux};
        return set.coloured() ? flux * channel_weight_.dot(V3d(set.tristimulus[r])) : flux;
    };
    // Files may be sorted, or alternate between a lamp's parts, so the half of each ray is drawn at random.
    std::uint64_t number = 0;
    for (const std::size_t r : rays) {
        Sampler draw(0, Purpose::acquisition, 0, number++);
        const LampRay& ray = set.rays[r];
        const V2d slope(double{ray.d.x} / double{ray.d.z}, double{ray.d.y} / double{ray.d.z});
        halves_[draw.bits() & 1].push_back({pass(ray, height_), slope, light_of(r)});
        light_ += light_of(r);
    }
    for (std::size_t r = 0; r < set.rays.size(); ++r) set_light_ += light_of(r);
    half_over_all_variance_ = 2 * static_cast<double>(all) / static_cast<double>(rays.size());  // not empty
}

void HeldOutRays::sort_lines() {
    for (std::vector<Line>& half : halves_) {
        std::vector<std::size_t> cell, next(kAll + 1);
        for (const Line& line : half) ++next[cell.emplace_back(planes_.front().cell_of(line.on_s)) + 1];
        std::partial_sum(next.begin(), next.end(), next.begin());
        std::vector<Line> sorted(half.size());
        for (std::size_t i = 0; i < half.size(); ++i) sorted[next[cell[i]]++] = half[i];
        half = std::move(sorted);
    }
}

std::size_t HeldOutRays::Plane::cell_of(const V2d& at) const {
    std::size_t cell[2];
    for (int a = 0; a < 2; ++a) {
        const PlaneCoordinate coordinate{kGridMiddle * half[a]};
        const double x = (coordinate.of(at[a] - middle[a]) / (2 * coordinate.c) + 1) * 0.5 * kCells;
        cell[a] = static_cast<std::size_t>(std::clamp(x, 0.0, kCells - 1.0));
    }
    return cell[0] * kCells + cell[1];
}

HeldOutRays::Plane HeldOutRays::make_plane(double distance) const {
    Plane plane{distance, {}, {}, {}, {}, {}};
    const std::size_t rays = halves_[0].size() + halves_[1].size();
    const std::size_t step = std::max<std::size_t>(1, (rays + kFramingRays - 1) / kFramingRays);
    for (int a = 0; a < 2; ++a) {
        std::vector<double> places;
        for (const std::vector<Line>& half : halves_) {
            for (std::size_t i = 0; i < half.size(); i += step) places.push_back(half[i].at(distance)[a]);
        }
        plane.middle[a] = median(places);
        for (double& place : places) place = std::fabs(place - plane.middle[a]);
        plane.half[a] = median(places);
    }
    // Light on a point or a line still needs cells of some size. For parallel light, the cells' directions
    // are as far apart as the width of the light on S, seen from the farthest plane.
    const double least =
        std::max(std::isinf(distance) ? 1 / kFarthest : 1e-6, 1e-3 * std::max(plane.half.x, plane.half.y));
    PlaneCoordinate coordinate[2];
    for (int a = 0; a < 2; ++a) {
        plane.half[a] = std::max(plane.half[a], least);
        coordinate[a].c = kGridMiddle * plane.half[a];
        for (int i = 0; i <= kCells; ++i) {
            const double x = 2 * coordinate[a].c * (2.0 * i / kCells - 1);
            plane.edges[a].push_back(i == 0 ? -INFINITY : i == kCells ? INFINITY : coordinate[a].on_plane(x));
        }
    }
    count_rays(plane);
    // As in a chi-square, a cell's difference counts by its square over its own flux, so that dim places
    // count beside bright ones; adding the mean cell's flux keeps empty cells from dominating.
    double flux = 0;
    for (std::size_t i = 0; i < kAll; ++i) flux += plane.counted[0][i] + plane.counted[1][i];
    plane.weight.resize(kAll);
    for (std::size_t i = 0; i < kAll; ++i) {
        const double here = plane.counted[0][i] + plane.counted[1][i];
        plane.weight[i] = 1 / (here + flux / kAll);  // > 0, because the rays carry flux
    }
    find_signal(plane);
    return plane;
}

void HeldOutRays::count_rays(Plane& plane) const {
    for (int half = 0; half < 2; ++half) {
        plane.counted[half].assign(kAll, 0.0);
        for (const Line& line : halves_[half])
            plane.counted[half][plane.cell_of(line.at(plane.distance))] += line.light;
    }
}

void HeldOutRays::find_signal(Plane& plane) {
    plane.signal = 0;
    for (std::size_t i = 0; i < kAll; ++i)
        plane.signal += plane.weight[i] * plane.counted[0][i] * plane.counted[1][i];
}

std::vector<float> HeldOutRays::project_half(const Rig& rig, const RayWeights& weights, int half) const {
    std::vector<float> flux(rig.coefficients() + kColumns);
    const V2d centre(rig.centre.x, rig.centre.y);
    for (const Line& line : halves_[half]) {
        const Passage at(line.on_s - centre, line.at(rig.distance) - centre, rig, weights);
        if (at.misses_s) continue;
        const auto along = [&](int axis, int filter, int pixel) {
            return index_along(rig, axis, filter, pixel);
        };
        at.record(rig, along).add(line.light, flux);
    }
    return flux;
}

std::vector<std::vector<HeldOutRays::Cells>> HeldOutRays::cast(std::span<const std::vector<float>> fields,
                                                               const Rig& rig, const Workers& workers) const {
    std::vector<Response> responses[2];
    for (std::vector<Response>& of_axis : responses) of_axis.resize(planes_.size());
    parallel_chunks(workers, static_cast<std::int64_t>(2 * planes_.size()), [&](std::int64_t i) {
        const auto p = static_cast<std::size_t>(i / 2);
        const int axis = static_cast<int>(i % 2);
        const Plane& plane = planes_[p];
        // Positions are relative to the rig's centre; slopes are not.
        const double centre = std::isinf(plane.distance) ? 0 : rig.centre[axis];
        responses[axis][p] =
            Response(rig, axis, lever(rig, plane.distance), plane.middle[axis] - centre, plane.edges[axis]);
    });
    std::vector<std::vector<Cells>> all(planes_.size(), std::vector<Cells>(fields.size(), Cells(kAll)));
    parallel_chunks(workers, static_cast<std::int64_t>(planes_.size() * fields.size()), [&](std::int64_t i) {
        const std::size_t p = static_cast<std::size_t>(i) / fields.size();
        const std::size_t f = static_cast<std::size_t>(i) % fields.size();
        cast_field(fields[f], responses[0][p], responses[1][p], kCells, all[p][f]);
    });
    return all;
}

double HeldOutRays::of_all_rays(double of_halves, double of_both) const {
    if (!(of_both > 0 && of_both < of_halves)) return of_both;
    // Twice the rays reduce it by this factor, and all rays by its power.
    return of_both * pow(of_both / of_halves, log2(0.5 * half_over_all_variance_));
}

HeldOutRays::Found HeldOutRays::find_errors(const Rig& rig, const RayWeights& weights,
                                            const Workers& workers) const {
    std::vector<float> flux[2];
    parallel_chunks(workers, 2, [&](std::int64_t half) {
        flux[half] = project_half(rig, weights, static_cast<int>(half));
    });
    Found found;
    double total = 0, negative = 0, of_halves = 0;
    for (std::size_t i = 0; i < flux[0].size(); ++i) {
        const double both = double{flux[0][i]} + double{flux[1][i]};
        total += both;
        negative += std::max(0.0, -both);
        of_halves += double{std::max(0.0F, -flux[0][i])} + double{std::max(0.0F, -flux[1][i])};
    }
    found.moved = error_of_moving(of_all_rays(of_halves, negative), total);
    found.held = light_ > 0 ? total / light_ : 0.0;
    const std::vector<std::vector<Cells>> all = cast(flux, rig, workers);
    for (std::size_t p = 0; p < planes_.size(); ++p) {
        const Plane& plane = planes_[p];
        const std::vector<Cells>& cast_by = all[p];
        double held_out = 0, between = 0, counts = 0;
        for (std::size_t i = 0; i < plane.weight.size(); ++i) {
            const double w = plane.weight[i];
            held_out += 0.5 * w *
                        (sqr(cast_by[0][i] - plane.counted[1][i]) + sqr(cast_by[1][i] - plane.counted[0][i]));
            between += w * sqr(cast_by[0][i] - cast_by[1][i]);
            counts += w * sqr(plane.counted[0][i] - plane.counted[1][i]);
        }
        // Each half's field has half of `between` as its variance, and each half's counts have half of
        // `counts`. The field of all rays has less, in proportion to the number of rays.
        const double bias2 = held_out - 0.5 * between - 0.5 * counts;
        const double own = 0.5 * between / half_over_all_variance_;
        PlaneError error{plane.distance};
        error.squared = plane.signal > 0 ? (bias2 + own) / plane.signal : 0;
        error.counts =
            plane.signal > 0 ? std::sqrt(0.5 * counts / half_over_all_variance_ / plane.signal) : 0;
        found.errors.push_back(error);
    }
    return found;
}

std::vector<float> HeldOutRays::fluxes_of(const LightField& field) const {
    const Rig& rig = field.rig();
    // The rays used may carry less flux than the field stands for.
    const double factor = rig.cell_volume() * light_ / set_light_;  // > 0: rays carry flux
    std::vector<float> flux(rig.coefficients() + kColumns);
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    flux[index_along(rig, 0, m, k) + index_along(rig, 1, n, l)] =
                        static_cast<float>(double{field.coefficient(m, n, k, l)} * factor);
                }
            }
        }
    }
    return flux;
}

void HeldOutRays::add_change(std::vector<PlaneError>& errors, const LightField& from, const LightField& to,
                             const Workers& workers) const {
    std::vector<float> change = fluxes_of(to);
    const std::vector<float> before = fluxes_of(from);
    std::transform(change.begin(), change.end(), before.begin(), change.begin(), std::minus<>());
    const std::vector<std::vector<Cells>> all = cast({&change, 1}, from.rig(), workers);
    for (std::size_t p = 0; p < planes_.size(); ++p) {
        const Plane& plane = planes_[p];
        double square = 0;
        for (std::size_t i = 0; i < plane.weight.size(); ++i)
            square += plane.weight[i] * sqr(all[p].front()[i]);
        if (plane.signal > 0) errors[p].squared += square / (4 * plane.signal);  // of halves
    }
}

std::vector<PlaneError> HeldOutRays::errors(const LightField& field) const {
    const std::vector<float> flux = fluxes_of(field);
    const std::vector<std::vector<Cells>> all = cast({&flux, 1}, field.rig(), Workers{1});
    std::vector<PlaneError> errors;
    for (std::size_t p = 0; p < planes_.size(); ++p) {
        const Plane& plane = planes_[p];
        const Cells& cast_by = all[p].front();
        double square = 0, counts = 0;
        for (std::size_t i = 0; i < cast_by.size(); ++i) {
            square += plane.weight[i] * sqr(cast_by[i] - plane.counted[0][i] - plane.counted[1][i]);
            counts += plane.weight[i] * sqr(plane.counted[0][i] - plane.counted[1][i]);
        }
        const double signal = 4 * plane.signal;
        PlaneError error{plane.distance};
        if (signal > 0) {
            error.squared = (square - counts) / signal;
            error.counts = std::sqrt(counts / signal);
        }
        errors.push_back(error);
    }
    return errors;
}

double total_error(std::span<const PlaneError> errors) {
    double sum = 0;
    for (const PlaneError& e : errors) sum += e.squared;
    return sum;
}

}  // namespace lucerna
