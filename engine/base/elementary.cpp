#include "engine/base/elementary.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

// The methods are those of any text on the subject, as [Muller 2016]: reduce the argument, evaluate a
// polynomial, and carry the rounding errors of the largest terms in a second double. The polynomials are
// near-minimax, and tests/generators/elementary_coefficients.py computes them.

namespace lucerna {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Represents hi + lo, where lo is at most about an ulp of hi.
struct Sum {
    double hi, lo;
};

// Adds without error, for |a| >= |b| or a = 0.
Sum sum(double a, double b) {
    const double hi = a + b;
    return {hi, b - (hi - a)};
}
// Adds without error.
Sum any_sum(double a, double b) {
    return std::fabs(a) >= std::fabs(b) ? sum(a, b) : sum(b, a);
}
// Multiplies without error.
Sum product(double a, double b) {
    const double hi = a * b;
    return {hi, std::fma(a, b, -hi)};
}

// Evaluates by Estrin's scheme, whose chains of dependent operations are short.
template <std::size_t N>
double polynomial(const std::array<double, N>& coefficients, double x) {
    if constexpr (N == 1) {
        return coefficients[0];
    } else {
        std::array<double, (N + 1) / 2> pairs;
        for (std::size_t i = 0; i < N / 2; ++i)
            pairs[i] = std::fma(coefficients[2 * i + 1], x, coefficients[2 * i]);
        if constexpr (N % 2 == 1) pairs[N / 2] = coefficients[N - 1];
        return polynomial(pairs, x * x);
    }
}

constexpr int kBias = 1023, kMantissaBits = 52;

// Requires -1022 <= n <= 1023.
double power_of_2(int n) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(n + kBias) << kMantissaBits);
}
// Multiplies a normal number near 1 by 2^n, rounding once. Requires |n| <= 2000.
double scaled(double x, int n) {
    return x * power_of_2(n / 2) * power_of_2(n - n / 2);
}
// Represents x = 2^n m for a finite x > 0, with m from `least` to 2 least.
struct Parts {
    int n;
    double m;
};
Parts parts(double x, double least) {
    constexpr int kShift = 54;
    const bool subnormal = x < std::numeric_limits<double>::min();
    const auto bits = std::bit_cast<std::uint64_t>(subnormal ? x * power_of_2(kShift) : x);
    int n = static_cast<int>(bits >> kMantissaBits) - kBias - (subnormal ? kShift : 0);
    double m = std::bit_cast<double>((bits & ((std::uint64_t{1} << kMantissaBits) - 1)) |
                                     (std::uint64_t{kBias} << kMantissaBits));
    if (m >= 2 * least) m *= 0.5, ++n;
    return {n, m};
}

// --- exponentials

constexpr Sum kLn2{0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};
constexpr double kLn2High = 0x1.62e42feep-1, kLn2Low = 0x1.a39ef35793c76p-33;  // the first has 32 bits
constexpr Sum kLog2E{0x1.71547652b82fep+0, 0x1.777d0ffda0d24p-56};
constexpr Sum kLog10E{0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};
constexpr Sum kLog10Of2{0x1.34413509f79ffp-2, -0x1.9dc1da994fd21p-59};

// (e^r - 1 - r) / r² for |r| <= ln 2 / 2, with a relative error of 2^-57.5
constexpr std::array<double, 11> kExp{0x1.0000000000000p-1,  0x1.5555555555557p-3,  0x1.5555555555556p-5,
                                      0x1.11111111100dfp-7,  0x1.6c16c16c162d6p-10, 0x1.a01a01abe6323p-13,
                                      0x1.a01a01a6d7831p-16, 0x1.71de0237484cdp-19, 0x1.27e4db67ac2b0p-22,
                                      0x1.af4ddda1c08cdp-26, 0x1.1f72fc83bcbc7p-29};

constexpr double kMostExponent = 1100;  // e to this is infinite, and e to minus this 0

// Represents 2^n (1 + t).
struct Exponential {
    int n;
    Sum t;
};
// Requires |x.hi| <= kMostExponent.
Exponential exponential(const Sum& x) {
    const double n = std::nearbyint(x.hi * kLog2E.hi);
    const double high = std::fma(n, -kLn2High, x.hi);  // exact: n has 11 bits
    const Sum r = any_sum(high, std::fma(n, -kLn2Low, x.lo));
    return {static_cast<int>(n), sum(r.hi, std::fma(r.hi * r.hi, polynomial(kExp, r.hi), r.lo))};
}
double exp_of(const Sum& x) {
    if (!(std::fabs(x.hi) <= kMostExponent)) return x.hi > 0 ? kInfinity : 0;
    const auto [n, t] = exponential(x);
    const Sum whole = sum(1, t.hi);
    return scaled(whole.hi + (whole.lo + t.lo), n);
}

// --- logarithms

// (2 atanh s - 2 s - ⅔ s³) / s⁵ as a function of s², for |s| <= (√2 - 1) / (√2 + 1)
constexpr std::array<double, 9> kLog{0x1.999999999999ap-2, 0x1.2492492492491p-2, 0x1.c71c71c71cfd7p-3,
                                     0x1.745d17451376fp-3, 0x1.3b13b1bc64d9dp-3, 0x1.1110dfb2433c1p-3,
                                     0x1.e1f7f8b33879dp-4, 0x1.ac4ab12e9f860p-4, 0x1.b8d2ce0baf5e8p-4};
constexpr Sum kTwoThirds{0x1.5555555555555p-1, 0x1.5555555555555p-55};

// Represents log(2^n m) for m from √½ to √2: n log 2 + of_m, with a relative error of of_m of about 2^-64.
struct Logarithm {
    double n;
    Sum of_m;
};
Logarithm logarithm(double x) {
    const auto [n, m] = parts(x, 0x1.6a09e667f3bcdp-1);
    // log m = 2 atanh s with s = (m - 1) / (m + 1); the divisor is >= 1.7.
    const double f = m - 1;
    const Sum d = m < 1 ? sum(1, m) : sum(m, 1);
    const double s = f / d.hi;
    const double rest = (std::fma(-s, d.hi, f) - s * d.lo) / d.hi;
    const Sum z = product(s, s), cube = product(z.hi, s);
    Sum factor = sum(kTwoThirds.hi, z.hi * polynomial(kLog, z.hi));
    factor.lo += kTwoThirds.lo;
    const Sum tail = product(cube.hi, factor.hi);
    const double low = tail.lo + cube.hi * factor.lo + factor.hi * (cube.lo + z.lo * s + 3 * z.hi * rest);
    const Sum head = sum(2 * s, tail.hi);
    return {static_cast<double>(n), sum(head.hi, head.lo + (low + 2 * rest))};
}
Sum log_of(double x) {
    const auto [n, of_m] = logarithm(x);
    const Sum high = any_sum(n * kLn2High, of_m.hi);  // the product is exact: n has 11 bits
    return sum(high.hi, high.lo + std::fma(n, kLn2Low, of_m.lo));
}
// Returns the logarithm to another base: `unit` is that of e, and `of_2` that of 2.
double log_to(double x, const Sum& unit, const Sum& of_2) {
    const auto [n, of_m] = logarithm(x);
    const Sum twos = product(n, of_2.hi), rest = product(of_m.hi, unit.hi);
    const Sum high = any_sum(twos.hi, rest.hi);
    return high.hi + (high.lo + (twos.lo + rest.lo + n * of_2.lo + of_m.hi * unit.lo + of_m.lo * unit.hi));
}
// Handles the arguments for which logarithms are not finite. Returns false for all others.
bool is_special_log(double x, double& value) {
    if (x > 0 && x < kInfinity) return false;
    value = x == 0 ? -kInfinity : x > 0 ? x : kNan;
    return true;
}

// --- trigonometry

// (sin r - r) / r³ and (cos r - 1 + r²/2) / r⁴ as functions of r², for |r| <= π/4, with a relative error of
// 2^-54
constexpr std::array<double, 7> kSin{-0x1.5555555555555p-3, 0x1.1111111111110p-7,   -0x1.a01a01a019938p-13,
                                     0x1.71de3a5460952p-19, -0x1.ae645412c4787p-26, 0x1.61217f0ac7f98p-33,
                                     -0x1.ab17d3985bccep-41};
constexpr std::array<double, 7> kCos{0x1.5555555555555p-5,   -0x1.6c16c16c16c16p-10, 0x1.a01a01a019d0ap-16,
                                     -0x1.27e4fb7712d61p-22, 0x1.1eed8deb97423p-29,  -0x1.9394ba0c332d9p-37,
                                     0x1.ab785aa02d659p-45};
constexpr double kHalfPi[3] = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, -0x1.f1976b7ed8fbcp-110};
constexpr double kTwoPi = 4 * kHalfPi[0];

// Represents an angle as n right angles and r, |r| <= π/4 but for rounding. Only the last two bits of n
// count.
struct Reduced {
    unsigned n;
    Sum r;
};
Reduced reduced(double x) {
    constexpr double kExact = 0x1p30;  // up to here the first difference below is exact
    if (!(std::fabs(x) <= kExact)) x = std::fmod(x, kTwoPi);
    const double n = std::nearbyint(x * (1 / kHalfPi[0]));
    const double first = std::fma(-n, kHalfPi[0], x);
    const Sum second = product(-n, kHalfPi[1]);
    const Sum r = any_sum(first, second.hi);
    return {static_cast<unsigned>(static_cast<std::int64_t>(n)),
            sum(r.hi, r.lo + std::fma(-n, kHalfPi[2], second.lo))};
}
double sin_of(const Sum& r) {
    const double z = r.hi * r.hi;
    return r.hi + std::fma(r.hi * z, polynomial(kSin, z), r.lo * std::fma(z, -0.5, 1));
}
double cos_of(const Sum& r) {
    const double z = r.hi * r.hi;
    const Sum head = sum(1, -0.5 * z);
    const double square_error = std::fma(r.hi, r.hi, -z);
    return head.hi + (head.lo + std::fma(z * z, polynomial(kCos, z), -r.hi * r.lo - 0.5 * square_error));
}
SinCos<double> turned(unsigned n, double s, double c) {
    switch (n % 4) {
        case 0:
            return {s, c};
        case 1:
            return {c, -s};
        case 2:
            return {-s, -c};
        default:
            return {-c, s};
    }
}

// (atan t - t) / t³ as a function of t², for |t| <= tan(π/8), with a relative error of 2^-54
constexpr std::array<double, 14> kAtan{-0x1.5555555555555p-2, 0x1.9999999999999p-3,  -0x1.2492492492461p-3,
                                       0x1.c71c71c718cf7p-4,  -0x1.745d1744b4e3fp-4, 0x1.3b13b106d37d1p-4,
                                       -0x1.11110ad583fe1p-4, 0x1.e1e0de906806ep-5,  -0x1.af19a8b3a761cp-5,
                                       0x1.857fa34a655edp-5,  -0x1.5fc95a7433e78p-5, 0x1.3106182c98160p-5,
                                       -0x1.bedee1b480460p-6, 0x1.87e420472bbe1p-7};
constexpr Sum kHalfTurn{0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};

// Returns the angle of (x, y), both positive and finite.
Sum angle(double y, double x) {
    const bool steep = y > x;
    const double a = steep ? x : y, b = steep ? y : x;
    constexpr double kTanPi8 = 0x1.a827999fcef32p-2;
    // The angle's tangent is a / b <= 1, or that of the angle less π/4 is (a - b) / (a + b).
    const bool wide = a > kTanPi8 * b;
    const Sum above = wide ? sum(a, -b) : Sum{a, 0};  // |a| >= |b| / 2, so this is exact
    const Sum below = wide ? sum(b, a) : Sum{b, 0};
    const double t = above.hi / below.hi;
    const double rest = (std::fma(-t, below.hi, above.hi) - t * below.lo) / below.hi;
    const double z = t * t;
    Sum result = sum(t, std::fma(t * z, polynomial(kAtan, z), rest));
    const auto add = [&result](double hi, double lo) {
        const Sum high = any_sum(hi, result.hi);
        result = sum(high.hi, high.lo + (lo + result.lo));
    };
    if (wide) add(kHalfTurn.hi / 4, kHalfTurn.lo / 4);
    if (!steep) return result;
    result = {-result.hi, -result.lo};
    add(kHalfTurn.hi / 2, kHalfTurn.lo / 2);
    return result;
}

}  // namespace

double exp(double x) {
    if (std::isnan(x)) return x;
    return exp_of({x, 0});
}
double exp2(double x) {
    if (std::isnan(x)) return x;
    if (!(std::fabs(x) <= kMostExponent)) return x > 0 ? kInfinity : 0;
    const double n = std::nearbyint(x);
    const Sum power = product(x - n, kLn2.hi);
    return scaled(exp_of({power.hi, power.lo + (x - n) * kLn2.lo}), static_cast<int>(n));
}
double expm1(double x) {
    if (!(std::fabs(x) <= kMostExponent)) return x > 0 ? kInfinity : x < 0 ? -1 : x;
    if (x == 0) return x;  // keeps its sign
    const auto [n, t] = exponential({x, 0});
    if (n == 0) return t.hi + t.lo;
    if (n > 60) return exp_of({x, 0});
    // 2^n t + (2^n - 1), where the difference is exact or rounds to -1.
    const double power = scaled(1, n);
    const Sum high = any_sum(power - 1, power * t.hi);
    return high.hi + (high.lo + power * t.lo);
}
double log(double x) {
    double special = 0;
    if (is_special_log(x, special)) return special;
    const Sum value = log_of(x);
    return value.hi + value.lo;
}
double log2(double x) {
    double special = 0;
    if (is_special_log(x, special)) return special;
    return log_to(x, kLog2E, {1, 0});
}
double log10(double x) {
    double special = 0;
    if (is_special_log(x, special)) return special;
    return log_to(x, kLog10E, kLog10Of2);
}
double log1p(double x) {
    double special = 0;
    if (is_special_log(1 + x, special)) return special;
    if (x == 0) return x;         // keeps its sign
    const Sum u = any_sum(1, x);  // u.hi > 0
    const Sum value = log_of(u.hi);
    return value.hi + (value.lo + u.lo / u.hi);
}

double pow(double x, double y) {
    if (y == 0 || x == 1) return 1;
    if (std::isnan(x) || std::isnan(y)) return kNan;
    const double size = std::fabs(x);
    const bool whole = std::trunc(y) == y, odd = whole && std::fabs(std::fmod(y, 2)) == 1;
    const double sign = odd && std::signbit(x) ? -1 : 1;
    if (size == 0 || size == kInfinity) return (size == 0) == (y < 0) ? sign * kInfinity : sign * 0;
    if (std::isinf(y)) return size == 1 ? 1 : (size > 1) == (y > 0) ? kInfinity : 0;
    if (x < 0 && !whole) return kNan;
    const Sum of_size = log_of(size);
    const Sum power = product(y, of_size.hi);
    if (std::fabs(power.hi) > kMostExponent) return power.hi > 0 ? sign * kInfinity : sign * 0;
    return sign * exp_of({power.hi, std::fma(y, of_size.lo, power.lo)});
}
double cbrt(double x) {
    const double size = std::fabs(x);
    if (!(size > 0 && size < kInfinity)) return x;
    // The cube must not be subnormal.
    const auto [n, m] = parts(size, 1);
    const int thirds = (n + 3000) / 3 - 1000;
    const double of = scaled(m, n - 3 * thirds);
    const double root = exp_of({log_of(of).hi / 3, 0});  // from 1 to 2
    // One step of Newton's method, with the error of the cube.
    const Sum square = product(root, root);
    const Sum cube = product(square.hi, root);
    const double error = (cube.hi - of) + (cube.lo + square.lo * root);
    return std::copysign(scaled(root - error / (3 * square.hi), thirds), x);
}
double hypot(double x, double y) {
    x = std::fabs(x), y = std::fabs(y);
    if (x == kInfinity || y == kInfinity) return kInfinity;
    if (std::isnan(x) || std::isnan(y)) return kNan;
    const double most = std::max(x, y);
    if (most == 0) return 0;
    // Squares must neither overflow nor lose bits by underflow.
    const auto [n, a] = parts(most, 1);
    const double b = std::min(x, y) * power_of_2(-n / 2) * power_of_2(-n + n / 2);
    const Sum a2 = product(a, a), b2 = product(b, b), both = sum(a2.hi, b2.hi);
    const double root = std::sqrt(both.hi);  // from 1 to √8
    const Sum square = product(root, root);
    const double error = (both.hi - square.hi) + (both.lo + a2.lo + b2.lo - square.lo);
    return scaled(root + error / (2 * root), n);
}

SinCos<double> sin_cos(double x) {
    if (!(std::fabs(x) < kInfinity)) return {kNan, kNan};
    if (x == 0) return {x, 1};  // keeps its sign
    const auto [n, r] = reduced(x);
    return turned(n, sin_of(r), cos_of(r));
}
double sin(double x) {
    return sin_cos(x).sin;
}
double cos(double x) {
    return sin_cos(x).cos;
}
double tan(double x) {
    const auto [s, c] = sin_cos(x);
    return s / c;  // no double is a multiple of π/2, except 0: c is not 0
}

SinCos<float> sin_cos(float x) {
    constexpr float kShort = 0x1p20F;  // up to here the angle below has an error of less than 2^-52
    if (!(std::fabs(x) <= kShort)) {
        const auto [sin_x, cos_x] = sin_cos(static_cast<double>(x));
        return {static_cast<float>(sin_x), static_cast<float>(cos_x)};
    }
    if (x == 0) return {x, 1};  // keeps its sign
    const auto angle = static_cast<double>(x);
    const double n = std::nearbyint(angle * (1 / kHalfPi[0]));
    const double r = std::fma(-n, kHalfPi[1], std::fma(-n, kHalfPi[0], angle));
    const double z = r * r;
    const double s = std::fma(r * z, polynomial(kSin, z), r);
    const double c = std::fma(z * z, polynomial(kCos, z), std::fma(z, -0.5, 1));
    const auto [sin_x, cos_x] = turned(static_cast<unsigned>(static_cast<std::int64_t>(n)), s, c);
    return {static_cast<float>(sin_x), static_cast<float>(cos_x)};
}
float sin(float x) {
    return sin_cos(x).sin;
}
float cos(float x) {
    return sin_cos(x).cos;
}

double atan2(double y, double x) {
    if (std::isnan(x) || std::isnan(y)) return kNan;
    double ay = std::fabs(y), ax = std::fabs(x);
    Sum result{0, 0};
    if (ay == kInfinity || ax == kInfinity) {
        result = ay == ax  ? Sum{kHalfTurn.hi / 4, kHalfTurn.lo / 4}
                 : ay > ax ? Sum{kHalfTurn.hi / 2, kHalfTurn.lo / 2}
                           : Sum{0, 0};
    } else if (ax == 0 && ay > 0) {
        result = {kHalfTurn.hi / 2, kHalfTurn.lo / 2};
    } else if (ay > 0) {
        constexpr double kLarge = 0x1p1000;  // a sum of two of these is finite
        if (std::max(ay, ax) > kLarge) ay *= 0.25, ax *= 0.25;
        result = angle(ay, ax);
    }
    if (std::signbit(x)) {
        const Sum high = sum(kHalfTurn.hi, -result.hi);
        result = {high.hi, high.lo + (kHalfTurn.lo - result.lo)};
    }
    return std::copysign(result.hi + result.lo, y);
}
double atan(double x) {
    return atan2(x, 1);
}
double asin(double x) {
    return std::fabs(x) <= 1 ? atan2(x, std::sqrt((1 - x) * (1 + x))) : kNan;
}
double acos(double x) {
    return std::fabs(x) <= 1 ? atan2(std::sqrt((1 - x) * (1 + x)), x) : kNan;
}

double log_gamma(double x) {
    // Stirling's series [Abramowitz and Stegun 1964, 6.1.41] is exact to a double from 10 on, to which the
    // recurrence leads.
    double factors = 1;
    for (; x < 10; x += 1) factors *= x;
    constexpr std::array<double, 7> kStirling{1.0 / 12,   -1.0 / 360,       1.0 / 1260, -1.0 / 1680,
                                              1.0 / 1188, -691.0 / 360'360, 1.0 / 156};
    const double r = 1 / x;
    constexpr double kHalfLogOf2Pi = 0x1.d67f1c864beb4p-1;
    return (x - 0.5) * log(x) - x + kHalfLogOf2Pi + r * polynomial(kStirling, r * r) - log(factors);
}

}  // namespace lucerna
