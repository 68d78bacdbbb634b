#include "lights/photometric_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ies_test {

using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ListeningMonitor;
using ::testing::SizeIs;

PhotometricWeb parse(const std::string& text) {
    Monitor silent;
    return parse_ies(text, "lamp.ies", silent);
}
std::string refusal(const std::string& text) {
    return error_of([&] { parse(text); });
}

std::string lamp(const std::string& numbers) {
    return "IESNA:LM-63-2002\n[TEST] 7\nTILT=NONE\n" + numbers;
}

TEST(Ies, OnePlane_HoldsForAll) {
    const PhotometricWeb web = parse(lamp("1 -1 1 3 1 1 2 .1 .2 0\n1 1 9\n0 45 90\n0\n10 20 5"));
    EXPECT_THAT(web.grid().azimuth, ElementsAre(0, 360));
    EXPECT_NEAR(web.intensity(web.direction(45, 123)), 20, 1e-5);
    EXPECT_EQ(web.info().watts, 9);
    EXPECT_EQ(web.info().lamp_lumens, 0) << "absolute";
    EXPECT_EQ(web.info().opening.size, V3d(0.2, 0.1, 0)) << "the length lies along C0";
    EXPECT_EQ(web.intensity(web.direction(91, 0)), 0);
}

TEST(Ies, Factors_MultiplyAsTheEditionSays) {
    const std::string numbers = "2 500 3 2 1 1 1 0 0 0\n0.5 0.8 9\n0 90\n0\n10 20";
    EXPECT_NEAR(parse(lamp(numbers)).peak(), 20 * 3 * 0.5, 1e-5) << "2002: the third number is none";
    EXPECT_NEAR(parse("IESNA91\nTILT=NONE\n" + numbers).peak(), 20 * 3 * 0.5 * 0.8, 1e-5);
    const PhotometricWeb oldest = parse("any label\nTILT=NONE\n" + numbers);
    EXPECT_NEAR(oldest.peak(), 20 * 3 * 0.5 * 0.8, 1e-5);
    EXPECT_THAT(oldest.info().keywords, ElementsAre(std::pair<std::string, std::string>("", "any label")));
    EXPECT_EQ(oldest.info().lamp_lumens, 1000);
}

TEST(Ies, LineEndsCommasAndWrapping_DoNotMatter) {
    const PhotometricWeb web = parse(lamp("1 -1 1 3 1 1 2 0 0 0\n1 1 9\n0 45 90\n0\n10 20 5"));
    const std::string others[] = {
        "IESNA:LM-63-2002\r\n[TEST] 7\r\nTILT=NONE\r\n1,-1,1,3,1,1,2,0,0,0\r\n1, 1, "
        "9\r\n0,45,90\r\n0\r\n10,20,5\r\n",
        "IESNA:LM-63-2002\r[TEST] 7\rTILT=NONE\r1 -1\r1 3 1 1 2 0\r0 0 1 1 9 0 45\r90 0 10\r20\r5\r\x1a",
        "\xef\xbb\xbfIESNA:LM-63-2002\n[TEST] 7\n TILT= NONE \n1 -1 1 3 1 1 2 0 0 0 1 1 9 0 4.5e1 90. 0 +10 "
        "20 5",
    };
    for (const std::string& text : others) {
        const PhotometricWeb other = parse(text);
        EXPECT_EQ(other.grid().candela, web.grid().candela) << text;
        EXPECT_EQ(other.grid().polar, web.grid().polar);
    }
}

TEST(Ies, Keywords_AreKept_MoreGoesOn) {
    const PhotometricWeb web = parse(
        "IES:LM-63-2019\n[TEST] 7\n[MANUFAC] Some\n[MORE] works\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 9 0 90 "
        "0 1 1");
    EXPECT_THAT(web.info().keywords,
                ElementsAre(std::pair<std::string, std::string>("TEST", "7"),
                            std::pair<std::string, std::string>("MANUFAC", "Some works")));
    EXPECT_EQ(web.info().provenance, "IES:LM-63-2019, Some works, 7");
}

TEST(Ies, Tilt_IsReadAndNotApplied) {
    const std::string numbers = "1 -1 1 2 1 1 2 0 0 0 1 1 9 0 90 0 4 2";
    EXPECT_EQ(parse("IESNA91\nTILT=INCLUDE\n1\n3\n0 45 90\n1 .9 .8\n" + numbers).peak(), 4);
    EXPECT_EQ(parse("IESNA91\nTILT=lamp.tlt\n" + numbers).peak(), 4);
}

TEST(Ies, QuadrantAndBilateral_AreMirrored) {
    const PhotometricWeb quadrant =
        parse(lamp("1 -1 1 2 3 1 2 0 0 0 1 1 9\n0 90\n0 45 90\n1 10\n1 20\n1 30"));
    EXPECT_THAT(quadrant.grid().azimuth, ElementsAre(0, 45, 90, 135, 180, 225, 270, 315, 360));
    for (const double c : {45.0, 135.0, 225.0, 315.0})
        EXPECT_NEAR(quadrant.intensity(quadrant.direction(90, c)), 20, 1e-5) << c;
    EXPECT_NEAR(quadrant.intensity(quadrant.direction(90, 270)), 30, 1e-5);
    const PhotometricWeb bilateral =
        parse(lamp("1 -1 1 2 3 1 2 0 0 0 1 1 9\n0 90\n0 60 180\n1 10\n1 20\n1 30"));
    EXPECT_THAT(bilateral.grid().azimuth, ElementsAre(0, 60, 180, 300, 360));
    EXPECT_NEAR(bilateral.intensity(bilateral.direction(90, 300)), 20, 1e-5);
    const PhotometricWeb about_90 =
        parse(lamp("1 -1 1 2 3 1 2 0 0 0 1 1 9\n0 90\n90 120 270\n1 10\n1 20\n1 30"));
    EXPECT_NEAR(about_90.intensity(about_90.direction(90, 60)), 20, 1e-5) << "120 mirrored";
    EXPECT_NEAR(about_90.intensity(about_90.direction(90, 120)), 20, 1e-5);
    EXPECT_NEAR(about_90.intensity(about_90.direction(90, 270)), 30, 1e-5);
    EXPECT_NEAR(about_90.intensity(about_90.direction(90, 0)), 20.0 + 10 * 60 / 150, 1e-4);
}

TEST(Ies, FullCircle_MayLackItsLastPlane) {
    const PhotometricWeb web =
        parse(lamp("1 -1 1 2 4 1 2 0 0 0 1 1 9\n0 90\n0 90 180 270\n1 10\n1 20\n1 30\n1 40"));
    EXPECT_NEAR(web.intensity(web.direction(90, 315)), 25, 1e-5);
    EXPECT_THAT(refusal(lamp("1 -1 1 2 2 1 2 0 0 0 1 1 9\n0 90\n0 50\n1 10\n1 20")),
                HasSubstr("lamp.ies:6:3: the planes go from 0 to 50"));
}

TEST(Ies, TypeB_TurnsAboutAHorizontalAxis) {
    // H runs from 0 to 40 (mirrored), V from -20 to 20.
    const PhotometricWeb web = parse(lamp("1 -1 1 3 2 2 2 0 0 0 1 1 9\n-20 0 20\n0 40\n1 2 3\n4 5 6"));
    EXPECT_NEAR(web.intensity({0, 0, 1}), 2, 1e-6) << "H = V = 0 is nadir";
    const double a = 20 * M_PI / 180, b = 40 * M_PI / 180;
    EXPECT_NEAR(web.intensity({std::sin(a), 0, std::cos(a)}), 3, 1e-5) << "V = 20";
    EXPECT_NEAR(web.intensity({0, std::sin(b), std::cos(b)}), 5, 1e-5) << "H = 40";
    EXPECT_NEAR(web.intensity({0, -std::sin(b), std::cos(b)}), 5, 1e-5) << "H = -40, mirrored";
    EXPECT_EQ(web.intensity({0, 0, -1}), 0);
}

TEST(Ies, TypeA_LooksAtTheHorizon) {
    const PhotometricWeb web = parse(lamp("1 -1 1 3 2 3 2 0 0 0 1 1 9\n-20 0 20\n-40 40\n1 2 3\n4 5 6"));
    EXPECT_NEAR(web.intensity({1, 0, 0}), 3.5, 1e-6) << "between H = -40 and 40";
    const double b = 40 * M_PI / 180;
    EXPECT_NEAR(web.intensity({std::cos(b), std::sin(b), 0}), 5, 1e-5) << "H = 40";
}

// The steps are unequal: the gap to 360 is no wider than the other steps.
TEST(Ies, UnevenFullCircle_MayLackItsLastPlane) {
    const PhotometricWeb web =
        parse(lamp("1 -1 1 2 5 1 2 0 0 0 1 1 9\n0 90\n0 5 90 200 340\n1 10\n1 20\n1 30\n1 40\n1 50"));
    EXPECT_THAT(web.grid().azimuth, ElementsAre(0, 5, 90, 200, 340, 360));
    EXPECT_NEAR(web.intensity(web.direction(90, 350)), 30, 1e-5) << "between 340 and 360";
    EXPECT_THAT(refusal(lamp("1 -1 1 2 4 1 2 0 0 0 1 1 9\n0 90\n0 70 140 210\n1 10\n1 20\n1 30\n1 40")),
                HasSubstr("the planes go from 0 to 210"));
}

const std::filesystem::path kFiles = std::filesystem::path(LUCERNA_SOURCE_DIR) / "tests/lights/photometric";

TEST(Ies, TypesAAndB_OfOneAngle_NameIt) {
    Monitor silent;
    EXPECT_THAT(error_of([&] { read_ies(kFiles / "typeBone.ies", silent); }),
                HasSubstr("typeBone.ies:8:1: 1 horizontal angle; at least 2 are needed"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 3 2 0 0 0 1 1 9\n0 90\n0\n1 10")),
                HasSubstr("lamp.ies:6:1: 1 horizontal angle; at least 2 are needed"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 2 2 2 0 0 0 1 1 9\n0 90\n0 95\n1 10 1 10")),
                HasSubstr("horizontal angles from -95 to 95; expected -90 to 90"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 2 3 2 0 0 0 1 1 9\n0 95\n0 90\n1 10 1 10")),
                HasSubstr("vertical angles from 0 to 95; expected -90 to 90"));
}

// The lamp is Lambertian with 1000 cd at nadir: its flux is π · 1000 lm.
TEST(Ies, DecimalCommas_AreReadWithAWarning) {
    ListeningMonitor monitor;
    const PhotometricWeb web = read_ies(kFiles / "decimalcomma.ies", monitor);
    EXPECT_EQ(web.peak(), 1000);
    EXPECT_NEAR(web.intensity(web.direction(5, 0)), 996.19, 1e-3);
    EXPECT_NEAR(web.flux(), 1000 * M_PI, 0.002 * 1000 * M_PI);
    EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr("decimalcomma.ies:9:1: the commas of \"1000,00\"")));
    const PhotometricWeb point = parse(lamp("1 -1 1.5 3 1 1 2 0 0 0.25 1 1 9\n0 45 90\n0\n10.5 20 5"));
    for (const char* text : {"1 -1 1,5 3 1 1 2 0 0 0,25 1 1 9\n0 45 90\n0\n10,5 20 5",
                             "1 -1 1.5 3 1 1 2 0 0 0.25 1 1 9\n0, 45, 90\n0\n10,5, 20, 5",
                             "1 -1 1,5 3 1 1 2 0 0 0,25 1 1 9\n0 45 90\n0\n10,5 20 5\nno more"}) {
        const PhotometricWeb comma = parse(lamp(text));
        EXPECT_EQ(comma.grid().candela, point.grid().candela) << text;
        EXPECT_EQ(comma.info().opening.size, point.info().opening.size) << text;
    }
}

TEST(Ies, CommasOfThousandsOrOfTooManyNumbers_AreRefused) {
    EXPECT_THAT(refusal(lamp("1 12,500 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10 5")),
                HasSubstr("lamp.ies:4:3: the comma of \"12,500\" may separate two numbers, decimals or "
                          "thousands"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10,1 5,2 77")),
                HasSubstr("lamp.ies:7:1: the comma of \"10,1\""));
    EXPECT_THAT(refusal(lamp("1,-1,1,2,1,1,2,0,0,0,1,1,9\n0,90\n0\n10,5,77")),
                HasSubstr("lamp.ies:5:1: the comma of \"0,90\""));
    // A file with too few numbers gets that message, with or without commas.
    EXPECT_THAT(refusal(lamp("1,-1,1,2,1,1,2,0,0,0,1,1,9\n0,90\n0\n10")),
                HasSubstr("the file ends after 17 numbers"));
}

TEST(Ies, BadFiles_NameTheirPlace) {
    EXPECT_THAT(refusal(""), HasSubstr("lamp.ies: no line begins with TILT="));
    EXPECT_THAT(refusal("IESNA91\n[A] b\n"), HasSubstr("TILT="));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10 x5")),
                HasSubstr("lamp.ies:7:4: a candela value is \"x5\"; expected a number"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10 -5")),
                HasSubstr("lamp.ies:7:4: a candela value is -5"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 4 2 0 0 0 1 1 9\n0 90\n0\n10 5")),
                HasSubstr("lamp.ies:4:12: the photometric type (1 C, 2 B, 3 A) is 4"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2.5 1 1 2 0 0 0")),
                HasSubstr("lamp.ies:4:8: the number of vertical angles"));
    EXPECT_THAT(refusal(lamp("1 -1 1 99999 9999 1 2 0 0 0 1 1 9\n0 90")),
                HasSubstr("the file ends after 15 numbers; expected vertical angle"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n90 0\n0\n10 5")),
                HasSubstr("lamp.ies:5:4: vertical angle 0 follows 90"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 190\n0\n10 5")), HasSubstr("0 to 180"));
    EXPECT_THAT(refusal(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10 1e999")), HasSubstr("lamp.ies:7:4"));
}

TEST(Ies, MoreThanIsNeeded_IsAWarning) {
    ListeningMonitor monitor;
    parse_ies(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10 5 77"), "lamp.ies", monitor);
    EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr("lamp.ies:7:6: the text after")));
    ListeningMonitor quiet;
    parse_ies(lamp("1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n10 5\n\x1a"), "lamp.ies", quiet);
    EXPECT_THAT(quiet.warnings, IsEmpty());
}

TEST(Ies, Written_IsReadBackTheSame) {
    LUCERNA_NEED_DATA(folder, "photometry");
    Monitor silent;
    const testing::TemporaryFolder temporary;
    for (const char* name : {"examp1.ies", "italo-street.ies", "road_luminaire.ldt", "projector.ldt"}) {
        const PhotometricWeb web = read_photometric(folder / name, silent);
        write_ies(temporary / "again.ies", web, name);
        const PhotometricWeb again = read_ies(temporary / "again.ies", silent);
        EXPECT_NEAR(again.flux() / web.flux(), 1, 1e-5) << name;
        for (const double gamma : {0.0, 13.3, 47.0, 71.2, 120.0}) {
            for (const double c : {0.0, 33.0, 91.0, 222.2, 359.0}) {
                EXPECT_NEAR(again.intensity(again.direction(gamma, c)),
                            web.intensity(web.direction(gamma, c)), 1e-5 * web.peak())
                    << name << " " << gamma << " " << c;
            }
        }
    }
}

}  // namespace ies_test
}  // namespace lucerna
