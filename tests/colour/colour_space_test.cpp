#include "engine/colour/colour_space.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/colour/spectrum.h"

namespace lucerna {
namespace colour_space_test {

const ColourSpace& space(std::string_view name) {
    const ColourSpace* found = find_colour_space(name);
    EXPECT_NE(found, nullptr) << name;
    return *found;
}

TEST(ColourSpaces, White_IsTheSameInAll) {
    EXPECT_EQ(colour_spaces().size(), 5U);
    for (const ColourSpace& s : colour_spaces())
        EXPECT_NEAR((s.to_xyz(V3d(1)) - kWhiteXyz).length(), 0, 1e-12) << s.name;
    EXPECT_EQ(find_colour_space("rec709"), nullptr);
}

TEST(ColourSpaces, Srgb_IsTheOneOfRendering) {
    for (const Rgb& c : {Rgb(1, 0, 0), Rgb(0.25F, 0.5F, 2)})
        EXPECT_NEAR((space("srgb").to_xyz(V3d(c)) - rgb_to_xyz(c)).length(), 0, 1e-15);
}

// Luminances of the primaries as the standards print them: ITU-R BT.2020 table 4, and the second row of the
// Academy's matrices. The Academy's are for another white, and the adaptation changes them in the third
// digit.
TEST(ColourSpaces, Primaries_HaveTheirPublishedLuminances) {
    const auto expect = [](std::string_view name, const V3d& luminances, double near) {
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(space(name).primaries[static_cast<std::size_t>(c)].y, luminances[c], near)
                << name << c;
    };
    expect("rec2020", {0.2627, 0.6780, 0.0593}, 6e-5);
    expect("dci-p3", {0.2290, 0.6917, 0.0793}, 6e-5);
    expect("acescg", {0.2722, 0.6741, 0.0537}, 8e-3);
    expect("aces2065-1", {0.3440, 0.7282, -0.0721}, 1e-2);
}

// Published matrices: BT.2020 to BT.709 (ITU-R BT.2087), and the Academy's ACEScg to sRGB with Bradford's
// adaptation.
TEST(ColourSpaces, ToSrgb_AreThePublishedMatrices) {
    const auto expect = [](std::string_view name, const double(&rows)[3][3], float near) {
        for (int column = 0; column < 3; ++column) {
            V3d one(0, 0, 0);
            one[column] = 1;
            const Rgb srgb = xyz_to_rgb(space(name).to_xyz(one));
            for (int row = 0; row < 3; ++row)
                EXPECT_NEAR(srgb[row], rows[row][column], near) << name << ' ' << row << column;
        }
    };
    expect("rec2020", {{1.6605, -0.5876, -0.0728}, {-0.1246, 1.1329, -0.0083}, {-0.0182, -0.1006, 1.1187}},
           2e-4F);
    expect("acescg", {{1.7050, -0.6218, -0.0833}, {-0.1303, 1.1408, -0.0105}, {-0.0240, -0.1290, 1.1530}},
           3e-4F);
}

}  // namespace colour_space_test
}  // namespace lucerna
