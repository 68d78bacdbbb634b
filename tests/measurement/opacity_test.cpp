#include "lights/measurement/opacity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "lights/bell.h"
#include "lights/measurement/acquire.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace opacity_test {

using testing::error_of;
using ::testing::HasSubstr;

TEST(Opacity, BothFilms_ScaledAndSubtracted_AreTheDual) {
    const Rig rig = testing::rig_b();
    const double plus = filter_scale(rig, FilterSign::positive);
    const double minus = filter_scale(rig, FilterSign::negative);
    double most[2] = {0, 0};
    for (int i = -220; i <= 220; ++i) {
        for (int j = -220; j <= 220; ++j) {
            const V2d x(i * 0.01 * rig.spacing.x, j * 0.01 * rig.spacing.y);
            const double p = filter_opacity(rig, FilterSign::positive, x);
            const double n = filter_opacity(rig, FilterSign::negative, x);
            ASSERT_GE(std::min(p, n), 0);
            ASSERT_LE(std::max(p, n), 1);
            ASSERT_EQ(std::min(p, n), 0);  // each point has one sign
            most[0] = std::max(most[0], p);
            most[1] = std::max(most[1], n);
            const double dual = bell_dual(i * 0.01) * bell_dual(j * 0.01) / rig.spacing.x / rig.spacing.y;
            ASSERT_NEAR(plus * p - minus * n, dual, 1e-9 * plus);
        }
    }
    // A film's whole range is used: the maximum lies at integer multiples of the spacing, which the grid
    // hits.
    EXPECT_NEAR(most[0], 1, 1e-12);
    EXPECT_NEAR(most[1], 1, 1e-12);
}

TEST(Opacity, ImagesOfAnotherRigOrNotFinite_AreRefused) {
    FilterImages images;
    images.rig = testing::rig_b();
    EXPECT_THAT(error_of([&] { field_of(images); }), HasSubstr("but the rig has"));
    images.positive.assign(images.rig.coefficients(), 1.0F);
    images.negative.assign(images.rig.coefficients(), 0.0F);
    images.flux = 1;
    const LightField field = field_of(images);
    EXPECT_NEAR(field.info().captured, field.flux(), 1e-9 * field.flux());
    EXPECT_NEAR(field.info().missed, 1 - field.flux(), 1e-9 * field.flux());
    images.negative[3] = NAN;
    EXPECT_THAT(error_of([&] { field_of(images); }), HasSubstr("finite"));
}

// ∫ Φ̃(x) Φ(x - m) dx = δ_m0 holds by the very nodes that measure: on whole panels, on parts of them, and on
// both together.
TEST(FilterAxis, DualAgainstBells_IsBiorthogonal) {
    const double spacing = 0.003;
    for (int rule = 3; rule <= 5; ++rule) {
        const FilterAxis axis(0.1, spacing, rule);
        std::vector<FilterNode> whole, parts;
        axis.add_range(0.1 - 2 * spacing, 0.1 + 2 * spacing, whole);
        for (const double cut :
             {-1.7, -1.66, -0.5, 0.1, 0.9, 2.0}) {  // the last interval ends at the filter's edge
            static double from = -2;
            if (cut == -1.7) from = -2;
            axis.add_range(0.1 + from * spacing, 0.1 + cut * spacing, parts);
            from = cut;
        }
        for (const auto* nodes : {&whole, &parts}) {
            for (int m = -3; m <= 3; ++m) {
                double sum = 0;
                for (const FilterNode& node : *nodes) {
                    const int i = -node.first;  // filter 0 among the node's four
                    if (i < 0 || i > 3) continue;
                    const auto at = static_cast<std::size_t>(i);
                    sum +=
                        (node.positive[at] - node.negative[at]) * testing::phi((node.x - 0.1) / spacing - m);
                }
                EXPECT_NEAR(sum, m == 0 ? 1 : 0, 1e-6) << m;
                if (nodes == &whole) {
                    EXPECT_NEAR(sum, m == 0 ? 1 : 0, 1e-12) << m;
                }
            }
        }
    }
}

TEST(FilterAxis, EachSign_IsIntegratedExactly) {
    // ∫|Φ̃| = 1.518, by a sum that does not use the nodes.
    double sum[2] = {0, 0};
    constexpr int kSteps = 400000;
    for (int i = 0; i < kSteps; ++i) {
        const double dual = bell_dual(-2 + 4 * (i + 0.5) / kSteps);
        sum[dual < 0] += std::fabs(dual) * 4 / kSteps;
    }
    EXPECT_NEAR(sum[0] + sum[1], 1.518, 1e-3);
    const FilterAxis axis(0, 1, 2);
    std::vector<FilterNode> nodes;
    axis.add_range(-2, 2, nodes);
    double got[2] = {0, 0};
    for (const FilterNode& node : nodes) {
        const int i = -node.first;
        if (i < 0 || i > 3) continue;
        got[0] += node.positive[static_cast<std::size_t>(i)];
        got[1] += node.negative[static_cast<std::size_t>(i)];
    }
    EXPECT_NEAR(got[0], sum[0], 1e-9);
    EXPECT_NEAR(got[1], sum[1], 1e-9);
}

// Returns an emitter on S that shines as a field does: L = h/g before the clamp.
EmitterModel emitter_of(const LightField& field) {
    EmitterModel emitter;
    emitter.outline = EmitterModel::Outline::rectangle;
    emitter.half_size = {1, 1};
    emitter.radiance = [&field, d = field.rig().distance](const V2d& p, const V3d& w) {
        const V2d on_m(p.x + w.x * d / w.z, p.y + w.y * d / w.z);
        return testing::brute_h(field, p, on_m) / field.rig().geometric_term(p, on_m);
    };
    emitter.flux = 1;
    return emitter;
}

double largest_difference(const LightField& a, const LightField& b) {
    double most = 0, largest = 0;
    for (std::size_t i = 0; i < a.coefficients().size(); ++i) {
        most = std::max(most, std::fabs(double{a.coefficients()[i]} - double{b.coefficients()[i]}));
        largest = std::max(largest, std::fabs(double{a.coefficients()[i]}));
    }
    return most / largest;
}

TEST(Acquire, FieldInTheBasis_ComesBack) {
    Monitor silent;
    for (const Rig& rig : {testing::rig_a(), testing::rig_b()}) {
        const LightField field = testing::random_field(rig, -1, 1, 7);
        const EmitterModel emitter = emitter_of(field);
        // One node per pixel suffices: the basis is constant within it.
        const LightField back = acquire(emitter, rig, {}, silent, {3, 1});
        EXPECT_LT(largest_difference(field, back), 1e-5);
        // Two nodes between knots cannot integrate a quadratic, and the test must detect that.
        EXPECT_GT(largest_difference(field, acquire(emitter, rig, {}, silent, {2, 1})), 1e-4);
    }
}

TEST(Acquire, OneBell_IsSeenByItsFilterAlone) {
    Monitor silent;
    for (const Rig& rig : {testing::rig_a(), testing::rig_b()}) {
        std::vector<float> e(rig.coefficients());
        const std::size_t one = rig.index(1, 1, 2, 3);
        e[one] = 1;
        const LightField field(rig, std::move(e));
        const LightField back = acquire(emitter_of(field), rig, {}, silent, {3, 1});
        for (std::size_t i = 0; i < back.coefficients().size(); ++i)
            ASSERT_NEAR(back.coefficients()[i], i == one ? 1 : 0, 1e-6) << i;
    }
}

}  // namespace opacity_test
}  // namespace lucerna
