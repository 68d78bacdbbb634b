// Tests the start of light paths: independent of batches, with lights in proportion to their power.
#include "photon/emission.h"

#include <gtest/gtest.h>

#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace emission_test {

using testing::SceneMaker;

// Returns a measured lamp in lumens beside lamps in watts: powers are compared as numbers, whatever their
// unit.
Scene three_lights() {
    SceneMaker make;
    Monitor silent;
    LightFieldInfo info;
    info.unit = FluxUnit::lumen;
    const LightField field = testing::random_field(testing::rig_a(), -0.2F, 1, 61, info);
    MeasuredSettings settings;
    settings.power = 30;
    make.light(make_point_light(V3f(0.0F), Rgb(10 / (4 * kPi))));
    make.light(make_measured_light(field, CellTable(field, {1}, silent), settings, silent));
    make.light(make_spot_light(V3f(1.0F), {0, 0, 1}, Rgb(1), {40, 40}));
    make.light(make_point_light(V3f(0.0F), Rgb(0.0F)));
    return make.build();
}

std::vector<std::optional<LightPathStart>> starts(const Scene& scene, std::uint32_t first, std::size_t n) {
    std::vector<std::optional<LightPathStart>> out(n);
    Emission(scene, 3, Purpose::emission, 7).start(first, out);
    return out;
}

TEST(Emission, Starts_InWhateverBatch_AreTheSame) {
    const Scene scene = three_lights();
    const auto whole = starts(scene, 1000, 700);
    Emission emission(scene, 3, Purpose::emission, 7);
    std::size_t visited = 0;
    emission.for_each(1000, 1700, [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
        ASSERT_EQ(path, 1000 + visited);
        const auto one = starts(scene, path, 1).front();
        const auto& of_whole = whole[visited++];
        ASSERT_TRUE(start && one && of_whole);
        for (const auto* other : {&*one, &*of_whole}) {
            EXPECT_EQ(start->light, other->light);
            EXPECT_EQ(start->cell, other->cell);
            EXPECT_EQ(start->from.p, other->from.p);
            EXPECT_EQ(start->d, other->d);
            EXPECT_EQ(start->power, other->power);
        }
    });
    EXPECT_EQ(visited, 700U);
}

TEST(Emission, Lights_AreChosenByPower_AndEvenly) {
    const Scene scene = three_lights();
    constexpr std::size_t kPaths = 4096;
    const double total = scene.picker().total_power();
    RunningStats flux[4];
    for (std::uint32_t first = 0; first < 16 * kPaths; first += kPaths) {
        double count[4] = {}, sum[4] = {};
        for (const auto& start : starts(scene, first, kPaths)) {
            ASSERT_TRUE(start);
            ++count[start->light];
            sum[start->light] += double{luminance(start->power)};
        }
        for (std::size_t i = 0; i < 4; ++i) {
            const double power = scene.lights()[i]->power();
            // Independent choices would be off by sqrt(4096 p (1-p)), which is up to 32; stratified ones by
            // one or two at each end of a light's interval.
            EXPECT_NEAR(count[i], kPaths * power / total, 2.5) << i;
            flux[i].add(sum[i] / kPaths);
        }
    }
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(flux[i].mean(), scene.lights()[i]->power(), 2e-3 * total) << i;
    }
    EXPECT_EQ(scene.lights()[1]->power(), 30);
}

TEST(Emission, NothingToEmit_IsNoStart) {
    SceneMaker make;
    make.light(make_point_light(V3f(0.0F), Rgb(0.0F)));
    for (const auto& start : starts(make.build(), 0, 10)) EXPECT_FALSE(start);
    for (const auto& start : starts(SceneMaker().build(), 0, 10)) EXPECT_FALSE(start);
    starts(SceneMaker().build(), 0, 0);
}

}  // namespace emission_test
}  // namespace lucerna
