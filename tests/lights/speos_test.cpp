// SPEOS ray files: byte by byte, and what their flux and wavelengths mean.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "engine/colour/spectrum.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/lights/ray_bytes.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace speos_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::rows_of_floats;

// Returns a header: the flux in W, five numbers without a known meaning, the flux in lm.
std::string header(float watts, float lumens) {
    return rows_of_floats({{watts, 2, 2, 2, 2, 2, lumens}});
}
std::string two_rays(float blue = 470, float red = 630) {
    return rows_of_floats({{1, 2, 3, 0, 0, 1, blue, 1}, {-1, 0, 0, 0, 0.6F, 0.8F, red, 3}});
}

class Speos : public ::testing::Test {
  protected:
    RaySet read(const std::string& bytes) {
        std::ofstream(folder_ / "lamp.ray", std::ios::binary) << bytes;
        return read_rays(folder_ / "lamp.ray", monitor_);
    }
    std::string error_text(const std::string& bytes) {
        const std::string message = testing::error_of([&] { read(bytes); });
        EXPECT_THAT(message, AllOf(HasSubstr("lamp.ray: "), Not(HasSubstr("\n"))));
        return message;
    }
    testing::TemporaryFolder folder_;
    testing::ListeningMonitor monitor_;
};

TEST_F(Speos, Rows_ArePositionDirectionWavelengthAndShareOfTheFlux) {
    const RaySet set = read(header(8, 0) + two_rays());
    ASSERT_EQ(set.rays.size(), 2U);
    EXPECT_NEAR(set.rays[0].o.y, 0.002F, 1e-9F);
    EXPECT_NEAR(set.rays[1].o.x, -0.001F, 1e-9F);
    EXPECT_EQ(set.rays[1].d, V3f(0, 0.6F, 0.8F));
    EXPECT_EQ(set.unit, FluxUnit::watt);
    EXPECT_EQ(set.flux, 8) << "energies are relative";
    EXPECT_EQ(set.rays[0].flux, 2);
    EXPECT_EQ(set.rays[1].flux, 6);
    EXPECT_TRUE(monitor_.warnings.empty());
    const V3d blue = cie_xyz(470), red = cie_xyz(630), sum = blue + 3.0 * red;
    EXPECT_NEAR((set.xyz - sum / sum.y).length(), 0, 1e-6);
    EXPECT_NEAR(set.lumens_per_watt, 683 * sum.y / 4, 1e-3);
    ASSERT_EQ(set.tristimulus.size(), 2U);
    EXPECT_NEAR(double{set.tristimulus[0].x}, blue.x / sum.y * 4, 1e-5);
    EXPECT_THAT(set.provenance, HasSubstr("SPEOS ray file lamp.ray, 2 rays"));
}

TEST_F(Speos, UnstatedFlux_IsTheSumOfTheEnergiesWithAWarning) {
    EXPECT_EQ(read(header(0, 0) + two_rays()).flux, 4);
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("states a flux of 0 W"));
}

TEST_F(Speos, StatedLumens_GiveTheEfficacy) {
    EXPECT_NEAR(read(header(2, 300) + two_rays()).lumens_per_watt, 150, 1e-4);
    EXPECT_TRUE(monitor_.warnings.empty());
    // No light has that many, but a program that rounds may state them.
    const RaySet green = read(header(1, 686) + two_rays(555, 555));
    EXPECT_NEAR(green.lumens_per_watt, 683, 1e-3);
    EXPECT_TRUE(monitor_.warnings.empty());
    EXPECT_NEAR((green.xyz - cie_xyz(555) / cie_xyz(555).y).length(), 0, 1e-6);
}

TEST_F(Speos, OneWavelengthThatContradictsTheHeader_IsAPlaceholder) {
    const RaySet white = read(header(2, 600) + two_rays(555, 555));
    EXPECT_EQ(white.xyz, kWhiteXyz);
    EXPECT_NEAR(white.lumens_per_watt, 300, 1e-4);
    EXPECT_FALSE(white.coloured());
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0],
                AllOf(HasSubstr("683 lm/W"), HasSubstr("600 lm and 2 W"), HasSubstr("white")));
}

TEST_F(Speos, UnusableRays_AreCountedAndTheFirstIsNamed) {
    const RaySet set = read(header(4, 0) + two_rays() +
                            rows_of_floats({{0, 0, 0, 0, 0, 1, 470, -1}, {0, 0, 0, 0, 0, 0, 470, 4}}));
    EXPECT_EQ(set.rays.size(), 2U);
    EXPECT_EQ(set.skipped_nan, 1U);
    EXPECT_EQ(set.skipped_zero_direction, 1U);
    EXPECT_EQ(set.skipped_flux, 2) << "the share of 4 of 8 of 4 W";
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0],
                HasSubstr("2 of 4 rays are skipped: the first, at byte 92, has the flux -1; expected"));
    monitor_.warnings.clear();
    read(header(4, 0) + two_rays() + rows_of_floats({{0, NAN, 0, 0, 0, 1, 470, 1}}));
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("at byte 92, has the position (0, nan, 0)"));
}

TEST_F(Speos, WrongFiles_SayWhatIsWrong) {
    const std::string good = header(4, 0) + two_rays();
    EXPECT_THAT(
        error_text(good.substr(0, good.size() - 1)),
        AllOf(HasSubstr("the 63 bytes after the header, from byte 28"), HasSubstr("rows of 32 bytes")));
    EXPECT_THAT(error_text(good + "x"), HasSubstr("the 65 bytes after the header"));
    EXPECT_THAT(error_text(header(4, 0)), HasSubstr("not a ray file"));
    std::string swapped = good;
    for (std::size_t at = 0; at < swapped.size(); at += 4)
        std::reverse(swapped.begin() + static_cast<std::ptrdiff_t>(at),
                     swapped.begin() + static_cast<std::ptrdiff_t>(at) + 4);
    EXPECT_THAT(error_text(swapped), HasSubstr("big-endian; expected little-endian"));
    const std::string polarised =
        header(4, 0) + rows_of_floats({{1, 2, 3, 0, 0, 1, 550, 1, 1, 0, 0, 0.5F, 0},
                                       {1, 2, 3, 0, 0, 1, 550, 1, 1, 0, 0, 0.5F, 1}});
    EXPECT_THAT(error_text(polarised), HasSubstr("rows of 52 bytes, of polarised rays; expected 32 bytes"));
    EXPECT_THAT(error_text(header(4, 0) + two_rays(0, 0)), HasSubstr("not a ray file"));
    EXPECT_THAT(error_text(header(4, 0) + rows_of_floats({{1, 2, 3, 0, 0, 1, 470, -1}})),
                HasSubstr("no ray is usable: the first, at byte 28, has the flux -1"));
    EXPECT_THAT(error_text(header(4, 0) + rows_of_floats({{1, 2, 3, 0, 0, 1, 470, 0}})),
                HasSubstr("the header states 4 W, but the rays have no flux"));
}

}  // namespace speos_test
}  // namespace lucerna
