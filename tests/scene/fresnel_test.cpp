#include "engine/scene/fresnel.h"

#include <gtest/gtest.h>

namespace lucerna {
namespace fresnel_test {

TEST(Fresnel, Dielectric_KnownAngles_HasKnownValues) {
    EXPECT_NEAR(fresnel_dielectric(1, 1.5F).reflectance, 0.04F, 1e-7F);
    EXPECT_NEAR(fresnel_dielectric(1, 1 / 1.5F).reflectance, 0.04F, 1e-7F);
    EXPECT_EQ(fresnel_dielectric(0, 1.5F).reflectance, 1);
    // At Brewster's angle, tan = η, only the perpendicular half is reflected: ((1 - η²)/(1 + η²))² of it.
    const float brewster = std::cos(std::atan(1.5F));
    EXPECT_NEAR(fresnel_dielectric(brewster, 1.5F).reflectance, 0.5F * sqr((1 - 2.25F) / (1 + 2.25F)), 1e-6F);
    // Reflection is total beyond the critical angle, sin = 1/1.5.
    const float critical = std::sqrt(1 - 1 / 2.25F);
    EXPECT_EQ(fresnel_dielectric(critical - 1e-4F, 1 / 1.5F).reflectance, 1);
    EXPECT_LT(fresnel_dielectric(critical + 1e-4F, 1 / 1.5F).reflectance, 1);
}

TEST(Fresnel, Dielectric_FromTheOtherSide_IsTheSame) {
    for (float c = 0.01F; c < 1; c += 0.01F) {
        const auto there = fresnel_dielectric(c, 1.7F);
        const auto back = fresnel_dielectric(there.cos_t, 1 / 1.7F);
        EXPECT_NEAR(there.reflectance, back.reflectance, 1e-4F);
        EXPECT_NEAR(back.cos_t, c, 1e-4F);
    }
}

TEST(Fresnel, Conductor_KnownCases_HasKnownValues) {
    for (float c = 0; c <= 1; c += 0.01F) {  // without absorption it equals a dielectric
        EXPECT_NEAR(fresnel_conductor(c, 1.5F, 0.0F), fresnel_dielectric(c, 1.5F).reflectance, 1e-5F) << c;
    }
    const float n = 0.2F;
    const float k = 3.9F;
    EXPECT_NEAR(fresnel_conductor(1, n, k), (sqr(n - 1) + k * k) / (sqr(n + 1) + k * k), 1e-6F);
    EXPECT_EQ(fresnel_conductor(0.5F, 0.0F, 0.0F), 1);
    EXPECT_EQ(fresnel_conductor(1, 0.0F, 0.0F), 1);
    EXPECT_EQ(fresnel_conductor(0, 1.0F, 0.0F), 1);
    EXPECT_EQ(fresnel_conductor(0.5F, 1.0F, 0.0F), 0);
    EXPECT_NEAR(fresnel_conductor(0.5F, 1e30F, 1e30F), 1, 1e-6F);
}

}  // namespace fresnel_test
}  // namespace lucerna
