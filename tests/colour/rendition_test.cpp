// The spectra are those of CIE 15:2018, tables 10.1 and 12.1. In tables, R_a is a whole number.
#include "engine/colour/rendition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace rendition_test {

using Table = std::array<double, kBands>;
constexpr Table kFl1 = {
    1.87,  2.36,  2.94,  3.47,  5.17,  19.49, 6.13,  6.24,  7.01,  7.79,  8.56,  43.67, 16.94, 10.72,
    11.35, 11.89, 12.37, 12.75, 13,    13.15, 13.23, 13.17, 13.13, 12.85, 12.52, 12.2,  11.83, 11.5,
    11.22, 11.05, 11.03, 11.18, 11.53, 27.74, 17.05, 13.55, 14.33, 15.01, 15.52, 18.29, 19.55, 15.48,
    14.91, 14.15, 13.22, 12.19, 11.12, 10.03, 8.95,  7.96,  7.02,  6.2,   5.42,  4.73,  4.15,  3.64,
    3.2,   2.81,  2.47,  2.18,  1.93,  1.72,  1.67,  1.43,  1.29,  1.19,  1.08,  0.96,  0.88,  0.81,
    0.77,  0.75,  0.73,  0.68,  0.69,  0.64,  0.68,  0.69,  0.61,  0.52,  0.43,
};
constexpr Table kFl2 = {
    1.18,  1.48,  1.84,  2.15,  3.44,  15.69, 3.85,  3.74,  4.19,  4.62,  5.06,  34.98, 11.81, 6.27,
    6.63,  6.93,  7.19,  7.4,   7.54,  7.62,  7.65,  7.62,  7.62,  7.45,  7.28,  7.15,  7.05,  7.04,
    7.16,  7.47,  8.04,  8.88,  10.01, 24.88, 16.64, 14.59, 16.16, 17.56, 18.62, 21.47, 22.79, 19.29,
    18.66, 17.73, 16.54, 15.21, 13.8,  12.36, 10.95, 9.65,  8.4,   7.32,  6.31,  5.43,  4.68,  4.02,
    3.45,  2.96,  2.55,  2.19,  1.89,  1.64,  1.53,  1.27,  1.1,   0.99,  0.88,  0.76,  0.68,  0.61,
    0.56,  0.54,  0.51,  0.47,  0.47,  0.43,  0.46,  0.47,  0.4,   0.33,  0.27,
};
constexpr Table kFl7 = {
    2.56,  3.18,  3.84,  4.53,  6.15,  19.37, 7.37,  7.05,  7.71,  8.41,  9.15,  44.14, 17.52, 11.35,
    12,    12.58, 13.08, 13.45, 13.71, 13.88, 13.95, 13.93, 13.82, 13.64, 13.43, 13.25, 13.08, 12.93,
    12.78, 12.6,  12.44, 12.33, 12.26, 29.52, 17.05, 12.44, 12.58, 12.72, 12.83, 15.46, 16.75, 12.83,
    12.67, 12.45, 12.19, 11.89, 11.6,  11.35, 11.12, 10.95, 10.76, 10.42, 10.11, 10.04, 10.02, 10.11,
    9.87,  8.65,  7.27,  6.44,  5.83,  5.41,  5.04,  4.57,  4.12,  3.77,  3.46,  3.08,  2.73,  2.47,
    2.25,  2.06,  1.9,   1.75,  1.62,  1.54,  1.45,  1.32,  1.17,  0.99,  0.81,
};
constexpr Table kFl11 = {
    0.91,  0.63, 0.46, 0.37, 1.29,  12.68, 1.59,  1.79,  2.46,  3.33, 4.49, 33.94, 12.13, 6.95,
    7.19,  7.12, 6.72, 6.13, 5.46,  4.79,  5.66,  14.29, 14.96, 8.97, 4.72, 2.33,  1.47,  1.1,
    0.89,  0.83, 1.18, 4.9,  39.59, 72.84, 32.61, 7.52,  2.83,  1.96, 1.67, 4.43,  11.28, 14.76,
    12.73, 9.74, 7.33, 9.72, 55.27, 42.58, 13.18, 13.16, 12.26, 5.11, 2.07, 2.34,  3.58,  3.01,
    2.48,  2.14, 1.54, 1.33, 1.46,  1.94,  2,     1.2,   1.35,  4.1,  5.58, 2.51,  0.57,  0.27,
    0.23,  0.21, 0.24, 0.24, 0.2,   0.24,  0.32,  0.26,  0.16,  0.12, 0.09,
};
constexpr Table kFl12 = {
    0.96,  0.64,  0.4,  0.33,  1.19,  12.48, 1.12,  0.94,  1.08,  1.37, 1.78, 29.05, 7.9,   2.65,
    2.71,  2.65,  2.49, 2.33,  2.1,   1.91,  3.01,  10.83, 11.88, 6.88, 3.43, 1.49,  0.92,  0.71,
    0.6,   0.63,  1.1,  4.56,  34.4,  65.4,  29.48, 7.16,  3.08,  2.47, 2.27, 5.09,  11.96, 15.32,
    14.27, 11.86, 9.28, 12.31, 68.53, 53.02, 14.67, 14.38, 14.71, 6.46, 2.57, 2.75,  4.18,  3.44,
    2.81,  2.42,  1.64, 1.36,  1.49,  2.14,  2.34,  1.42,  1.61,  5.04, 6.98, 3.19,  0.71,  0.3,
    0.26,  0.23,  0.28, 0.28,  0.21,  0.17,  0.21,  0.19,  0.15,  0.1,  0.05,
};
constexpr Table kLedB1 = {
    0,     0.01,  0.01, 0.02,  0.04,  0.07,  0.15,  0.28,  0.53,  0.92,  1.54,  2.52,  4.16,  6.39,
    7.89,  7.57,  6.25, 5.16,  4.37,  3.84,  3.7,   3.88,  4.26,  4.79,  5.41,  6.05,  6.7,   7.34,
    7.98,  8.64,  9.31, 10.02, 10.76, 11.53, 12.38, 13.28, 14.23, 15.2,  16.2,  17.19, 18.14, 19.02,
    19.78, 20.38, 20.8, 21,    20.97, 20.71, 20.23, 19.56, 18.76, 17.82, 16.78, 15.66, 14.49, 13.31,
    12.15, 11.02, 9.95, 8.93,  7.98,  7.1,   6.3,   5.57,  4.89,  4.26,  3.72,  3.25,  2.83,  2.47,
    2.15,  1.87,  1.63, 1.42,  1.25,  1.1,   0.97,  0.86,  0.76,  0.68,  0.61,
};

BandSpectrum at_100_lx(BandSpectrum spectrum) {
    return 100 / band_lumens(spectrum) * spectrum;
}
BandSpectrum of(const Table& table) {
    return at_100_lx({table});
}
// The formulas of A and of daylight are of older values of the radiation constant c2.
BandSpectrum illuminant_a() {
    return at_100_lx(banded(blackbody_spectrum(2848 * 1.438777 / 1.4350)));
}
BandSpectrum daylight(double kelvin) {
    return at_100_lx(banded(daylight_spectrum(kelvin * 1.4388 / 1.4380)));
}
ColourRendition rendition(const BandSpectrum& spectrum) {
    return colour_rendition(spectrum).value();
}

TEST(ColourRendition, OfReferenceIlluminants_IsPerfect) {
    for (const BandSpectrum& light : {illuminant_a(), daylight(5500), daylight(6500)}) {
        const ColourRendition of_light = rendition(light);
        for (const double special : of_light.special) EXPECT_NEAR(special, 100, 0.02);
        EXPECT_NEAR(of_light.general, 100, 0.01);
        EXPECT_NEAR(of_light.fidelity, 100, 0.01);
        EXPECT_NEAR(of_light.gamut, 100, 0.01);
    }
    // Between 4000 and 5000 K a black body is no longer its own reference in TM-30, and still is in CIE 13.3.
    const ColourRendition between = rendition(banded(blackbody_spectrum(4900)));
    EXPECT_NEAR(between.general, 100, 0.02);
    EXPECT_LT(between.fidelity, 99);
}

// CIE 15:2018, table 10.2, has CCT and R_a of fluorescent lamps.
TEST(ColourRendition, OfFluorescentLamps_IsThePublishedOne) {
    const struct {
        const Table& table;
        double kelvin, general;
    } published[] = {
        {kFl1, 6430, 76}, {kFl2, 4230, 64}, {kFl7, 6500, 90}, {kFl11, 4000, 83}, {kFl12, 3000, 83}};
    for (const auto& lamp : published) {
        const ColourRendition of_lamp = rendition(of(lamp.table));
        EXPECT_NEAR(of_lamp.temperature.kelvin, lamp.kelvin, 6);
        EXPECT_NEAR(of_lamp.general, lamp.general, 0.5) << lamp.kelvin;
    }
}

// The indices of FL1 are those of NIST's spreadsheet [colour-science 2025], which takes its colour
// temperature from another table.
TEST(ColourRendition, OfEachSample_AgreesWithAnotherProgram) {
    const double expected[14] = {69.20, 83.65,  92.14, 72.67, 73.89, 79.62, 82.27,
                                 53.39, -47.28, 61.57, 67.52, 74.89, 72.77, 94.88};
    const ColourRendition of_lamp = rendition(of(kFl1));
    for (std::size_t i = 0; i < 14; ++i) EXPECT_NEAR(of_lamp.special[i], expected[i], 0.3) << i + 1;
    // A spectrum that is off by one band is rejected.
    Table shifted = kFl1;
    std::rotate(shifted.begin(), shifted.begin() + 1, shifted.end());
    const ColourRendition wrong = rendition(of(shifted));
    EXPECT_GT(std::fabs(wrong.r9() - expected[8]), 3);
    EXPECT_GT(std::fabs(wrong.general - 75.85), 1);
}

// The calculator of TM-30-18 [colour-science 2025] has 70, 86, 4225 K and 0.0019 for FL2; CIE 224's
// has 70.1.
TEST(ColourRendition, FidelityAndGamut_AreThoseOfThePublishedCalculators) {
    const ColourRendition of_lamp = rendition(of(kFl2));
    EXPECT_NEAR(of_lamp.fidelity, 70.12, 0.01);
    EXPECT_NEAR(of_lamp.gamut, 86, 0.5);
    EXPECT_NEAR(of_lamp.temperature.kelvin, 4225, 1);
    EXPECT_NEAR(of_lamp.temperature.duv, 0.0018, 1e-4);
    EXPECT_NEAR(rendition(of(kFl1)).fidelity, 80.6, 0.1);
}

TEST(ColourRendition, OfLightThatIsNotNearlyWhite_IsNone) {
    EXPECT_FALSE(colour_rendition(banded(Spectrum{{530, 1}})));
    EXPECT_FALSE(colour_rendition(banded(blackbody_spectrum(30000))));
    EXPECT_FALSE(colour_rendition(BandSpectrum{}));
}

// 100 lx are these melanopic equivalent daylight illuminances [Rudawski 2025]. The published sums are over 1
// nm; of a line spectrum that is known every 5 nm, the two differ by 0.1 %.
TEST(MelanopicEdi, OfIlluminants_IsThePublishedOne) {
    EXPECT_NEAR(melanopic_edi(illuminant_a()), 49.581, 0.01);
    EXPECT_NEAR(melanopic_edi(daylight(6500)), 100, 0.03);
    EXPECT_NEAR(melanopic_edi(daylight(5500)), 90.402, 0.06);
    EXPECT_NEAR(melanopic_edi(of(kFl12)), 40.420, 0.08);
    EXPECT_GT(std::fabs(melanopic_edi(of(kFl11)) - 40.420), 10);
}

TEST(MelanopicEdi, OfAnLed_IsTheSumOfItsTable) {
    double sum = 0, lumens = 0;
    for (std::size_t i = 0; i < kBands; ++i) {
        sum += 5 * kLedB1[i] * melanopic_action()[i];
        lumens += 683 * 5 * kLedB1[i] * cie_xyz(380 + 5.0 * static_cast<double>(i)).y;
    }
    EXPECT_NEAR(melanopic_edi(of(kLedB1)), 100 * sum / lumens / 1.3262e-3, 1e-9);
    EXPECT_NEAR(rendition(of(kLedB1)).temperature.kelvin, 2733, 1);  // CIE 15:2018, table 12.2
}

TEST(Banded, Samples_KeepTheirPower) {
    // Fine samples, and a line, keep ∫ s dλ and ∫ s λ dλ, as 1 and λ are linear.
    const Spectrum fine = {{400, 0}, {401.5, 3}, {404, 1}, {404.25, 8}, {433, 2}, {433.5, 0}};
    double power = 0, moment = 0;
    for (std::size_t i = 1; i < fine.size(); ++i) {
        const auto &a = fine[i - 1], &b = fine[i];
        const double h = b.nanometres - a.nanometres;
        power += 0.5 * h * (a.weight + b.weight);
        moment += h / 6 *
                  (a.nanometres * a.weight + b.nanometres * b.weight +
                   (a.nanometres + b.nanometres) * (a.weight + b.weight));
    }
    const auto moment_of = [](const BandSpectrum& s) {
        double sum = 0;
        for (std::size_t i = 0; i < kBands; ++i) sum += 5 * s.at[i] * BandSpectrum::nanometres(i);
        return sum;
    };
    EXPECT_NEAR(banded(fine).integral(), power, 1e-10);
    EXPECT_NEAR(moment_of(banded(fine)), moment, 1e-7);
    const BandSpectrum line = banded(Spectrum{{528, 2}});
    EXPECT_NEAR(line.integral(), 2, 1e-12);
    EXPECT_NEAR(moment_of(line), 2 * 528, 1e-9);
    EXPECT_NEAR(band_xyz(line).y, 2 * (0.4 * cie_xyz(525).y + 0.6 * cie_xyz(530).y), 1e-12);
    // Light beyond the bands is left out.
    EXPECT_EQ(banded(Spectrum{{900, 1}}).integral(), 0);
    EXPECT_EQ(banded(Spectrum{{360, 1}, {361, 1}, {375, 1}}).integral(), 0);
}

TEST(Banded, TablesOfTheBandsOwnStep_StayAsTheyAre) {
    Spectrum table;
    for (std::size_t i = 0; i < kBands; ++i) table.push_back({BandSpectrum::nanometres(i), kFl2[i]});
    EXPECT_EQ(banded(table).at, kFl2);
    // Between samples 10 nm apart, values are linear; beyond the ends there is nothing.
    const BandSpectrum coarse = banded(Spectrum{{400, 1}, {410, 3}, {420, 3}});
    EXPECT_EQ(coarse.at[3], 0);
    EXPECT_EQ(coarse.at[4], 1);
    EXPECT_EQ(coarse.at[5], 2);
    EXPECT_EQ(coarse.at[8], 3);
    EXPECT_EQ(coarse.at[9], 0);
}

}  // namespace rendition_test
}  // namespace lucerna
