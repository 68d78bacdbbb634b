// The projected distance against the plain one, where the irradiance is known [photon-maps 2]. The figure of
// the same shapes is bench/figures/metric_bias.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "tests/support/lit_shapes.h"

namespace lucerna {
namespace {

using namespace testing;

enum : std::size_t { kEuclidean, kRatio1, kRatio15, kRatio2, kRatio4 };
constexpr std::uint32_t kPhotons = 1U << 20;

std::vector<double> bias(const LitShape& shape) {
    std::vector<double> result = mean_estimates(shape, KernelShape::epanechnikov, kPhotons);
    for (double& b : result) b -= shape.exact;
    return result;
}

TEST(MetricBias, ConcaveCorner_ProjectionLightensTheDarkLine_MoreSoWithARoomierBall) {
    for (const float t : {0.0F, 0.1F, 0.25F}) {
        const auto b = bias(concave_corner(t));
        EXPECT_LT(b[kRatio1], 0) << t;
        EXPECT_GT(b[kRatio15], b[kRatio1]) << t;
        EXPECT_GT(b[kRatio2], b[kRatio15]) << t;
        EXPECT_GT(b[kRatio4], b[kRatio2]) << t;
        RecordProperty(fmt::format("t{}", t), fmt::format("{:.3f}", fmt::join(b, " ")));
    }
}

TEST(MetricBias, LitFromBehind_IsExactlyZero) {
    for (const double b : bias(lit_from_behind())) EXPECT_EQ(b, 0);
}

}  // namespace
}  // namespace lucerna
