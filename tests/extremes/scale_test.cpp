// The size and the place of a scene do not change its image: the same room at a millionth and at a million
// times its size, and moved by a hundred thousand times its size [docs/development/extremes.md].
//
// Scaled by a power of two, images are equal bit by bit: only exponents change. Scaled by a power of ten, or
// moved, they are equal up to rounding: a few decisions differ (a ray at an edge, a photon at a radius), so
// that a few pixels may differ by a few of their samples.
#include <gtest/gtest.h>

#include "tests/support/every_light.h"
#include "tests/support/same_image.h"

namespace lucerna {
namespace scale_test {

using namespace testing;

constexpr int kSpp = 4;

class Sizes : public ::testing::TestWithParam<Method> {};

TEST_P(Sizes, APowerOfTwo_SameImageToTheBit) {
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        const Image one = lights().image(lights().scene(light), GetParam(), kSpp);
        for (const int exponent : {-20, 20}) {
            const Placing placed{std::ldexp(1.0, exponent), V3d(0.0)};
            const Image scaled = lights().image(lights().scene(light, placed), GetParam(), kSpp);
            const Difference d = difference(one, scaled);
            EXPECT_TRUE(same(one, scaled))
                << light.name << " 2^" << exponent << ": " << d.pixels << " " << d.mean;
        }
    }
}

TEST_P(Sizes, AMillionthAndAMillion_SameImageToRounding) {
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        const Image one = lights().image(lights().scene(light), GetParam(), kSpp);
        for (const double scale : {1e-6, 1e6}) {
            const Image scaled = lights().image(lights().scene(light, {scale, V3d(0.0)}), GetParam(), kSpp);
            const Difference d = difference(one, scaled);
            EXPECT_LT(d.pixels, 0.03) << light.name << " " << scale << ": " << d.mean;
            EXPECT_LT(std::fabs(d.mean), 0.01) << light.name << " " << scale;
        }
    }
}

TEST_P(Sizes, FarAway_SameImageToRounding) {
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        const Image one = lights().image(lights().scene(light), GetParam(), kSpp);
        for (const double scale : {1e-6, 1.0, 1e6}) {
            const Placing placed{scale, 1e5 * scale * V3d(1, -2, 0.7)};
            const Image moved = lights().image(lights().scene(light, placed), GetParam(), kSpp);
            const Difference d = difference(one, moved);
            EXPECT_LT(d.pixels, 0.03) << light.name << " " << scale << ": " << d.mean;
            EXPECT_LT(std::fabs(d.mean), 0.01) << light.name << " " << scale;
        }
    }
}

// The tests above would notice a change: another seed gives another image.
TEST_P(Sizes, AnotherSeed_IsAnotherImage) {
    const LightCase light = lights().cases().front();
    const Image one = lights().image(lights().scene(light), GetParam(), kSpp, 1);
    const Image two = lights().image(lights().scene(light), GetParam(), kSpp, 2);
    EXPECT_GT(difference(one, two).pixels, 0.3);
}

INSTANTIATE_TEST_SUITE_P(Methods, Sizes, ::testing::ValuesIn(every_method()), name_of);

}  // namespace scale_test
}  // namespace lucerna
