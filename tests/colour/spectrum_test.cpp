#include "engine/colour/spectrum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

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

double linear_at(const Spectrum& spectrum, double nm) {
    const auto next =
        std::find_if(spectrum.begin(), spectrum.end(), [nm](auto s) { return s.nanometres >= nm; });
    if (next->nanometres == nm) return next->weight;
    const auto before = next - 1;
    return std::lerp(before->weight, next->weight,
                     (nm - before->nanometres) / (next->nanometres - before->nanometres));
}

void expect_chromaticity(const V3d& xyz, double x, double y, double near) {
    EXPECT_NEAR(xyz.x / (xyz.x + xyz.y + xyz.z), x, near);
    EXPECT_NEAR(xyz.y / (xyz.x + xyz.y + xyz.z), y, near);
}

// Published values of CIE 018:2019; 106.857 is the sum of ȳ.
TEST(Cie, Observer_HasItsPublishedValuesAndIntegrals) {
    EXPECT_EQ(cie_xyz(360), V3d(0.0001299, 0.000003917, 0.0006061));
    EXPECT_EQ(cie_xyz(555).y, 1);
    EXPECT_EQ(cie_xyz(600), V3d(1.0622, 0.631, 0.0008));
    EXPECT_EQ(cie_xyz(446).z, 1.7829682);
    EXPECT_EQ(cie_xyz(830), V3d(0.000001251141, 0.00000045181, 0));
    EXPECT_NEAR(cie_xyz(507).y, 0.4443096, 1e-12);
    EXPECT_NEAR(cie_xyz(700).y, 0.004102, 1e-12);
    V3d sum(0, 0, 0), most(0, 0, 0);
    for (int nm = kFirstVisible; nm <= kLastVisible; ++nm) {
        const V3d here = cie_xyz(nm);
        sum += here;
        for (int c = 0; c < 3; ++c) most[c] = std::max(most[c], here[c]);
        EXPECT_GE(std::min({here.x, here.y, here.z}), 0);
    }
    EXPECT_NEAR(sum.x, 106.865469, 1e-6);
    EXPECT_NEAR(sum.y, 106.856917, 1e-6);
    EXPECT_NEAR(sum.z, 106.892251, 1e-6);
    EXPECT_EQ(most, V3d(cie_xyz(599).x, 1, cie_xyz(446).z));
    EXPECT_EQ(most.x, 1.0629096);
}

// Detects a wrong digit: a cubic through four neighbours predicts each value. The table's knots every 5 nm
// deviate from it by up to 0.36 %; a wrong digit deviates more, because the values change by a few per cent
// per nanometre.
TEST(Cie, Observer_IsSmooth) {
    const auto roughness = [](double nm, int c, double error) {
        const auto at = [&](int step) { return cie_xyz(nm + step)[c]; };
        const double foretold = (4 * (at(-1) + at(1)) - at(-2) - at(2)) / 6;
        return std::fabs(at(0) + error - foretold) / std::max(at(0), 1e-4);
    };
    for (int nm = kFirstVisible + 2; nm <= kLastVisible - 2; ++nm) {
        for (int c = 0; c < 3; ++c) EXPECT_LT(roughness(nm, c, 0), 0.004) << nm << ' ' << c;
    }
    EXPECT_GT(roughness(507, 1, 0.4364 - 0.4443096), 0.004);
}

TEST(Cie, BetweenSamplesLinear_OutsideNothing) {
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(cie_xyz(500.25)[c], 0.75 * cie_xyz(500)[c] + 0.25 * cie_xyz(501)[c], 1e-15);
    }
    for (const double outside : {359.999, 830.001, -1e300, 1e300, std::numeric_limits<double>::infinity(),
                                 std::numeric_limits<double>::quiet_NaN()}) {
        EXPECT_EQ(cie_xyz(outside), V3d(0, 0, 0)) << outside;
    }
    const SpectralSample infrared[] = {{900, 1}, {1e300, 1}};
    EXPECT_EQ(spectrum_to_xyz(infrared), V3d(0, 0, 0));
}

// Integrates by brute force with a thousand steps per nanometre.
TEST(Cie, Integral_OfASpectrum_IsThatOfFineSteps) {
    const SpectralSample odd[] = {{300, 2}, {441.3, 0.5}, {441.9, 7}, {560, 1}, {560.2, 0}, {900, 4}};
    V3d sum(0, 0, 0);
    for (std::size_t i = 1; i < std::size(odd); ++i) {
        const auto &a = odd[i - 1], &b = odd[i];
        const double width = b.nanometres - a.nanometres;
        const int steps = static_cast<int>(std::ceil(width * 1000));
        for (int k = 0; k < steps; ++k) {
            const double x = (k + 0.5) / steps;
            sum += width / steps * (a.weight + x * (b.weight - a.weight)) * cie_xyz(a.nanometres + x * width);
        }
    }
    const V3d is = spectrum_to_xyz(odd);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(is[c] / sum[c], 1, 1e-7) << c;
}

// CIE 15:2004, table T.3 (2 degrees), has sums every 5 nm from 380 to 780 nm, five digits, and daylight's
// factors M1 and M2 rounded to three. These and the integral over the whole range differ by up to 2e-5.
TEST(Cie, Illuminants_HaveTheirPublishedChromaticities) {
    const auto summed = [](const auto& weight) {
        V3d sum(0, 0, 0);
        for (int nm = 380; nm <= 780; nm += 5) sum += weight(nm) * cie_xyz(nm);
        return sum;
    };
    const auto planck = [](double nm) { return std::pow(nm, -5) / std::expm1(1.435e7 / (2848 * nm)); };
    const auto daylight = [](double kelvin) {
        return [s = daylight_spectrum(kelvin * 1.4388 / 1.4380)](double nm) { return linear_at(s, nm); };
    };
    expect_chromaticity(summed([](double) { return 1.0; }), 1 / 3.0, 1 / 3.0, 0.6e-5);
    expect_chromaticity(summed(planck), 0.44758, 0.40745, 0.6e-5);
    expect_chromaticity(summed(daylight(6500)), 0.31272, 0.32903, 1.5e-5);
    expect_chromaticity(summed(daylight(5000)), 0.34567, 0.35851, 1.5e-5);

    const SpectralSample equal[] = {{360, 1}, {830, 1}};
    expect_chromaticity(spectrum_to_xyz(equal), 1 / 3.0, 1 / 3.0, 5e-5);
    const auto of = [](std::string_view name) { return rgb_to_xyz(*illuminant_rgb(name)); };
    expect_chromaticity(of("A"), 0.44758, 0.40745, 2e-5);
    expect_chromaticity(of("D65"), 0.31272, 0.32903, 2e-5);
    expect_chromaticity(of("D50"), 0.34567, 0.35851, 2e-5);
}

TEST(Cie, ColoursOutsideTheGamut_KeepLuminanceAndLoseSaturationOnly) {
    for (double nm = 400; nm <= 700; nm += 5) {
        const Rgb full = xyz_to_rgb(cie_xyz(nm));
        const Rgb colour = colour_of_luminance_one(full);
        EXPECT_NEAR(luminance(colour), 1, 1e-6F) << nm;
        EXPECT_GE(std::min({colour.x, colour.y, colour.z}), 0) << nm;
        // The colour lies on the line between grey and the full colour: (c - 1) is parallel to (full / y -
        // 1).
        const Rgb a = colour - Rgb(1);
        const Rgb b = full / luminance(full) - Rgb(1);
        const V3f across = V3f(a.x, a.y, a.z).cross(V3f(b.x, b.y, b.z));
        EXPECT_NEAR(across.length(), 0, 1e-3F * V3f(b.x, b.y, b.z).length()) << nm;
    }
    EXPECT_EQ(colour_of_luminance_one(Rgb(0)), Rgb(1));
    EXPECT_EQ(colour_of_luminance_one(Rgb(NAN)), Rgb(1));
    const Rgb inside = colour_of_luminance_one(Rgb(0.2F, 0.4F, 0.6F));
    EXPECT_NEAR(inside.z / inside.x, 3, 1e-5F);
}

// Compares with the tabulated values of CIE 15.
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
    expect_rgb(rgb / luminance(rgb), Rgb(1.0F), 5e-4F);
    // Y is the mean of the spectrum weighted by ȳ; by the tables it is 98.89 for 100 at 560 nm.
    EXPECT_NEAR(luminance(rgb), 98.89, 0.01);
}

TEST(Blackbody, Of6504Kelvin_IsNearWhiteAndOthersAreWarmOrCold) {
    const Rgb white = emission_rgb(blackbody_spectrum(6504));
    expect_rgb(white / luminance(white), {1.0429F, 0.9836F, 1.0359F}, 2e-4F);
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
    // The ratio of two wavelengths follows Planck's law.
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
    expect_rgb(*illuminant_rgb("D65"), Rgb(1.0F), 5e-4F);
    // Expected from the published chromaticities: A (0.44757, 0.40745), D50 (0.34567, 0.35850).
    const auto of = [](double x, double y) { return xyz_colour({x / y, 1, (1 - x - y) / y}); };
    expect_rgb(*illuminant_rgb("A"), of(0.44757, 0.40745), 2e-4F);
    expect_rgb(*illuminant_rgb("D50"), of(0.34567, 0.35850), 2e-4F);
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
    // The usual constants of silver assume no particular white, so equal_energy_rgb() replaces (1, 1, 1).
    expect_rgb(ratio_rgb(eta) * equal_energy_rgb(), {0.155F, 0.117F, 0.138F}, 0.001F);
    expect_rgb(ratio_rgb(k) * equal_energy_rgb(), {4.83F, 3.12F, 2.15F}, 0.005F);
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
              "b.spd:2:1: \"x\" is not a number; expected wavelengths in nm and values");
    EXPECT_EQ(refusal("400 1 400 2"),
              "b.spd:1:1: wavelength 400 follows 400; expected ascending wavelengths");
    EXPECT_EQ(refusal("400 1 500"), "b.spd: holds 3 numbers; expected pairs of wavelength and value");
    EXPECT_EQ(refusal("# nothing"), "b.spd: holds 0 numbers; expected pairs of wavelength and value");
    EXPECT_EQ(refusal("400 nan"),
              "b.spd:1:1: \"nan\" is not a number; expected wavelengths in nm and values");
}

}  // namespace spectrum_test
}  // namespace lucerna
