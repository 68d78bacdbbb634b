// lucerna light import and emit: rays in, rays out.
#include "engine/base/files.h"
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

TEST_F(LightRays, EmitThenImport_KeepsTheLumensInEveryFormat) {
    for (const std::string name : {"out.tm25ray", "out.dat", "out.ray"}) {
        const Outcome emitted = lucerna_run({"light", "emit", "lamp.exr", "--rays", "20000", "-o", name});
        ASSERT_EQ(emitted.code, 0) << emitted.err;
        EXPECT_THAT(emitted.out, AllOf(HasSubstr("20000"), HasSubstr(" lm")));
        const Outcome seen = lucerna_run({"light", "info", name});
        EXPECT_EQ(seen.code, 0);
        EXPECT_THAT(seen.out, AllOf(HasSubstr("rays                 20000"), HasSubstr(" lm")));
        const Outcome imported = lucerna_run({"light", "import", name, "-o", "again.exr", "--noise", "30%"});
        ASSERT_EQ(imported.code, 0) << imported.err;
        EXPECT_THAT(imported.out, AllOf(HasSubstr("where the rays' light went"), HasSubstr("(limit 30 %)")));
        const LightField again = read_light_field("again.exr");
        EXPECT_EQ(again.info().unit, FluxUnit::lumen);
        EXPECT_NEAR((again.info().captured + again.info().missed) / flux_, 1, 1e-4);
        // The rays start on S, in the lamp's own frame; light that spreads over all of M from every point of
        // S is closest together a little before it.
        EXPECT_GE(again.rig().centre.z, 0.002 - 1e-6);
        EXPECT_LE(again.rig().centre.z, 0.005);
        EXPECT_NEAR(again.rig().centre.x, 0.01, 3e-4);
    }
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

TEST_F(LightRays, BadWords_AreRefusedBeforeTheWork) {
    expect_refused({"light", "emit", "lamp.exr", "-o", "out.txt"}, {"out.txt", ".tm25ray"});
    expect_refused({"light", "emit", "lamp.exr", "--rays", "0", "-o", "out.ray"}, {"--rays"});
    expect_refused({"light", "emit", "lamp.exr", "--mode", "exakt", "-o", "out.ray"}, {"--mode", "weighted"});
    expect_refused({"light", "emit", "none.exr", "-o", "out.ray"}, {"none.exr"});
    expect_refused({"light", "import", "scene.pbrt", "-o", "out.exr"}, {"scene.pbrt", ".tm25ray"});
    expect_refused({"light", "import", "scene.pbrt", "--noise", "0", "-o", "out.exr"}, {"--noise"});
}

}  // namespace light_rays_test
}  // namespace lucerna
