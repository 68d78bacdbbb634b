// The bell function Φ, the basis of light fields on S, and its dual.
//
// Φ is the piecewise quadratic bump centred on each filter position of the sampling plane. Positions are one
// unit apart here; the light field scales them by its spacing. Φ is C¹, its support is [-1, 1], and its
// shifts add up to 1. A measurement does not weight light with Φ but with the dual Φ̃, whose product with its
// own Φ integrates to 1 and with every other Φ to 0, so that the measured numbers are the coefficients of Φ
// [Goesele 2003, 3]. Among all duals with support [-2, 2], Φ̃ has the least norm, so it amplifies measurement
// noise least.
//
// Source: [Goesele 2003, 3, 4.2]; the dual of least norm is derived here.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>

#include "engine/base/elementary.h"

namespace lucerna {

// Evaluates Φ(x).
template <std::floating_point T>
T bell(T x) {
    const T a = std::fabs(x);
    const T rest = std::max(T(1) - a, T(0));
    return a <= T(0.5) ? T(1) - T(2) * a * a : T(2) * rest * rest;
}

// Returns the x in [0, 1] with Φ(x) = value; value is clamped to [0, 1].
template <std::floating_point T>
T inverse_bell(T value) {
    const T v = std::clamp(value, T(0), T(1));
    return v >= T(0.5) ? std::sqrt((T(1) - v) * T(0.5)) : T(1) - std::sqrt(v * T(0.5));
}

// Returns F(x) = ∫ Φ from 0 (the peak) to x, for x in [0, 1]; F(1) = 1/2.
template <std::floating_point T>
T bell_integral(T x) {
    if (x <= T(0.5)) return x - x * x * x * (T(2) / T(3));
    const T rest = T(1) - x;
    return T(0.5) - rest * rest * rest * (T(2) / T(3));
}

// Returns ∫ Φ from -1 to x, which is 0 for x below -1 and 1 for x above 1.
template <std::floating_point T>
T bell_upto(T x) {
    const T inner = bell_integral(std::min(std::fabs(x), T(1)));
    return x < 0 ? T(0.5) - inner : T(0.5) + inner;
}

// Returns the x in [0, 1] with F(x) = y, for y in [0, 1/2] (clamped), in closed form: x = √2 sin θ turns x -
// 2x³/3 into (√2/3) sin 3θ, and the outer piece is a cube root.
inline double inverse_bell_integral(double y) {
    const double v = std::clamp(y, 0.0, 0.5);
    constexpr double kRoot2 = 1.41421356237309504880;
    if (v <= 5.0 / 12) return kRoot2 * sin(asin(3 / kRoot2 * v) / 3);  // 3v/√2 <= 0.884
    return 1 - cbrt(1.5 * (0.5 - v));
}

// As above in single precision, within 1e-7, because particles need it by the million. Both pieces use
// Newton's method from a good start, without a branch or a call, so that a loop over it becomes vector
// instructions.
inline float inverse_bell_integral(float y) {
    const float v = std::min(std::max(y, 0.0F), 0.5F);
    // The inner piece solves x - 2x³/3 = v. Its slope 1 - 2x² is at least 1/2 up to the joint.
    const float v2 = v * v;
    float x = v * (1 + v2 * (0.745F + v2 * (-0.819F + 18.06F * v2)));
    for (int i = 0; i < 2; ++i) x -= (x - x * x * x * (2.0F / 3.0F) - v) / (1 - 2 * x * x);
    // The outer piece solves r³ = 3/2 (1/2 - v), starting from a third of the exponent. The start is never 0,
    // so the quotient is finite.
    const float cube = 1.5F * (0.5F - v);
    float r = std::bit_cast<float>(std::bit_cast<std::uint32_t>(cube) / 3 + 0x2a5119f2U);
    for (int i = 0; i < 3; ++i) r = (2 * r + cube / (r * r)) * (1.0F / 3.0F);
    return v <= 5.0F / 12.0F ? x : 1 - r;
}

// Evaluates Φ̃(x), the clipped combination of shifts of Φ [Goesele 2003, 4.2]. It ends with a step at ±2,
// where it is 49/736.
template <std::floating_point T>
T bell_dual(T x) {
    const T a = std::fabs(x);  // even
    if (a > T(2)) return T(0);
    return (T(49) * bell(a - T(2)) - T(161) * bell(a - T(1)) + T(1009) * bell(a) - T(161) * bell(a + T(1))) /
           T(736);  // Φ(a + 2) is 0 for every a >= 0
}

// Returns the four duals, of filters -1, 0, 1 and 2, at a point `f` in [0, 1) past filter 0. Within one
// interval only two bells differ from 0, b = Φ(f) and 1 - b, so each dual is a combination of those two.
template <std::floating_point T>
std::array<T, 4> bell_dual_weights(T f) {
    const T b = bell(f);
    const T c = T(1) - b;
    return {(T(-161) * b + T(49) * c) / T(736), (T(1009) * b - T(161) * c) / T(736),
            (T(-161) * b + T(1009) * c) / T(736), (T(49) * b - T(161) * c) / T(736)};
}

// Selects the basis function of a coefficient on S: the bell, for measurements behind a filter, or the hat 1
// - |x|, which interpolates a field of point samples linearly [Heidrich 1998]. The shifts of either add up to
// 1, and its integral is 1; over an interval one function falls from 1 to 0 as the next rises.
enum class FilterBasis : std::uint8_t { bell, hat };

// Each basis gives, for x in [0, 1]: its value, the x of a value, F(x) = ∫ from 0 to x, and the x of F.
struct BellBasis {
    template <std::floating_point T>
    static T value(T x) {
        return bell(x);
    }
    static double inverse(double value) { return inverse_bell(value); }
    static double integral(double x) { return bell_integral(x); }
    static float inverse_integral(float y) { return inverse_bell_integral(y); }
};
struct HatBasis {
    template <std::floating_point T>
    static T value(T x) {
        return std::max(T(1) - std::fabs(x), T(0));
    }
    static double inverse(double value) { return 1 - std::clamp(value, 0.0, 1.0); }
    static double integral(double x) { return x - 0.5 * x * x; }
    static float inverse_integral(float y) { return 1 - std::sqrt(std::max(0.0F, 1 - 2 * y)); }
};

// Calls visit(BellBasis()) or visit(HatBasis()).
template <typename Visit>
decltype(auto) with_basis(FilterBasis basis, Visit&& visit) {
    return basis == FilterBasis::hat ? visit(HatBasis()) : visit(BellBasis());
}

// Evaluates the basis at any x.
inline double basis_value(FilterBasis basis, double x) {
    return with_basis(basis, [x](auto of) { return of.value(x); });
}

// Returns ∫ Φ(x) Φ(x - m) dx.
constexpr double bell_overlap(int m) {
    if (m == 0) return 23.0 / 30.0;
    return m == 1 || m == -1 ? 7.0 / 60.0 : 0.0;
}

// ∫ Φ̃(x)² dx is the factor by which a coefficient amplifies the variance of white noise, per axis.
inline constexpr double kBellDualNorm2 = 1009.0 / 736.0;

}  // namespace lucerna
