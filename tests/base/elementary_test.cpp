// Elementary functions beside MPFR, which rounds correctly.
#include "engine/base/elementary.h"

#include <gtest/gtest.h>
#include <mpfr.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>

namespace lucerna {
namespace elementary_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Holds a number of 300 bits.
class Number {
  public:
    explicit Number(double value = 0) {
        mpfr_init2(value_, 300);
        mpfr_set_d(value_, value, MPFR_RNDN);
    }
    ~Number() { mpfr_clear(value_); }
    Number(const Number&) = delete;
    Number& operator=(const Number&) = delete;
    operator mpfr_ptr() { return value_; }

  private:
    mpfr_t value_;
};

// Returns the distance of `value` from the exact one in units of the last place of that.
double error_in_ulp(double value, Number& exact) {
    const double rounded = mpfr_get_d(exact, MPFR_RNDN);
    if (!std::isfinite(rounded)) return rounded == value ? 0 : kInfinity;
    Number difference;
    mpfr_sub_d(difference, exact, value, MPFR_RNDN);
    const int exponent = rounded == 0 ? -1022 : std::max(std::ilogb(rounded), -1022);
    return std::fabs(mpfr_get_d(difference, MPFR_RNDN)) / std::ldexp(1.0, exponent - 52);
}

using Draw = std::function<double()>;

std::mt19937_64& numbers() {
    static std::mt19937_64 generator(2003);
    return generator;
}
Draw even(double low, double high) {
    return [=] { return std::uniform_real_distribution<double>(low, high)(numbers()); };
}
// Draws numbers of both signs whose exponents are uniform.
Draw spread(double low, double high) {
    return
        [draw = even(low, high)] { return (numbers()() & 1U) != 0 ? std::exp2(draw()) : -std::exp2(draw()); };
}
Draw positive(double low, double high) {
    return [draw = spread(low, high)] { return std::fabs(draw()); };
}

constexpr int kDraws = 30'000;

struct OneArgument {
    const char* name;
    double (*function)(double);
    int (*exact)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
    Draw draw;
    double most;  // error, ulp
};

// The bounds are those that docs/explanation/portable.md states.
TEST(Elementary, Long_FunctionsOfOneNumber_AreWithinTheStatedErrors) {
    const auto right_angles = [] {
        return static_cast<double>(numbers()() % 600'000'000) * 1.5707963267948966;
    };
    const OneArgument all[] = {
        {"exp", exp, mpfr_exp, even(-745, 709), 1.01},
        {"exp", exp, mpfr_exp, spread(-40, 4), 0.7},
        {"exp2", exp2, mpfr_exp2, even(-1074, 1023), 1.01},
        {"expm1", expm1, mpfr_expm1, spread(-60, 9), 1.2},
        {"expm1", expm1, mpfr_expm1, even(-2, 2), 1.2},
        {"log", log, mpfr_log, positive(-1074, 1023), 0.51},
        {"log", log, mpfr_log, even(0.5, 2), 0.51},
        {"log2", log2, mpfr_log2, positive(-1074, 1023), 0.51},
        {"log2", log2, mpfr_log2, even(0.5, 2), 0.51},
        {"log10", log10, mpfr_log10, positive(-1074, 1023), 0.51},
        {"log10", log10, mpfr_log10, even(0.5, 2), 0.51},
        {"log1p", log1p, mpfr_log1p, positive(-60, 60), 0.7},
        {"log1p", log1p, mpfr_log1p, even(-0.999, 1), 0.7},
        {"cbrt", cbrt, mpfr_cbrt, spread(-1074, 1023), 0.51},
        {"sin", sin, mpfr_sin, even(-10, 10), 0.8},
        {"sin", sin, mpfr_sin, spread(-40, 29.9), 0.8},
        {"sin", sin, mpfr_sin, right_angles, 0.8},
        {"cos", cos, mpfr_cos, even(-10, 10), 0.8},
        {"cos", cos, mpfr_cos, spread(-40, 29.9), 0.8},
        {"cos", cos, mpfr_cos, right_angles, 0.8},
        {"tan", tan, mpfr_tan, even(-10, 10), 2},
        {"tan", tan, mpfr_tan, spread(-40, 29.9), 2},
        {"asin", asin, mpfr_asin, even(-1, 1), 2},
        {"asin", asin, mpfr_asin, spread(-60, 0), 2},
        {"acos", acos, mpfr_acos, even(-1, 1), 2},
        {"acos", acos, mpfr_acos, [draw = positive(-52, 0)] { return 1 - draw(); }, 2},
        {"atan", atan, mpfr_atan, even(-3, 3), 1.2},
        {"atan", atan, mpfr_atan, spread(-60, 60), 1.2},
        {"log_gamma", log_gamma, mpfr_lngamma, even(3, 100), 64},
    };
    for (const OneArgument& one : all) {
        double worst = 0, at = 0;
        for (int i = 0; i < kDraws; ++i) {
            const double x = one.draw();
            Number argument(x), exact;
            one.exact(exact, argument, MPFR_RNDN);
            const double error = error_in_ulp(one.function(x), exact);
            if (!(error <= worst)) worst = error, at = x;
        }
        EXPECT_LE(worst, one.most) << one.name << " at " << at;
        EXPECT_GT(worst, 0.4) << one.name;
    }
}

struct TwoArguments {
    const char* name;
    double (*function)(double, double);
    int (*exact)(mpfr_ptr, mpfr_srcptr, mpfr_srcptr, mpfr_rnd_t);
    Draw first, second;
    double most;  // error, ulp
};

TEST(Elementary, FunctionsOfTwoNumbers_AreWithinTheStatedErrors) {
    const TwoArguments all[] = {
        {"pow", pow, mpfr_pow, positive(-20, 20), even(-30, 30), 0.8},
        {"pow", pow, mpfr_pow, even(0.5, 2), even(-700, 700), 0.8},
        {"pow", pow, mpfr_pow, even(0, 1), even(0.3, 3), 0.8},
        {"atan2", atan2, mpfr_atan2, spread(-30, 30), spread(-30, 30), 1.2},
        {"atan2", atan2, mpfr_atan2, even(-1, 1), even(-1, 1), 1.2},
        {"hypot", hypot, mpfr_hypot, spread(-1022, 1022), spread(-1022, 1022), 0.51},
        {"hypot", hypot, mpfr_hypot, even(-1, 1), even(-1, 1), 0.51},
    };
    for (const TwoArguments& two : all) {
        double worst = 0, at = 0, and_at = 0;
        for (int i = 0; i < kDraws; ++i) {
            const double x = two.first(), y = two.second();
            Number a(x), b(y), exact;
            two.exact(exact, a, b, MPFR_RNDN);
            const double error = error_in_ulp(two.function(x, y), exact);
            if (!(error <= worst)) worst = error, at = x, and_at = y;
        }
        EXPECT_LE(worst, two.most) << two.name << " at " << at << ", " << and_at;
        EXPECT_GT(worst, 0.4) << two.name;
    }
}

// The test of errors must reject a polynomial with one term too few.
TEST(Elementary, AFunctionThatIsOffByTwoUlp_IsSeen) {
    Number argument(0.7), exact;
    mpfr_sin(exact, argument, MPFR_RNDN);
    const double right = std::sin(0.7);
    EXPECT_LE(error_in_ulp(right, exact), 0.6);
    EXPECT_GT(error_in_ulp(std::nextafter(std::nextafter(right, 1), 1), exact), 1.4);
}

bool same(double a, double b) {
    return std::isnan(a) ? std::isnan(b) : std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

// Special values are those of the C library, signs of zeros included.
TEST(Elementary, SpecialValues_AreThoseOfTheStandard) {
    const double values[] = {0.0,  -0.0,  1.0,    -1.0,   2.0,     -2.0,      0.5,        -0.5,        3.0,
                             -3.0, 1e308, -1e308, 5e-324, -5e-324, kInfinity, -kInfinity, std::nan("")};
    const std::pair<double (*)(double), double (*)(double)> ones[] = {
        {exp, std::exp},   {exp2, std::exp2},   {expm1, std::expm1}, {log, std::log},
        {log2, std::log2}, {log10, std::log10}, {log1p, std::log1p}, {cbrt, std::cbrt},
        {asin, std::asin}, {acos, std::acos},   {atan, std::atan},   {tan, std::tan}};
    for (std::size_t i = 0; i < std::size(ones); ++i) {
        for (const double x : values) {
            if (std::isfinite(x) && std::fabs(x) > 0 && !std::isinf(ones[i].second(x)) &&
                !std::isnan(ones[i].second(x)))
                continue;  // the errors of these are tested above
            if (ones[i].first == static_cast<double (*)(double)>(tan) && std::isfinite(x) && std::fabs(x) > 1)
                continue;
            EXPECT_TRUE(same(ones[i].first(x), ones[i].second(x)))
                << i << " of " << x << ": " << ones[i].first(x) << " " << ones[i].second(x);
        }
    }
    for (const double x : values) {
        for (const double y : values) {
            const double right = std::pow(x, y), found = pow(x, y);
            EXPECT_TRUE(same(found, right) || std::fabs(found / right - 1) < 1e-15)
                << "pow of " << x << ", " << y << ": " << found << " " << right;
            const double angle = std::atan2(y, x), found_angle = atan2(y, x);
            EXPECT_TRUE(same(found_angle, angle) || std::fabs(found_angle / angle - 1) < 1e-15)
                << "atan2 of " << y << ", " << x << ": " << found_angle << " " << angle;
            const double length = std::hypot(x, y), found_length = hypot(x, y);
            EXPECT_TRUE(same(found_length, length) || std::fabs(found_length / length - 1) < 1e-15)
                << "hypot of " << x << ", " << y << ": " << found_length << " " << length;
        }
    }
    EXPECT_TRUE(same(sin(-0.0), -0.0) && same(cos(0.0), 1.0) && std::isnan(sin(kInfinity)));
    EXPECT_EQ(exp(0.0), 1.0);
    EXPECT_EQ(log10(1000.0), 3.0);
    EXPECT_EQ(log2(1024.0), 10.0);
    EXPECT_EQ(pow(2.0, -3.0), 0.125);
    EXPECT_EQ(exp2(-7.0), 1.0 / 128);
}

// Returns whether sines and cosines of floats are at most an ulp from those of doubles, rounded.
bool sines_agree(std::uint32_t bits) {
    const auto x = std::bit_cast<float>(bits);
    if (!std::isfinite(x)) return std::isnan(sin(x));
    const auto [s, c] = sin_cos(x);
    const auto [sin_x, cos_x] = sin_cos(static_cast<double>(x));
    const auto near = [](float value, double exact) {
        const float right = static_cast<float>(exact);
        return value == right || value == std::nextafter(right, 2.0F) ||
               value == std::nextafter(right, -2.0F);
    };
    return near(s, sin_x) && near(c, cos_x);
}
TEST(Elementary, SinesOfFloats_AreThoseOfDoubles) {
    for (std::uint64_t bits = 0; bits < (std::uint64_t{1} << 32); bits += 4099)
        ASSERT_TRUE(sines_agree(static_cast<std::uint32_t>(bits))) << bits;
}
TEST(Elementary, Nightly_SinesOfEveryFloat_AreThoseOfDoubles) {
    for (std::uint64_t bits = 0; bits < (std::uint64_t{1} << 32); ++bits)
        ASSERT_TRUE(sines_agree(static_cast<std::uint32_t>(bits))) << bits;
}

}  // namespace elementary_test
}  // namespace lucerna
