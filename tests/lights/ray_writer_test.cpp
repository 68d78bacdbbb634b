// Written ray files: byte by byte, and the same bytes again after reading them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "engine/colour/spectrum.h"
#include "engine/system/files.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/lights/ray_bytes.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ray_writer_test {

using ::testing::HasSubstr;

// Returns rays whose numbers use all bits of a float.
RaySet random_rays(FluxUnit unit) {
    RaySet set;
    set.unit = unit;
    std::mt19937 bits(5);
    std::uniform_real_distribution<float> number(-1, 1);
    for (int i = 0; i < 2000; ++i) {
        const V3f d(number(bits), number(bits), number(bits));
        set.rays.push_back(
            {0.01F * V3f(number(bits), number(bits), number(bits)), d.normalized(), std::fabs(number(bits))});
        set.flux += double{set.rays.back().flux};
    }
    set.text = "rays of a lamp, größer ";
    return set;
}

// Gives each ray its own colour.
void colour(RaySet& set) {
    std::mt19937 bits(6);
    std::uniform_real_distribution<float> number(0.1F, 1.5F);
    V3d sum(0, 0, 0);
    for (const LampRay& ray : set.rays) {
        set.tristimulus.emplace_back(number(bits), set.unit == FluxUnit::lumen ? 1.0F : number(bits),
                                     number(bits));
        sum += double{ray.flux} * V3d(set.tristimulus.back());
    }
    if (set.unit == FluxUnit::watt) {
        for (V3f& xyz : set.tristimulus) xyz = V3f(V3d(xyz) * (set.flux / sum.y));
        set.lumens_per_watt = 123.4567;
    }
    set.xyz = sum / sum.y;
}

std::vector<std::pair<std::string, RaySet>> lamps() {
    std::vector<std::pair<std::string, RaySet>> all;
    for (const FluxUnit unit : {FluxUnit::lumen, FluxUnit::watt}) {
        const std::string name(flux_unit_name(unit));
        RaySet white = random_rays(unit), amber = white, mixed = white, green = white, deep = white;
        amber.xyz = {1.2, 1, 0.1};
        colour(mixed);
        green.xyz = cie_xyz(531.23) / cie_xyz(531.23).y;
        deep.xyz = cie_xyz(780) / cie_xyz(780).y;
        if (unit == FluxUnit::watt) {
            white.lumens_per_watt = 301.2;
            amber.lumens_per_watt = 201.3;
            green.lumens_per_watt = 683 * cie_xyz(531.23).y;
            deep.lumens_per_watt = 683 * cie_xyz(780).y;
        }
        all.emplace_back("white, " + name, white);
        all.emplace_back("amber, " + name, amber);
        all.emplace_back("mixed, " + name, mixed);
        all.emplace_back("green, " + name, green);
        all.emplace_back("deep red, " + name, deep);
    }
    return all;
}

TEST(RayWriter, EveryFormat_ReadAndWrittenAgain_HasTheSameBytes) {
    const testing::TemporaryFolder folder;
    for (const char* suffix : {".tm25ray", ".dat", ".ray", ".speos.ray"}) {
        for (const auto& [name, lamp] : lamps()) {
            SCOPED_TRACE(name + suffix);
            const std::filesystem::path first = folder / (std::string("first") + suffix),
                                        second = folder / (std::string("second") + suffix);
            write_rays(first, lamp);
            testing::ListeningMonitor monitor;
            const RaySet read = read_rays(first, monitor);
            EXPECT_EQ(read.rays.size(), lamp.rays.size());
            write_rays(second, read);
            EXPECT_EQ(read_text(first), read_text(second));
        }
    }
}

TEST(RayWriter, Speos_ByteByByte) {
    const testing::TemporaryFolder folder;
    RaySet set;
    set.unit = FluxUnit::watt;
    set.rays = {{V3f(0.5F, 0, -0.25F), V3f(0, 0, 1), 2}, {V3f(0, 0.125F, 0), V3f(0, 0.6F, 0.8F), 6}};
    set.xyz = cie_xyz(530) / cie_xyz(530).y;
    set.lumens_per_watt = 600;
    write_rays(folder / "Lamp.Speos.RAY", set);
    EXPECT_EQ(
        read_text(folder / "Lamp.Speos.RAY"),
        testing::rows_of_floats(
            {{8, 2, 2, 2, 2, 2, 4800}, {500, 0, -250, 0, 0, 1, 530, 2}, {0, 125, 0, 0, 0.6F, 0.8F, 530, 6}}));
    // Lumens become the watts that they have at the wavelength: 555 nm of a lamp without one.
    set.unit = FluxUnit::lumen;
    set.rays = {{V3f(0.0F), V3f(0, 0, 1), 1366}};
    set.xyz = kWhiteXyz;
    set.lumens_per_watt = 0;
    write_rays(folder / "lamp.speos.ray", set);
    EXPECT_EQ(read_text(folder / "lamp.speos.ray"),
              testing::rows_of_floats({{2, 2, 2, 2, 2, 2, 1366}, {0, 0, 0, 0, 0, 1, 555, 2}}));
}

TEST(RayWriter, Speos_KeepsTheColourOfOneWavelength) {
    RayFileInfo info;
    info.xyz = cie_xyz(455.5) / cie_xyz(455.5).y;
    EXPECT_TRUE(keeps_colour("lamp.speos.ray", info));
    EXPECT_FALSE(keeps_colour("lamp.ray", info)) << "LightTools's";
    info.xyz = kWhiteXyz;
    EXPECT_FALSE(keeps_colour("lamp.speos.ray", info));
    info.colour_per_ray = true;
    EXPECT_FALSE(keeps_colour("lamp.speos.ray", info));
}

TEST(RayWriter, Speos_RefusesWattsOfUnknownLight) {
    const testing::TemporaryFolder folder;
    EXPECT_THAT(
        testing::error_of([&] { write_rays(folder / "lamp.speos.ray", random_rays(FluxUnit::watt)); }),
        HasSubstr("expected a lamp in lumens, or one imported with --colours or --efficacy"));
    EXPECT_FALSE(std::filesystem::exists(folder / "lamp.speos.ray"));
}

}  // namespace ray_writer_test
}  // namespace lucerna
