// Compares the projected with the Euclidean distance where the irradiance is known [Lastra 2002; Goesele
// 2003, 5.2]. bench/figures/metric_bias draws the same shapes; numbers are fractions of the full irradiance,
// the radius is 1.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "photon/density_estimate.h"
#include "tests/support/lit_shapes.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace metric_bias_test {

using namespace testing;

enum : std::size_t { kEuclidean, kRatio1, kRatio15, kRatio2, kRatio4, kRatio8 };
constexpr std::uint32_t kPhotons = 1U << 19;

std::vector<double> bias(const LitShape& shape) {
    std::vector<double> result = mean_estimates(shape, KernelShape::epanechnikov, kPhotons);
    for (double& b : result) b -= shape.exact;
    ::testing::Test::RecordProperty(fmt::format("{} {} {}", shape.name, shape.size, shape.t),
                                    fmt::format("{:.3f}", fmt::join(result, " ")));
    return result;
}

// The larger the ball, the more of the wall's photons fill the disc behind it.
TEST(MetricBias, ConcaveCorner_DarkLineFadesWithTheRatio) {
    for (const float t : {0.0F, 0.1F}) {
        const auto b = bias(concave_corner(t));
        EXPECT_LT(b[kRatio1], -0.17) << t;
        for (std::size_t i = kRatio15; i <= kRatio8; ++i) EXPECT_GT(b[i], b[i - 1]) << t;
        EXPECT_GT(b[kRatio2], -0.15) << t;
        EXPECT_GT(b[kRatio4], -0.085) << t;
        EXPECT_GT(b[kRatio8], -0.05) << t;
    }
}

// With the Euclidean distance the density of the wall is taken for the floor's.
TEST(MetricBias, CornerInSteepOrFlatLight_PlainDistanceIsWrongByAThird_ProjectedIsNot) {
    const auto steep = bias(corner_in_sunlight(0.1F, 20));
    EXPECT_LT(steep[kEuclidean], -0.2);
    EXPECT_GT(steep[kRatio2], -0.05);
    EXPECT_NEAR(steep[kRatio4], 0, 0.01);
    const auto flat = bias(corner_in_sunlight(0.1F, 60));
    EXPECT_GT(flat[kEuclidean], 0.4);
    EXPECT_NEAR(flat[kRatio1], 0, 0.02);
    EXPECT_NEAR(flat[kRatio2], 0, 0.02);
}

TEST(MetricBias, ConvexEdge_NothingFillsTheOverhang) {
    const auto b = bias(convex_edge(0.25F));
    EXPECT_NEAR(b[kEuclidean], -0.08, 0.02);
    EXPECT_NEAR(b[kRatio1], -0.21, 0.02);
    EXPECT_NEAR(b[kRatio2], -0.18, 0.02);
    EXPECT_NEAR(b[kRatio8], -0.16, 0.02);
}

// On curved surfaces the disc leaves the surface, and photons that cross it land outside the ball: where the
// radius of curvature is not much larger than the estimate's, the Euclidean distance is better. Both errors
// fall with the square of the curvature.
TEST(MetricBias, SphereAndThinCylinder_PlainDistanceIsCloser) {
    for (const bool inside : {true, false}) {
        const auto wide = bias(sphere(2, inside));
        EXPECT_NEAR(wide[kEuclidean], -0.021, 0.01);
        EXPECT_NEAR(wide[kRatio2], -0.11, 0.015);
        const auto wider = bias(sphere(5, inside));
        EXPECT_NEAR(wider[kEuclidean], 0, 0.01);
        EXPECT_NEAR(wider[kRatio2], -0.02, 0.01);
        EXPECT_NEAR(wider[kRatio1], -0.08, 0.01);  // the ball is no wider than the disc, and cuts it
    }
    const auto wire = bias(cylinder(0.5F));
    EXPECT_NEAR(wire[kEuclidean], -0.095, 0.02);
    EXPECT_NEAR(wire[kRatio2], -0.305, 0.02);
}

// A large ball has its price: photons on top of a shelf count as light on the floor below it.
TEST(MetricBias, DarkFloorUnderALitShelf_LeaksBelowTheBallsHeight) {
    const auto low = bias(under_shelf(1.5F));
    EXPECT_EQ(low[kEuclidean], 0);
    EXPECT_EQ(low[kRatio1], 0);
    EXPECT_NEAR(low[kRatio2], 0.16, 0.03);
    EXPECT_NEAR(low[kRatio4], 0.73, 0.03);
    const auto high = bias(under_shelf(3));
    EXPECT_EQ(high[kRatio2], 0);
    EXPECT_GT(high[kRatio4], 0.15);
}

TEST(MetricBias, LitFromBehind_IsExactlyZero) {
    for (const double b : bias(lit_from_behind())) EXPECT_EQ(b, 0);
}

struct ProbedShape {
    LitShape shape;
    Scene scene;
    double most;  // largest error of the corrected estimate
};

std::vector<ProbedShape> probed_shapes() {
    std::vector<ProbedShape> all;
    const float far = 2 * kShapeReach;
    {
        SceneMaker make;
        make.quad({0, -far, 0}, {far, 0, 0}, {0, 2 * far, 0}, make.diffuse(Rgb(0.5F)));
        make.quad({0, -far, 0}, {0, 2 * far, 0}, {0, 0, far}, make.diffuse(Rgb(0.5F)));
        all.push_back({concave_corner(0.1F), make.build(), 0.04});
    }
    {
        SceneMaker make;
        make.quad({-far, -far, 0}, {far, 0, 0}, {0, 2 * far, 0}, make.diffuse(Rgb(0.5F)));
        make.quad({0, -far, -far}, {0, 2 * far, 0}, {0, 0, far}, make.diffuse(Rgb(0.5F)));
        all.push_back({convex_edge(0.25F), make.build(), 0.04});
    }
    {
        SceneMaker make;
        make.sphere(V3f(0.0F), 2, make.diffuse(Rgb(0.5F)));
        all.push_back({sphere(2, false), make.build(), 0.04});
    }
    return all;
}

// The probes correct what is missing behind walls, over edges and at curved surfaces.
TEST(MetricBias, WithProbes_CornersEdgesAndCurvesComeOutRight) {
    for (const ProbedShape& probed : probed_shapes()) {
        Photons deposited;
        constexpr std::uint32_t kDeposited = 200'000;
        const auto power = static_cast<float>(probed.shape.area / kDeposited);
        for (std::uint32_t i = 0; i < kDeposited; ++i) {
            Sampler sampler = Sampler::stratified(3, Purpose::test, 0, i);
            const DepositedPhoton photon = probed.shape.photon(sampler);
            deposited.add(photon.p, PackedDirection(photon.n),
                          {PackedDirection(photon.d), Rgb(power), 0, kNoCell});
        }
        const PhotonMap map(deposited);
        double none = 0, mended = 0;
        constexpr int kPlaces = 512;  // with different probes in the same light
        for (int i = 0; i < kPlaces; ++i) {
            const V3f x = probed.shape.x + V3f(0, 1e-4F * static_cast<float>(i), 0);
            const V3f on = probed.shape.name == "outside sphere" ? 2.0F * x.normalized() : x;
            DensityEstimateSettings settings{
                0, 1, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
            const SurfacePoint at{on, probed.shape.n, surface_error(on, 1)};
            none += static_cast<double>(DensityEstimate(map, settings).irradiance(at).value.x) / kPlaces;
            settings.boundary = Boundary::probes;
            const Probing probing{probed.scene, Sampler(4, Purpose::test, 0, static_cast<std::uint64_t>(i))};
            mended +=
                static_cast<double>(DensityEstimate(map, settings, probing).irradiance(at).value.x) / kPlaces;
        }
        EXPECT_LT(none, 0.93) << probed.shape.name;
        EXPECT_NEAR(mended, 1, probed.most) << probed.shape.name;
        RecordProperty(probed.shape.name, fmt::format("{:.3f} -> {:.3f}", none, mended));
    }
}

}  // namespace metric_bias_test
}  // namespace lucerna
