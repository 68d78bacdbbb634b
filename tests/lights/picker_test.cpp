#include "lights/light_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "lights/analytic.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace picker_test {

using testing::chi_square;

std::vector<std::unique_ptr<Light>> lights_of(const std::vector<float>& powers) {
    std::vector<std::unique_ptr<Light>> lights;
    for (const float power : powers) lights.push_back(make_point_light({0, 0, 0}, Rgb(power / (4 * kPi))));
    return lights;
}

TEST(LightPicker, NoLightOrNoPower_PicksNone) {
    EXPECT_FALSE(LightPicker().pick(0.5F));
    EXPECT_EQ(LightPicker().total_power(), 0);
    const auto dark = lights_of({0, 0});
    const LightPicker picker(dark);
    EXPECT_FALSE(picker.pick(0.5F));
    EXPECT_EQ(picker.probability(1), 0);
}

TEST(LightPicker, ManyPicks_FollowPower) {
    const std::vector<float> powers = {1, 0, 5, 0.01F, 3};
    const auto lights = lights_of(powers);
    const LightPicker picker(lights);
    EXPECT_NEAR(picker.total_power(), 9.01, 1e-5);
    constexpr int kPicks = 200000;
    std::vector<std::uint64_t> counts(powers.size());
    std::vector<std::uint64_t> rest(16);
    Sampler s(1, Purpose::test, 0, 0);
    for (int i = 0; i < kPicks; ++i) {
        const auto pick = picker.pick(s.next());
        ASSERT_TRUE(pick);
        ++counts[pick->light];
        EXPECT_EQ(pick->probability, picker.probability(pick->light));
        ++rest[static_cast<std::size_t>(16 * pick->remainder)];
    }
    std::vector<double> expected;
    for (const float power : powers) expected.push_back(static_cast<double>(power) / 9.01 * kPicks);
    EXPECT_TRUE(chi_square(counts, expected).accepted());
    EXPECT_TRUE(chi_square(rest, std::vector<double>(16, kPicks / 16.0)).accepted());
    EXPECT_EQ(counts[1], 0U);
    // The same test rejects a light with a probability wrong by a twentieth.
    expected[0] *= 1.05, expected[2] -= 0.05 / 9.01 * kPicks;
    EXPECT_FALSE(chi_square(counts, expected).accepted());
}

TEST(LightPicker, Probabilities_SumToOne) {
    const auto lights = lights_of({1, 2, 0, 1e-6F, 1e6F});
    const LightPicker picker(lights);
    double sum = 0;
    for (std::uint32_t i = 0; i < 5; ++i) sum += static_cast<double>(picker.probability(i));
    EXPECT_NEAR(sum, 1, 1e-6);
}

TEST(LightPicker, PowerThatIsNotANumber_IsRefusedByName) {
    for (const float bad : {NAN, INFINITY, -1.0F}) {
        const auto lights = lights_of({1, bad});
        try {
            LightPicker{lights};
            ADD_FAILURE() << bad;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("light 1 (point)"), std::string::npos) << error.what();
        }
    }
}

}  // namespace picker_test
}  // namespace lucerna
