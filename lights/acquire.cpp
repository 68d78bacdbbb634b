// The virtual rig: section 2 of [LF] by quadrature.
#include "lights/acquire.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "lights/bell.h"
#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr double kPiD = 3.14159265358979323846;

struct Range {
    double from, to;
};

// Between whole numbers the four duals over a point are quadratic on either half, and cross 0 here.
constexpr std::array<double, 6> kDualKnots{0.0,
                                           0.26230405792404127,  // Φ̃(x - 1): 1170 Φ = 161
                                           0.3415650255319866,   // Φ̃(x - 2): 210 Φ = 49
                                           0.5,
                                           0.6584349744680134,   // Φ̃(x + 1)
                                           0.7376959420759588};  // Φ̃(x)

// Gauss nodes over a range, cut at the knots, which rise: the integrand is smooth between knots only.
void place_nodes(const Range& range, std::span<const double> knots, int rule, std::vector<GaussNode>& nodes) {
    nodes.clear();
    double from = range.from;
    const auto add_piece = [&](double to) {
        if (!(to > from)) return;
        for (const GaussNode& g : gauss_rule(rule))
            nodes.push_back({from + (to - from) * g.x, (to - from) * g.weight});
        from = to;
    };
    for (const double knot : knots) add_piece(std::min(knot, range.to));
    add_piece(range.to);
}

// Gathers, for one point of M, what every filter lets through.
class PointIntegral {
  public:
    PointIntegral(const EmitterModel& emitter, const Rig& rig, int rule)
        : emitter_(emitter),
          rig_(rig),
          rule_(rule),
          row_(static_cast<std::size_t>(rig.views.x)),
          sum_(static_cast<std::size_t>(rig.views.x) * static_cast<std::size_t>(rig.views.y)) {}

    // Filters [first, last] of each axis matter. Afterwards sum(m, n) = ∫∫ max(0, ±Φ̃_m Φ̃_n) L g du dv, the
    // signs side by side.
    void at(const V2d& on_m, const V2i& first, const V2i& last) {
        std::fill(sum_.begin(), sum_.end(), Signs{});
        // The emitter's outline, seen from the point of M and drawn on S.
        const double w = emitter_.setback / (rig_.distance + emitter_.setback);  // distance > 0
        const V2d centre = w * on_m;
        const V2d half = (1 - w) * emitter_.half_size;
        Range reach[2];
        for (int a = 0; a < 2; ++a) {
            reach[a] = {rig_.filter(a, first[a]) - 2 * rig_.spacing[a],
                        rig_.filter(a, last[a]) + 2 * rig_.spacing[a]};
            knots_[a].clear();  // the duals are polynomials of one sign between these
            for (int i = first[a] - 2; i <= last[a] + 2; ++i) {
                for (const double f : kDualKnots) {
                    knots_[a].push_back(rig_.filter(a, 0) + (i + f) * rig_.spacing[a]);
                }
            }
        }
        const auto row_at = [&](double v, double half_chord, double weight) {
            const Range chord{std::max(centre.x - half_chord, reach[0].from),
                              std::min(centre.x + half_chord, reach[0].to)};
            if (!(chord.to > chord.from)) return;
            place_nodes(chord, knots_[0], rule_, u_);
            add_row(v, weight, on_m, w);
        };
        if (emitter_.outline == EmitterModel::Outline::rectangle) {
            const Range v{std::max(centre.y - half.y, reach[1].from),
                          std::min(centre.y + half.y, reach[1].to)};
            place_nodes(v, knots_[1], rule_, v_);
            for (const GaussNode& node : v_) row_at(node.x, half.x, node.weight);
            return;
        }
        // A disc: v = r sin φ takes the square root out of the chord's length. Cut where v passes a knot and
        // where either end of the chord does.
        const double r = half.x;
        const auto angle = [&](double v) { return std::asin(std::clamp((v - centre.y) / r, -1.0, 1.0)); };
        angles_.clear();
        for (const double knot : knots_[1]) angles_.push_back(angle(knot));
        for (const double knot : knots_[0]) {
            const double c = std::fabs(knot - centre.x) / r;
            if (c < 1) angles_.insert(angles_.end(), {std::acos(c), -std::acos(c)});
        }
        std::sort(angles_.begin(), angles_.end());
        place_nodes({angle(reach[1].from), angle(reach[1].to)}, angles_, rule_, v_);
        for (const GaussNode& node : v_) {
            const double half_chord = r * std::cos(node.x);
            row_at(centre.y + r * std::sin(node.x), half_chord, node.weight * half_chord);
        }
    }
    const std::array<double, 2>& sum(int m, int n) const { return sum_[slot(m, n)]; }

  private:
    using Signs = std::array<double, 2>;  // positive and negative part, both >= 0

    std::size_t slot(int m, int n) const {
        return static_cast<std::size_t>(m) * static_cast<std::size_t>(rig_.views.y) +
               static_cast<std::size_t>(n);
    }

    // Adds the nodes of one row to the (at most four) rows of filters over it.
    void add_row(double v, double weight, const V2d& on_m, double w) {
        std::fill(row_.begin(), row_.end(), Signs{});
        for (const GaussNode& node : u_) {
            const V2d on_s(node.x, v);
            const V2d on_emitter = (on_s - w * on_m) / (1 - w);  // w < 1
            const V3d d = V3d(on_m.x - on_s.x, on_m.y - on_s.y, rig_.distance).normalized();
            const double value =
                node.weight * emitter_.radiance(on_emitter, d) * rig_.geometric_term(on_s, on_m);
            spread(0, node.x, [&](int m, double dual) {
                row_[static_cast<std::size_t>(m)][dual < 0] += std::fabs(dual) * value;
            });
        }
        spread(1, v, [&](int n, double dual) {
            const double share = weight * std::fabs(dual);
            const std::size_t same = dual < 0;  // a product is positive where its factors agree
            for (int m = 0; m < rig_.views.x; ++m) {
                const Signs& row = row_[static_cast<std::size_t>(m)];
                Signs& sum = sum_[slot(m, n)];
                sum[0] += share * row[same];
                sum[1] += share * row[1 - same];
            }
        });
    }
    // Calls add(filter, Φ̃ / Δ) for the filters over a position.
    template <typename Add>
    void spread(int axis, double position, Add&& add) const {
        const double x = (position - rig_.filter(axis, 0)) / rig_.spacing[axis];
        const double base = std::floor(x);
        const auto duals = bell_dual_weights(x - base);
        for (int i = 0; i < 4; ++i) {
            const int filter = static_cast<int>(base) - 1 + i;
            if (filter < 0 || filter >= rig_.views[axis]) continue;
            add(filter, duals[static_cast<std::size_t>(i)] / rig_.spacing[axis]);
        }
    }

    const EmitterModel& emitter_;
    const Rig& rig_;
    int rule_;
    std::vector<double> knots_[2], angles_;
    std::vector<GaussNode> u_, v_;
    std::vector<Signs> row_, sum_;
};

// The views whose image holds global column P, which is P - mσ for view m.
std::pair<int, int> views_of_column(const Rig& rig, int axis, int column) {
    const int sigma = rig.shift[axis];
    if (sigma == 0) return {0, rig.views[axis] - 1};
    const int over = column - rig.pixels[axis] + 1;  // least m σ
    return {over > 0 ? (over + sigma - 1) / sigma : 0, std::min(column / sigma, rig.views[axis] - 1)};
}

int global_columns(const Rig& rig, int axis) {
    return rig.pixels[axis] + (rig.views[axis] - 1) * rig.shift[axis];
}

double global_edge(const Rig& rig, int axis, int column) {
    const double sensor = rig.shift[axis] > 0 ? rig.filter(axis, 0) : 0.0;
    return sensor + (column - 0.5 * rig.pixels[axis]) * rig.pixel[axis];
}

// One pixel of the global grid on M, for all views that see it.
void acquire_pixel(const Rig& rig, const V2i& column, int rule, PointIntegral& integral,
                   FilterImages& images) {
    const auto [m0, m1] = views_of_column(rig, 0, column.x);
    const auto [n0, n1] = views_of_column(rig, 1, column.y);
    if (m0 > m1 || n0 > n1) return;  // a column between two sensors
    std::vector<std::array<double, 2>> mean(static_cast<std::size_t>(m1 - m0 + 1) *
                                            static_cast<std::size_t>(n1 - n0 + 1));
    for (const GaussNode& gx : gauss_rule(rule)) {
        for (const GaussNode& gy : gauss_rule(rule)) {
            integral.at({global_edge(rig, 0, column.x) + gx.x * rig.pixel.x,
                         global_edge(rig, 1, column.y) + gy.x * rig.pixel.y},
                        {m0, n0}, {m1, n1});
            std::size_t i = 0;
            for (int m = m0; m <= m1; ++m) {
                for (int n = n0; n <= n1; ++n, ++i) {
                    for (std::size_t sign = 0; sign < 2; ++sign)
                        mean[i][sign] += gx.weight * gy.weight * integral.sum(m, n)[sign];
                }
            }
        }
    }
    std::size_t i = 0;
    for (int m = m0; m <= m1; ++m) {
        for (int n = n0; n <= n1; ++n, ++i) {
            const std::size_t at = rig.index(m, n, column.x - m * rig.shift.x, column.y - n * rig.shift.y);
            images.positive[at] = static_cast<float>(mean[i][0] / filter_scale(rig, FilterSign::positive));
            images.negative[at] = static_cast<float>(mean[i][1] / filter_scale(rig, FilterSign::negative));
        }
    }
}

}  // namespace

EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux, double exponent,
                            std::function<double(const V2d&)> pattern) {
    const bool disc = outline == EmitterModel::Outline::disc;
    const V2d half = disc ? V2d(half_size.x, half_size.x) : half_size;
    if (!(half.x > 0 && half.y > 0) || !std::isfinite(half.x) || !std::isfinite(half.y)) {
        throw InputError(
            fmt::format("emitter: a half size of {} by {} m; finite and positive", half.x, half.y));
    }
    if (!(flux > 0) || !std::isfinite(flux))
        throw InputError(fmt::format("emitter: a flux of {}; positive", flux));
    if (!(exponent >= 1) || !std::isfinite(exponent)) {
        throw InputError(fmt::format("emitter: a lobe exponent of {}; 1 (Lambertian) or more", exponent));
    }
    // The pattern's mean over the outline, by the midpoint rule.
    double mean = 1;
    if (pattern) {
        constexpr int kSide = 512;
        double sum = 0;
        int points = 0;
        for (int i = 0; i < kSide * kSide; ++i) {
            const V2d p(2 * (i % kSide + 0.5) / kSide - 1,
                        2 * (static_cast<double>(i / kSide) + 0.5) / kSide - 1);
            if (disc && p.length2() > 1) continue;
            sum += pattern(p);
            ++points;
        }
        mean = sum / points;
        if (!(mean > 0) || !std::isfinite(mean))
            throw InputError(fmt::format("emitter: a pattern of mean {}", mean));
    }
    // flux = A L0 ∫ cos^exponent dω = A L0 2π / (exponent + 1).
    const double area = disc ? kPiD * half.x * half.x : 4 * half.x * half.y;
    const double l0 = flux * (exponent + 1) / (2 * kPiD * area * mean);
    EmitterModel emitter;
    emitter.outline = outline;
    emitter.half_size = half;
    emitter.flux = flux;
    emitter.radiance = [=](const V2d& position, const V3d& direction) {
        const double lobe = exponent == 1 ? 1.0 : std::pow(std::max(0.0, direction.z), exponent - 1);
        return l0 * lobe * (pattern ? pattern({position.x / half.x, position.y / half.y}) : 1.0);
    };
    emitter.info.provenance = fmt::format("computed: {} of {:g} x {:g} m, cosine power {:g}",
                                          disc ? "disc" : "rectangle", 2 * half.x, 2 * half.y, exponent);
    return emitter;
}

FilterImages acquire_filters(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                             Monitor& monitor, const AcquireOptions& options) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    if (!(emitter.setback >= 0) || !std::isfinite(emitter.setback)) {
        throw InputError(fmt::format("emitter: {} m behind the plane S; 0 or more", emitter.setback));
    }
    FilterImages images{rig, std::vector<float>(rig.coefficients()), std::vector<float>(rig.coefficients()),
                        emitter.info, emitter.flux};
    const V2i columns(global_columns(rig, 0), global_columns(rig, 1));
    Phase phase(monitor, "virtual acquisition", static_cast<std::uint64_t>(columns.x));
    // Each global pixel writes coefficients of its own, so columns may be done in any order.
    parallel_chunks(workers, columns.x, [&](std::int64_t p) {
        if (monitor.stopped()) throw InputError("virtual acquisition: stopped");
        PointIntegral integral(emitter, rig, options.s_nodes);
        for (int q = 0; q < columns.y; ++q) {
            acquire_pixel(rig, {static_cast<int>(p), q}, options.m_nodes, integral, images);
        }
        phase.advance(1);
    });
    return images;
}

LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options) {
    return field_of(acquire_filters(emitter, rig, workers, monitor, options));
}

}  // namespace lucerna
