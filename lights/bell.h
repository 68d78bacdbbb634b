// The bell Φ from which light fields are built, and its dual.
//
// Φ is the piecewise quadratic bump that stands over every filter position of the sampling plane. Positions
// are one unit apart here; the light field scales them by its spacing. Φ is C¹, covers [-1, 1], and its
// shifts add up to 1. A measurement does not weigh light with Φ but with the dual Φ̃, which is 1 against its
// own Φ and 0 against every other one; so the numbers measured are the very coefficients of Φ [LF 2]. Of all
// duals on [-2, 2] it is the one of least norm: no other makes less noise out of a noisy measurement.
//
// Source: Goesele, Granier, Heidrich, Seidel, "Accurate Light Source Acquisition and Rendering", SIGGRAPH
// 2003 [LF].
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>

namespace lucerna {

// Φ(x).
template <std::floating_point T>
T bell(T x) {
    const T a = std::fabs(x);
    if (a <= T(0.5)) return T(1) - T(2) * a * a;
    if (a <= T(1)) return T(2) * (a - T(1)) * (a - T(1));
    return T(0);
}

// The x in [0, 1] with Φ(x) = value; value is clamped to [0, 1].
template <std::floating_point T>
T inverse_bell(T value) {
    const T v = std::clamp(value, T(0), T(1));
    return v >= T(0.5) ? std::sqrt((T(1) - v) * T(0.5)) : T(1) - std::sqrt(v * T(0.5));
}

// F(x) = ∫ of Φ from 0 to x, for x in [0, 1]: from the peak outwards; F(1) = 1/2.
template <std::floating_point T>
T bell_integral(T x) {
    if (x <= T(0.5)) return x - x * x * x * (T(2) / T(3));
    const T rest = T(1) - x;
    return T(0.5) - rest * rest * rest * (T(2) / T(3));
}

// The x in [0, 1] with F(x) = y, for y in [0, 1/2] (clamped). Closed form: x = √2 sin θ turns x - 2x³/3 into
// (√2/3) sin 3θ; the outer part is a cube root.
template <std::floating_point T>
T inverse_bell_integral(T y) {
    const T v = std::clamp(y, T(0), T(0.5));
    constexpr T kRoot2 = T(1.41421356237309504880);
    if (v <= T(5) / T(12)) return kRoot2 * std::sin(std::asin(T(3) / kRoot2 * v) / T(3));  // 3v/√2 <= 0.884
    return T(1) - std::cbrt(T(1.5) * (T(0.5) - v));
}

// Φ̃(x): the clipped combination of Φ's shifts [LF 2]. It ends with a step at ±2, where it is 49/736.
template <std::floating_point T>
T bell_dual(T x) {
    const T a = std::fabs(x);  // even
    if (a > T(2)) return T(0);
    return (T(49) * bell(a - T(2)) - T(161) * bell(a - T(1)) + T(1009) * bell(a) - T(161) * bell(a + T(1))) /
           T(736);  // Φ(a + 2) is 0 for every a >= 0
}

// The four duals over a point `f` in [0, 1) past filter 0: of filters -1, 0, 1, 2. Over one interval only two
// bells differ from 0, b = Φ(f) and 1 - b, so each dual is a combination of those two.
template <std::floating_point T>
std::array<T, 4> bell_dual_weights(T f) {
    const T b = bell(f);
    const T c = T(1) - b;
    return {(T(-161) * b + T(49) * c) / T(736), (T(1009) * b - T(161) * c) / T(736),
            (T(-161) * b + T(1009) * c) / T(736), (T(49) * b - T(161) * c) / T(736)};
}

// ∫ Φ(x) Φ(x - m) dx.
constexpr double bell_overlap(int m) {
    if (m == 0) return 23.0 / 30.0;
    return m == 1 || m == -1 ? 7.0 / 60.0 : 0.0;
}

// ∫ Φ̃(x)² dx: the factor by which the variance of white noise grows in a coefficient, per axis.
inline constexpr double kBellDualNorm2 = 1009.0 / 736.0;

}  // namespace lucerna
