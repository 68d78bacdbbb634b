#include "photon/tangent_metric.h"

#include <gtest/gtest.h>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "photon/photon.h"

namespace lucerna {
namespace tangent_metric_test {

const V3f kUp(0, 0, 1);

V3f downwards(Sampler& sampler) {
    return -square_to_cosine_hemisphere(sampler.next2());
}

TEST(TangentMetric, FlatSurface_EqualsEuclidean) {
    Sampler sampler(1, Purpose::test, 0, 0);
    const V3f x(0.3F, 0.4F, 0.5F);
    const TangentMetric metric(x, kUp, MetricKind::projected, 1);
    for (int i = 0; i < 10'000; ++i) {
        const V3f p(sampler.next(), sampler.next(), x.z);
        const float r2 = (p - x).length2();
        EXPECT_NEAR(metric(p, downwards(sampler), r2), r2, 1e-6F * r2);
    }
}

TEST(TangentMetric, FlatSurfaceWithRoundedHeights_GrazingPhotonsStay) {
    // Heights are off by one unit in the last place, directions within 1e-6 of the plane: no photon may be
    // dropped.
    const V3f x(300, 400, 500);
    const TangentMetric metric(x, kUp, MetricKind::projected, 1);
    const float ulp = std::nextafter(500.0F, 1000.0F) - 500.0F;
    for (const float slope : {1e-2F, 1e-4F, 1e-6F, 1e-20F}) {
        const V3f d(std::sqrt(1 - slope * slope), 0, -slope);
        for (const float height : {-ulp, 0.0F, ulp}) {
            const V3f p = x + V3f(1, 0, height);
            const float d2 = metric(p, d, (p - x).length2());
            EXPECT_TRUE(std::isfinite(d2));
            EXPECT_NEAR(d2, 1, 0.02F);
        }
    }
}

TEST(TangentMetric, AnySlope_EqualsTheFormula) {
    // d² = a² - 2a (d·(x - x_i)) + |x - x_i|², in double.
    Sampler sampler(2, Purpose::test, 0, 0);
    for (int i = 0; i < 10'000; ++i) {
        const V3f x(sampler.next(), sampler.next(), sampler.next());
        const V3f p(sampler.next(), sampler.next(), sampler.next());
        const V3f n = square_to_sphere(sampler.next2());
        V3f d = square_to_sphere(sampler.next2());
        if (n.dot(d) > 0) d = -d;
        if (n.dot(d) > -2 * kGrazing) continue;
        const V3d v = V3d(x) - V3d(p);
        const double a = V3d(n).dot(v) / V3d(n).dot(V3d(d));
        const double expected = a * a - 2 * a * V3d(d).dot(v) + v.dot(v);
        const TangentMetric metric(x, n, MetricKind::projected, 1e6F);
        EXPECT_NEAR(metric(p, d, static_cast<float>(v.length2())), expected, 1e-3 * (a * a + 1));
    }
}

TEST(TangentMetric, PhotonFromBehind_NeverCounts) {
    for (const MetricKind kind : {MetricKind::projected, MetricKind::euclidean}) {
        const TangentMetric metric(V3f(0.0F), kUp, kind, 2);
        EXPECT_EQ(metric(V3f(0.0F), kUp, 0), INFINITY);
        EXPECT_EQ(metric(V3f(0.0F), V3f(1, 0, 0), 0), INFINITY);
    }
}

TEST(TangentMetric, ConcaveCorner_PhotonOnTheWallFillsTheDiscBehindIt) {
    // There is a wall at x = 0 above the floor z = 0; a ray towards the wall's foot meets the wall.
    const V3f d = V3f(-1, 0, -1).normalized();
    const V3f on_wall(0, 0, 0.1F);
    const V3f x(0.05F, 0, 0);
    const TangentMetric metric(x, kUp, MetricKind::projected, 4);
    EXPECT_NEAR(std::sqrt(metric(on_wall, d, (on_wall - x).length2())), 0.15F, 1e-5F);
}

TEST(TangentMetric, Ball_HoldsEveryPhotonThatCounts) {
    Sampler sampler(3, Purpose::test, 0, 0);
    const TangentMetric metric(V3f(0.0F), kUp, MetricKind::projected, 2);
    for (int i = 0; i < 10'000; ++i) {
        const V3f p = V3f(sampler.next(), sampler.next(), sampler.next()) * 2.0F - V3f(1.0F);
        const float r2 = p.length2();
        const float d2 = metric(p, downwards(sampler), r2);
        EXPECT_LE(r2, metric.ball2(d2) * 1.0001F);
    }
}

TEST(Kernel, EachShape_IntegratesToOneOverTheDisc) {
    for (const KernelShape shape : {KernelShape::constant, KernelShape::cone, KernelShape::epanechnikov}) {
        double sum = 0;
        constexpr int kSteps = 100'000;
        for (int i = 0; i < kSteps; ++i) {
            const double x = (i + 0.5) / kSteps;
            sum += 2 * M_PI * x * static_cast<double>(kernel(shape, static_cast<float>(x * x))) / kSteps;
        }
        EXPECT_NEAR(sum, 1, 1e-5);
    }
}

TEST(PackedDirection, RoundTrip_WithinOneTenThousandthOfARadian) {
    Sampler sampler(4, Purpose::test, 0, 0);
    float worst = 0;
    for (int i = 0; i < 100'000; ++i) {
        const V3f d = square_to_sphere(sampler.next2());
        const V3f back = PackedDirection(d).unpack();
        EXPECT_NEAR(back.length(), 1, 1e-6F);
        worst = std::max(worst, (back - d).length());
    }
    EXPECT_LT(worst, 1e-4F);
    for (const V3f& axis : {V3f(1, 0, 0), V3f(0, -1, 0), V3f(0, 0, 1), V3f(0, 0, -1)}) {
        EXPECT_LT((PackedDirection(axis).unpack() - axis).length(), 1e-4F);
    }
}

}  // namespace tangent_metric_test
}  // namespace lucerna
