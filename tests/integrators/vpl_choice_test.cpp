// Tests that the mean of the indirect light is the same whether all VPLs of a set get a shadow ray or some by
// Russian roulette.
#include <gtest/gtest.h>

#include <array>
#include <optional>

#include "engine/vpl/igi_vpls.h"
#include "tests/support/materials.h"
#include "tests/support/media_methods.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace vpl_choice_test {

using testing::Colour;

IgiSettings few_sets() {
    IgiSettings igi;
    igi.nlights = 32;
    igi.nsets = 4;
    igi.mindist = 0.1F;
    igi.gather_samples = 0;
    return igi;
}
IgiSettings every_light() {
    IgiSettings igi = few_sets();
    igi.shadow_rays = 0;
    return igi;
}

struct Way {
    const char* name;
    IgiSettings settings;
};
std::vector<Way> ways() {
    IgiSettings rays = few_sets(), one = rays, note = rays;
    one.shadow_rays = 1;
    note.rr_threshold = 0.05F;
    return {{"four rays", rays}, {"one ray", one}, {"by a threshold", note}};
}

// Samples the radiance all over the small Cornell box, except its lamp.
Colour look(const Scene& scene, const IgiSettings& settings, int samples) {
    return testing::radiance(scene, settings, samples, [](const V2f& u) {
        return testing::from_to({0.5F, 0.5F, -1.4F}, {u.x, 0.8F * u.y, 0});
    });
}

double sigmas_apart(const Colour& a, const Colour& b) {
    double most = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double sigma = std::hypot(a[k].standard_error(), b[k].standard_error());
        most = std::max(most, std::fabs(a[k].mean() - b[k].mean()) / sigma);
    }
    return most;
}

void expect_all_ways_agree(const Scene& scene, int samples) {
    const Colour truth = look(scene, every_light(), 2 * samples);
    for (const Way& way : ways()) {
        EXPECT_LT(sigmas_apart(look(scene, way.settings, samples), truth), 4) << way.name;
    }
    // The comparison must detect a third less light.
    IgiSettings wrong = few_sets();
    wrong.indirect_scale = 0.67F;
    EXPECT_GT(sigmas_apart(look(scene, wrong, samples), truth), 4);
}

// Rounding never leads past the last set, for either half of the samples, and each set is chosen equally
// often.
TEST(ChosenSet, OfAnyNumber_IsOneOfTheHalfsOwn) {
    constexpr float kLast = 0x1.fffffep-1F;
    for (const std::size_t sets : {1U, 2U, 64U, 1024U}) {
        EXPECT_EQ(chosen_set(kLast, std::nullopt, sets), sets - 1);
        EXPECT_EQ(chosen_set(0, std::nullopt, sets), 0U);
        EXPECT_EQ(chosen_set(kLast, 1, sets), sets - 1);
        EXPECT_EQ(chosen_set(0, 1, sets), sets / 2);
        EXPECT_EQ(chosen_set(kLast, 0, sets), sets > 1 ? sets / 2 - 1 : 0);
    }
    std::array<int, 8> chosen{};
    for (int i = 0; i < 64; ++i)
        ++chosen[chosen_set((static_cast<float>(i / 2) + 0.5F) / 32, i % 2, chosen.size())];
    for (const int times : chosen) EXPECT_EQ(times, 8);
}

TEST(VplChoice, DiffuseBox_AllWaysAgree) {
    expect_all_ways_agree(testing::small_cornell(), 20'000);
}

TEST(VplChoice, Varnish_AllWaysAgree) {
    const auto add_plate = [](testing::SceneMaker& make) {
        const auto varnished = make.material(testing::coated(testing::grey(0.5F), 0.3F));
        make.quad({0.1F, 0.01F, 0.1F}, {0, 0, 0.8F}, {0.8F, 0, 0}, varnished);
    };
    expect_all_ways_agree(testing::small_cornell_with(add_plate), 20'000);
}

TEST(VplChoice, Fog_AllWaysAgree) {
    expect_all_ways_agree(testing::foggy_cornell(1, 0.5F), 10'000);
}

TEST(VplChoice, Clamp_AllWaysAgree) {
    const Scene scene = testing::small_cornell();
    IgiSettings all = every_light();
    all.glimit = 2;
    const Colour truth = look(scene, all, 40'000);
    for (Way& way : ways()) {
        way.settings.glimit = 2;
        EXPECT_LT(sigmas_apart(look(scene, way.settings, 20'000), truth), 4) << way.name;
    }
}

TEST(VplChoice, RelativeRoulette_TheSameInAnyUnit) {
    // Lamps a thousand times brighter, or a scene a thousand times smaller, change no decision of the
    // roulette.
    const auto looked = [](float power, float size) {
        testing::SceneMaker make;
        make.room(V3f(size), make.diffuse(Rgb(0.5F)));
        make.light(make_point_light(size * V3f(0.5F, 0.75F, 0.5F), Rgb(power)));
        const Scene scene = make.build();
        IgiSettings igi = few_sets();
        igi.mindist = 0.125F * size;
        Colour stats = testing::radiance(scene, igi, 200, [&](const V2f& u) {
            return testing::from_to(size * V3f(0.5F, 0.25F, 0.125F), size * V3f(u.x, u.y, 1));
        });
        return stats[1].mean();
    };
    const double usual = looked(1, 1);
    EXPECT_NEAR(looked(1024, 1) / usual, 1024, 1e-3);
    EXPECT_NEAR(looked(1, 1.0F / 1024) / usual, 1024 * 1024, 1e3);
}

}  // namespace vpl_choice_test
}  // namespace lucerna
