#include "lights/bell.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <functional>

#include "engine/base/sampler.h"
#include "lights/bell_cell.h"
#include "lights/gauss.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace bell_test {

// Integrates over [from, to] in pieces of one half: exact for products of two quadratic pieces.
double integral(double from, double to, const std::function<double(double)>& f) {
    double sum = 0;
    for (double x = from; x < to; x += 0.5) {
        for (const GaussNode& node : gauss_rule(5)) sum += 0.5 * node.weight * f(x + 0.5 * node.x);
    }
    return sum;
}

TEST(Bell, Shifts_AnyPoint_AddUpToOne) {
    for (int i = 0; i <= 1000; ++i) {
        const double x = i / 1000.0;
        EXPECT_NEAR(bell(x) + bell(x - 1), 1.0, 1e-15);
    }
}

TEST(Bell, Joints_BothSides_ShareValueAndSlope) {
    constexpr double h = 1e-6;
    for (const double joint : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
        EXPECT_NEAR(bell(joint - h), bell(joint + h), 1e-5);
        const double below = (bell(joint) - bell(joint - h)) / h;
        const double above = (bell(joint + h) - bell(joint)) / h;
        EXPECT_NEAR(below, above, 1e-4) << joint;
    }
}

TEST(Bell, Overlaps_AgainstQuadrature_Agree) {
    for (int m = -3; m <= 3; ++m) {
        EXPECT_NEAR(bell_overlap(m), integral(-4, 4, [m](double x) { return bell(x) * bell(x - m); }), 1e-14)
            << m;
    }
}

TEST(BellDual, AgainstShiftedBells_IsBiorthogonal) {
    for (int m = -4; m <= 4; ++m) {
        const double product = integral(-2, 2, [m](double x) { return bell_dual(x) * bell(x - m); });
        EXPECT_NEAR(product, m == 0 ? 1.0 : 0.0, 1e-12) << m;
    }
}

TEST(BellDual, Values_OfTheDerivation_AreMet) {
    EXPECT_DOUBLE_EQ(bell_dual(0.0), 1009.0 / 736);
    EXPECT_NEAR(bell_dual(0.5), 0.576087, 1e-6);
    EXPECT_NEAR(bell_dual(1.0), -0.218750, 1e-6);
    EXPECT_NEAR(bell_dual(2.0), 49.0 / 736, 1e-15);
    EXPECT_EQ(bell_dual(2.0001), 0.0);
    EXPECT_NEAR(integral(-2, 2, [](double x) { return bell_dual(x); }), 1.0, 1e-14);
    double absolute = 0;
    for (int i = 0; i < 40000; ++i) absolute += std::fabs(bell_dual((i + 0.5) / 10000 - 2)) / 10000;
    EXPECT_NEAR(absolute, 1.518, 1e-3);
    EXPECT_NEAR(integral(-2, 2, [](double x) { return bell_dual(x) * bell_dual(x); }), kBellDualNorm2, 1e-14);
}

TEST(BellDual, WeightsOverAPoint_AreTheDualsThere) {
    for (int i = 0; i < 100; ++i) {
        const double f = i / 100.0;
        const auto weights = bell_dual_weights(f);
        for (int k = 0; k < 4; ++k)
            EXPECT_NEAR(weights[static_cast<std::size_t>(k)], bell_dual(f + 1 - k), 1e-14);
    }
}

TEST(BellIntegral, AgainstQuadrature_AgreesAndInverts) {
    for (int i = 0; i <= 2000; ++i) {
        const double x = i / 2000.0;
        double by_rule = 0;
        for (const auto& [from, to] : {std::pair{0.0, std::min(x, 0.5)}, std::pair{0.5, std::max(x, 0.5)}}) {
            for (const GaussNode& node : gauss_rule(3))
                by_rule += (to - from) * node.weight * bell(from + (to - from) * node.x);
        }
        EXPECT_NEAR(bell_integral(x), by_rule, 1e-14);
        EXPECT_NEAR(bell(inverse_bell(bell(x))), bell(x), 1e-14);
        // Near x = 1, F approaches its limit as (1 - x)³: x is accurate to the cube root of rounding, F
        // fully.
        const double back = inverse_bell_integral(bell_integral(x));
        EXPECT_NEAR(back, x, x < 0.999 ? 1e-9 : 1e-5);
        EXPECT_NEAR(bell_integral(back), bell_integral(x), 1e-14);
        const float y = 0.5F * static_cast<float>(x);
        EXPECT_NEAR(bell_integral(inverse_bell_integral(y)), y, 1e-6F);
    }
    EXPECT_EQ(inverse_bell_integral(0.0), 0.0);
    EXPECT_EQ(inverse_bell_integral(0.5), 1.0);
    EXPECT_EQ(inverse_bell_integral(0.7), 1.0);
}

TEST(GaussRule, Powers_UpToItsDegree_AreExact) {
    for (int n = 1; n <= kMaxGauss; ++n) {
        for (int power = 0; power < 2 * n; ++power) {
            double sum = 0;
            for (const GaussNode& node : gauss_rule(n)) sum += node.weight * std::pow(node.x, power);
            EXPECT_NEAR(sum, 1.0 / (power + 1), 1e-14) << n << " " << power;
        }
    }
}

BellCell cell_of(float a, float b, float c, float d, FilterBasis basis = FilterBasis::bell) {
    BellCell cell;
    cell.basis = basis;
    cell.e[0][0] = a, cell.e[0][1] = b, cell.e[1][0] = c, cell.e[1][1] = d;
    return cell;
}

const BellCell kCells[] = {cell_of(1, 2, 3, 4),      cell_of(1, 0, 0, 0),    cell_of(1, -1, -1, 1),
                           cell_of(-1, 1, 1, -1),    cell_of(1, -1, -1, -1), cell_of(0, -3, 5, -1),
                           cell_of(2, 1, -1, -2),    cell_of(1, -9, -9, -9), cell_of(-1, 3, 0.5F, 2),
                           cell_of(-5, -4, -3, 0.5F)};

// Returns the cells with bells and the same cells with hats.
std::vector<BellCell> all_cells() {
    std::vector<BellCell> cells;
    for (const FilterBasis basis : {FilterBasis::bell, FilterBasis::hat}) {
        for (BellCell cell : kCells) {
            cell.basis = basis;
            cells.push_back(cell);
        }
    }
    return cells;
}

TEST(HatCell, Value_AnyPlace_IsBilinearInterpolation) {
    const BellCell cell = cell_of(1, -2, 3, 0.5F, FilterBasis::hat);
    for (int i = 0; i <= 100; ++i) {
        const float x = static_cast<float>(i % 11) / 10, y = static_cast<float>(i / 11) / 10;
        EXPECT_NEAR(cell.value(x, y), (1 - x) * ((1 - y) * 1 + y * -2) + x * ((1 - y) * 3 + y * 0.5F), 1e-6F);
    }
}

TEST(HatBasis, Integral_AgainstItsDefinition_AgreesAndInverts) {
    for (int i = 0; i <= 1000; ++i) {
        const double x = i / 1000.0;
        EXPECT_NEAR(HatBasis::integral(x), 0.5 * (1 - sqr(1 - x)), 1e-15);
        EXPECT_NEAR(HatBasis::inverse(HatBasis::value(x)), x, 1e-15);
        const float y = 0.5F * static_cast<float>(x);
        EXPECT_NEAR(HatBasis::integral(double{HatBasis::inverse_integral(y)}), double{y}, 1e-7);
    }
}

TEST(BellCell, ClampedMean_AgainstFineGrid_Agrees) {
    for (const BellCell& cell : all_cells()) {
        constexpr int kSide = 1000;
        double sum = 0;
        for (int i = 0; i < kSide * kSide; ++i) {
            const float x = (static_cast<float>(i % kSide) + 0.5F) / kSide;
            const float y = (static_cast<float>(i / kSide) + 0.5F) / kSide;
            sum += std::max(0.0, double{cell.value(x, y)});
        }
        EXPECT_NEAR(cell.clamped_mean(), sum / kSide / kSide, 3e-5) << cell.e[0][0] << " " << cell.e[0][1];
    }
    EXPECT_EQ(cell_of(-1, -1, 0, -2).clamped_mean(), 0.0);
    EXPECT_EQ(cell_of(0, 0, 0, 0).clamped_mean(), 0.0);
}

RC_GTEST_PROP(BellCell, ClampedMean_OfAnyMembers_LiesBetweenSignedMeanAndPositivePart, ()) {
    const auto number = [] { return static_cast<float>(*rc::gen::inRange(-1000, 1000)) / 100; };
    const BellCell cell = cell_of(number(), number(), number(), number());
    double plus = 0;
    for (const auto& row : cell.e) {
        for (const float e : row) plus += 0.25 * std::max(0.0, double{e});
    }
    RC_ASSERT(cell.clamped_mean() >= cell.signed_mean() - 1e-6);
    RC_ASSERT(cell.clamped_mean() <= plus + 1e-6);
}

// Compares drawn points over a grid with the density of `truth` by a chi-square test.
testing::ChiSquare test_draws(const BellCell& cell, const BellCell& truth, bool by_inversion, int points) {
    constexpr int kSide = 12;
    constexpr int kFine = 20;
    std::vector<double> expected(kSide * kSide);
    double total = 0;
    for (int i = 0; i < kSide * kFine; ++i) {
        for (int j = 0; j < kSide * kFine; ++j) {
            const float x = (static_cast<float>(i) + 0.5F) / (kSide * kFine);
            const float y = (static_cast<float>(j) + 0.5F) / (kSide * kFine);
            const double h = std::max(0.0, double{truth.value(x, y)});
            expected[static_cast<std::size_t>(i / kFine * kSide + j / kFine)] += h;
            total += h;
        }
    }
    std::vector<std::uint64_t> observed(expected.size());
    for (double& e : expected) e *= points / total;
    // A bin that the edge of the clamped region cuts may have no midpoint with a positive density.
    for (double& e : expected) e = std::max(e, 1e-9);
    for (int i = 0; i < points; ++i) {
        Sampler sampler(7, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        const V2f at = by_inversion ? cell.draw_by_inversion(u) : cell.draw(u, sampler.bits());
        EXPECT_TRUE(at.x >= 0 && at.x <= 1 && at.y >= 0 && at.y <= 1);
        const auto bin = [](float x) { return std::min(kSide - 1, static_cast<int>(x * kSide)); };
        ++observed[static_cast<std::size_t>(bin(at.x) * kSide + bin(at.y))];
    }
    return testing::chi_square(observed, expected);
}

TEST(BellCell, Draw_AnySigns_FollowsTheClampedDensity) {
    for (const BellCell& cell : all_cells()) {
        EXPECT_TRUE(test_draws(cell, cell, false, 100000).accepted()) << cell.e[0][0] << " " << cell.e[0][1];
    }
}

TEST(BellCell, DrawByInversion_AnySigns_FollowsTheSameDensity) {
    for (const BellCell& cell : all_cells()) {
        EXPECT_TRUE(test_draws(cell, cell, true, 10000).accepted()) << cell.e[0][0] << " " << cell.e[0][1];
    }
}

TEST(BellCell, DrawTest_OfAnotherCell_IsRejected) {
    EXPECT_FALSE(test_draws(kCells[0], cell_of(1, 2, 3, 5), false, 100000).accepted());
    EXPECT_FALSE(test_draws(kCells[4], cell_of(1, -1, -1, -0.7F), false, 100000).accepted());
    // The points follow bells, the density that is tested has hats.
    EXPECT_FALSE(test_draws(kCells[0], cell_of(1, 2, 3, 4, FilterBasis::hat), false, 100000).accepted());
}

TEST(Bell, InverseIntegral_InSinglePrecision_IsThatInDouble) {
    float before = -1;
    for (int i = 0; i <= 100000; ++i) {
        const float y = 0.5F * static_cast<float>(i) / 100000;
        const float x = inverse_bell_integral(y);
        EXPECT_NEAR(double{x}, inverse_bell_integral(double{y}), 1.2e-7) << y;
        EXPECT_GE(x, before - 1.2e-7F);
        before = x;
    }
    EXPECT_EQ(inverse_bell_integral(0.0F), 0.0F);
    EXPECT_EQ(inverse_bell_integral(0.5F), 1.0F);
    EXPECT_EQ(inverse_bell_integral(2.0F), 1.0F);
    EXPECT_EQ(inverse_bell_integral(-1.0F), 0.0F);
}

}  // namespace bell_test
}  // namespace lucerna
