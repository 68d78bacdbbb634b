// Scales with round limits, and the colours of values on them.
#include "engine/figures/false_colour.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace lucerna {
namespace false_colour_test {

using ::testing::DoubleEq;
using ::testing::ElementsAre;

ScaleRange range_of(ScaleSettings settings, const std::vector<double>& values) {
    return FalseColour(settings, values).range();
}

TEST(RoundSteps, AreTheLeastOfOneTwoFive) {
    const std::pair<double, double> known[] = {{1, 1},      {1.0001, 2},   {2, 2},       {3, 5},
                                               {5, 5},      {5.5, 10},     {0.03, 0.05}, {0.1, 0.1},
                                               {720, 1000}, {1e-20, 1e-20}};
    for (const auto& [value, step] : known) EXPECT_EQ(round_step_from(value).value(), step) << value;
    // Decimals are exact.
    const RoundStep tenth{1, -1};
    EXPECT_EQ(tenth.multiple(3), 0.3);
    EXPECT_EQ(tenth.multiple(7), 0.7);
}

TEST(RoundNumbers, AreInTheRangeWithItsEnds) {
    EXPECT_THAT(round_numbers({0, 500}, Scaling::linear, 5), ElementsAre(0, 100, 200, 300, 400, 500));
    EXPECT_THAT(round_numbers({-0.3, 0.3}, Scaling::linear, 6),
                ElementsAre(-0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3));
    EXPECT_THAT(round_numbers({13, 29}, Scaling::linear, 4), ElementsAre(15, 20, 25));
    EXPECT_THAT(round_numbers({1, 100}, Scaling::logarithmic, 8), ElementsAre(1, 2, 5, 10, 20, 50, 100));
    EXPECT_THAT(round_numbers({0.01, 1000}, Scaling::logarithmic, 8),
                ElementsAre(0.01, 0.1, 1, 10, 100, 1000));
    EXPECT_LE(round_numbers({1e-20, 1e20}, Scaling::logarithmic, 8).size(), 9U);
    EXPECT_THAT(round_numbers({300, 480}, Scaling::logarithmic, 4), ElementsAre(300, 350, 400, 450));
}

TEST(AutomaticRange, IsRoundAndHoldsTheValues) {
    EXPECT_EQ(range_of({}, {12, 430}).low, 0);
    EXPECT_EQ(range_of({}, {12, 430}).high, 450);
    EXPECT_EQ(range_of({}, {12, 520}).high, 600);
    EXPECT_EQ(range_of({}, {0, 0.3}).high, 0.3);
    EXPECT_EQ(range_of({}, {480, 512}).low, 480);  // uniform light keeps its differences
    EXPECT_EQ(range_of({}, {480, 512}).high, 515);
    EXPECT_EQ(range_of({}, {-3, 8}).low, -4);
    EXPECT_EQ(range_of({}, {-3, -2}).high, 0);
    EXPECT_EQ(range_of({}, {7, 7}).low, 0);
    EXPECT_EQ(range_of({}, {7, 7}).high, 7);
    for (const std::vector<double>& values :
         {std::vector<double>{}, {0}, {NAN, NAN}, {INFINITY}, {0, 0, 0}}) {
        EXPECT_EQ(range_of({}, values).low, 0);
        EXPECT_EQ(range_of({}, values).high, 1);
    }
}

TEST(AutomaticRange, LeavesOutTheBrightestShare) {
    std::vector<double> values(200, 90);
    values[3] = 1e6;
    ScaleSettings settings;
    settings.inside = 0.99;
    EXPECT_EQ(range_of(settings, values).high, 90);
    settings.inside = 1;
    EXPECT_EQ(range_of(settings, values).high, 1e6);
}

TEST(AutomaticRange, Logarithmic_EndsAtOneTwoFive) {
    ScaleSettings settings;
    settings.scaling = Scaling::logarithmic;
    EXPECT_EQ(range_of(settings, {3, 700}).low, 2);
    EXPECT_EQ(range_of(settings, {3, 700}).high, 1000);
    EXPECT_EQ(range_of(settings, {1e-9, 700}).low, 0.1);  // limited to four decades
    EXPECT_EQ(range_of(settings, {5, 5}).high, 10);
    EXPECT_EQ(range_of(settings, {5, 5}).low, 5);
    EXPECT_EQ(range_of(settings, {0, -4, NAN}).high, 1);
}

TEST(AutomaticRange, Diverging_IsTheSameOnBothSides) {
    ScaleSettings settings;
    settings.map = ColourMap::diverging;
    EXPECT_EQ(range_of(settings, {-0.034, 0.01}).low, -0.05);
    EXPECT_EQ(range_of(settings, {-0.034, 0.01}).high, 0.05);
    EXPECT_EQ(range_of(settings, {}).high, 1);
}

TEST(FalseColours, FollowTheMapAndMarkWhatIsOutside) {
    for (const ColourMap map : {ColourMap::viridis, ColourMap::magma, ColourMap::diverging}) {
        ScaleSettings settings;
        settings.map = map;
        settings.range = ScaleRange{-100, 300};
        const FalseColour colour(settings, {});
        EXPECT_EQ(colour(-100), colour_at(map, 0));
        EXPECT_EQ(colour(300), colour_at(map, 1));
        EXPECT_EQ(colour(100), colour_at(map, 0.5));
        const Rgb marks[] = {colour(-100.001), colour(300.001), colour(NAN)};
        EXPECT_EQ(colour(-INFINITY), marks[0]);
        EXPECT_EQ(colour(INFINITY), marks[1]);
        EXPECT_EQ(marks[2].x, marks[2].y);  // grey
        EXPECT_EQ(marks[2].y, marks[2].z);
        // Neither a colour of the map nor another mark is close.
        for (const Rgb& mark : marks) {
            for (int i = 0; i <= 100; ++i) EXPECT_GT((colour_at(map, i / 100.0) - mark).length(), 0.12F);
        }
        EXPECT_GT((marks[0] - marks[1]).length(), 0.3F);
    }
}

TEST(FalseColours, OnALogarithmicScale_GoByRatios) {
    ScaleSettings settings;
    settings.scaling = Scaling::logarithmic;
    settings.range = ScaleRange{1, 10000};
    const FalseColour colour(settings, {});
    EXPECT_NEAR(colour.share(100), 0.5, 1e-12);
    EXPECT_EQ(colour(0), colour.outside().below);
    EXPECT_EQ(colour(-5), colour.outside().below);
}

TEST(ColourMaps, Viridis_RisesInLightnessByEvenSteps) {
    const auto lightness = [](const Rgb& c) {
        const auto linear = [](float v) {
            return v <= 0.04045F ? double{v} / 12.92 : std::pow((double{v} + 0.055) / 1.055, 2.4);
        };
        const double y = 0.2126 * linear(c.x) + 0.7152 * linear(c.y) + 0.0722 * linear(c.z);
        return 116 * std::cbrt(y) - 16;  // above 8
    };
    const double low = lightness(viridis_colour(0)), high = lightness(viridis_colour(1));
    EXPECT_NEAR(low, 15, 2);
    EXPECT_NEAR(high, 91, 2);
    for (int i = 0; i <= 20; ++i)
        EXPECT_NEAR(lightness(viridis_colour(i / 20.0)), low + (high - low) * i / 20, 2.0) << i;
}

TEST(ColourMaps, Names_LeadToMaps) {
    for (const std::string_view name : colour_map_names()) EXPECT_TRUE(colour_map_named(name));
    EXPECT_EQ(colour_map_named("magma"), ColourMap::magma);
    EXPECT_FALSE(colour_map_named("jet"));
}

}  // namespace false_colour_test
}  // namespace lucerna
