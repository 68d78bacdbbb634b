// `lucerna light ugr`: its inputs, options and errors. The ratings are tested in
// tests/photometry/ugr_table_test.cpp.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "lights/light_field.h"
#include "lights/ray_set.h"
#include "tests/cli/run_support.h"
#include "tests/photometry/ugr_tables.h"

namespace lucerna {
namespace ugr_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;

// Returns an IES file of type C with the lengths `size` ("width length height") in metres, whose intensity is
// 1000 cd cos(γ) / π in all planes, or `share` of that in the plane C90.
std::string lambertian(const std::string& size, double share = 1) {
    std::string text = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 91 2 1 2 " + size + "\n1 1 9\n";
    for (int gamma = 0; gamma <= 90; ++gamma) text += fmt::format("{}\n", gamma);
    text += "0 90\n";
    for (const double of_plane : {1.0, share}) {
        for (int gamma = 0; gamma <= 90; ++gamma) {
            const double candela = of_plane * 1000 / kPiD * std::cos(gamma * kPiD / 180);
            text += fmt::format("{:.6f}\n", std::fabs(candela));
        }
    }
    return text;
}

class UgrCommand : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        std::ofstream("lamp.ies") << lambertian(".6 .6 0");
        std::ofstream("long.ies") << lambertian(".1 1.2 0", 0.5);
        std::ofstream("point.ies") << lambertian("0 0 0");
    }
    // Runs the command and returns the ratings for 1000 lm by "X,Y,view,ceiling,walls,floor".
    static std::map<std::string, double> ratings(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"light", "ugr"});
        arguments.insert(arguments.end(), {"-o", "ugr.csv", "--quiet"});
        const Outcome done = lucerna_run(arguments);
        EXPECT_EQ(done.code, 0) << done.err;
        EXPECT_EQ(done.out, "");
        std::ifstream in("ugr.csv");
        std::string line;
        std::getline(in, line);
        EXPECT_EQ(line,
                  "X [H],Y [H],view,ceiling,walls,floor,UGR for 1000 lm,UGR for the lamp flux,lamp flux "
                  "[lm],method");
        std::map<std::string, double> found;
        while (std::getline(in, line)) {
            std::size_t end = 0;
            for (int i = 0; i < 6; ++i) end = line.find(',', end) + 1;
            found[line.substr(0, end - 1)] = std::stod(line.substr(end));
        }
        EXPECT_EQ(found.size(), 190U);
        return found;
    }
};

TEST_F(UgrCommand, OfAPhotometricFile_PrintsTheTable) {
    const Outcome done = lucerna_run({"light", "ugr", "lamp.ies"});
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr("UGR for 1000 lm of the lamps (uncorrected); CIE 190:2010, S/H = 0.25"));
    const double expected = ugr_table_test::kLambertian[10][0][0];  // 4H x 8H, 70/50/20
    EXPECT_THAT(done.out, HasSubstr(fmt::format("4H x 8H   {:.1f} ", expected)));
    EXPECT_THAT(done.out, HasSubstr("axis                 C0; the observer sees C90 crosswise, C0 endwise"));
    EXPECT_NEAR(ratings({"lamp.ies"})["4,8,endwise,0.7,0.5,0.2"], expected, 0.01);
}

TEST_F(UgrCommand, Options_ChangeSpacingOpeningAndAxis) {
    EXPECT_NEAR(ratings({"lamp.ies", "--spacing", "1"})["4,8,crosswise,0.7,0.5,0.2"],
                ugr_table_test::kLambertianAtS1H[10][0][0], 0.01);
    // Four times the area is half the size of each term: 8 log10(4) less.
    EXPECT_NEAR(ratings({"lamp.ies", "--opening", "1.2mx1.2m"})["4,8,crosswise,0.7,0.5,0.2"],
                ugr_table_test::kLambertian[10][0][0] - 8 * std::log10(4.0), 0.01);
    auto as_it_is = ratings({"long.ies"}), turned = ratings({"long.ies", "--axis", "c90"});
    EXPECT_NEAR(as_it_is["4,8,crosswise,0.7,0.5,0.2"], turned["4,8,endwise,0.7,0.5,0.2"], 1e-9);
    // The plane C90, which the observer sees crosswise, is the darker one.
    EXPECT_LT(as_it_is["4,8,crosswise,0.7,0.5,0.2"], as_it_is["4,8,endwise,0.7,0.5,0.2"] - 1);
}

TEST_F(UgrCommand, OfRays_NeedsAnOpeningAndTellsTheFlux) {
    RaySet rays;
    rays.unit = FluxUnit::watt;
    constexpr int kRings = 180, kAround = 360;
    for (int i = 0; i < kRings; ++i) {
        for (int j = 0; j < kAround; ++j) {
            // Directions of equal flux of a cosine emitter.
            const double sine = std::sqrt((i + 0.5) / kRings), c = 2 * kPiD * (j + 0.5) / kAround;
            rays.rays.push_back({{0, 0, 0},
                                 V3f(V3d(sine * std::cos(c), sine * std::sin(c), std::sqrt(1 - sine * sine))),
                                 10.0F / (kRings * kAround)});
        }
    }
    rays.flux = 10;
    write_rays("lamp.ray", rays);
    const Outcome refused = lucerna_run({"light", "ugr", "lamp.ray"});
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.err, HasSubstr("lamp.ray: the file states no luminous opening"));
    const Outcome watts = lucerna_run({"light", "ugr", "lamp.ray", "--opening", "600mmx600mm"});
    EXPECT_EQ(watts.code, 1);
    EXPECT_THAT(watts.err,
                HasSubstr("lamp.ray: the lamp is in W, but UGR needs lm; give the conversion with"));
    auto found = ratings({"lamp.ray", "--opening", "600mmx600mm", "--efficacy", "100"});
    EXPECT_NEAR(found["4,8,crosswise,0.7,0.5,0.2"], ugr_table_test::kLambertian[10][0][0], 0.1);
}

TEST_F(UgrCommand, Long_OfALightField_IsThatOfItsFarFieldAndOfTheLamp) {
    const Outcome acquired =
        lucerna_run({"light", "acquire", "--radius", "30cm", "--flux", "2000", "--unit", "lm", "--views",
                     "8x8", "--pixels", "48x48", "--capture", "99.5%", "-o", "disc.exr"});
    ASSERT_EQ(acquired.code, 0) << acquired.err;
    const Outcome far = lucerna_run({"light", "farfield", "disc.exr", "-o", "disc.ies"});
    ASSERT_EQ(far.code, 0) << far.err;
    auto of_field = ratings({"disc.exr"}), of_file = ratings({"disc.ies"});
    for (const auto& [cell, rating] : of_field) EXPECT_NEAR(rating, of_file[cell], 0.01) << cell;
    // A disc of 30 cm radius has another area than the square of 0.6 m. In rooms of 2H x 2H it is seen at up
    // to 65 degrees from nadir. The missing 0.5 % of the light, at greater angles, raises ratings for 1000 lm
    // by 0.03.
    auto of_disc = ratings({"disc.exr", "--opening", "531.736mmx531.736mm"});
    EXPECT_NEAR(of_disc["2,2,crosswise,0.7,0.5,0.2"],
                ugr_table_test::kLambertian[0][0][0] - 8 * std::log10(kPiD * 0.09 / 0.36), 0.1);
}

TEST_F(UgrCommand, Errors_NameFileAndValue) {
    const auto error = [](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"light", "ugr"});
        const Outcome done = lucerna_run(arguments);
        EXPECT_EQ(done.code, 1);
        return done.err;
    };
    EXPECT_THAT(error({"none.ies"}), HasSubstr("none.ies"));
    EXPECT_THAT(error({"point.ies"}), HasSubstr("point.ies: the file states no luminous opening"));
    EXPECT_THAT(error({"lamp.ies", "--spacing", "0.3"}),
                HasSubstr("--spacing: 0.3 does not divide the sides of the rooms"));
    EXPECT_THAT(error({"lamp.ies", "--spacing", "2"}), HasSubstr("--spacing"));
    EXPECT_THAT(error({"lamp.ies", "--axis", "y"}),
                HasSubstr("--axis: \"y\" is unknown; expected c0 or c90"));
    EXPECT_THAT(error({"lamp.ies", "-o", "ugr.txt"}), HasSubstr("ugr.txt"));
    EXPECT_THAT(error({"lamp.ies", "-o", "lamp.ies"}), HasSubstr("lamp.ies"));
}

TEST_F(UgrCommand, OfAnAsymmetricLuminaire_IsWarnedOf) {
    // Only the half around C0 shines.
    std::ofstream("wall.ies")
        << "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 3 1 2 .1 .1 0\n1 1 9\n0 45 90\n0 90 180\n"
           "500 400 100\n500 100 20\n500 10 1\n";
    const Outcome warned = lucerna_run({"light", "ugr", "wall.ies"});
    EXPECT_EQ(warned.code, 0);
    EXPECT_THAT(warned.err,
                HasSubstr("the luminaire is not symmetric: seen from the opposite sides (C270 crosswise, "
                          "C180 endwise)"));
    EXPECT_THAT(lucerna_run({"light", "ugr", "long.ies"}).err, Not(HasSubstr("symmetric")));
}

}  // namespace ugr_test
}  // namespace lucerna
