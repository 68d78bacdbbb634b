// Lights of any power: the image is proportional to it, from 1e-20 to 1e20 [docs/development/extremes.md].
#include <gtest/gtest.h>

#include "tests/support/every_light.h"

namespace lucerna {
namespace power_test {

using namespace testing;

constexpr int kSpp = 4;

class Powers : public ::testing::TestWithParam<Method> {};

TEST_P(Powers, FromTiniestToHugest_ImageIsInProportion) {
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        const Image one = lights().image(lights().scene(light), GetParam(), kSpp);
        EXPECT_TRUE(is_finite(one)) << light.name;
        for (const double power : {1e-20, 1e20}) {
            const Image image = lights().image(lights().scene(light, {}, power), GetParam(), kSpp);
            EXPECT_TRUE(is_finite(image)) << light.name << " " << power;
            const Difference d = difference(one, image, 1 / power);
            EXPECT_LT(d.pixels, 0.03) << light.name << " " << power << ": " << d.mean;
            EXPECT_LT(std::fabs(d.mean), 0.01) << light.name << " " << power;
        }
    }
}

// In a room of a millionth of the size a light of the same radiance has 1e-12 times the flux, in one of a
// million times the size 1e12 times: both extremes are combined.
TEST_P(Powers, FaintInATinyRoomAndBrightInAHugeOne_ImageIsInProportion) {
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        const Image one = lights().image(lights().scene(light), GetParam(), kSpp);
        for (const auto& [scale, power] : {std::pair(1e-6, 1e-20), std::pair(1e6, 1e15)}) {
            const Image image =
                lights().image(lights().scene(light, {scale, V3d(0.0)}, power), GetParam(), kSpp);
            EXPECT_TRUE(is_finite(image)) << light.name << " " << power;
            const Difference d = difference(one, image, 1 / power);
            EXPECT_LT(d.pixels, 0.03) << light.name << " " << power << ": " << d.mean;
            EXPECT_LT(std::fabs(d.mean), 0.01) << light.name << " " << power;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Methods, Powers, ::testing::ValuesIn(every_method()), name_of);

}  // namespace power_test
}  // namespace lucerna
