// Zemax and LightTools ray files, field by field; and the choice of the reader by a file's content.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/archives.h"
#include "tests/support/error_of.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ray_files_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

template <typename T>
void set(std::string& bytes, std::size_t at, const T& value) {
    std::memcpy(&bytes[at], &value, sizeof value);
}

std::string rows(std::initializer_list<std::initializer_list<float>> values) {
    std::string bytes;
    for (const auto& row : values) {
        for (const float v : row) bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
    }
    return bytes;
}

// Returns a file of two rays, with 1 and 3 units of flux and lengths in mm.
std::string zemax() {
    std::string b(208, '\0');
    set(b, 0, std::int32_t{1010});
    set(b, 4, std::int32_t{2});
    std::memcpy(&b[8], "a lamp\x01of two rays", 18);
    set(b, 136, std::int32_t{4});
    return b + rows({{1, 2, 3, 0, 0, 1, 1}, {-1, 0, 0, 0, 3, 4, 3}});
}

std::string lighttools() {
    std::string b(44, '\0');
    std::memcpy(b.data(), "LTRF", 4);
    set(b, 4, std::int32_t{2});
    set(b, 24, std::int32_t{1});
    return b + rows({{1, 2, 3, 0, 0, 1, 1}, {-1, 0, 0, 0, 3, 4, 3}}) + "LTRFEND";
}

// Returns the same file in version 3, whose header says that the rays are not polarised.
std::string lighttools_3() {
    std::string b = lighttools();
    set(b, 4, std::int32_t{3});
    return b.insert(44, 4, '\0');
}

class RayFiles : public ::testing::Test {
  protected:
    RaySet read(const std::string& bytes, const std::string& name = "rays.bin") {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return read_rays(folder_ / name, monitor_);
    }
    std::string error_text(const std::string& bytes) {
        const std::string message = testing::error_of([&] { read(bytes); });
        EXPECT_THAT(message, AllOf(HasSubstr("rays.bin"), Not(HasSubstr("\n"))));
        return message;
    }
    testing::TemporaryFolder folder_;
    testing::ListeningMonitor monitor_;
};

void expect_the_two_rays(const RaySet& set) {
    ASSERT_EQ(set.rays.size(), 2U);
    EXPECT_NEAR(set.rays[0].o.y, 0.002F, 1e-9F);
    EXPECT_NEAR(set.rays[1].o.x, -0.001F, 1e-9F);
    EXPECT_NEAR(set.rays[1].d.y, 0.6F, 1e-6F);
    EXPECT_NEAR(set.rays[1].d.z, 0.8F, 1e-6F);
    EXPECT_EQ(set.rays[1].flux, 3);
    EXPECT_EQ(set.flux, 4);
    EXPECT_EQ(set.unit, FluxUnit::watt);
    EXPECT_EQ(set.colour(), Rgb(1));
}

TEST_F(RayFiles, BothVendors_SameRays_AreTheSameSet) {
    expect_the_two_rays(read(zemax()));
    expect_the_two_rays(read(lighttools()));
    expect_the_two_rays(read(lighttools_3()));
    EXPECT_TRUE(monitor_.warnings.empty());
    EXPECT_THAT(read(zemax()).provenance, HasSubstr("a lamp of two rays"));
}

TEST_F(RayFiles, LengthUnits_AreTurnedIntoMetres) {
    const auto y_of = [&](std::string bytes, std::size_t at, std::int32_t unit) {
        set(bytes, at, unit);
        return read(bytes).rays[0].o.y;
    };
    const float zemax_metres[] = {1, 0.0254F, 0.01F, 0.3048F, 0.001F};
    for (std::int32_t unit = 0; unit < 5; ++unit)
        EXPECT_FLOAT_EQ(y_of(zemax(), 136, unit), 2 * zemax_metres[unit]);
    const float lighttools_metres[] = {0.001F, 0.001F, 0.01F, 1, 0.0254F, 0.3048F, 1e-6F, 1e-9F};
    for (std::int32_t unit = 0; unit < 8; ++unit)
        EXPECT_FLOAT_EQ(y_of(lighttools(), 24, unit), 2 * lighttools_metres[unit]);
    ASSERT_EQ(monitor_.warnings.size(), 1U);  // for unit 0
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("mm is assumed"));
}

TEST_F(RayFiles, LuminousFlux_StaysLumens) {
    std::string z = zemax(), l = lighttools();
    set(z, 196, std::int32_t{1});
    set(l, 12, std::int32_t{1});
    for (const std::string& bytes : {z, l}) {
        const RaySet rays = read(bytes);
        EXPECT_EQ(rays.unit, FluxUnit::lumen);
        EXPECT_EQ(rays.flux, 4);
    }
}

TEST_F(RayFiles, HeaderFlux_FiniteAndPositive_WinsWithAWarning) {
    std::string z = zemax(), l = lighttools();
    set(z, 112, 8.0F);
    set(l, 40, 8.0F);
    for (const std::string& bytes : {z, l}) {
        const RaySet rays = read(bytes);
        EXPECT_EQ(rays.flux, 8);
        EXPECT_FLOAT_EQ(rays.rays[1].flux, 6);
    }
    ASSERT_EQ(monitor_.warnings.size(), 2U);
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("the header's flux is used"));
}

TEST_F(RayFiles, Wavelengths_GiveTheColour) {
    const V3d blue = cie_xyz(470), red = cie_xyz(630);
    const Rgb of_watts = colour_of_luminance_one(xyz_to_rgb(blue + 3.0 * red));
    const Rgb of_lumens = colour_of_luminance_one(xyz_to_rgb(blue / blue.y + 3.0 / red.y * red));
    std::string z =
        zemax().substr(0, 208) + rows({{0, 0, 0, 0, 0, 1, 1, 0.47F}, {0, 0, 0, 0, 0, 1, 3, 0.63F}});
    set(z, 192, std::int32_t{2});
    std::string l = lighttools().substr(0, 44) +
                    rows({{0, 0, 0, 0, 0, 1, 1, 470}, {0, 0, 0, 0, 0, 1, 3, 630}}) + "LTRFEND";
    set(l, 20, std::int32_t{2});
    const auto near = [](const V3f& is, const V3d& should) {
        EXPECT_NEAR((V3d(is) - should).length() / should.length(), 0, 1e-6);
    };
    for (const std::string& bytes : {z, l}) {
        const RaySet rays = read(bytes);
        EXPECT_NEAR((rays.colour() - of_watts).length(), 0, 1e-4F);
        ASSERT_EQ(rays.tristimulus.size(), 2U);
        const double mean = (blue.y + 3 * red.y) / 4;
        near(rays.tristimulus[0], blue / mean);
        near(rays.tristimulus[1], red / mean);
        EXPECT_NEAR(rays.lumens_per_watt, 683 * mean, 1e-3);
    }
    set(z, 196, std::int32_t{1});
    set(l, 12, std::int32_t{1});
    for (const std::string& bytes : {z, l}) {
        const RaySet rays = read(bytes);
        EXPECT_NEAR((rays.colour() - of_lumens).length(), 0, 1e-4F);
        ASSERT_EQ(rays.tristimulus.size(), 2U);
        near(rays.tristimulus[0], blue / blue.y);
        near(rays.tristimulus[1], red / red.y);
    }
    // One wavelength applies to all rays.
    std::string single = zemax();
    set(single, 116, 0.53F);
    const RaySet green = read(single);
    EXPECT_NEAR((green.xyz - cie_xyz(530) / cie_xyz(530).y).length(), 0, 1e-6);
    EXPECT_FALSE(green.coloured());
    EXPECT_NEAR(green.lumens_per_watt, 683 * cie_xyz(530).y, 1e-2);
}

TEST_F(RayFiles, UnusableRays_AreCounted) {
    std::string z = zemax();
    set(z, 4, std::int32_t{4});
    z += rows({{0, NAN, 0, 0, 0, 1, 1}, {0, 0, 0, 0, 0, 0, 5}});
    std::string l = lighttools();
    l.insert(l.size() - 7, rows({{0, NAN, 0, 0, 0, 1, 1}, {0, 0, 0, 0, 0, 0, 5}}));
    for (const std::string& bytes : {z, l}) {
        const RaySet rays = read(bytes);
        EXPECT_EQ(rays.rays.size(), 2U);
        EXPECT_EQ(rays.skipped_nan, 1U);
        EXPECT_EQ(rays.skipped_zero_direction, 1U);
        EXPECT_EQ(rays.skipped_flux, 6);
        EXPECT_EQ(rays.flux, 10);
    }
    ASSERT_EQ(monitor_.warnings.size(), 2U);
    EXPECT_THAT(monitor_.warnings[0],
                HasSubstr("2 of 4 rays are skipped: the first, at byte 264, has the position (0, nan, 0)"));
    EXPECT_THAT(monitor_.warnings[1], HasSubstr("the first, at byte 100, has"));
}

TEST_F(RayFiles, InvisibleWavelengths_AreNamedAndCarryNoLight) {
    std::string l = lighttools().substr(0, 44) +
                    rows({{0, 0, 0, 0, 0, 1, 1, 359.5F}, {0, 0, 0, 0, 0, 1, 3, 630}}) + "LTRFEND";
    set(l, 20, std::int32_t{2});
    const RaySet rays = read(l);
    ASSERT_EQ(rays.tristimulus.size(), 2U);
    EXPECT_EQ(rays.tristimulus[0], V3f(0.0F));
    EXPECT_NEAR(rays.lumens_per_watt, 683 * cie_xyz(630).y * 0.75, 1e-3);
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0],
                HasSubstr("1 of 2 rays are of wavelengths outside 360 to 830 nm, which are not visible, the "
                          "first of 359.5 nm"));
}

TEST_F(RayFiles, LyingHeaders_AreRefusedBeforeAnythingIsAllocated) {
    const auto with = [](std::string bytes, std::size_t at, std::int32_t value) {
        set(bytes, at, value);
        return bytes;
    };
    EXPECT_THAT(error_text(with(zemax(), 4, 2147483647)), HasSubstr("truncated in the rays"));
    EXPECT_THAT(error_text(with(zemax(), 4, 3)), HasSubstr("truncated in the rays"));
    EXPECT_THAT(error_text(with(zemax(), 4, -1)), HasSubstr("-1 rays"));
    EXPECT_THAT(error_text(with(zemax(), 136, 5)), HasSubstr("length unit 5; expected 0 (m)"));
    EXPECT_THAT(error_text(with(zemax(), 192, 1)), HasSubstr("ray format 1"));
    EXPECT_THAT(error_text(with(zemax(), 196, 2)), HasSubstr("flux type 2"));
    EXPECT_THAT(error_text(zemax().substr(0, 100)), HasSubstr("truncated in the header"));
    EXPECT_THAT(error_text(with(zemax(), 0, -234684416)), HasSubstr("big-endian"));
    EXPECT_THAT(error_text(with(lighttools(), 4, 0x2000000)), HasSubstr("big-endian"));
    EXPECT_THAT(error_text(with(lighttools(), 4, 4)), HasSubstr("version 4; expected 2 or 3"));
    EXPECT_THAT(error_text(with(lighttools_3(), 44, 1)), HasSubstr("polarisation 1; expected 0"));
    EXPECT_THAT(error_text(with(lighttools(), 12, 2)), HasSubstr("data type 2"));
    EXPECT_THAT(error_text(with(lighttools(), 16, 1)), HasSubstr("far-field"));
    EXPECT_THAT(error_text(with(lighttools(), 20, 1)),
                HasSubstr("colour information 1 (CIE tristimulus values)"));
    EXPECT_THAT(error_text(with(lighttools(), 24, 9)), HasSubstr("length unit 9"));
    EXPECT_THAT(error_text(lighttools().substr(0, 60)), HasSubstr("truncated"));
    EXPECT_THAT(error_text(lighttools().substr(0, 44) + "LTRFEND"), HasSubstr("0 rays"));
    std::string no_end = lighttools();
    no_end.back() = 'X';
    EXPECT_THAT(error_text(no_end), HasSubstr("LTRFEND"));
}

TEST_F(RayFiles, PackedFiles_AreReadWithoutUnpackingThemFirst) {
    const std::string text = "2 4\n1 2 3 0 0 1 1\n-1 0 0 0 3 4 3\n";
    for (const std::string& bytes : {zemax(), lighttools(), lighttools_3(), text}) {
        expect_the_two_rays(read(testing::gzip_of(bytes), "rays.gz"));
        expect_the_two_rays(
            read(testing::zip_of({{"read me.txt", "A lamp."}, {"a/lamp.dat", bytes}}), "rays.zip"));
    }
    EXPECT_THAT(read(testing::zip_of({{"a/lamp.dat", zemax()}})).provenance,
                HasSubstr("Zemax ray file lamp.dat"));
    EXPECT_THAT(error_text(testing::zip_of({{"lamp.dat", zemax()}, {"lamp.ray", lighttools()}})),
                HasSubstr("the zip archive holds 2 ray files: lamp.dat, lamp.ray; expected one"));
    EXPECT_THAT(error_text(testing::zip_of({{"a.txt", "text"}})),
                HasSubstr("no ray file in the zip archive"));
    EXPECT_THAT(error_text(testing::gzip_of("text of gzip")),
                HasSubstr("text that begins with \"text of gzip\""));
    EXPECT_THAT(error_text(testing::zip_of({{"lamp.dat", zemax().substr(0, 230)}})),
                HasSubstr("rays.bin/lamp.dat: truncated in the rays"));
    EXPECT_THAT(error_text(testing::gzip_of(zemax()).substr(0, 40)), HasSubstr("end too early"));
    std::ofstream(folder_ / "lamp.gz", std::ios::binary) << testing::gzip_of(zemax());
    EXPECT_TRUE(is_ray_file(folder_ / "lamp.gz"));
    std::ofstream(folder_ / "lamp.txt") << "a lamp";
    EXPECT_FALSE(is_ray_file(folder_ / "lamp.txt"));
}

TEST_F(RayFiles, ContentSpeaksBeforeTheName) {
    expect_the_two_rays(read(lighttools(), "rays.dat"));
    expect_the_two_rays(read(zemax(), "rays.ray"));
    EXPECT_THAT(error_text("rubbish"), AllOf(HasSubstr(".tm25ray"), HasSubstr(".dat"), HasSubstr(".ray")));
    EXPECT_THAT(error_text("r"), HasSubstr("not a ray file"));
}

TEST_F(RayFiles, OtherFiles_AreNamedForWhatTheyAre) {
    const auto bytes = [](std::initializer_list<int> values, std::size_t size = 600) {
        std::string text;
        for (const int value : values) text += static_cast<char>(value);
        return text + std::string(size, '\0');
    };
    const std::vector<std::pair<std::string, std::string>> files = {
        {"rays of a lamp\n1 2 3", "text that begins with \"rays of a lamp\""},
        {"# Ray data of LightTools 8.4\n1 2 3 0 0 1 1\n",
         "text of LightTools, in whose header no line names the columns"},
        {"200 4 7\n0 0 0 0 0 1 1\n", "text that begins with \"200 4 7\""},
        {bytes({'7', 'z', 0xBC, 0xAF, 0x27, 0x1C}), "a 7z archive"},
        {bytes({0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'}), "a PNG picture"},
        {bytes({0xFF, 0xD8, 0xFF, 0xE0}), "a JPEG picture"},
        {bytes({0x76, 0x2F, 0x31, 0x01}), "an OpenEXR file"},
        {"%PDF-1.7\n", "a PDF document"},
        {"<!DOCTYPE html><html>", "a web page"},
        {"IESNA:LM-63-2002\nTILT=NONE\n", "an IES LM-63 photometric file"},
        {bytes({1, 2, 3, 4}), "of no format that is known"}};
    for (const auto& [content, name] : files) {
        for (const char* file : {"rays.dat", "rays.ray", "rays.tm25ray", "rays.bin"}) {
            const std::string message = testing::error_of([&, &text = content] { read(text, file); });
            EXPECT_THAT(message, AllOf(HasSubstr(std::string(file) + ": not a ray file: "), HasSubstr(name),
                                       HasSubstr("expected"), Not(HasSubstr("\n"))));
        }
    }
}

// Holds the same two rays as text; lengths are in mm, the fluxes are 1 and 3 W.
constexpr const char* kTwoRays = "1 2 3 0 0 1 1\n-1 0 0 0 3 4 3\n";

TEST_F(RayFiles, ZemaxText_IsReadByItsContent) {
    const std::vector<std::string> texts = {
        "2 4\n" + std::string(kTwoRays), "\n  2\t4 \r\n\r\n\t1 2 3 0 0 1 1.0\r\n -1e0 +0 0 0 3 .4E1 3",
        "2 2\n.1 .2 .3 0 0 1 1 0\n-.1 0 0 0 3 4 3 0\n", "2 0\n1e-3 .002 3E-3 0 0 1 1\n-.001 0 0 0 3 4 3"};
    for (const std::string& text : texts) {
        monitor_.warnings.clear();
        expect_the_two_rays(read(text, "rays.dat"));
        ASSERT_EQ(monitor_.warnings.size(), 1U) << text;
        EXPECT_THAT(monitor_.warnings[0], HasSubstr("watts are assumed"));
    }
    EXPECT_NEAR(read("1 1\n1 0 0 0 0 1 1\n").rays[0].o.x, 0.0254F, 1e-8F);
    EXPECT_NEAR(read("1 3\n1 0 0 0 0 1 1\n").rays[0].o.x, 0.3048F, 1e-7F);
}

TEST_F(RayFiles, ZemaxText_WavelengthsGiveEachRayItsColour) {
    const RaySet set = read("3 4\n0 0 0 0 0 1 1 0.48\n0 0 0 0 0 1 1 0.62\n0 0 0 0 0 1 1 0\n");
    ASSERT_EQ(set.tristimulus.size(), 3U);
    const double mean = (cie_xyz(480).y + cie_xyz(620).y) / 2;
    EXPECT_NEAR(double{set.tristimulus[0].y}, cie_xyz(480).y / mean, 1e-5);
    EXPECT_NEAR(double{set.tristimulus[1].x}, cie_xyz(620).x / mean, 1e-5);
    EXPECT_NEAR(set.lumens_per_watt, 683 * mean, 1e-2);
    const RaySet one = read("2 4\n0 0 0 0 0 1 1 .55\n0 0 0 0 0 1 2 .55\n");
    EXPECT_FALSE(one.coloured());
    EXPECT_NEAR(one.lumens_per_watt, 683 * cie_xyz(550).y, 1e-3);
}

TEST_F(RayFiles, ZemaxText_SaysWhatIsWrongAndWhere) {
    EXPECT_THAT(error_text("2 5\n" + std::string(kTwoRays)),
                HasSubstr(":1:1: length unit 5; expected 0 (m)"));
    EXPECT_THAT(error_text("0 4\n" + std::string(kTwoRays)), HasSubstr(":1:1: the file states 0 rays"));
    EXPECT_THAT(error_text("-1 4\n" + std::string(kTwoRays)), HasSubstr("the file states -1 rays"));
    EXPECT_THAT(error_text("3 4\n" + std::string(kTwoRays)), HasSubstr("3 rays stated"));
    EXPECT_THAT(error_text("3 4\n" + std::string(kTwoRays) + std::string(40, '\n')),
                HasSubstr("3 rays stated, 2 there"));
    EXPECT_THAT(error_text("900000000000 4\n" + std::string(kTwoRays)), HasSubstr("room for at most 2"));
    EXPECT_THAT(error_text("2 4\n0 0 0 0 0 1 1\n0 0 x 0 0 1 1\n"), HasSubstr(":3:1: \"x\" is not a number"));
    EXPECT_THAT(error_text("1 4\n0,5 0 0 0 0 1 1\n"), HasSubstr(":2:1: \"0,5\" is not a number"));
    EXPECT_THAT(error_text("2 4\n0 0 0 0 0 1 1\n0 0 0 0 0 1 1 .55\n"),
                HasSubstr(":3:1: 8 numbers; expected 7"));
    EXPECT_THAT(error_text("1 4\n0 0 0 0 0 1             \n"), HasSubstr(":2:1: 6 numbers; expected 7 or 8"));
    EXPECT_THAT(error_text("1 4\n0 0 0 0 0 1 1 1 1\n"), HasSubstr(":2:1: 9 numbers; expected 7 or 8"));
    EXPECT_THAT(error_text("1 4\n" + std::string(100000, '1') + "\n"),
                HasSubstr("more than 4096 characters"));
    EXPECT_THAT(error_text("1 4\nnan 0 0 0 0 1 1\n"),
                HasSubstr("no ray is usable: the first, at line 2, has the position (nan, 0, 0)"));
    EXPECT_THAT(error_text("1 4\n0 0 0 0 0 1 -2\n"), HasSubstr("at line 2, has the flux -2; expected"));
    EXPECT_THAT(error_text("1 4\n0 0 0 0 0 0 2\n"), HasSubstr("and the direction (0, 0, 0); expected"));
    monitor_.warnings.clear();
    EXPECT_EQ(read("1 4\n" + std::string(kTwoRays)).rays.size(), 1U);
    EXPECT_THAT(monitor_.warnings, ::testing::Contains(HasSubstr("1 lines after the last ray are ignored")));
}

TEST(RayFilesData, ZemaxText_IsALambertianDiscOfGreen) {
    LUCERNA_NEED_DATA(path, "faults/rays/zemax-text.dat");
    testing::ListeningMonitor monitor;
    const RaySet set = read_rays(path, monitor);
    ASSERT_EQ(set.rays.size(), 200U);
    EXPECT_NEAR(set.flux, 1, 1e-6);
    EXPECT_FALSE(set.coloured());
    EXPECT_NEAR(set.lumens_per_watt, 683 * cie_xyz(550).y, 1e-3);
    EXPECT_NEAR(set.rays[0].o.x, 0.105324e-3F, 1e-10F);
    EXPECT_NEAR(set.rays[0].d.z, 0.486030F, 1e-6F);
}

TEST(RayFilesData, ThreeRays_OfBothVendors_AreTheSame) {
    LUCERNA_NEED_DATA(zemax_file, "three-rays-zemax.dat");
    LUCERNA_NEED_DATA(lighttools_file, "three-rays-lighttools.ray");
    testing::ListeningMonitor monitor;
    const RaySet a = read_rays(zemax_file, monitor);
    const RaySet b = read_rays(lighttools_file, monitor);
    ASSERT_EQ(a.rays.size(), 3U);
    ASSERT_EQ(b.rays.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(a.rays[i].o, b.rays[i].o);
        EXPECT_EQ(a.rays[i].d, b.rays[i].d);
        EXPECT_EQ(a.rays[i].flux, b.rays[i].flux);
        EXPECT_NEAR(a.rays[i].d.length(), 1, 1e-6F);
    }
    EXPECT_EQ(a.unit, b.unit);
    EXPECT_EQ(a.flux, b.flux);
    EXPECT_NEAR(a.flux, 0.00310661, 1e-8);  // stated in both headers, three times the sum over the rays
    EXPECT_EQ(monitor.warnings.size(), 2U);
    EXPECT_NEAR((a.colour() - b.colour()).length(), 0, 1e-5F);  // wavelengths in µm and in nm
    EXPECT_NEAR(a.rays[0].o.x, -6.6684e-4F, 1e-8F);
    EXPECT_NEAR(a.rays[0].d.z, 0.5F, 1e-6F);
}

}  // namespace ray_files_test
}  // namespace lucerna
