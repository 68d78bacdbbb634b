// `lucerna light import` and `emit`: from rays to lamps and back.
#include "engine/system/files.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace light_rays_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::lucerna_run;
using testing::Outcome;

class LightRays : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        Rig rig;
        rig.views = {5, 4};
        rig.spacing = {0.001, 0.001};
        rig.pixels = {6, 8};
        rig.pixel = {0.01, 0.01};
        rig.distance = 0.1;
        rig.centre = {0.01, 0, 0.002};
        LightFieldInfo info;
        info.unit = FluxUnit::lumen;
        write_light_field("lamp.exr", LightField(rig, std::vector<float>(rig.coefficients(), 1e8F), info));
        flux_ = read_light_field("lamp.exr").flux();
    }
    double flux_ = 0;
};

TEST_F(LightRays, Long_EmitThenImport_KeepsTheLumensInEveryFormat) {
    for (const std::string name : {"out.tm25ray", "out.dat", "out.ray"}) {
        const Outcome emitted = lucerna_run({"light", "emit", "lamp.exr", "--rays", "20000", "-o", name});
        ASSERT_EQ(emitted.code, 0) << emitted.err;
        EXPECT_THAT(emitted.out, AllOf(HasSubstr("20000"), HasSubstr(" lm")));
        const Outcome seen = lucerna_run({"light", "info", name});
        EXPECT_EQ(seen.code, 0);
        EXPECT_THAT(seen.out, AllOf(HasSubstr("rays                 20000"), HasSubstr(" lm")));
        const Outcome imported = lucerna_run({"light", "import", name, "-o", "again.exr"});
        ASSERT_EQ(imported.code, 0) << imported.err;
        EXPECT_THAT(imported.out,
                    AllOf(HasSubstr("distribution of the rays' flux"), HasSubstr("error of irradiance")));
        const LightField again = read_light_field("again.exr");
        EXPECT_EQ(again.info().unit, FluxUnit::lumen);
        EXPECT_NEAR((again.info().captured + again.info().missed) / flux_, 1, 1e-4);
        // The rays start on S, in the lamp's own frame; light that spreads over all of M from every point of
        // S is narrowest slightly in front of S.
        EXPECT_GE(again.rig().centre.z, 0.002 - 1e-6);
        EXPECT_LE(again.rig().centre.z, 0.005);
        EXPECT_NEAR(again.rig().centre.x, 0.01, 3e-4);
    }
}

TEST_F(LightRays, Emit_ForSpeos_KeepsTheLumensAndNamesTheLossOfColour) {
    const Outcome emitted =
        lucerna_run({"light", "emit", "lamp.exr", "--rays", "100", "-o", "out.speos.ray"});
    ASSERT_EQ(emitted.code, 0) << emitted.err;
    EXPECT_THAT(emitted.err, HasSubstr("the lamp's colour is not saved"));
    const Outcome seen = lucerna_run({"light", "info", "out.speos.ray"});
    EXPECT_THAT(seen.out, AllOf(HasSubstr("SPEOS ray file out.speos.ray, 100 rays"), HasSubstr("683 lm/W")));
    Monitor silent;
    EXPECT_NEAR(683 * read_rays("out.speos.ray", silent).flux / flux_, 1, 1e-6);
    std::filesystem::rename("out.speos.ray", "rays.bin");
    EXPECT_THAT(lucerna_run({"info", "rays.bin"}).out, HasSubstr("SPEOS ray file rays.bin, 100 rays"));
}

TEST_F(LightRays, Emit_SameCommand_SameBytes) {
    const auto emit = [](const std::string& seed, const std::string& threads) {
        const Outcome done = lucerna_run({"light", "emit", "lamp.exr", "--rays", "3000", "--seed", seed,
                                          "--threads", threads, "--quiet", "-o", "out.ray"});
        EXPECT_EQ(done.code, 0) << done.err;
        EXPECT_THAT(done.out, IsEmpty());
        return read_bytes("out.ray");
    };
    EXPECT_EQ(emit("1", "1"), emit("1", "3"));
    EXPECT_NE(emit("1", "1"), emit("2", "1"));
}

// Writes the rays of the lamp of SetUp with all of them in the colour `xyz`.
void recolour(const std::string& from, const std::string& to, const V3d& xyz,
              FluxUnit unit = FluxUnit::lumen) {
    Monitor silent;
    RaySet set = read_rays(from, silent);
    set.xyz = xyz;
    set.unit = unit;
    write_rays(to, set);
}

TEST_F(LightRays, SeveralFiles_AreOneLampOfTheirDrivenFluxes) {
    ASSERT_EQ(lucerna_run({"light", "emit", "lamp.exr", "--rays", "20000", "-o", "white.tm25ray"}).code, 0);
    const V3d red(2.3, 1, 0), blue(5.5, 1, 30);
    recolour("white.tm25ray", "red.tm25ray", red);
    recolour("white.tm25ray", "blue.tm25ray", blue);
    const std::vector<std::string> import = {"light",    "import",  "red.tm25ray", "blue.tm25ray", "-o",
                                             "both.exr", "--views", "5x4",         "--pixels",     "6x8"};
    const auto with = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words = import;
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    const Outcome driven = lucerna_run(with({"--drive", "1,0.25"}));
    ASSERT_EQ(driven.code, 0) << driven.err;
    const LightFieldInfo info = read_light_field("both.exr").info();
    EXPECT_NEAR((info.captured + info.missed) / (1.25 * flux_), 1, 1e-4);
    const Rgb colour = colour_of_luminance_one(xyz_to_rgb((red + 0.25 * blue) / 1.25));
    EXPECT_NEAR((info.colour - colour).length(), 0, 2e-3F) << "stored as halves";
    EXPECT_THAT(info.provenance, HasSubstr("0.25 x TM-25 ray file blue.tm25ray"));
    ASSERT_EQ(lucerna_run(import).code, 0);
    const LightFieldInfo whole = read_light_field("both.exr").info();
    EXPECT_NEAR((whole.captured + whole.missed) / (2 * flux_), 1, 1e-4);

    expect_refused(with({"--drive", "1"}), {"--drive: 1 values for 2 ray files"});
    expect_refused(with({"--drive", "1,1,1"}), {"--drive: 3 values for 2 ray files"});
    expect_refused(with({"--drive", "1,-1"}), {"--drive", "-1"});
    expect_refused(with({"--drive", "1,"}), {"--drive"});
    expect_refused(with({"--drive", "1,x"}), {"--drive", "x"});
    expect_refused(with({"--drive", "0,0"}), {"all drives are 0"});
    expect_refused(with({"none.tm25ray"}), {"none.tm25ray"});
    recolour("white.tm25ray", "watts.tm25ray", kWhiteXyz, FluxUnit::watt);
    expect_refused(with({"watts.tm25ray"}), {"watts.tm25ray: its flux is in W", "red.tm25ray in lm"});
}

TEST_F(LightRays, Info_TellsChromaticityAndColourTemperature) {
    ASSERT_EQ(lucerna_run({"light", "emit", "lamp.exr", "--rays", "100", "-o", "white.tm25ray"}).code, 0);
    EXPECT_THAT(
        lucerna_run({"light", "info", "white.tm25ray"}).out,
        AllOf(HasSubstr("x 0.3127, y 0.3290; u' 0.1978, v' 0.4683"), HasSubstr("6502 K, Duv +0.0032")));
    recolour("white.tm25ray", "warm.tm25ray", V3d(1.09850, 1, 0.35585));
    EXPECT_THAT(lucerna_run({"light", "info", "warm.tm25ray"}).out,
                AllOf(HasSubstr("x 0.4476, y 0.4074"), HasSubstr("2856 K, Duv +0.0000")));
    recolour("white.tm25ray", "green.tm25ray", V3d(0.19, 1, 0.05));
    EXPECT_THAT(lucerna_run({"light", "info", "green.tm25ray"}).out, HasSubstr("no CCT"));
}

TEST_F(LightRays, BadWords_AreRefusedBeforeTheWork) {
    expect_refused({"light", "emit", "lamp.exr", "-o", "out.txt"}, {"out.txt", ".tm25ray"});
    expect_refused({"light", "emit", "lamp.exr", "--rays", "0", "-o", "out.ray"}, {"--rays"});
    expect_refused({"light", "emit", "lamp.exr", "--mode", "exakt", "-o", "out.ray"}, {"--mode", "constant"});
    expect_refused({"light", "emit", "none.exr", "-o", "out.ray"}, {"none.exr"});
    expect_refused({"light", "import", "scene.pbrt", "-o", "out.exr"}, {"scene.pbrt", ".tm25ray"});
    expect_refused({"light", "import", "scene.pbrt", "--capture", "0", "-o", "out.exr"}, {"--capture"});
}

}  // namespace light_rays_test
}  // namespace lucerna
