#include "lights/bell_cell.h"

#include <algorithm>
#include <array>
#include <optional>

#include "engine/base/sampler.h"
#include "lights/gauss.h"

namespace lucerna {
namespace {

// At fixed y, h is linear in a = Φ(x): h = alpha a + beta (1 - a).
struct Line {
    double alpha, beta;
};

// A cell whose basis is a compile-time type.
template <typename Basis>
struct Known {
    const float (&e)[2][2];

    Line line_at(double y) const {
        const double b = Basis::value(y);
        return {e[0][0] * b + e[0][1] * (1 - b), e[1][0] * b + e[1][1] * (1 - b)};
    }

    // Returns ∫ h dx from 0 to x.
    static double line_integral(const Line& h, double x) {
        const double f = Basis::integral(x);
        return h.alpha * f + h.beta * (x - f);
    }

    // Returns where h is positive: a range of x that touches 0 or 1 or both, or is empty.
    static std::pair<double, double> positive_range(const Line& h) {
        if (h.alpha >= 0 && h.beta >= 0) return {0, 1};
        if (h.alpha <= 0 && h.beta <= 0) return {0, 0};
        const double root =
            Basis::inverse(h.beta / (h.beta - h.alpha));  // signs differ: the denominator is not 0
        return h.alpha > 0 ? std::pair{0.0, root} : std::pair{root, 1.0};
    }

    static double positive_integral(const Line& h) {
        const auto [from, to] = positive_range(h);
        return std::max(0.0, line_integral(h, to) - line_integral(h, from));
    }

    // Holds the y at which the marginal is not smooth: where an end of the line changes sign, where the root
    // passes the bell's joint, and the bell's joint in y. The first and last are 0 and 1.
    struct Pieces {
        std::array<double, 6> y{};
        int count = 0;

        explicit Pieces(const float (&e)[2][2]) {
            y[0] = 0;
            count = 1;
            const auto add_root = [this](double at_one, double at_zero) {  // of at_one b + at_zero (1 - b)
                if ((at_one < 0) == (at_zero < 0) || at_one == at_zero) return;
                y[static_cast<std::size_t>(count++)] = Basis::inverse(at_zero / (at_zero - at_one));
            };
            add_root(e[0][0], e[0][1]);
            add_root(e[1][0], e[1][1]);
            add_root(double{e[0][0]} + double{e[1][0]}, double{e[0][1]} + double{e[1][1]});
            y[static_cast<std::size_t>(count++)] = 0.5;
            y[static_cast<std::size_t>(count++)] = 1;
            std::sort(y.begin(), y.begin() + count);
        }
    };

    // Returns ∫ of the marginal from y0 to y1, which lie in one piece.
    double marginal_integral(double y0, double y1) const {
        double sum = 0;
        for (const GaussNode& node : gauss_rule(5)) {
            sum += node.weight * positive_integral(line_at(y0 + (y1 - y0) * node.x));
        }
        return sum * (y1 - y0);
    }

    double clamped_mean() const {
        const Pieces pieces(e);
        double sum = 0;
        for (int i = 1; i < pieces.count; ++i) {
            const double from = pieces.y[static_cast<std::size_t>(i - 1)];
            const double to = pieces.y[static_cast<std::size_t>(i)];
            if (to > from) sum += marginal_integral(from, to);
        }
        return sum;
    }

    V2f draw_by_inversion(const V2f& u, double mean) const;
};

// Solves rising(x) = target in [from, to] by bisection; 40 halvings resolve more than a float.
template <typename Rising>
double bisect(double from, double to, double target, Rising&& rising) {
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (from + to);
        (rising(middle) < target ? from : to) = middle;
    }
    return 0.5 * (from + to);
}

template <typename Basis>
V2f Known<Basis>::draw_by_inversion(const V2f& u, double mean) const {
    const Pieces pieces(e);
    double target = double{u.y} * mean;
    double y = 1;
    for (int i = 1; i < pieces.count; ++i) {
        const double from = pieces.y[static_cast<std::size_t>(i - 1)];
        const double to = pieces.y[static_cast<std::size_t>(i)];
        const double mass = to > from ? marginal_integral(from, to) : 0;
        if (target < mass) {
            y = bisect(from, to, target, [&](double at) { return marginal_integral(from, at); });
            break;
        }
        target -= mass;
    }
    const Line h = line_at(y);
    const auto [from, to] = positive_range(h);
    const double base = line_integral(h, from);
    const double share = double{u.x} * (line_integral(h, to) - base);
    const double x = bisect(from, to, share, [&](double at) { return line_integral(h, at) - base; });
    return {static_cast<float>(x), static_cast<float>(y)};
}

}  // namespace

double BellCell::clamped_mean() const {
    if (!has_negative()) return signed_mean();
    if (e[0][0] <= 0 && e[0][1] <= 0 && e[1][0] <= 0 && e[1][1] <= 0) return 0;
    return with_basis(basis, [&](auto of) { return Known<decltype(of)>{e}.clamped_mean(); });
}

V2f BellCell::draw(const V2f& u, std::uint32_t salt) const {
    return with_basis(basis, [&](auto of) {
        const V2f at = draw_positive<decltype(of)>(u);
        return stays<decltype(of)>(at, salt) ? at : draw_again(salt);
    });
}

V2f BellCell::draw_again(std::uint32_t salt) const {
    Sampler sampler(salt, Purpose::emission, 1, 0);
    for (int i = 1; i < kTries; ++i) {
        const V2f u = sampler.next2();
        const std::uint32_t bits = sampler.bits();
        const auto at = with_basis(basis, [&](auto of) -> std::optional<V2f> {
            const V2f drawn = draw_positive<decltype(of)>(u);
            return stays<decltype(of)>(drawn, bits) ? std::optional(drawn) : std::nullopt;
        });
        if (at) return *at;
    }
    return draw_by_inversion(sampler.next2());
}

V2f BellCell::draw_by_inversion(const V2f& u) const {
    return with_basis(basis,
                      [&](auto of) { return Known<decltype(of)>{e}.draw_by_inversion(u, clamped_mean()); });
}

}  // namespace lucerna
