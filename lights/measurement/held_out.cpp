#include "lights/measurement/held_out.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/sampler.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostRays = 400'000;    // more add little
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
    std::vector<double> from = seen_from(0), mean(edges.size());
    for (int i = 0; i < steps; ++i) {
        const std::vector<double> to = seen_from(i + 1);
        const double x = -reach + (i + 0.5) / kSteps;
        const int lowest = std::max(0, static_cast<int>(std::ceil(x - reach)));
        const int highest = std::min(stepped.count() - 1, static_cast<int>(std::floor(x + reach)));
        for (int j = 0; j < other.count(); ++j) {
            for (std::size_t e = 0; e < edges.size(); ++e) mean[e] = mean_upto<Other>(from[e] - j, to[e] - j);
            for (int k = lowest; k <= highest; ++k) {
                const double weight = stepped.value(x - k) / kSteps;
                const int filter = stepped.on_s ? k : j, pixel = stepped.on_s ? j : k;
                const int pixels = stepped.on_s ? other.count() : stepped.count();
                double* const to_cells = &share[static_cast<std::size_t>(filter * pixels + pixel) * cells];
                for (std::size_t c = 0; c < cells; ++c)
                    to_cells[c] += weight * std::fabs(mean[c + 1] - mean[c]);
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
    std::vector<double> share;
    std::vector<std::pair<std::size_t, std::size_t>> cells;  // per coefficient: first, one past the last

    Response(const Rig& rig, int axis, const Lever& lever, double middle, std::span<const double> edges)
        : share(shares_of(rig, axis, lever, middle, edges)) {
        const std::size_t per_row = edges.size() - 1;
        for (std::size_t row = 0; row < share.size(); row += per_row) {
            std::size_t first = 0, end = per_row;
            while (first < end && share[row + first] == 0) ++first;
            while (end > first && share[row + end - 1] == 0) --end;
            cells.emplace_back(first, end);
        }
    }
};

// Emission is clamped, so that light which negative coefficients should subtract stays in the wrong place.
// Because bells overlap, about half of the negative sum is taken from its surroundings.
template <typename Coefficient>
double clamping_error(std::span<const Coefficient> coefficients) {
    double negative = 0, total = 0;
    for (const Coefficient e : coefficients) {
        negative += std::max(0.0, -double{e});
        total += double{e};
    }
    return total > 0 ? sqr(0.5 * negative / total) : 0.0;
}

// Returns the value below which half of the values lie. Requires at least one.
double median(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

HeldOutRays::HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all, double height)
    : set_(set), height_(height) {
    take_rays(rays, all);
    if (set.coloured()) {
        V3d sum(0);
        for (const std::size_t r : rays_) sum += double{set.rays[r].flux} * V3d(set.tristimulus[r]);
        // A channel with hardly any light does not count.
        for (int c = 0; c < 3; ++c) channel_weight_[c] = sum[c] > 0.01 * sum.y ? sum.y / (3 * sum[c]) : 0.0;
    }
    for (const std::size_t ray : rays_) light_ += light_of(ray);
    planes_.push_back(make_plane(0));
    const double unit = std::max(planes_.front().half.x, planes_.front().half.y);
    for (const double d : kDistances) {
        if (d > 0) planes_.push_back(make_plane(d * unit));
    }
}

HeldOutRays::HeldOutRays(const RaySet& set, std::span<const std::size_t> rays, std::size_t all,
                         const HeldOutRays& like)
    : set_(set), height_(like.height_), channel_weight_(like.channel_weight_), planes_(like.planes_) {
    take_rays(rays, all);
    for (const std::size_t ray : rays_) light_ += light_of(ray);
    for (Plane& plane : planes_) {
        count_rays(plane);
        find_signal(plane);
    }
}

void HeldOutRays::take_rays(std::span<const std::size_t> rays, std::size_t all) {
    const std::size_t step = (rays.size() + kMostRays - 1) / kMostRays;
    for (std::size_t i = 0; i < rays.size(); i += std::max<std::size_t>(step, 1)) rays_.push_back(rays[i]);
    // Files may be sorted, or alternate between a lamp's parts, so the half of each ray is drawn at random.
    std::uint64_t number = 0;
    for (const std::size_t ray : rays_) {
        Sampler draw(0, Purpose::acquisition, 0, number++);
        halves_[draw.bits() & 1].push_back(ray);
    }
    half_over_all_variance_ = 2 * static_cast<double>(all) / static_cast<double>(rays_.size());  // not empty
}

V2d HeldOutRays::place_of(const LampRay& ray, double distance) const {
    if (!std::isinf(distance)) return pass(ray, height_ + distance);
    return {double{ray.d.x} / double{ray.d.z}, double{ray.d.y} / double{ray.d.z}};
}

HeldOutRays::Plane HeldOutRays::make_plane(double distance) const {
    Plane plane{distance, {}, {}, {}, {}, {}};
    std::vector<double> values[2];
    const std::size_t step = (rays_.size() + kFramingRays - 1) / kFramingRays;
    for (int a = 0; a < 2; ++a) {
        std::vector<double> values_here;
        for (std::size_t i = 0; i < rays_.size(); i += std::max<std::size_t>(step, 1))
            values_here.push_back(place_of(set_.rays[rays_[i]], distance)[a]);
        plane.middle[a] = median(values_here);
        for (double& v : values_here) v = std::fabs(v - plane.middle[a]);
        plane.half[a] = median(values_here);
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
    PlaneCoordinate coordinate[2];
    for (int a = 0; a < 2; ++a) coordinate[a].c = kGridMiddle * plane.half[a];
    for (int half = 0; half < 2; ++half) {
        plane.counted[half].assign(kAll, 0.0);
        for (const std::size_t r : halves_[half]) {
            const V2d at = place_of(set_.rays[r], plane.distance) - plane.middle;
            std::size_t cell[2];
            for (int a = 0; a < 2; ++a) {
                const double x = (coordinate[a].of(at[a]) / (2 * coordinate[a].c) + 1) * 0.5 * kCells;
                cell[a] = static_cast<std::size_t>(std::clamp(x, 0.0, kCells - 1.0));
            }
            plane.counted[half][cell[0] * kCells + cell[1]] += light_of(r);
        }
    }
}

void HeldOutRays::find_signal(Plane& plane) {
    plane.signal = 0;
    for (std::size_t i = 0; i < kAll; ++i)
        plane.signal += plane.weight[i] * plane.counted[0][i] * plane.counted[1][i];
}

// Returns the fluxes of the coefficients that one half of the rays makes: E times a cell's volume.
std::vector<double> HeldOutRays::project_half(const Rig& rig, const RayWeights& weights, int half) const {
    std::vector<double> flux(rig.coefficients());
    for (const std::size_t r : halves_[half]) {
        const LampRay& ray = set_.rays[r];
        const Passage at(ray, rig, weights);
        if (at.misses_s) continue;
        at.for_each(rig, 0, [&](int m, int k, double across) {
            const double weighed = light_of(r) * across;
            at.for_each(rig, 1, [&](int n, int l, double up) {
                flux[rig.index(at.base[0] - 1 + m, at.base[1] - 1 + n, k, l)] += weighed * up;
            });
        });
    }
    return flux;
}

// Returns what the coefficients of each field cast into the cells of a plane.
std::vector<std::vector<double>> HeldOutRays::cast(std::span<const std::vector<double>> fields,
                                                   const Rig& rig, const Plane& plane) const {
    const Lever at = lever(rig, plane.distance);
    // Positions are relative to the rig's centre; slopes are not.
    const bool far = std::isinf(plane.distance);
    const V2d middle = plane.middle - (far ? V2d(0, 0) : V2d(rig.centre.x, rig.centre.y));
    const Response across(rig, 0, at, middle.x, plane.edges[0]);
    const Response up(rig, 1, at, middle.y, plane.edges[1]);
    std::vector<std::vector<double>> all;
    for (const std::vector<double>& flux : fields) {
        std::vector<double>& cells = all.emplace_back(std::size_t{kCells} * kCells);
        std::vector<double> row(kCells);
        const auto per_view = static_cast<std::size_t>(rig.pixels.y);
        for (int m = 0; m < rig.views.x; ++m) {
            for (int k = 0; k < rig.pixels.x; ++k) {
                const auto column = static_cast<std::size_t>(m * rig.pixels.x + k);
                const auto [left, right] = across.cells[column];
                if (left == right) continue;
                std::fill(row.begin(), row.end(), 0.0);
                for (int n = 0; n < rig.views.y; ++n) {
                    const double* e = &flux[rig.index(m, n, k, 0)];
                    for (std::size_t l = 0; l < per_view; ++l) {
                        if (e[l] == 0) continue;
                        const std::size_t i = static_cast<std::size_t>(n) * per_view + l;
                        const double* shares = &up.share[i * kCells];
                        for (std::size_t y = up.cells[i].first; y < up.cells[i].second; ++y)
                            row[y] += e[l] * shares[y];
                    }
                }
                const double* shares = &across.share[column * kCells];
                for (std::size_t x = left; x < right; ++x) {
                    for (std::size_t y = 0; y < kCells; ++y) cells[x * kCells + y] += shares[x] * row[y];
                }
            }
        }
    }
    return all;
}

HeldOutRays::Found HeldOutRays::find_errors(const Rig& rig, const RayWeights& weights,
                                            const Workers& workers) const {
    std::vector<double> flux[2];
    parallel_chunks(workers, 2, [&](std::int64_t half) {
        flux[half] = project_half(rig, weights, static_cast<int>(half));
    });
    Found found;
    std::vector<double> both = flux[0];
    for (std::size_t i = 0; i < both.size(); ++i) both[i] += flux[1][i];
    found.clamped = clamping_error(std::span<const double>(both));
    const double total = std::accumulate(both.begin(), both.end(), 0.0);
    found.held = light_ > 0 ? total / light_ : 0.0;
    found.errors.resize(planes_.size());
    parallel_chunks(workers, static_cast<std::int64_t>(planes_.size()), [&](std::int64_t p) {
        const Plane& plane = planes_[static_cast<std::size_t>(p)];
        const std::vector<std::vector<double>> cast_by = cast(flux, rig, plane);
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
        PlaneError& error = found.errors[static_cast<std::size_t>(p)];
        error.distance = plane.distance;
        error.squared = plane.signal > 0 ? (bias2 + own) / plane.signal : 0;
        error.counts =
            plane.signal > 0 ? std::sqrt(0.5 * counts / half_over_all_variance_ / plane.signal) : 0;
    });
    return found;
}

std::vector<PlaneError> HeldOutRays::errors(const LightField& field) const {
    const Rig& rig = field.rig();
    // The rays used may carry less flux than the field stands for.
    double taken = 0, all = 0;
    for (const std::size_t r : rays_) taken += light_of(r);
    for (std::size_t r = 0; r < set_.rays.size(); ++r) all += light_of(r);
    std::vector<double> flux(field.coefficients().begin(), field.coefficients().end());
    for (double& e : flux) e *= rig.cell_volume() * taken / all;  // all > 0: rays carry flux
    const double clamped = clamping_error(std::span<const double>(flux));
    std::vector<PlaneError> errors;
    for (const Plane& plane : planes_) {
        const std::vector<double> cast_by = std::move(cast({&flux, 1}, rig, plane).front());
        double square = 0, counts = 0;
        for (std::size_t i = 0; i < cast_by.size(); ++i) {
            square += plane.weight[i] * sqr(cast_by[i] - plane.counted[0][i] - plane.counted[1][i]);
            counts += plane.weight[i] * sqr(plane.counted[0][i] - plane.counted[1][i]);
        }
        const double signal = 4 * plane.signal;
        PlaneError error{plane.distance};
        if (signal > 0) {
            error.squared = (square - counts) / signal + clamped;
            error.counts = std::sqrt(counts / signal);
        }
        errors.push_back(error);
    }
    return errors;
}

void add_clamping(std::vector<PlaneError>& errors, const LightField& field) {
    const double clamped = clamping_error(field.coefficients());
    for (PlaneError& e : errors) e.squared += clamped;
}

double total_error(std::span<const PlaneError> errors) {
    double sum = 0;
    for (const PlaneError& e : errors) sum += e.squared;
    return sum;
}

}  // namespace lucerna
