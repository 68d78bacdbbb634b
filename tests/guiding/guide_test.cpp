#include "engine/guiding/guide.h"

#include <gtest/gtest.h>

#include "photon/build_maps.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace guide_test {

using testing::SceneMaker;

// Holds the choices that a guide refers to.
struct Tallied {
    std::vector<Guide::Choice> choices;
    float defensive_weight;
    Guide guide;

    explicit Tallied(std::span<const PartSample> samples)
        : defensive_weight(make_histogram(samples, choices)), guide(choices, defensive_weight) {}
};

std::vector<PartSample> samples() {
    // The samples are of light 3 in two cells and of light 1 without cells; one photon has no weight.
    return {{3, 7, 1, 0.1F}, {1, kNoCell, 2, 0.1F}, {3, 2, 0.5F, 0.1F},
            {3, 7, 3, 0.1F}, {1, kNoCell, 1, 0.1F}, {9, 0, 0, 0.1F}};
}

TEST(Guide, Choices_AreTheSamplesByLightAndPart) {
    const Tallied tallied(samples());
    const Guide& guide = tallied.guide;
    ASSERT_EQ(guide.choices().size(), 4U);
    const std::tuple<std::uint32_t, CellId, float> expected[] = {
        {1, kNoCell, 3 / 7.5F}, {3, 2, 0.5F / 7.5F}, {3, 7, 4 / 7.5F}, {9, 0, 0.0F}};
    for (std::size_t i = 0; i < 4; ++i) {
        const auto& [light, part, probability] = expected[i];
        EXPECT_EQ(guide.choices()[i].light, light);
        EXPECT_EQ(guide.choices()[i].part, part);
        EXPECT_NEAR(guide.choices()[i].probability, probability, 1e-6F);
        EXPECT_EQ(guide.probability(light, part), guide.choices()[i].probability);
    }
    EXPECT_EQ(guide.probability(3, 3), 0);
    EXPECT_EQ(guide.probability(0, 0), 0);
    EXPECT_EQ(guide.probability(10, 0), 0);
}

TEST(Guide, Draws_ComeInProportion_AndTheTestSeesWhenTheyDoNot) {
    const Tallied tallied(samples());
    const Guide& guide = tallied.guide;
    constexpr int kDraws = 40000;
    std::vector<std::uint64_t> observed(guide.choices().size());
    for (int i = 0; i < kDraws; ++i) {
        Sampler sampler(3, Purpose::test, 0, static_cast<std::uint64_t>(i));
        ++observed[static_cast<std::size_t>(&guide.draw(sampler.next()) - guide.choices().data())];
    }
    std::vector<double> expected;
    for (const Guide::Choice& choice : guide.choices()) {
        expected.push_back(kDraws * double{choice.probability});
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
    std::swap(expected[0], expected[2]);
    EXPECT_FALSE(testing::chi_square(observed, expected).accepted());
}

TEST(Guide, WithoutWeight_IsEmpty) {
    EXPECT_TRUE(Guide().empty());
    EXPECT_EQ(Guide().defensive_weight(), 1);
    EXPECT_TRUE(Tallied(std::vector<PartSample>{}).guide.empty());
    EXPECT_TRUE(Tallied(std::vector<PartSample>{{0, 0, 0, 1}, {1, 0, 0, 1}}).guide.empty());
    EXPECT_EQ(Guide().probability(0, 0), 0);
    EXPECT_EQ(Tallied(std::vector<PartSample>{{0, 0, 0, 1}}).defensive_weight, 1);
}

// Returns the mean defensive weight for photons of `kinds` equally probable choices, of which only the first
// `lit` arrive.
float mean_defensive_weight(int kinds, int lit, int photons) {
    RunningStats stats;
    for (std::uint64_t i = 0; i < 2000; ++i) {
        Sampler sampler(4, Purpose::test, 0, i);
        std::vector<PartSample> drawn;
        for (int k = 0; k < photons; ++k) {
            const auto part = static_cast<CellId>(sampler.next() * static_cast<float>(lit));
            drawn.push_back({0, part, 1, 1 / static_cast<float>(kinds)});
        }
        stats.add(double{Tallied(drawn).defensive_weight});
    }
    return static_cast<float>(stats.mean());
}

TEST(Guide, DefensiveWeight_IsLargeWherePhotonsSayNothingNew_AndSmallWhereTheyAgree) {
    EXPECT_GT(mean_defensive_weight(40, 40, 24), 0.85F);
    EXPECT_GT(mean_defensive_weight(400, 400, 24), 0.9F);
    EXPECT_LT(mean_defensive_weight(40, 1, 24), 0.02F);
    EXPECT_LT(mean_defensive_weight(40, 4, 24), 0.1F);
    // One photon is not enough to learn from.
    EXPECT_EQ(mean_defensive_weight(40, 1, 1), 1);
    // Neither are three photons of different choices.
    const Tallied lone(std::vector<PartSample>{{0, 0, 1, 0.1F}, {0, 1, 1, 0.1F}, {1, 0, 1, 0.1F}});
    EXPECT_EQ(lone.defensive_weight, 1);
}

// The defensive weight is the share f of a mixture that maximizes the likelihood of the photons.
TEST(Guide, DefensiveWeight_IsTheMaximumOfTheLikelihood) {
    const std::vector<PartSample> some{{0, 0, 1, 0.1F}, {0, 0, 1, 0.1F}, {0, 0, 1, 0.1F}, {0, 1, 1, 0.2F},
                                       {0, 2, 1, 0.3F}, {0, 2, 1, 0.3F}, {0, 3, 1, 0.05F}};
    const auto log_likelihood = [](double f) {
        const auto one = [f](double plain, double others) {
            return std::log(f * plain + (1 - f) * others / 6);
        };
        return 3 * one(0.1, 2) + one(0.2, 0) + 2 * one(0.3, 1) + one(0.05, 0);
    };
    double best = 0.001;
    for (double f = 0.001; f < 1; f += 0.001) {
        if (log_likelihood(f) > log_likelihood(best)) best = f;
    }
    EXPECT_NEAR(double{Tallied(some).defensive_weight}, best, 0.01);
}

// Returns two point lights, one on either side of a wall.
Scene two_chambers() {
    SceneMaker make;
    const auto white = make.diffuse(Rgb(0.5F));
    make.quad({-2, 0, -1}, {0, 0, 2}, {4, 0, 0}, white);
    make.quad({0, 0, -1}, {0, 2, 0}, {0, 0, 2}, white);
    make.quad({-2, 2, -1}, {4, 0, 0}, {0, 0, 2}, white);
    make.light(make_point_light({-1, 1, 0}, Rgb(1.0F)));
    make.light(make_point_light({1, 1, 0}, Rgb(1.0F)));
    return make.build();
}

TEST(GuideMap, BesideAWall_OnlyTheLightOfThisSideIsNamed) {
    const Scene scene = two_chambers();
    Monitor silent;
    const GuideMap guides = build_guides(scene, {20'000, 5, 0, {}}, Workers{2}, silent);
    for (const float x : {-1.5F, -0.5F, 0.5F, 1.5F}) {
        const Guide guide = guides.at({x, 0, 0.2F}, {0, 1, 0});
        ASSERT_EQ(guide.choices().size(), 1U) << x;
        EXPECT_EQ(guide.choices()[0].light, x < 0 ? 0U : 1U);
        EXPECT_EQ(guide.choices()[0].part, kNoCell);
        EXPECT_EQ(guide.choices()[0].probability, 1);
    }
    // The floor's other side is dark.
    EXPECT_TRUE(guides.any_near({1, 0, 0}, {0, 1, 0}));
    EXPECT_FALSE(guides.any_near({1, 0, 0}, {0, -1, 0}));
    EXPECT_TRUE(guides.at({1, 0, 0}, {0, -1, 0}).empty());
}

TEST(Guide, TalliesBehindEachOther_AreApart) {
    std::vector<Guide::Choice> choices;
    make_histogram(samples(), choices);
    const std::size_t first = choices.size();
    make_histogram(std::vector<PartSample>{{5, 1, 2, 0.5F}, {4, 1, 6, 0.5F}}, choices);
    ASSERT_EQ(choices.size(), first + 2);
    EXPECT_EQ(choices[first].light, 4U);
    EXPECT_EQ(choices[first].probability, 0.75F);
    EXPECT_EQ(choices[first].upto, 0.75F);
    EXPECT_EQ(choices[first + 1].upto, 1);
}

// With k = 1 every photon has a cached distribution of its own.
TEST(GuideMap, AtAPhoton_ItsOwnLightIsNamed_AndElsewhereTheNearestsThatFacesThisWay) {
    const Scene scene = two_chambers();
    Monitor silent;
    GuideSettings own;
    own.k = 1;
    const GuideMap guides = build_guides(scene, {2000, 5, 0, own}, Workers{2}, silent);
    const PhotonMap& map = guides.map();
    ASSERT_EQ(guides.distributions(), map.size());
    for (std::size_t i = 0; i < map.size(); i += 7) {
        const Guide guide = guides.at(map.positions()[i], map.normals()[i].unpack());
        ASSERT_EQ(guide.choices().size(), 1U) << i;
        EXPECT_EQ(guide.choices()[0].light, map.photons()[i].light);
    }
    Sampler sampler(6, Purpose::test, 0, 0);
    for (int i = 0; i < 200; ++i) {
        const V2f u = sampler.next2();
        const V3f x(-2 + 4 * u.x, 0, -1 + 2 * u.y), up(0, 1, 0);
        std::size_t nearest = 0;
        float least = INFINITY;
        for (std::size_t k = 0; k < map.size(); ++k) {
            const float r2 = (map.positions()[k] - x).length2();
            if (map.normals()[k].unpack().dot(up) > 0.7F && r2 < least) least = r2, nearest = k;
        }
        const Guide guide = guides.at(x, up);
        ASSERT_FALSE(guide.empty());
        EXPECT_EQ(guide.choices()[0].light, map.photons()[nearest].light);
    }
    // No surface faces in this direction.
    EXPECT_TRUE(guides.at({-1, 0, 0}, {0, 0, 1}).empty());
}

TEST(GuideMap, ForAGateAlone_HasNoDistributions) {
    Monitor silent;
    GuideSettings gate;
    gate.k = 0;
    const GuideMap guides = build_guides(two_chambers(), {2000, 5, 0, gate}, Workers{2}, silent);
    EXPECT_EQ(guides.distributions(), 0U);
    EXPECT_TRUE(guides.at({1, 0, 0}, {0, 1, 0}).empty());
    EXPECT_TRUE(guides.any_near({1, 0, 0}, {0, 1, 0}));
}

TEST(GuideMap, FewPhotons_HaveADefinedAnswer) {
    const Scene scene = two_chambers();
    Monitor silent;
    GuideSettings wide;
    wide.radius = 100;
    wide.k = GuideSettings::kMostPhotons;
    const GuideMap one = build_guides(scene, {1, 5, 0, wide}, Workers{1}, silent);
    ASSERT_EQ(one.map().size(), 1U);
    EXPECT_EQ(one.at({-1, 0, 0}, {0, 1, 0}).empty(), one.at({1, 0, 0}, {0, 1, 0}).empty());
    SceneMaker dark;
    const GuideMap none = build_guides(dark.build(), {100, 5, 0, wide}, Workers{1}, silent);
    EXPECT_TRUE(none.at({0, 0, 0}, {0, 1, 0}).empty());
    EXPECT_FALSE(none.any_near({0, 0, 0}, {0, 1, 0}));
}

}  // namespace guide_test
}  // namespace lucerna
