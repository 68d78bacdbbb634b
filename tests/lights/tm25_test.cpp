#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace tm25_test {

using ::testing::HasSubstr;

// The contents of a TM-25 file, field by field.
struct File {
    float lumens = NAN, watts = NAN;
    std::uint64_t rays = 0;
    std::int32_t version = 2013, spectral = 0, tables = 0, extras = 0, text_bytes = 0;
    float wavelength = NAN;
    std::array<std::int32_t, 8> flags{1, 1, 0, 0, 1, 0, 0, 0};
    std::string body;  // tables, padding, names, text, rays

    template <typename T>
    void put(const T& value) {
        body.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void row(std::initializer_list<float> values) {
        for (const float v : values) put(v);
        ++rays;
    }
    void table(std::initializer_list<std::pair<float, float>> pairs) {
        put(static_cast<std::int32_t>(pairs.size()));
        for (const auto& [nm, weight] : pairs) put(nm), put(weight);
        ++tables;
    }
    void pad() {
        while ((36288 + body.size()) % 32 != 0) body += '\0';
    }
    std::string bytes() const {
        std::string b(36288, '\0');
        const auto set = [&b](std::size_t at, const auto& value) {
            std::memcpy(&b[at], &value, sizeof value);
        };
        std::memcpy(b.data(), "TM25", 4);
        set(4, version), set(12, lumens), set(16, watts), set(20, rays);
        std::memcpy(&b[28], "2024-02-29", 10);
        set(60, spectral), set(64, wavelength), set(76, tables), set(80, extras), set(84, text_bytes);
        set(256, flags);
        const char32_t name[] = U"Lämpchen\n9";
        std::memcpy(&b[288], name, sizeof name);
        return b + body;
    }
};

class Tm25 : public ::testing::Test {
  protected:
    RaySet read(const std::string& bytes) {
        std::ofstream(folder_ / "rays.tm25ray", std::ios::binary) << bytes;
        return read_rays(folder_ / "rays.tm25ray", monitor_);
    }
    std::string error_text(const std::string& bytes) {
        try {
            read(bytes);
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("rays.tm25ray"));
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
            return error.what();
        }
        return "";
    }
    testing::TemporaryFolder folder_;
    testing::ListeningMonitor monitor_;
};

File two_rays() {
    File file;
    file.row({1, 2, 3, 0, 0, 1, 5});
    file.row({-1, 0, 0, 0, 3, 4, 15});
    return file;
}

TEST_F(Tm25, Rays_AreInMetresAndUnitDirections) {
    const RaySet set = read(two_rays().bytes());
    ASSERT_EQ(set.rays.size(), 2U);
    EXPECT_NEAR(set.rays[0].o.y, 0.002F, 1e-9F);
    EXPECT_NEAR(set.rays[1].d.y, 0.6F, 1e-6F);
    EXPECT_NEAR(set.rays[1].d.z, 0.8F, 1e-6F);
    EXPECT_EQ(set.unit, FluxUnit::lumen);
    EXPECT_NEAR(set.flux, 20, 1e-9);
    EXPECT_EQ(set.colour(), Rgb(1));
    EXPECT_THAT(set.provenance, HasSubstr("Lämpchen 9"));
    EXPECT_THAT(set.provenance, HasSubstr("2024-02-29"));
    EXPECT_TRUE(monitor_.warnings.empty());
}

TEST_F(Tm25, HeaderFlux_FiniteAndPositive_WinsWithAWarning) {
    File file = two_rays();
    file.lumens = 40;
    const RaySet set = read(file.bytes());
    EXPECT_EQ(set.flux, 40);
    EXPECT_NEAR(set.rays[0].flux, 10, 1e-5F);
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("40"));
    for (const float nonsense : {0.0F, -3.0F, INFINITY, NAN}) {
        file.lumens = nonsense;
        EXPECT_NEAR(read(file.bytes()).flux, 20, 1e-9);
    }
}

TEST_F(Tm25, UnusableRays_AreCountedWithTheirFlux) {
    File file = two_rays();
    file.row({0, NAN, 0, 0, 0, 1, 5});
    file.row({0, 0, 0, 0, 0, 0, 7});
    file.row({0, 0, 0, 0, 0, 1, -7});
    file.row({0, 0, 0, 0, 0, INFINITY, NAN});
    file.row({0, 0, 0, 1e30F, 0, 1e30F, 1});
    const RaySet set = read(file.bytes());
    EXPECT_EQ(set.rays.size(), 3U);
    EXPECT_EQ(set.skipped_nan, 3U);
    EXPECT_EQ(set.skipped_zero_direction, 1U);
    EXPECT_NEAR(set.skipped_flux, 12, 1e-9);
    EXPECT_NEAR(set.flux, 33, 1e-9);
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0],
                HasSubstr("4 of 7 rays are skipped: the first, at byte 36344, has the position (0, nan, 0)"));
}

TEST_F(Tm25, Columns_OfEveryKind_AreFound) {
    File file;
    file.flags = {1, 1, 1, 1, 1, 1, 1, 1};
    file.extras = 2;
    file.text_bytes = 32;
    file.table({{500, 1}, {600, 1}});
    file.table({{400, 1}, {500, 1}, {600, 2}});
    file.pad();
    file.body.append(2 * 512 + 32, 'x');
    for (int i = 0; i < 3; ++i) {
        // Columns: x y z, direction, W, nm, lm, Stokes 6, X Z, index, extras.
        file.row({0, 0, 0, 0, 0, 1, 2, 550, 900, 0, 0, 0, 0, 0, 0, 800, 100, 1, 7, 7});
    }
    const RaySet set = read(file.bytes());
    EXPECT_EQ(set.unit, FluxUnit::watt);
    EXPECT_NEAR(set.flux, 6, 1e-9);
    const Rgb truth = colour_of_luminance_one(xyz_to_rgb({800, 900, 100}));
    EXPECT_NEAR(set.colour().x, truth.x, 1e-5F);
    EXPECT_NEAR(set.colour().z, truth.z, 1e-5F);
}

TEST_F(Tm25, Spectra_OfEveryKind_GiveTheColour) {
    const auto expect_colour = [](const RaySet& set, const V3d& xyz) {
        const Rgb truth = colour_of_luminance_one(xyz_to_rgb(xyz));
        EXPECT_NEAR(set.colour().x, truth.x, 1e-4F);
        EXPECT_NEAR(set.colour().y, truth.y, 1e-4F);
        EXPECT_NEAR(set.colour().z, truth.z, 1e-4F);
        EXPECT_NEAR(luminance(set.colour()), 1, 1e-6F);
    };
    File single = two_rays();
    single.spectral = 1;
    single.wavelength = 600;
    expect_colour(read(single.bytes()), cie_xyz(600));

    File per_ray;
    per_ray.spectral = 2;
    per_ray.flags[3] = 1;
    per_ray.row({0, 0, 0, 0, 0, 1, 480, 1});
    per_ray.row({0, 0, 0, 0, 0, 1, 620, 3});
    expect_colour(read(per_ray.bytes()), cie_xyz(480) / cie_xyz(480).y + cie_xyz(620) * 3 / cie_xyz(620).y);

    File table;
    table.spectral = 3;
    table.table({{450, 1}, {650, 1}});
    table.pad();
    table.row({0, 0, 0, 0, 0, 1, 1});
    const std::array<SpectralSample, 2> flat{{{450, 1}, {650, 1}}};
    expect_colour(read(table.bytes()), spectrum_to_xyz(flat));

    File index;
    index.spectral = 4;
    index.flags = {1, 1, 1, 0, 0, 0, 0, 1};
    index.table({{480, 1}});
    index.table({{620, 1}});
    index.pad();
    index.row({0, 0, 0, 0, 0, 1, 2, 1});
    index.row({0, 0, 0, 0, 0, 1, 1, 2});
    expect_colour(read(index.bytes()), 2.0 * cie_xyz(480) + cie_xyz(620));
}

// Compares the sum of flux · tristimulus over all rays with the set's flux times its colour.
void expect_mean(const RaySet& set) {
    ASSERT_EQ(set.tristimulus.size(), set.rays.size());
    V3d sum(0, 0, 0);
    double flux = 0;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        sum += double{set.rays[i].flux} * V3d(set.tristimulus[i]);
        flux += double{set.rays[i].flux};
    }
    EXPECT_EQ(set.xyz.y, 1);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c] / flux, set.xyz[c], 1e-6 * std::max(1.0, set.xyz[c])) << c;
}

void expect_ray(const RaySet& set, std::size_t i, const V3d& xyz) {
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(double{set.tristimulus[i][c]}, xyz[c], 1e-6 * std::max(1.0, xyz[c])) << i << ' ' << c;
}

TEST_F(Tm25, Wavelengths_GiveEachRayItsColour) {
    const V3d blue = cie_xyz(455.5), red = cie_xyz(620), green = cie_xyz(530);
    File file;
    file.spectral = 2;
    file.flags = {1, 1, 0, 1, 1, 0, 0, 0};
    file.row({0, 0, 0, 0, 0, 1, 455.5F, 1});
    file.row({0, NAN, 0, 0, 0, 1, 530, 9});
    file.row({0, 0, 0, 0, 0, 1, 620, 3});
    file.row({0, 0, 0, 0, 0, 1, 530, 2});
    const RaySet lumens = read(file.bytes());
    ASSERT_EQ(lumens.rays.size(), 3U);
    expect_mean(lumens);
    expect_ray(lumens, 0, blue / blue.y);
    expect_ray(lumens, 1, red / red.y);
    expect_ray(lumens, 2, green / green.y);
    EXPECT_EQ(lumens.spectra, (std::vector<Spectrum>{{{456, 1}}, {{620, 1}}, {{530, 1}}}));
    EXPECT_EQ(lumens.spectrum, (std::vector<std::uint16_t>{0, 1, 2}));

    file.flags = {1, 1, 1, 1, 0, 0, 0, 0};  // the same numbers, watts first
    for (std::size_t row = 0; row < file.rays; ++row) {
        float* at = reinterpret_cast<float*>(&file.body[row * 8 * sizeof(float)]);
        std::swap(at[6], at[7]);
    }
    file.watts = 60;  // takes precedence over the sum over the rays
    file.lumens = 1;
    const RaySet watts = read(file.bytes());
    expect_mean(watts);
    const double mean = (blue.y + 3 * red.y + 2 * green.y) / 6;
    expect_ray(watts, 0, blue / mean);
    expect_ray(watts, 1, red / mean);
    expect_ray(watts, 2, green / mean);
    EXPECT_NEAR(watts.lumens_per_watt, 683 * mean, 1e-4);
    EXPECT_GT(watts.tristimulus[2].y / watts.tristimulus[0].y, 10)
        << "a watt of green is brighter than of blue";
}

TEST_F(Tm25, Tristimulus_OfEachRay_IsKept) {
    File file;
    file.flags = {1, 1, 0, 0, 1, 0, 1, 0};
    file.row({0, 0, 0, 0, 0, 1, 2, 3, 0.5F});
    file.row({0, 0, 0, 0, 0, 1, 0, 0, 0});
    file.row({0, 0, 0, 0, 0, 1, 6, 3, 9});
    file.row({0, 0, 0, 0, 0, 1, 8, NAN, 9});
    const RaySet set = read(file.bytes());
    ASSERT_EQ(set.rays.size(), 4U);
    expect_mean(set);
    EXPECT_NEAR((set.xyz - V3d(6.0 / 8, 1, 9.5 / 8)).length(), 0, 1e-6);
    expect_ray(set, 0, {1.5, 1, 0.25});
    expect_ray(set, 1, set.xyz);
    expect_ray(set, 2, {0.5, 1, 1.5});
    expect_ray(set, 3, set.xyz);

    // Where a file has watts, too, Y is in lumens.
    File both;
    both.flags = {1, 1, 1, 0, 1, 0, 1, 0};
    both.row({0, 0, 0, 0, 0, 1, 1, 300, 200, 100});
    both.row({0, 0, 0, 0, 0, 1, 3, 300, 500, 10});
    const RaySet watts = read(both.bytes());
    expect_mean(watts);
    EXPECT_NEAR(watts.lumens_per_watt, 150, 1e-4);
    expect_ray(watts, 0, V3d(200, 300, 100) / 150.0);
    expect_ray(watts, 1, V3d(500, 300, 10) / 450.0);
}

TEST_F(Tm25, Spectra_ByIndex_CountByTheirWattsNotTheirScale) {
    File file;
    file.spectral = 4;
    file.flags = {1, 1, 1, 0, 0, 0, 0, 1};
    file.table({{450, 1000}, {470, 1000}});
    file.table({{600, 0.001F}, {640, 0.001F}});
    file.pad();
    file.row({0, 0, 0, 0, 0, 1, 2, 1});
    file.row({0, 0, 0, 0, 0, 1, 1, 2});
    const RaySet set = read(file.bytes());
    const std::array<SpectralSample, 2> blue{{{450, 1}, {470, 1}}}, red{{{600, 1}, {640, 1}}};
    const V3d b = spectrum_to_xyz(blue) / 20.0, r = spectrum_to_xyz(red) / 40.0;
    const double mean = (2 * b.y + r.y) / 3;
    expect_mean(set);
    expect_ray(set, 0, b / mean);
    expect_ray(set, 1, r / mean);
    EXPECT_NEAR(set.lumens_per_watt, 683 * mean, 1e-3);
    EXPECT_TRUE(monitor_.warnings.empty());
    ASSERT_EQ(set.spectra.size(), 2U);
    EXPECT_EQ(set.spectra[0], (Spectrum{{450, 1000}, {470, 1000}}));
    EXPECT_EQ(set.spectrum, (std::vector<std::uint16_t>{0, 1}));
}

// Returns rays of 1 W each, with these indices into a table of spectra: blue, green and red.
File indexed(std::initializer_list<float> indices) {
    File file;
    file.spectral = 4;
    file.flags = {1, 1, 1, 0, 0, 0, 0, 1};
    for (const float nm : {480.0F, 530.0F, 620.0F}) file.table({{nm, 1}});
    file.pad();
    for (const float index : indices) file.row({0, 0, 0, 0, 0, 1, 1, index});
    return file;
}

TEST_F(Tm25, SpectrumIndices_CountFromOne) {
    const V3d blue = cie_xyz(480), green = cie_xyz(530), red = cie_xyz(620);
    const RaySet all = read(indexed({3, 1, 2}).bytes());
    const double mean = (blue.y + green.y + red.y) / 3;
    expect_ray(all, 0, red / mean);
    expect_ray(all, 1, blue / mean);
    expect_ray(all, 2, green / mean);
    const RaySet first = read(indexed({1, 1}).bytes());
    EXPECT_NEAR((first.xyz - blue / blue.y).length(), 0, 1e-6) << "none has the last";
    EXPECT_EQ(first.spectra, (std::vector<Spectrum>{{{480, 1}}})) << "all rays have this one";
    EXPECT_TRUE(first.spectrum.empty());
    EXPECT_NEAR((read(indexed({3, 3}).bytes()).xyz - red / red.y).length(), 0, 1e-6);
    EXPECT_TRUE(monitor_.warnings.empty());
}

TEST_F(Tm25, SpectrumIndices_WithZeroAndWithoutTheLast_CountFromZeroWithAWarning) {
    const V3d blue = cie_xyz(480), red = cie_xyz(620);
    const RaySet set = read(indexed({2, 0}).bytes());
    const double mean = (blue.y + red.y) / 2;
    expect_ray(set, 0, red / mean);
    expect_ray(set, 1, blue / mean);
    ASSERT_EQ(monitor_.warnings.size(), 1U);
    EXPECT_THAT(monitor_.warnings[0], HasSubstr("ray 2 has the spectrum index 0"));
}

TEST_F(Tm25, SpectrumIndices_OutOfRange_NameTheRayAndTheRange) {
    const auto expect_refused = [&](std::initializer_list<float> indices, const char* what) {
        const std::string error = error_text(indexed(indices).bytes());
        EXPECT_THAT(error, HasSubstr(what));
        EXPECT_THAT(error, HasSubstr("from 1 to 3"));
    };
    expect_refused({1, 2, 4}, "ray 3 has the spectrum index 4");
    expect_refused({1, 0, 3, 0}, "ray 2 has the spectrum index 0");
    expect_refused({1, -1}, "ray 2 has the spectrum index -1");
    expect_refused({1, 1.5F}, "ray 2 has the spectrum index 1.5");
    expect_refused({NAN, 1}, "ray 1 has the spectrum index nan");
    expect_refused({INFINITY}, "ray 1 has the spectrum index inf");
    // A ray that is left out needs no valid index, but is counted.
    File file = indexed({1});
    file.row({NAN, 0, 0, 0, 0, 1, 1, 99});
    EXPECT_EQ(read(file.bytes()).rays.size(), 1U);
    file.row({0, 0, 0, 0, 0, 1, 1, 99});
    EXPECT_THAT(error_text(file.bytes()), HasSubstr("ray 3 has the spectrum index 99"));
    File none;
    none.spectral = 4;
    none.flags = {1, 1, 1, 0, 0, 0, 0, 1};
    none.row({0, 0, 0, 0, 0, 1, 1, 1});
    EXPECT_THAT(error_text(none.bytes()), HasSubstr("no spectral table"));
}

// NaNs as programs write them, in native and in swapped byte order.
constexpr std::uint32_t kNaNs[] = {0x7FC00001, 0xFFC00000, 0x7FA00000, 0x0100C07F,
                                   0x0000C07F, 0x0000A07F, 0x8000C07F};

TEST_F(Tm25, UnknownValues_AsNaNOfEitherByteOrder_AreUnknown) {
    for (const std::uint32_t bits : kNaNs) {
        SCOPED_TRACE(bits);
        const float unknown = std::bit_cast<float>(bits);
        File file;
        file.flags = {1, 1, 1, 0, 0, 0, 0, 0};
        file.row({0, 0, 0, 0, 0, 1, 5});
        file.row({0, 0, 0, 0, 0, 1, 15});
        file.lumens = file.watts = unknown;
        file.spectral = 1;
        file.wavelength = unknown;
        const RaySet set = read(file.bytes());
        EXPECT_EQ(set.flux, 20);
        EXPECT_EQ(set.rays[1].flux, 15);
        EXPECT_TRUE(std::isnan(set.header_watts) && std::isnan(set.header_lumens));
        EXPECT_EQ(set.lumens_per_watt, 0);
        EXPECT_EQ(set.xyz, kWhiteXyz);
        EXPECT_TRUE(monitor_.warnings.empty());

        // In a file with a wavelength for each ray, rays of unknown colour get the mean colour of the others.
        File rays;
        rays.spectral = 2;
        rays.flags = {1, 1, 1, 1, 0, 0, 0, 0};
        rays.row({0, 0, 0, 0, 0, 1, 1, 480});
        rays.row({0, 0, 0, 0, 0, 1, 1, 620});
        rays.row({0, 0, 0, 0, 0, 1, 1, unknown});
        const RaySet coloured = read(rays.bytes());
        expect_ray(coloured, 2, coloured.xyz);
        EXPECT_NEAR(coloured.lumens_per_watt, 683 * (cie_xyz(480).y + cie_xyz(620).y) / 2, 1e-3);
        File xyz;
        xyz.flags = {1, 1, 0, 0, 1, 0, 1, 0};
        xyz.row({0, 0, 0, 0, 0, 1, 2, 3, 0});
        xyz.row({0, 0, 0, 0, 0, 1, 2, 1, 4});
        xyz.row({0, 0, 0, 0, 0, 1, 2, unknown, unknown});
        const RaySet tristimulus = read(xyz.bytes());
        expect_ray(tristimulus, 0, {1.5, 1, 0});
        expect_ray(tristimulus, 2, {1, 1, 1});
    }
}

TEST_F(Tm25, OneColour_TakesNoMemoryPerRay) {
    File file;
    file.spectral = 2;
    file.flags[3] = 1;
    file.flags[4] = 1;
    file.row({0, 0, 0, 0, 0, 1, 620, 3});
    file.row({0, 0, 0, 0, 0, 1, 620, 1});
    const RaySet set = read(file.bytes());
    EXPECT_FALSE(set.coloured());
    EXPECT_NEAR((set.xyz - cie_xyz(620) / cie_xyz(620).y).length(), 0, 1e-6);
    EXPECT_FALSE(read(two_rays().bytes()).coloured());
    // Radiation outside the visible spectrum has no colour.
    File dark = file;
    dark.flags = {1, 1, 1, 1, 0, 0, 0, 0};
    dark.body.clear(), dark.rays = 0;
    dark.row({0, 0, 0, 0, 0, 1, 1, 940});
    const RaySet infrared = read(dark.bytes());
    EXPECT_FALSE(infrared.coloured());
    EXPECT_EQ(infrared.xyz, kWhiteXyz);
    EXPECT_EQ(infrared.lumens_per_watt, 0);
}

TEST_F(Tm25, ColoursOutsideTheGamut_StayWhatTheyAre) {
    File single = two_rays();
    single.spectral = 1;
    single.wavelength = 520;
    const RaySet set = read(single.bytes());
    EXPECT_EQ(set.xyz, cie_xyz(520) / cie_xyz(520).y);
    EXPECT_LT(xyz_to_rgb(set.xyz).x, -1) << "no sRGB";
    EXPECT_EQ(set.colour().x, 0);
}

TEST_F(Tm25, LyingHeaders_AreRefusedBeforeAnythingIsAllocated) {
    const auto with = [](const std::function<void(File&)>& spoil) {
        File file = two_rays();
        spoil(file);
        return file.bytes();
    };
    EXPECT_THAT(error_text(with([](File& f) { f.rays = ~std::uint64_t{0}; })),
                HasSubstr("truncated in the rays"));
    EXPECT_THAT(error_text(with([](File& f) { f.rays = 3; })), HasSubstr("truncated in the rays"));
    EXPECT_THAT(error_text(with([](File& f) { f.rays = 0; })), HasSubstr("0 rays"));
    EXPECT_THAT(error_text(with([](File& f) { f.version = 1; })), HasSubstr("2013"));
    EXPECT_THAT(
        error_text(with([](File& f) { f.version = 2020; })),
        HasSubstr("TM-25 version 2020 (ANSI/IES TM-25-20, whose layout is not public); expected 2013"));
    EXPECT_THAT(error_text(with([](File& f) { f.spectral = 9; })), HasSubstr("spectral"));
    EXPECT_THAT(error_text(with([](File& f) { f.tables = 2147483647; })), HasSubstr("spectral table"));
    EXPECT_THAT(error_text(with([](File& f) { f.tables = -1; })), HasSubstr("tables"));
    EXPECT_THAT(error_text(with([](File& f) { f.extras = 100000; })), HasSubstr("column names"));
    EXPECT_THAT(error_text(with([](File& f) { f.extras = -5; })), HasSubstr("additional items"));
    EXPECT_THAT(error_text(with([](File& f) { f.text_bytes = 1 << 30; })), HasSubstr("text"));
    EXPECT_THAT(error_text(with([](File& f) { f.flags[1] = 0; })), HasSubstr("direction"));
    EXPECT_THAT(error_text(with([](File& f) { f.flags[4] = 0; })), HasSubstr("flux"));
    EXPECT_THAT(error_text(with([](File& f) { f.flags[6] = 77; })), HasSubstr("tristimulus"));
    EXPECT_THAT(error_text("IESNA:LM-63-2002"), HasSubstr("it is an IES LM-63 photometric file"));
    EXPECT_THAT(error_text("TM25"), HasSubstr("truncated in the header"));
    EXPECT_THAT(error_text("T"), HasSubstr("not a ray file"));
    EXPECT_THAT(error_text(with([](File& f) { f.version = -586743808; })), HasSubstr("big-endian"));
    File blind;
    blind.row({NAN, 0, 0, 0, 0, 1, 1});
    EXPECT_THAT(error_text(blind.bytes()), HasSubstr("no ray is usable"));
    EXPECT_THROW(read_rays(folder_ / "none", monitor_), InputError);
}

TEST_F(Tm25, Damage_AnyByteOrLength_NeverCrashes) {
    File file = two_rays();
    file.lumens = 20;
    const std::string good = file.bytes();
    const auto survives = [&](const std::string& bytes) {
        try {
            for (const LampRay& ray : read(bytes).rays) EXPECT_NEAR(ray.d.length(), 1, 1e-5F);
        } catch (const InputError&) {
        }
    };
    Sampler sampler(3, Purpose::test, 0, 0);
    for (int i = 0; i < 400; ++i) {
        std::string bad = good;
        const std::size_t where = i % 3 == 0 ? 36288 + sampler.bits() % 56 : sampler.bits() % 288;
        bad[where] = static_cast<char>(sampler.bits());
        survives(bad);
    }
    for (std::size_t cut = 0; cut < 60; ++cut) survives(good.substr(0, good.size() - cut));
}

// The indices select the file's own two spectra, for 1000 rays of 0.5 mW each.
TEST(Tm25Data, IndicesOneAndTwo_GiveBothSpectra) {
    LUCERNA_NEED_DATA(path, "faults/rays/spectra-index-1-and-2.tm25ray");
    testing::ListeningMonitor monitor;
    const RaySet set = read_rays(path, monitor);
    EXPECT_TRUE(monitor.warnings.empty());
    EXPECT_TRUE(set.coloured());
    EXPECT_NEAR(set.lumens_per_watt, 177.6, 0.05);
    const double sum = set.xyz.x + set.xyz.y + set.xyz.z;
    EXPECT_NEAR(set.xyz.x / sum, 0.4161, 5e-5);
    EXPECT_NEAR(set.xyz.y / sum, 0.2278, 5e-5);
}

TEST(Tm25Data, FluxUnknownByByteSwappedNaN_IsTheSumOfTheRays) {
    LUCERNA_NEED_DATA(path, "faults/rays/unknown-flux-byte-swapped.tm25ray");
    testing::ListeningMonitor monitor;
    const RaySet set = read_rays(path, monitor);
    EXPECT_TRUE(monitor.warnings.empty());
    EXPECT_NEAR(set.flux, 1, 1e-6);
    EXPECT_EQ(set.lumens_per_watt, 0) << "neither flux is stated";
}

TEST(Tm25Data, OsramGreen_MatchesItsCheckValues) {
    LUCERNA_NEED_DATA(path, "osram-ostar-green-100k.tm25ray");
    testing::ListeningMonitor monitor;
    const RaySet set = read_rays(path, monitor);
    EXPECT_TRUE(monitor.warnings.empty());
    ASSERT_EQ(set.rays.size(), 100000U);
    EXPECT_EQ(set.unit, FluxUnit::lumen);
    EXPECT_EQ(set.flux, 337);
    EXPECT_NEAR(set.header_watts, 0.69379, 1e-5);
    V3d mean(0, 0, 0);
    double sum = 0;
    int down = 0;
    for (const LampRay& ray : set.rays) {
        mean += V3d(ray.d) / 1e5;
        sum += double{ray.flux};
        down += ray.d.z < 0;
        EXPECT_LE(std::fabs(ray.o.x), 0.002933F);
        EXPECT_TRUE(ray.o.z >= -0.001181F && ray.o.z <= 0.0000201F);
    }
    EXPECT_NEAR(sum, 337, 1e-3);
    EXPECT_NEAR(mean.x, 0.00036, 1e-5);
    EXPECT_NEAR(mean.y, -0.00491, 1e-5);
    EXPECT_NEAR(mean.z, 0.69570, 1e-5);
    EXPECT_EQ(down, 56);
    // A green beyond sRGB's gamut is mixed with grey until its red is just not negative.
    EXPECT_NEAR(luminance(set.colour()), 1, 1e-6F);
    EXPECT_EQ(set.colour().x, 0);
    EXPECT_GT(set.colour().y, 1.3F);
    EXPECT_GT(set.colour().z, 0);
}

TEST(Tm25Data, Cylinder_HeaderThatDisagrees_WinsWithAWarning) {
    LUCERNA_NEED_DATA(path, "cylinder-10k.tm25ray");
    testing::ListeningMonitor monitor;
    const RaySet set = read_rays(path, monitor);
    EXPECT_EQ(set.flux, 1);
    ASSERT_FALSE(monitor.warnings.empty());
    EXPECT_THAT(monitor.warnings[0], HasSubstr("the header's flux is used"));
}

}  // namespace tm25_test
}  // namespace lucerna
