#include "engine/base/spectrum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/support/error_of.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace spectrum_test {

void expect_rgb(const Rgb& is, const Rgb& should, float near) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(is[c], should[c], near) << c << ": " << is << " " << should;
}

double value_at(const Spectrum& spectrum, double nm) {
    const auto next =
        std::find_if(spectrum.begin(), spectrum.end(), [nm](auto s) { return s.nanometres >= nm; });
    return next->weight;
}

// Tabulated values of CIE 15.
TEST(Daylight, D65AndD50_HaveTheirTabulatedValues) {
    const Spectrum d65 = daylight_spectrum(6500 * 1.4388 / 1.4380),
                   d50 = daylight_spectrum(5000 * 1.4388 / 1.4380);
    EXPECT_NEAR(value_at(d65, 450), 117.008, 0.05);
    EXPECT_NEAR(value_at(d65, 560), 100, 1e-9);
    EXPECT_NEAR(value_at(d65, 600), 90.006, 0.05);
    EXPECT_NEAR(value_at(d65, 700), 71.609, 0.05);
    EXPECT_NEAR(value_at(d50, 450), 87.25, 0.1);
    EXPECT_NEAR(value_at(d50, 650), 95.67, 0.1);
}

TEST(Spectrum, D65_IsWhite) {
    const Spectrum d65 = daylight_spectrum(6500 * 1.4388 / 1.4380);
    const Rgb rgb = emission_rgb(d65);
    expect_rgb(rgb / luminance(rgb), Rgb(1.0F), 0.01F);
    // Y is the mean of the spectrum under ȳ; by the tables 98.89 beside 100 at 560 nm.
    EXPECT_NEAR(luminance(rgb), 98.9, 0.3);
}

TEST(Blackbody, Of6504Kelvin_IsNearWhiteAndOthersAreWarmOrCold) {
    const Rgb white = emission_rgb(blackbody_spectrum(6504));
    expect_rgb(white / luminance(white), {1.04F, 0.985F, 1.035F}, 0.015F);
    const Rgb candle = emission_rgb(blackbody_spectrum(1900));
    EXPECT_GT(candle.x, 4 * candle.z);
    const Rgb sky = emission_rgb(blackbody_spectrum(12000));
    EXPECT_GT(sky.z, 1.5F * sky.x);
}

TEST(Blackbody, LargestValue_IsOneWhereWienSays) {
    const Spectrum body = blackbody_spectrum(5000);  // 579.6 nm
    double largest = 0, at = 0;
    for (const auto& s : body) {
        if (s.weight > largest) largest = s.weight, at = s.nanometres;
    }
    EXPECT_NEAR(largest, 1, 1e-4);
    EXPECT_NEAR(at, 580, 2.5);
    // Ratio of two wavelengths by Planck's law.
    const double ratio = std::pow(600.0 / 450, 5) * std::expm1(1.438777e7 / (600 * 5000.0)) /
                         std::expm1(1.438777e7 / (450 * 5000.0));
    EXPECT_NEAR(value_at(body, 450) / value_at(body, 600), ratio, 1e-9);
    for (const double kelvin : {300.0, 1e6}) {
        for (const auto& s : blackbody_spectrum(kelvin)) EXPECT_TRUE(std::isfinite(s.weight));
    }
}

TEST(Illuminants, HaveLuminanceOneAndTheirColours) {
    for (const std::string_view name : illuminant_names()) {
        EXPECT_NEAR(luminance(*illuminant_rgb(name)), 1, 1e-4) << name;
    }
    expect_rgb(*illuminant_rgb("D65"), Rgb(1.0F), 0.01F);
    // By the published chromaticities: A (0.44757, 0.40745), D50 (0.34567, 0.35850), within the fit's 1 %.
    const auto of = [](double x, double y) { return xyz_colour({x / y, 1, (1 - x - y) / y}); };
    expect_rgb(*illuminant_rgb("A"), of(0.44757, 0.40745), 0.02F);
    expect_rgb(*illuminant_rgb("D50"), of(0.34567, 0.35850), 0.02F);
    expect_rgb(*illuminant_rgb("F7"), Rgb(1.0F), 0.02F);  // daylight tubes
    EXPECT_FALSE(illuminant_rgb("F13"));
}

TEST(Ratios, AreWhiteBalancedAndKeepTheirBounds) {
    const SpectralSample one[] = {{400, 0.7}};
    expect_rgb(ratio_rgb(one), Rgb(0.7F), 1e-6F);
    EXPECT_GT(emission_rgb(one).x, 0.8F) << "as a light, equal energy is pink";
    EXPECT_NEAR(luminance(emission_rgb(one)), 0.7F, 1e-3F);
    const SpectralSample red[] = {{360, 0}, {600, 0}, {610, 1}, {830, 1}};
    const Rgb rgb = ratio_rgb(red);
    EXPECT_GT(rgb.x, 0.6F);
    EXPECT_LE(max_component(rgb), 1) << "a reflectance stays one";
    EXPECT_GE(std::min(rgb.y, rgb.z), 0);
}

TEST(Spd, Silver_IsTheOneOfTheTables) {
    LUCERNA_NEED_DATA(folder, "pbrt/pbrt-v2/spds/metals");
    const Spectrum eta = read_spd(folder / "Ag.eta.spd"), k = read_spd(folder / "Ag.k.spd");
    // The usual constants of silver lack a white of their own: equal_energy_rgb() takes the place of (1, 1,
    // 1).
    expect_rgb(ratio_rgb(eta) * equal_energy_rgb(), {0.155F, 0.117F, 0.138F}, 0.003F);
    expect_rgb(ratio_rgb(k) * equal_energy_rgb(), {4.83F, 3.12F, 2.15F}, 0.05F);
}

TEST(Spd, Text_MayHaveCommentsAndAnyLayout) {
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "a.spd") << "# silver\n400, 1 # here\n\n 500\n2; 600 3\n";
    const Spectrum spectrum = read_spd(folder / "a.spd");
    ASSERT_EQ(spectrum.size(), 3U);
    EXPECT_EQ(spectrum[1].nanometres, 500);
    EXPECT_EQ(spectrum[2].weight, 3);
    const auto refusal = [&](const std::string& text) {
        std::ofstream(folder / "b.spd") << text;
        const std::string message = testing::error_of([&] { read_spd(folder / "b.spd"); });
        return message.substr(message.rfind('/') + 1);
    };
    EXPECT_EQ(refusal("400 1\n500 x\n"),
              "b.spd:2:1: \"x\" is no number; wavelengths in nm and values are accepted");
    EXPECT_EQ(refusal("400 1 400 2"),
              "b.spd:1:1: wavelength 400 does not follow 400; rising ones are accepted");
    EXPECT_EQ(refusal("400 1 500"), "b.spd: holds 3 numbers; pairs of wavelength and value are accepted");
    EXPECT_EQ(refusal("# nothing"), "b.spd: holds 0 numbers; pairs of wavelength and value are accepted");
    EXPECT_EQ(refusal("400 nan"),
              "b.spd:1:1: \"nan\" is no number; wavelengths in nm and values are accepted");
}

}  // namespace spectrum_test
}  // namespace lucerna
