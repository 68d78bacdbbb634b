// UGR tables: beside those that ugr_tables.py computes independently, and beside CIE 190's own example; the
// shares of flux and the interreflection beside closed forms and CIE 190's tables.
#include "engine/photometry/ugr_table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/photometry/position_table.h"
#include "engine/photometry/ugr_text.h"
#include "lights/photometric.h"
#include "lights/photometric_files.h"
#include "tests/photometry/ugr_tables.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace ugr_table_test {

// The luminaires of ugr_tables.py.

UgrLuminaire lambertian() {
    UgrLuminaire luminaire;
    luminaire.intensity = [](const V3d& w) { return 1000 / kPiD * std::max(0.0, w.z); };
    luminaire.projected_area = [](const V3d& w) { return 0.36 * std::fabs(w.z); };
    return luminaire;
}

UgrLuminaire of_web(const PhotometricWeb& web, const std::array<double, 2>& facing) {
    return {[&web](const V3d& w) { return web.intensity(w); },
            [&web](const V3d& w) { return web.info().opening.projected_area(w); }, web.info().lamp_lumens,
            facing};
}

struct Difference {
    double greatest = 0, mean = 0;
};

Difference difference(const UgrTable& table, const Ratings& expected) {
    Difference result;
    for (std::size_t i = 0; i < kUgrRooms.size(); ++i) {
        for (const std::size_t view : {kCrosswise, kEndwise}) {
            for (std::size_t j = 0; j < kUgrReflectances.size(); ++j) {
                const double off = table.uncorrected[i][view][j] - expected[i][view][j];
                result.greatest = std::max(result.greatest, std::fabs(off));
                result.mean += off / 190;
            }
        }
    }
    return result;
}

void report(const std::string& what, const Difference& of) {
    std::puts(
        fmt::format("{}: differences of UGR {:+.4f} in the mean, {:.4f} at most", what, of.mean, of.greatest)
            .c_str());
}

constexpr double kAgreement = 0.01;  // of UGR, between two implementations

TEST(UgrTable, OfALambertianLuminaire_IsThatOfTheIndependentComputation) {
    const Difference close = difference(ugr_table(lambertian(), 4), kLambertian);
    const Difference wide = difference(ugr_table(lambertian(), 1), kLambertianAtS1H);
    report("Lambertian, S/H = 0.25", close);
    report("Lambertian, S/H = 1", wide);
    EXPECT_LE(close.greatest, kAgreement);
    EXPECT_LE(wide.greatest, kAgreement);
    // The test must detect the other spacing.
    EXPECT_GT(difference(ugr_table(lambertian(), 1), kLambertian).greatest, 0.1);
}

TEST(UgrTable, OfRealFiles_IsThatOfTheIndependentComputation) {
    Monitor silent;
    LUCERNA_NEED_DATA(ies, std::filesystem::path("photometry") / "examp1.ies");
    LUCERNA_NEED_DATA(ldt, std::filesystem::path("photometry") / "fluorescent_luminaire.ldt");
    const PhotometricWeb up_and_down = read_photometric(ies, silent), louvre = read_photometric(ldt, silent);
    const Difference first = difference(ugr_table(of_web(up_and_down, {90, 0}), 4), kExamp1);
    const Difference second = difference(ugr_table(of_web(louvre, {0, 90}), 4), kFluorescent);
    report("examp1.ies", first);
    report("fluorescent_luminaire.ldt", second);
    EXPECT_LE(first.greatest, kAgreement);
    EXPECT_LE(second.greatest, kAgreement);
    // The test must detect that crosswise and endwise are exchanged.
    EXPECT_GT(difference(ugr_table(of_web(up_and_down, {0, 90}), 4), kExamp1).greatest, 0.5);
    EXPECT_GT(difference(ugr_table(of_web(louvre, {90, 0}), 4), kFluorescent).greatest, 0.5);
}

// CIE 190:2010's example: a louvre of 1 m x 0.316 m with 65 % of its lamps' flux. Intensities for 1000 lm in
// the planes C = 0, 15 ... 90 at γ = 0, 5 ... 90, symmetric to both planes, and the standard's table for S =
// H, as transcribed by [eulumdat-ugr 2026].
// clang-format off
constexpr double kExampleIntensities[7][19] = {
    {264, 264, 258, 258, 242, 216, 193, 178, 158, 136, 114, 92, 72, 54, 44, 27, 22, 14, 5},
    {264, 265, 257, 257, 244, 218, 194, 179, 160, 135, 115, 94, 73, 55, 44, 29, 21, 14, 5},
    {264, 264, 258, 255, 246, 223, 197, 181, 162, 140, 118, 99, 77, 59, 43, 34, 20, 13, 4},
    {264, 265, 260, 255, 249, 232, 208, 182, 167, 145, 123, 105, 86, 65, 47, 33, 18, 12, 3},
    {264, 264, 262, 256, 249, 238, 222, 194, 171, 153, 130, 111, 92, 75, 55, 36, 21, 8, 1},
    {264, 263, 261, 258, 251, 240, 231, 214, 189, 163, 143, 119, 99, 79, 61, 44, 25, 8, 0},
    {264, 264, 260, 257, 250, 240, 232, 217, 204, 184, 152, 125, 101, 79, 60, 43, 25, 9, 0}
};
constexpr Ratings kExampleTable = {
    {{8.9, 10.5, 9.3, 10.8, 11.1}, {10.7, 12.2, 11.0, 12.5, 12.9}},
    {{10.5, 11.9, 10.8, 12.2, 12.6}, {12.4, 13.8, 12.8, 14.2, 14.5}},
    {{11.0, 12.3, 11.4, 12.6, 13.0}, {13.1, 14.5, 13.5, 14.8, 15.2}},
    {{11.5, 12.7, 11.9, 13.1, 13.5}, {13.6, 14.8, 14.0, 15.2, 15.6}},
    {{11.7, 12.9, 12.2, 13.3, 13.7}, {13.8, 14.9, 14.2, 15.3, 15.7}},
    {{12.0, 13.2, 12.5, 13.5, 14.0}, {13.8, 15.0, 14.3, 15.3, 15.8}},
    {{9.6, 11.0, 10.0, 11.3, 11.7}, {11.0, 12.4, 11.4, 12.7, 13.1}},
    {{11.4, 12.5, 11.8, 12.9, 13.3}, {13.0, 14.1, 13.4, 14.5, 14.9}},
    {{12.0, 13.0, 12.4, 13.4, 13.9}, {13.9, 14.9, 14.3, 15.3, 15.7}},
    {{12.7, 13.5, 13.1, 14.0, 14.4}, {14.5, 15.4, 15.0, 15.8, 16.3}},
    {{13.0, 13.8, 13.5, 14.2, 14.7}, {14.7, 15.5, 15.2, 16.0, 16.4}},
    {{13.4, 14.1, 13.8, 14.6, 15.0}, {14.8, 15.6, 15.3, 16.0, 16.5}},
    {{12.4, 13.2, 12.8, 13.6, 14.1}, {14.0, 14.8, 14.5, 15.3, 15.8}},
    {{13.2, 13.8, 13.7, 14.3, 14.8}, {14.8, 15.4, 15.3, 15.9, 16.4}},
    {{13.6, 14.2, 14.1, 14.7, 15.2}, {15.0, 15.6, 15.5, 16.1, 16.6}},
    {{14.1, 14.7, 14.6, 15.1, 15.7}, {15.2, 15.7, 15.7, 16.2, 16.8}},
    {{12.4, 13.1, 12.9, 13.6, 14.1}, {14.0, 14.8, 14.5, 15.2, 15.7}},
    {{13.2, 13.8, 13.8, 14.3, 14.8}, {14.8, 15.4, 15.3, 15.9, 16.4}},
    {{13.7, 14.3, 14.3, 14.8, 15.3}, {15.1, 15.6, 15.6, 16.1, 16.7}},
};
// clang-format on

// Returns the value at `t` in [0, 1] between the second and the third of four values, by Catmull and Rom's
// cubic.
double between(const std::array<double, 4>& v, double t) {
    return v[1] + 0.5 * t *
                      (v[2] - v[0] +
                       t * (2 * v[0] - 5 * v[1] + 4 * v[2] - v[3] + t * (3 * (v[1] - v[2]) + v[3] - v[0])));
}

// Returns the example with `more` cd added to each intensity that is not 0. Between the entries the intensity
// is smooth: straight lines between planes 15 degrees apart would change ratings by up to 0.05.
UgrLuminaire example_of_cie190(double more = 0) {
    const auto entry = [more](int plane, int row) {
        plane = plane > 6 ? 12 - plane : std::abs(plane);
        row = std::min(std::abs(row), 18);
        const double candela = kExampleIntensities[plane][row];
        return candela > 0 ? candela + more : 0.0;
    };
    UgrLuminaire luminaire;
    luminaire.intensity = [entry](const V3d& w) {
        if (!(w.z > 0)) return 0.0;
        const double c = std::atan2(std::fabs(w.y), std::fabs(w.x)) * 180 / kPiD / 15;
        const double gamma = std::acos(std::min(w.z, 1.0)) * 180 / kPiD / 5;
        const int plane = static_cast<int>(c), row = static_cast<int>(gamma);
        std::array<double, 4> along{};
        for (int i = 0; i < 4; ++i) {
            std::array<double, 4> across{};
            for (int j = 0; j < 4; ++j) across[j] = entry(plane + j - 1, row + i - 1);
            along[i] = between(across, c - plane);
        }
        return std::max(0.0, between(along, gamma - row));
    };
    luminaire.projected_area = [](const V3d& w) { return 0.316 * std::fabs(w.z); };
    return luminaire;
}

TEST(Cie190, TableOfItsExample_IsTheStandards) {
    const UgrTable table = ugr_table(example_of_cie190(), 1);
    const UgrTable least = ugr_table(example_of_cie190(-0.5), 1), most = ugr_table(example_of_cie190(0.5), 1);
    report("CIE 190's example", difference(table, kExampleTable));
    // The standard's intensities are rounded to 1 cd, its ratings to 0.1 and its transfer factors to 0.001.
    for (std::size_t i = 0; i < kUgrRooms.size(); ++i) {
        for (std::size_t j = 0; j < kUgrReflectances.size(); ++j) {
            const double factor = ugr_transfer(kUgrRooms[i], kUgrReflectances[j]).from_floor;
            const double rounding = 0.05 + 8 * std::log10(1 + 0.0005 / factor);
            for (const std::size_t view : {kCrosswise, kEndwise}) {
                const double published = kExampleTable[i][view][j];
                EXPECT_GE(published, least.uncorrected[i][view][j] - rounding)
                    << i << ' ' << view << ' ' << j;
                EXPECT_LE(published, most.uncorrected[i][view][j] + rounding) << i << ' ' << view << ' ' << j;
            }
        }
    }
    std::puts(fmt::format("by intensities 0.5 cd smaller and larger: {:+.3f} and {:+.3f} in 4H x 8H",
                          least.uncorrected[10][0][0] - table.uncorrected[10][0][0],
                          most.uncorrected[10][0][0] - table.uncorrected[10][0][0])
                  .c_str());
    // The test must detect that crosswise and endwise are exchanged, and the other spacing.
    UgrLuminaire exchanged = example_of_cie190();
    exchanged.facing = {90, 0};
    EXPECT_GT(difference(ugr_table(exchanged, 1), kExampleTable).greatest, 1);
    EXPECT_GT(difference(ugr_table(example_of_cie190(), 4), kExampleTable).greatest, 0.3);
}

// CIE 190:2010, Table 5: from floor, walls and ceiling, as transcribed by [eulumdat-ugr 2026].
struct TransferRow {
    UgrRoom room;
    double factors[5][3];
};
constexpr TransferRow kTransfers[] = {{{2, 2},
                                       {{0.220, 0.422, 0.646},
                                        {0.188, 0.217, 0.553},
                                        {0.198, 0.380, 0.445},
                                        {0.172, 0.198, 0.386},
                                        {0.157, 0.181, 0.227}}},
                                      {{4, 8},
                                       {{0.115, 0.211, 0.307},
                                        {0.106, 0.117, 0.283},
                                        {0.100, 0.187, 0.211},
                                        {0.093, 0.104, 0.196},
                                        {0.081, 0.092, 0.114}}},
                                      {{12, 8},
                                       {{0.071, 0.133, 0.183},
                                        {0.067, 0.076, 0.174},
                                        {0.061, 0.117, 0.125},
                                        {0.058, 0.067, 0.120},
                                        {0.049, 0.059, 0.069}}}};

TEST(Cie190, TransferFactors_AreTheStandards) {
    double worst = 0;
    for (const TransferRow& row : kTransfers) {
        for (std::size_t i = 0; i < kUgrReflectances.size(); ++i) {
            const UgrTransfer found = ugr_transfer(row.room, kUgrReflectances[i]);
            worst = std::max({worst, std::fabs(found.from_floor - row.factors[i][0]),
                              std::fabs(found.from_walls - row.factors[i][1]),
                              std::fabs(found.from_ceiling - row.factors[i][2])});
        }
    }
    std::puts(fmt::format("transfer factors: {:.5f} at most from CIE 190's, which have three digits", worst)
                  .c_str());
    EXPECT_LE(worst, 0.001);  // a unit of the last digit
}

// Returns the form factor from a small horizontal surface to a rectangle parallel to it at distance 1 that
// begins below it and extends over x and y, of either sign.
double corner_factor(double x, double y) {
    const double a = std::sqrt(1 + x * x), b = std::sqrt(1 + y * y);
    return (x / a * std::atan(y / a) + y / b * std::atan(x / b)) / (2 * kPiD);
}

// Returns the share of a Lambertian luminaire's light on the floor by its distances to the walls, in closed
// form.
double lambertian_floor_share(const UgrRoom& room, int per_height) {
    double share = 0;
    const int columns = room.across * per_height, rows = room.along * per_height;
    for (int i = 0; i < columns; ++i) {
        for (int j = 0; j < rows; ++j) {
            const double x = (i + 0.5) / per_height, y = (j + 0.5) / per_height;
            for (const double to_x : {x, room.across - x}) {
                for (const double to_y : {y, room.along - y}) share += corner_factor(to_x, to_y);
            }
        }
    }
    return share / (columns * rows);
}

// Returns this share by integrating ugr_floor_share() over the angle from nadir.
double integrated_floor_share(const UgrRoom& room, int per_height) {
    constexpr int kSteps = 900;
    double share = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double gamma = (i + 0.5) * kPiD / 2 / kSteps;
        share += ugr_floor_share(room, per_height, gamma) * std::sin(2 * gamma) * kPiD / 2 / kSteps;
    }
    return share;
}

TEST(UgrTable, LightOnTheFloor_IsThatOfClosedForms) {
    double worst = 0;
    for (const UgrRoom& room : kUgrRooms) {
        for (const int per_height : {1, 4}) {
            const double exact = lambertian_floor_share(room, per_height);
            worst = std::max(worst, std::fabs(integrated_floor_share(room, per_height) / exact - 1));
        }
        // Many luminaires are a uniform ceiling.
        EXPECT_NEAR(lambertian_floor_share(room, 16), opposed_form_factor(room.across, room.along), 3e-4);
    }
    std::puts(fmt::format("light on the floor: relative error {:.5f} at most", worst).c_str());
    EXPECT_LE(worst, 1e-3);
    // Straight down all light falls on the floor, and at grazing angles none.
    EXPECT_EQ(ugr_floor_share({2, 2}, 1, 0), 1);
    EXPECT_EQ(ugr_floor_share({2, 2}, 1, 1.57), 0);
}

TEST(UgrTable, OpposedFormFactor_IsKnownForASquare) {
    // The form factor between opposed faces of a cube.
    EXPECT_NEAR(opposed_form_factor(1, 1), 0.19982490, 1e-8);
    EXPECT_NEAR(opposed_form_factor(1e4, 1e4), 1, 1e-3);
}

TEST(UgrTable, RatingFollowsFluxAndSize) {
    const UgrTable plain = ugr_table(lambertian(), 2);
    UgrLuminaire brighter = lambertian();
    brighter.intensity = [](const V3d& w) { return 3000 / kPiD * std::max(0.0, w.z); };
    brighter.lamp_flux = 3000;
    const UgrTable three = ugr_table(brighter, 2);
    EXPECT_NEAR(three.correction(), 8 * std::log10(3.0), 1e-12);
    EXPECT_NEAR(three.uncorrected[10][0][0], plain.uncorrected[10][0][0], 1e-9);
    UgrLuminaire larger = lambertian();
    larger.projected_area = [](const V3d& w) { return 3.6 * std::fabs(w.z); };
    // Σ L² ω goes with 1 / A.
    EXPECT_NEAR(ugr_table(larger, 2).uncorrected[10][0][0], plain.uncorrected[10][0][0] - 8, 1e-9);
    // Both views of a luminaire without an axis are the same, and a square room has one background.
    EXPECT_NEAR(plain.uncorrected[10][0][0], plain.uncorrected[10][1][0], 1e-9);
}

TEST(UgrTable, OfLightThatNoEyeSees_IsEmpty) {
    UgrLuminaire uplight = lambertian();
    uplight.intensity = [](const V3d& w) { return 1000 / kPiD * std::max(0.0, -w.z); };
    const UgrTable table = ugr_table(uplight, 1);
    EXPECT_EQ(table.uncorrected[0][0][0], -INFINITY);
    EXPECT_NE(ugr_text(table).find("none"), std::string::npos);
    EXPECT_NE(ugr_csv(table).find("\n2,2,crosswise,0.7,0.5,0.2,,,1000,\"CIE 190:2010, S/H = 1\"\n"),
              std::string::npos);
}

TEST(UgrTable, Csv_HasAllRatingsWithTheirMethod) {
    const UgrTable table = ugr_table(lambertian(), 4);
    const std::string csv = ugr_csv(table);
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 190);
    EXPECT_NE(
        csv.find(fmt::format("\n4,8,endwise,0.7,0.5,0.2,{0:.3f},{0:.3f},1000,\"CIE 190:2010, S/H = 0.25\"\n",
                             table.uncorrected[10][kEndwise][0])),
        std::string::npos);
}

TEST(PositionTable, EndsWhereTheStandardsDoes) {
    EXPECT_EQ(tabulated_position_index(0, 0), 1.0);
    EXPECT_EQ(tabulated_position_index(3, 1.9), 16.0);
    EXPECT_NEAR(*tabulated_position_index(0.55, 0.55), 0.25 * (2.91 + 3.10 + 3.40 + 3.60), 1e-12);
    EXPECT_FALSE(tabulated_position_index(3.01, 1));
    EXPECT_FALSE(tabulated_position_index(1, 1.91));
    EXPECT_FALSE(tabulated_position_index(0.05, 1.75));  // one of the four entries is empty
}

}  // namespace ugr_table_test
}  // namespace lucerna
