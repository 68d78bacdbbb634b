// lucerna light farfield, and what the other commands say of photometric files.
#include <fstream>

#include "lights/light_field.h"
#include "lights/photometric_files.h"
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
    EXPECT_THAT(done.out, HasSubstr("peak                 100 cd at 0"));
    EXPECT_THAT(content("lamp.svg"), StartsWith("<svg"));
    EXPECT_THAT(content("lamp.svg"), HasSubstr("100 cd</text>"));
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"light", "info", "lamp.ies"}, {"info", "lamp.ies"}}) {
        const Outcome info = lucerna_run(command);
        ASSERT_EQ(info.code, 0) << info.err;
        EXPECT_THAT(info.out, HasSubstr("luminous opening     200 mm along C0, 100 mm along C90"));
    }
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

TEST_F(FarFieldCommand, BadWords_AreNamed) {
    const auto refusal = [](std::vector<std::string> words) {
        words.insert(words.begin(), {"light", "farfield"});
        const Outcome done = lucerna_run(words);
        EXPECT_EQ(done.code, 1);
        return done.err;
    };
    EXPECT_THAT(refusal({"lamp.ies", "-o", "lamp.txt"}), HasSubstr(".svg and .ies can"));
    EXPECT_THAT(refusal({"none.ies", "-o", "lamp.svg"}), HasSubstr("none.ies: no such file"));
    EXPECT_THAT(refusal({"watts.exr", "-o", "lamp.svg", "--step", "7"}), HasSubstr("a step of 7 degrees"));
    EXPECT_THAT(refusal({"lamp.ies", "-o", "none/lamp.svg"}), HasSubstr("none"));
}

}  // namespace farfield_test
}  // namespace lucerna
