#include "lights/photometric_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace ldt_test {

using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ListeningMonitor;

// Writes planes every 45 degrees with two angles; the stored plane i has 10 cd/klm at 0 and 100 (i + 1) at
// 90.
struct File {
    int symmetry = 0, planes = 8;
    std::string lumens = "2000", conversion = "1", count = "1";
    int stored = 8;

    std::vector<double> angles = {};  // of the planes; empty: evenly spaced
    std::string heights = "0\n0\n0\n0\n", luminous = "0\n0\n";

    std::string text() const {
        std::string t =
            fmt::format("Works\n1\n{}\n{}\n45\n2\n90\nreport\nLamp\nnr\nfile\ndate\n", symmetry, planes);
        t += "300\n200\n50\n" + luminous + heights + "100\n80\n" + conversion + "\n0\n1\n";
        t += count + "\nLED\n" + lumens + "\n3000\n80\n25\n";
        for (int i = 0; i < 10; ++i) t += "0.5\n";
        for (int i = 0; i < planes; ++i) {
            t += fmt::format("{}\n",
                             angles.empty() ? 360.0 / planes * i : angles[static_cast<std::size_t>(i)]);
        }
        t += "0\n90\n";
        for (int i = 0; i < stored; ++i) t += fmt::format("10\n{}\n", 100 * (i + 1));
        return t;
    }
};

PhotometricWeb parse(const std::string& text) {
    Monitor silent;
    return parse_ldt(text, "lamp.ldt", silent);
}
double at_horizon(const PhotometricWeb& web, double c) {
    return web.intensity(web.direction(90, c));
}

TEST(Ldt, EverySymmetry_GivesAllPlanes) {
    const PhotometricWeb none = parse(File{0, 8, "1000", "1", "1", 8}.text());
    EXPECT_NEAR(at_horizon(none, 45), 200, 1e-3);
    EXPECT_NEAR(at_horizon(none, 315), 800, 1e-3);
    EXPECT_NEAR(at_horizon(none, 337.5), 450, 1e-3) << "between 315 and 0";
    const PhotometricWeb round = parse(File{1, 8, "1000", "1", "1", 1}.text());
    EXPECT_NEAR(at_horizon(round, 77), 100, 1e-3);
    const PhotometricWeb about_c0 = parse(File{2, 8, "1000", "1", "1", 5}.text());
    EXPECT_NEAR(at_horizon(about_c0, 45), 200, 1e-3);
    EXPECT_NEAR(at_horizon(about_c0, 315), 200, 1e-3);
    const PhotometricWeb about_c90 = parse(File{3, 8, "1000", "1", "1", 5}.text());
    EXPECT_NEAR(at_horizon(about_c90, 90), 100, 1e-3);
    EXPECT_NEAR(at_horizon(about_c90, 135), 200, 1e-3);
    EXPECT_NEAR(at_horizon(about_c90, 45), 200, 1e-3);
    EXPECT_NEAR(at_horizon(about_c90, 270), 500, 1e-3);
    EXPECT_NEAR(at_horizon(about_c90, 0), 300, 1e-3);
    const PhotometricWeb quadrant = parse(File{4, 8, "1000", "1", "1", 3}.text());
    for (const double c : {45.0, 135.0, 225.0, 315.0}) EXPECT_NEAR(at_horizon(quadrant, c), 200, 1e-3);
    EXPECT_NEAR(at_horizon(quadrant, 270), 300, 1e-3);
}

TEST(Ldt, Values_AreCandelaPerThousandLumens) {
    EXPECT_NEAR(at_horizon(parse(File{.lumens = "2000", .conversion = "0,5"}.text()), 0), 100, 1e-3)
        << "a decimal comma";
    const PhotometricWeb web = parse(File{}.text());
    EXPECT_EQ(web.info().lamp_lumens, 2000);
    EXPECT_NEAR(web.info().output_ratio, 0.8, 1e-12);
    EXPECT_EQ(web.info().watts, 25);
    EXPECT_EQ(web.info().opening.size, V3d(0.2, 0.3, 0)) << "the length lies along C90";
    EXPECT_EQ(parse(File{.count = "-1"}.text()).info().lamp_lumens, 0) << "absolute";
    EXPECT_EQ(web.info().provenance, "EULUMDAT, Works, Lamp");
}

TEST(Ldt, UnevenPlanes_AreCompletedByTheirSymmetry) {
    const auto planes = [](int symmetry, std::vector<double> angles, int stored) {
        const int count = static_cast<int>(angles.size());
        return parse(File{.symmetry = symmetry,
                          .planes = count,
                          .lumens = "1000",
                          .stored = stored,
                          .angles = std::move(angles)}
                         .text());
    };
    // The list may end at any distance from 360.
    const PhotometricWeb none = planes(0, {0, 5, 90, 200, 300}, 5);
    EXPECT_NEAR(at_horizon(none, 300), 500, 1e-3);
    EXPECT_NEAR(at_horizon(none, 330), 300, 1e-3) << "between 300 and 360";
    // Symmetry 0 means no symmetry, even if the planes end at 90 or 180.
    EXPECT_NEAR(at_horizon(planes(0, {0, 30, 90}, 3), 180), 300 - 200 * 90.0 / 270, 1e-3);
    EXPECT_NEAR(at_horizon(planes(0, {0, 90, 180}, 3), 270), 200, 1e-3);
    EXPECT_NEAR(at_horizon(planes(0, {0, 90, 180, 270, 360}, 5), 315), 250, 1e-3) << "C360 is C0";
    EXPECT_NEAR(at_horizon(planes(0, {15, 135, 255}, 3), 0), 100 + 200 * 15.0 / 120, 1e-3);
    const PhotometricWeb about_c0 = planes(2, {0, 10, 60, 180, 300, 350}, 4);
    EXPECT_NEAR(at_horizon(about_c0, 350), 200, 1e-3);
    EXPECT_NEAR(at_horizon(about_c0, 300), 300, 1e-3);
    EXPECT_NEAR(at_horizon(about_c0, 180), 400, 1e-3);
    const PhotometricWeb without_c180 = planes(2, {0, 60, 120, 240, 300}, 3);
    EXPECT_NEAR(at_horizon(without_c180, 180), 300, 1e-3) << "between C120 and its image";
    // Planes are denser in front than behind: C90 is not at a quarter of the list.
    const PhotometricWeb about_c90 = planes(3, {0, 30, 60, 90, 120, 150, 180, 225, 270, 315}, 6);
    EXPECT_NEAR(at_horizon(about_c90, 90), 100, 1e-3);
    EXPECT_NEAR(at_horizon(about_c90, 30), 300, 1e-3) << "as C150";
    EXPECT_NEAR(at_horizon(about_c90, 315), 500, 1e-3) << "as C225";
    EXPECT_NEAR(at_horizon(about_c90, 270), 600, 1e-3);
    const PhotometricWeb quadrant = planes(4, {0, 20, 90, 160, 180, 200, 270, 340}, 3);
    for (const double c : {20.0, 160.0, 200.0, 340.0}) EXPECT_NEAR(at_horizon(quadrant, c), 200, 1e-3);
    EXPECT_NEAR(at_horizon(quadrant, 270), 300, 1e-3);
    EXPECT_THAT(error_of([&] {
                    planes(2, {0, 10, 60, 180, 290, 350}, 4);
                }),
                HasSubstr("symmetry 2 does not fit the 6 C planes: C290"));
    EXPECT_THAT(error_of([&] { planes(3, {0, 45, 135, 180}, 3); }), HasSubstr("without a plane C90"));
}

// The lamp is Lambertian with 1000 cd at nadir.
TEST(Ldt, UnevenPlanesWithoutSymmetry_HaveTheirFlux) {
    Monitor silent;
    const PhotometricWeb web = read_ldt(
        std::filesystem::path(LUCERNA_SOURCE_DIR) / "tests/lights/photometric/uneven_refinedC0.ldt", silent);
    EXPECT_NEAR(web.flux(), 3139.6, 0.1);
    EXPECT_EQ(web.grid().azimuth.back(), 360);
}

TEST(Ldt, Openings_AreRectanglesAndCirclesWithHeights) {
    using Shape = LuminousOpening::Shape;
    const auto opening = [](const char* luminous, const char* heights) {
        return parse(File{.heights = heights, .luminous = luminous}.text()).info().opening;
    };
    const LuminousOpening rectangle = opening("600\n300\n", "100\n20\n30\n40\n");
    EXPECT_EQ(rectangle.shape, Shape::box);
    EXPECT_NEAR(rectangle.projected_area({0, 0, 1}), 0.18, 1e-12);
    EXPECT_NEAR(rectangle.projected_area({1, 0, 0}), 0.6 * 0.1, 1e-12) << "C0 sees the length";
    EXPECT_NEAR(rectangle.projected_area({0, -1, 0}), 0.3 * 0.02, 1e-12) << "C90 sees the width";
    EXPECT_NEAR(rectangle.projected_area({-1, 0, 0}), 0.6 * 0.03, 1e-12);
    EXPECT_NEAR(rectangle.projected_area({0, 1, 0}), 0.3 * 0.04, 1e-12);
    const LuminousOpening circle = opening("400\n0\n", "50\n50\n50\n50\n");
    EXPECT_EQ(circle.name(), "upright cylinder");
    EXPECT_NEAR(circle.projected_area({0, 0.6, 0.8}), kPiD / 4 * 0.16 * 0.8 + 0.4 * 0.05 * 0.6, 1e-12);
    EXPECT_EQ(opening("400\n0\n", "0\n0\n0\n0\n").name(), "disc");
    EXPECT_EQ(opening("0\n0\n", "0\n0\n0\n0\n").size, V3d(0.2, 0.3, 0)) << "the luminaire's";
}

TEST(Ldt, CommasAreDecimal_OrRefusedBesidePoints) {
    const auto refusal = [](std::string text) { return error_of([&] { parse(text); }); };
    EXPECT_EQ(parse(File{.lumens = "33,25"}.text()).info().lamp_lumens, 33.25);
    EXPECT_THAT(refusal(File{.lumens = "33,200"}.text()),
                HasSubstr("the lamps' lumens is \"33,200\", whose comma may separate thousands"))
        << "its direct ratios have points";
    std::string commas = File{.lumens = "33,200"}.text();
    std::replace(commas.begin(), commas.end(), '.', ',');
    EXPECT_EQ(parse(commas).info().lamp_lumens, 33.2) << "no point: all commas are decimal";
    EXPECT_THAT(refusal(File{.lumens = "1,000,000"}.text()),
                HasSubstr("the lamps' lumens is \"1,000,000\"; expected a number"));
}

TEST(Ldt, BadFiles_NameTheirLine) {
    const auto refusal = [](std::string text) { return error_of([&] { parse(text); }); };
    EXPECT_THAT(refusal("Works\n1\n"), HasSubstr("lamp.ldt: the file ends after line 2; expected line 3"));
    EXPECT_THAT(refusal("Works\n1\n7\n"),
                HasSubstr("lamp.ldt:3:1: line 3, the symmetry is 7; expected 0 to 4"));
    EXPECT_THAT(refusal("Works\n1\n0\nmany\n"),
                HasSubstr("lamp.ldt:4:1: line 4, the number of C planes is \"many\"; expected a number"));
    EXPECT_THAT(refusal(File{4, 7, "1000", "1", "1", 3}.text()),
                HasSubstr("lamp.ldt:3:1: symmetry 4 does not fit the 7 C planes: C102.857 is not a mirror "
                          "image"));
    std::string cut = File{}.text();
    cut.resize(cut.size() - 4);
    EXPECT_THAT(refusal(cut), HasSubstr("lamp.ldt: the file ends"));
    std::string negative = File{}.text();
    negative.replace(negative.rfind("800"), 3, "-80");
    EXPECT_THAT(refusal(negative), HasSubstr("an intensity is -80"));
}

TEST(Ldt, SeveralLampSets_TheFirstCounts) {
    std::string text = File{}.text();
    const std::string one = "1\n1\nLED\n2000\n3000\n80\n25\n";
    text.replace(text.find(one), one.size(), "2\n1\nLED\n2000\n3000\n80\n25\n1\nLED\n9000\n4000\n80\n99\n");
    ListeningMonitor monitor;
    const PhotometricWeb web = parse_ldt(text, "lamp.ldt", monitor);
    EXPECT_EQ(web.info().lamp_lumens, 2000);
    EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr("2 sets of lamps")));
}

// Returns the lines from `from` on (counted from 1), without `count` of them.
std::string without_lines(const std::string& text, int from, int count) {
    std::string kept;
    int number = 0;
    for (const TextLine& line : lines_of(text)) {
        ++number;
        if (number < from || number >= from + count) kept += std::string(line.text) + "\n";
    }
    return kept;
}

TEST(Ldt, NumbersThatFitInOneWay_AreReadWithAWarning) {
    const PhotometricWeb plain = parse(File{}.text());
    const auto read = [](const std::string& text, const std::string& warning) {
        ListeningMonitor monitor;
        PhotometricWeb web = parse_ldt(text, "lamp.ldt", monitor);
        EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr(warning)));
        return web;
    };
    const auto expect_plain = [&](const std::string& text, const std::string& warning) {
        const PhotometricWeb web = read(text, warning);
        EXPECT_EQ(web.grid().candela, plain.grid().candela) << warning;
        EXPECT_EQ(web.grid().azimuth, plain.grid().azimuth) << warning;
        EXPECT_EQ(web.info().lamp_lumens, plain.info().lamp_lumens) << warning;
    };
    const std::string text = File{}.text();
    expect_plain(without_lines(text, 33, 3), "7 direct ratios instead of 10");
    expect_plain(without_lines(text, 33, 10), "0 direct ratios instead of 10");
    expect_plain("\n\n" + text, "the file begins in line 3");
    expect_plain(without_lines(text, 1, 1), "the first line, the manufacturer, is missing");
    std::string doubled, spaced = text;
    for (const TextLine& line : lines_of(text)) doubled += std::string(line.text) + "\r\r\n";
    expect_plain(doubled, "every second line is empty");
    spaced.replace(spaced.find("\n0\n90\n10\n"), 1, "\n\n");
    expect_plain(spaced, "empty lines");
    std::string joined = text;
    joined.replace(joined.rfind("\n800"), 1, " ");
    expect_plain(joined, "several numbers in a line");
    std::string sets = text;
    sets.replace(sets.find("\n0\n1\n1\nLED"), 4, "\n0\n-1");
    expect_plain(sets, "-1 sets of lamps");
    expect_plain(File{.symmetry = 1}.text(), "the 8 planes of symmetry 0 instead of 1");
    expect_plain(File{.symmetry = 4}.text(), "the 8 planes of symmetry 0 instead of 4");

    const PhotometricWeb round = read(File{.stored = 1}.text(), "the 1 planes of symmetry 1 instead of 0");
    EXPECT_NEAR(at_horizon(round, 123), 200, 1e-3);
    const PhotometricWeb quadrant =
        read(File{.symmetry = 4, .planes = 3, .stored = 3, .angles = {0, 45, 90}}.text(),
             "a list of the stored planes alone, of symmetry 4");
    EXPECT_NEAR(at_horizon(quadrant, 225), 400, 1e-3);
}

TEST(Ldt, NumbersThatFitInNoWay_OrInSeveral_AreRefused) {
    const auto refusal = [](std::string text) { return error_of([&] { parse(text); }); };
    EXPECT_THAT(refusal(File{.stored = 5}.text()), HasSubstr("the file ends"))
        << "5 planes of 8 are symmetric about C0-C180 or about C90-C270";
    std::string text = File{}.text();
    text.replace(text.rfind("800"), 3, "nan");
    EXPECT_THAT(refusal(text), HasSubstr("an intensity is \"nan\"; expected a number"));
    EXPECT_THAT(refusal(File{.angles = {0, 45, 90, 135, 180, 270, 225, 315}}.text()),
                HasSubstr("a C angle 225 follows 270; expected ascending angles"));
    EXPECT_THAT(refusal("\xff\xfeW\0o"), HasSubstr("the text is UTF-16"));
    std::string none = File{}.text();
    none.replace(none.find("\n0\n1\n1\nLED"), 4, "\n0\n0");
    EXPECT_THAT(refusal(none), HasSubstr("line 26, the number of lamp sets, is 0"));
}

}  // namespace ldt_test
}  // namespace lucerna
