#include "lights/photometric_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace ldt_test {

using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ListeningMonitor;

// Planes every 45 degrees, two angles; plane i of those stored has 10 cd/klm at 0 and 100 (i + 1) at 90.
struct File {
    int symmetry = 0, planes = 8;
    std::string lumens = "2000", conversion = "1", count = "1";
    int stored = 8;

    std::string text() const {
        std::string t =
            fmt::format("Works\n1\n{}\n{}\n45\n2\n90\nreport\nLamp\nnr\nfile\ndate\n", symmetry, planes);
        t += "300\n200\n50\n0\n0\n0\n0\n0\n0\n100\n80\n" + conversion + "\n0\n1\n";
        t += count + "\nLED\n" + lumens + "\n3000\n80\n25\n";
        for (int i = 0; i < 10; ++i) t += "0.5\n";
        for (int i = 0; i < planes; ++i) t += fmt::format("{}\n", 360.0 / planes * i);
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
    EXPECT_EQ(web.info().opening, V3d(0.2, 0.3, 0)) << "the length lies along C90";
    EXPECT_EQ(parse(File{.count = "-1"}.text()).info().lamp_lumens, 0) << "absolute";
    EXPECT_EQ(web.info().provenance, "EULUMDAT, Works, Lamp");
}

TEST(Ldt, BadFiles_NameTheirLine) {
    const auto refusal = [](std::string text) { return error_of([&] { parse(text); }); };
    EXPECT_THAT(refusal("Works\n1\n"), HasSubstr("lamp.ldt: the file ends after line 2; expected line 3"));
    EXPECT_THAT(refusal("Works\n1\n7\n"),
                HasSubstr("lamp.ldt:3:1: line 3, the symmetry is 7; expected 0 to 4"));
    EXPECT_THAT(refusal("Works\n1\n0\nmany\n"),
                HasSubstr("lamp.ldt:4:1: line 4, the number of C planes is \"many\"; expected a number"));
    EXPECT_THAT(refusal(File{4, 7, "1000", "1", "1", 3}.text()),
                HasSubstr("lamp.ldt:3:1: 7 C planes with symmetry 4; expected a multiple of 4"));
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

TEST(Photometric, OtherEndings_AreRefused) {
    Monitor silent;
    EXPECT_THAT(error_of([&] { read_photometric("lamp.txt", silent); }), HasSubstr("expected .ies or .ldt"));
}

}  // namespace ldt_test
}  // namespace lucerna
