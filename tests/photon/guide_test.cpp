#include "photon/guide.h"

#include <gtest/gtest.h>

#include "photon/build_maps.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace {

using testing::SceneMaker;

std::vector<Guide::Vote> votes() {
    // Light 3 in two parts, light 1 in one; one photon weighs nothing.
    return {{3, 7, 1}, {1, kNoCell, 2}, {3, 2, 0.5F}, {3, 7, 3}, {1, kNoCell, 1}, {9, 0, 0}};
}

TEST(Guide, Choices_AreTheVotesByLightAndPart) {
    const Guide guide(votes());
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
    const Guide guide(votes());
    constexpr int kDraws = 40000;
    std::vector<std::uint64_t> observed(guide.choices().size());
    for (int i = 0; i < kDraws; ++i) {
        Stream stream(3, Purpose::test, 0, static_cast<std::uint64_t>(i));
        ++observed[static_cast<std::size_t>(&guide.draw(stream.next()) - guide.choices().data())];
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
    EXPECT_EQ(Guide().unseen(), 1);
    EXPECT_TRUE(Guide(std::vector<Guide::Vote>{}).empty());
    EXPECT_TRUE(Guide(std::vector<Guide::Vote>{{0, 0, 0}, {1, 0, 0}}).empty());
    EXPECT_EQ(Guide(std::vector<Guide::Vote>{{0, 0, 0}}).probability(0, 0), 0);
}

TEST(Guide, Unseen_IsTheShareOfPhotonsThatAreAlone) {
    const Guide guide(votes());
    EXPECT_FLOAT_EQ(guide.unseen(), 2 / 6.0F);
    EXPECT_EQ(Guide(std::vector<Guide::Vote>{{0, 0, 1}, {0, 0, 1}}).unseen(), 0);
    EXPECT_EQ(Guide(std::vector<Guide::Vote>{{0, 0, 1}, {0, 1, 1}}).unseen(), 1);
}

// Many kinds of equal share: what the lone photons say is missing is what is missing.
TEST(Guide, Unseen_IsOnAverageTheProbabilityOfWhatWasNotDrawn) {
    constexpr int kKinds = 40;
    constexpr int kPhotons = 50;
    RunningStats difference;
    for (std::uint64_t i = 0; i < 4000; ++i) {
        Stream stream(4, Purpose::test, 0, i);
        std::vector<Guide::Vote> drawn;
        for (int k = 0; k < kPhotons; ++k) {
            drawn.push_back({0, static_cast<CellId>(stream.next() * kKinds), 1});
        }
        const Guide guide(drawn);
        const double missing = 1 - static_cast<double>(guide.choices().size()) / kKinds;
        difference.add(double{guide.unseen()} - missing);
    }
    // Good's estimate is that of one photon fewer: off by less than 1/k of itself.
    EXPECT_NEAR(difference.mean(), 0, 0.3 / kPhotons + 4 * difference.standard_error());
}

// Two points of light on either side of a wall.
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

TEST(GuideMap, FewPhotons_AllVote) {
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

}  // namespace
}  // namespace lucerna
