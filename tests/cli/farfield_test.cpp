// `lucerna light farfield`, and what the other commands report of photometric files.
#include <fstream>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/colour/chromaticity.h"
#include "engine/colour/spectrum.h"
#include "engine/image/image.h"
#include "lights/light_field.h"
#include "lights/photometric_files.h"
#include "lights/ray_set.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace farfield_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using testing::Outcome;
using ::testing::StartsWith;

class FarFieldCommand : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        std::ofstream("lamp.ies") << "IESNA:LM-63-2002\n[LUMINAIRE] a < b\nTILT=NONE\n1 -1 1 2 1 1 2 .1 .2 "
                                     "0\n1 1 9\n0 90\n0\n100 0\n";
        Rig rig;
        rig.views = {2, 2};
        rig.spacing = {0.01, 0.01};
        rig.pixels = {4, 4};
        rig.pixel = {0.02, 0.02};
        rig.distance = 0.05;
        LightFieldInfo info;
        info.unit = FluxUnit::watt;
        write_light_field("watts.exr",
                          LightField(rig, std::vector<float>(rig.coefficients(), 1000.0F), info));
    }
    static std::string content(const char* file) {
        std::ifstream in(file);
        return {std::istreambuf_iterator<char>(in), {}};
    }
};

TEST_F(FarFieldCommand, PhotometricFile_BecomesADiagramAndIsDescribed) {
    const Outcome done = lucerna_run({"light", "farfield", "lamp.ies", "-o", "lamp.svg"});
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr("peak intensity       100 cd towards (0.000, 0.000, 1.000)"));
    EXPECT_THAT(content("lamp.svg"), StartsWith("<svg"));
    EXPECT_THAT(content("lamp.svg"), HasSubstr("100 cd</text>"));
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"light", "info", "lamp.ies"}, {"info", "lamp.ies"}}) {
        const Outcome info = lucerna_run(command);
        ASSERT_EQ(info.code, 0) << info.err;
        EXPECT_THAT(info.out,
                    HasSubstr("luminous opening     200 mm along C0, 100 mm along C90, 0 high (rectangle)"));
    }
}

TEST_F(FarFieldCommand, Long_OpeningOfALamp_IsWhatOfItShines) {
    const Outcome acquired = lucerna_run({"light", "acquire", "--radius", "3mm", "--flux", "1000", "--unit",
                                          "lm", "--views", "45x57", "--pixels", "24x24", "-o", "disc.exr"});
    ASSERT_EQ(acquired.code, 0) << acquired.err;
    const Outcome done =
        lucerna_run({"light", "farfield", "disc.exr", "-o", "disc.ies", "--step", "5", "--plane-step", "30"});
    ASSERT_EQ(done.code, 0) << done.err;
    Monitor silent;
    const V3d size = read_ies("disc.ies", silent).info().opening.size;
    // The basis blurs the edge.
    EXPECT_NEAR(size.x * size.y / (M_PI * 9e-6), 1, 0.15);
    EXPECT_EQ(size.z, 0);
}

TEST_F(FarFieldCommand, FieldInWatts_NeedsAnEfficacyForAPhotometricFile) {
    const Outcome refused = lucerna_run({"light", "farfield", "watts.exr", "-o", "lamp2.ies"});
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.err, HasSubstr("watts.exr: the lamp is in W"));
    const Outcome done = lucerna_run({"light", "farfield", "watts.exr", "-o", "lamp2.ies", "-o", "lamp2.svg",
                                      "--efficacy", "200", "--step", "5", "--plane-step", "15"});
    ASSERT_EQ(done.code, 0) << done.err;
    Monitor silent;
    const double watts = read_light_field("watts.exr").flux();
    EXPECT_NEAR(read_ies("lamp2.ies", silent).flux() / (200 * watts), 1, 1e-4);
    const Outcome diagram = lucerna_run({"light", "farfield", "watts.exr", "-o", "lamp3.svg", "--step", "5"});
    EXPECT_THAT(content("lamp3.svg"), HasSubstr("W/sr"));
    EXPECT_EQ(diagram.code, 0);
}

// Writes a green and a blue lamp as ray files; the second is in watts, without a luminous flux.
void write_two_chips() {
    const auto chip = [](float place, FluxUnit unit) {
        RaySet set;
        set.unit = unit;
        for (int i = 0; i < 3000; ++i) {
            Sampler sampler(7, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const V2f at = sampler.next2();
            set.rays.push_back({{place + 0.001F * at.x, 0.001F * at.y, 0},
                                square_to_cosine_hemisphere(sampler.next2()),
                                1e-3F});
        }
        set.flux = 3;
        return set;
    };
    write_rays("green.ray", chip(0, FluxUnit::lumen));
    write_rays("blue.ray", chip(0.002F, FluxUnit::watt));
}

TEST_F(FarFieldCommand, LampOfTwoChips_IsImportedInColourAndShownSo) {
    write_two_chips();
    std::vector<std::string> import{"light",     "import",  "green.ray", "blue.ray", "-o",
                                    "chips.exr", "--views", "16x16",     "--pixels", "12x12"};
    const Outcome refused = lucerna_run(import);
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.err, HasSubstr("blue.ray: its flux is in W"));
    EXPECT_THAT(refused.err, HasSubstr("--colours"));
    import.insert(import.end(), {"--colours", "528nm,457nm", "--drive", "30,1"});
    const Outcome done = lucerna_run(import);
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr("varying with position and direction"));
    // The lamps emit 90 lm of 528 nm and 3 W of 457 nm.
    const LightField field = read_light_field("chips.exr");
    const V3d green = cie_xyz(528), blue = cie_xyz(457);
    const V3d sum = 90.0 / green.y * green + 3.0 * 683 * blue;
    EXPECT_EQ(field.info().unit, FluxUnit::lumen);
    EXPECT_NEAR((field.info().captured + field.info().missed) / sum.y, 1, 1e-3);
    EXPECT_NEAR(field.xyz().z / (sum.z / sum.y), 1, 0.02);

    const Outcome colours = lucerna_run(
        {"light", "farfield", "chips.exr", "-o", "chips.csv", "--step", "15", "--plane-step", "90"});
    ASSERT_EQ(colours.code, 0) << colours.err;
    EXPECT_THAT(colours.out, HasSubstr("colour over angle"));
    EXPECT_THAT(content("chips.csv"), HasSubstr("delta_uv_mean"));
    const Outcome shown =
        lucerna_run({"light", "project", "chips.exr", "--distance", "0", "-o", "near.exr", "--size",
                     "4mmx4mm", "--centre", "1.5mm,0.5mm", "--pixels", "32x32", "--chromaticity", "--png"});
    ASSERT_EQ(shown.code, 0) << shown.err;
    const Image map = read_exr("near-chromaticity.exr");
    const Chromaticity left = chromaticity(green), right = chromaticity(blue);
    // The left of the screen is green, the right blue.
    EXPECT_GT(left.v, right.v);
    EXPECT_GT(map.rgb_at(8, 16).y, map.rgb_at(23, 16).y + 0.1F);
    EXPECT_TRUE(std::filesystem::exists("near-chromaticity.png"));
    const Outcome none = lucerna_run({"light", "farfield", "lamp.ies", "-o", "lamp.csv"});
    EXPECT_EQ(none.code, 1);
    EXPECT_THAT(none.err, HasSubstr("has no colours"));
}

TEST_F(FarFieldCommand, FieldInWattsOfKnownEfficacy_IsEmittedInItsColours) {
    write_two_chips();
    for (const std::string& wanted : {std::string("528nm,457nm"), std::string("457nm")}) {
        std::vector<std::string> import{"light", "import", "blue.ray", "-o", "watts-of-chips.exr"};
        const bool both = wanted.size() > 6;
        if (both) {
            std::filesystem::copy_file("blue.ray", "other.ray");
            import.insert(import.begin() + 2, "other.ray");
        }
        import.insert(import.end(), {"--colours", wanted, "--views", "6x6", "--pixels", "8x8"});
        const Outcome done = lucerna_run(import);
        ASSERT_EQ(done.code, 0) << done.err;
        const LightField field = read_light_field("watts-of-chips.exr");
        const double expected = both ? 683 * (cie_xyz(528).y + cie_xyz(457).y) / 2 : 683 * cie_xyz(457).y;
        EXPECT_NEAR(field.info().lumens_per_watt / expected, 1, 1e-4);
        const Outcome emitted =
            lucerna_run({"light", "emit", "watts-of-chips.exr", "--rays", "2000", "-o", "watts.tm25ray"});
        ASSERT_EQ(emitted.code, 0) << emitted.err;
        EXPECT_THAT(emitted.err, ::testing::Not(HasSubstr("colour is not saved")));
        Monitor silent;
        const RaySet rays = read_rays("watts.tm25ray", silent);
        EXPECT_EQ(rays.unit, FluxUnit::watt);
        EXPECT_NEAR(rays.lumens_per_watt / expected, 1, 1e-3);
        EXPECT_EQ(rays.coloured(), both);
        for (const std::string lamp : {"watts-of-chips.exr", "watts.tm25ray"}) {
            const Outcome far = lucerna_run({"light", "farfield", lamp, "-o", "far.ies", "--step", "5"});
            ASSERT_EQ(far.code, 0) << far.err;
            const double watts = lamp.ends_with(".exr") ? field.flux() : rays.flux;
            EXPECT_NEAR(read_ies("far.ies", silent).flux() / (expected * watts), 1, 2e-3) << lamp;
        }
    }
}

TEST_F(FarFieldCommand, BadWords_AreNamed) {
    const auto refusal = [](std::vector<std::string> words) {
        words.insert(words.begin(), {"light", "farfield"});
        const Outcome done = lucerna_run(words);
        EXPECT_EQ(done.code, 1);
        return done.err;
    };
    EXPECT_THAT(refusal({"lamp.ies", "-o", "lamp.txt"}), HasSubstr("expected .svg, .ies or .csv"));
    EXPECT_THAT(refusal({"none.ies", "-o", "lamp.svg"}), HasSubstr("none.ies: no such file"));
    EXPECT_THAT(refusal({"watts.exr", "-o", "lamp.svg", "--step", "7"}), HasSubstr("a step of 7 degrees"));
    EXPECT_THAT(refusal({"lamp.ies", "-o", "none/lamp.svg"}), HasSubstr("none"));
}

}  // namespace farfield_test
}  // namespace lucerna
