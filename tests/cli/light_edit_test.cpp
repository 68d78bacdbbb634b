// `light edit` and `light acquire --scene` as commands: what they write and print, and what they refuse.
#include <gmock/gmock.h>

#include <cmath>

#include "lights/lumigraph.h"
#include "lights/ray_set.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace light_edit_test {

using testing::lucerna_run;
using testing::Outcome;

using ::testing::AllOf;
using ::testing::HasSubstr;

using RunEdit = testing::RunTest;

void make_lamp(const std::string& file) {
    ASSERT_EQ(lucerna_run({"light", "acquire", "--emitter", "rectangle", "--size", "8mmx4mm", "--views",
                           "6x6", "--pixels", "12x12", "--flux", "50", "-o", file, "--quiet"})
                  .code,
              0);
}

TEST_F(RunEdit, LampsWithTheirOwnEdits_BecomeOneLamp) {
    make_lamp("led.exr");
    const Outcome made = lucerna_run({"light", "edit", "led.exr", "--move", "20mm,0,0", "led.exr", "--dim",
                                      "0.5", "--move", "20mm,0,0", "--turn", "z,60", "-o", "pair.exr"});
    ASSERT_EQ(made.code, 0) << made.err;
    const Lumigraph led = read_lumigraph("led.exr"), pair = read_lumigraph("pair.exr");
    EXPECT_NEAR(pair.flux() / led.flux(), 1.5, 1e-3);
    EXPECT_NEAR((pair.captured() + pair.missed()) / 75, 1, 1e-3);
    ASSERT_EQ(pair.slabs().size(), 2U);
    // Moved first and then turned: the second lamp stands 60 degrees around the origin.
    const Slab& second = pair.slabs()[1];
    const V3d place = second.axes.to_lamp(second.field.rig().centre);
    EXPECT_NEAR(place.x, 0.01, 1e-9);
    EXPECT_NEAR(place.y, 0.02 * std::sqrt(0.75), 1e-9);
    EXPECT_THAT(made.out,
                AllOf(HasSubstr("lamp 1               led.exr --move 20mm,0,0: "),
                      HasSubstr("lamp 2               led.exr --dim 0.5 --move 20mm,0,0 --turn z,60: ")));
    EXPECT_THAT(second.field.info().provenance, AllOf(HasSubstr("lamp 2 of 2"), HasSubstr("--turn z,60")));
}

TEST_F(RunEdit, OrderOfEdits_Matters) {
    make_lamp("led.exr");
    ASSERT_EQ(lucerna_run({"light", "edit", "led.exr", "--turn", "z,90", "--move", "20mm,0,0", "-o", "a.exr",
                           "--quiet"})
                  .code,
              0);
    const Slab& slab = read_lumigraph("a.exr").slabs()[0];
    EXPECT_LT((slab.axes.to_lamp(slab.field.rig().centre) - V3d(0.02, 0, 0)).length(), 1e-9);
}

TEST_F(RunEdit, RayFiles_BecomeARayFile) {
    make_lamp("led.exr");
    ASSERT_EQ(
        lucerna_run({"light", "emit", "led.exr", "--rays", "5000", "-o", "led.tm25ray", "--quiet"}).code, 0);
    const Outcome made = lucerna_run({"light", "edit", "led.tm25ray", "--turn=x,180", "led.tm25ray",
                                      "--sides", "+z", "-o", "both.tm25ray"});
    ASSERT_EQ(made.code, 0) << made.err;
    Monitor silent;
    const RaySet led = read_rays("led.tm25ray", silent), both = read_rays("both.tm25ray", silent);
    double below = 0;
    for (const LampRay& ray : both.rays) below += ray.d.z < 0 ? double{ray.flux} : 0.0;
    EXPECT_NEAR(below / led.flux, 1, 1e-4);
    EXPECT_GT(both.flux, 1.2 * led.flux);
    EXPECT_LT(both.flux, 1.9 * led.flux);
}

TEST_F(RunEdit, Mistakes_AreRefusedInOneLine) {
    make_lamp("led.exr");
    write("rays.tm25ray", "");
    expect_refused({"light", "edit", "none.exr", "-o", "a.exr"}, {"none.exr"});
    expect_refused({"light", "edit", "led.exr", "--turn", "60", "-o", "a.exr"},
                   {"--turn", "\"60\"", "AXIS,DEGREES"});
    expect_refused({"light", "edit", "led.exr", "--turn", "w,60", "-o", "a.exr"},
                   {"--turn", "\"w\"", "x, y or z"});
    expect_refused({"light", "edit", "led.exr", "--move", "1mm,2mm", "-o", "a.exr"}, {"--move", "X,Y,Z"});
    expect_refused({"light", "edit", "led.exr", "--move", "1,2,3", "-o", "a.exr"}, {"--move", "\"1\""});
    expect_refused({"light", "edit", "led.exr", "--dim", "0", "-o", "a.exr"}, {"--dim", "\"0\""});
    expect_refused({"light", "edit", "led.exr", "--mirror", "+x", "-o", "a.exr"}, {"--mirror", "x, y or z"});
    expect_refused({"light", "edit", "--dim", "0.5", "led.exr", "-o", "a.exr"},
                   {"--dim", "stands before the first lamp"});
    expect_refused({"light", "edit", "led.exr", "--sides=-z", "-o", "a.exr"}, {"led.exr", "slabs face +z"});
    expect_refused({"light", "edit", "led.exr", "-o", "a.tm25ray"}, {"led.exr", "lucerna light emit"});
    expect_refused({"light", "edit", "rays.tm25ray", "-o", "a.exr"},
                   {"rays.tm25ray", "lucerna light import"});
    expect_refused({"light", "edit", "led.exr", "-o", "a.png"}, {"a.png", ".exr for light fields"});
    expect_refused({"light", "edit", "led.exr", "-o", "led.exr"}, {"led.exr"});
}

TEST_F(RunEdit, Help_Teaches) {
    const Outcome outcome = lucerna_run({"light", "edit", "--help"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("Examples:"), HasSubstr("--mirror"), HasSubstr("in the order")));
}

// A lamp's ray file in front of a mirror, with a board at its side.
constexpr const char* kLuminaire = R"(Option "string unit" "photometric"
Camera "perspective" Film "rgb" WorldBegin
MakeNamedMaterial "board" "string type" "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
NamedMaterial "board"
AttributeBegin Translate 0.03 0 0.02 Rotate 90 0 1 0 Shape "disk" "float radius" 0.02 AttributeEnd
Material "conductor" "rgb reflectance" [ 0.9 0.9 0.9 ]
AttributeBegin Translate 0 0 -0.001 Shape "disk" "float radius" 0.03 AttributeEnd
LightSource "rayfile" "string filename" "led.tm25ray"
)";

using RunAcquireScene = testing::RunTest;

TEST_F(RunAcquireScene, LuminaireAroundARayFile_BecomesALampWithItsLosses) {
    make_lamp("led.exr");
    ASSERT_EQ(
        lucerna_run({"light", "emit", "led.exr", "--rays", "20000", "-o", "led.tm25ray", "--quiet"}).code, 0);
    write("luminaire.pbrt", kLuminaire);
    const std::vector<std::string> words{"light",    "acquire", "--scene", "luminaire.pbrt",
                                         "--rays",   "20000",   "--views", "6x6",
                                         "--pixels", "12x12",   "-o"};
    const auto acquire = [&](const std::string& file, const std::string& threads) {
        std::vector<std::string> all = words;
        all.insert(all.end(), {file, "--threads", threads});
        return lucerna_run(all);
    };
    const Outcome made = acquire("lamp.exr", "2");
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_THAT(made.out, AllOf(HasSubstr("light paths          20000"), HasSubstr("absorbed by board"),
                                HasSubstr("leaves the luminaire"), HasSubstr("in cut-off paths")));
    const Lumigraph lamp = read_lumigraph("lamp.exr"), led = read_lumigraph("led.exr");
    EXPECT_EQ(lamp.unit(), FluxUnit::lumen);
    const double leaving = lamp.captured() + lamp.missed();
    EXPECT_LT(leaving, 0.99 * led.flux());
    EXPECT_GT(leaving, 0.8 * led.flux());
    ASSERT_EQ(acquire("again.exr", "1").code, 0);
    EXPECT_EQ(content_hash(read_lumigraph("again.exr")), content_hash(lamp)) << "on any number of threads";
}

TEST_F(RunAcquireScene, FluxAndSides_AreThoseAskedFor) {
    make_lamp("led.exr");
    ASSERT_EQ(
        lucerna_run({"light", "emit", "led.exr", "--rays", "20000", "-o", "led.tm25ray", "--quiet"}).code, 0);
    write("luminaire.pbrt", kLuminaire);
    const Outcome made =
        lucerna_run({"light", "acquire", "--scene", "luminaire.pbrt", "--rays", "20000", "--views", "6x6",
                     "--pixels", "12x12", "--flux", "300", "--sides", "+z,-x", "-o", "lamp.exr", "--quiet"});
    ASSERT_EQ(made.code, 0) << made.err;
    const Lumigraph lamp = read_lumigraph("lamp.exr");
    EXPECT_NEAR(lamp.captured() + lamp.missed(), 300, 0.5);
    ASSERT_EQ(lamp.slabs().size(), 2U);
    EXPECT_EQ(lamp.slabs()[1].axes.name(), "-x");
}

TEST_F(RunAcquireScene, Mistakes_AreRefusedInOneLine) {
    make_lamp("led.exr");
    ASSERT_EQ(
        lucerna_run({"light", "emit", "led.exr", "--rays", "2000", "-o", "led.tm25ray", "--quiet"}).code, 0);
    write("luminaire.pbrt", kLuminaire);
    write("sun.pbrt",
          "Camera \"perspective\" Film \"rgb\" WorldBegin\nLightSource \"distant\"\nShape \"sphere\"\n");
    write("rig.toml", "");
    expect_refused({"light", "acquire", "--scene", "none.pbrt", "-o", "a.exr"}, {"none.pbrt"});
    write("model.glb", "");
    expect_refused({"light", "acquire", "--scene", "model.glb", "-o", "a.exr"},
                   {"--scene", "lucerna import"});
    expect_refused({"light", "acquire", "--scene", "sun.pbrt", "-o", "a.exr"},
                   {"sun.pbrt", "of type distant"});
    expect_refused({"light", "acquire", "--scene", "luminaire.pbrt", "--radius", "3mm", "-o", "a.exr"},
                   {"--radius", "does not apply to --scene"});
    expect_refused({"light", "acquire", "rig.toml", "--scene", "luminaire.pbrt", "-o", "a.exr"}, {"--scene"});
    expect_refused({"light", "acquire", "--rays", "100", "-o", "a.exr"},
                   {"--rays", "applies only to --scene"});
    expect_refused({"light", "acquire", "--scene", "luminaire.pbrt", "--unit", "W", "-o", "a.exr"},
                   {"--unit", "the scene is in lm"});
    expect_refused({"light", "acquire", "--scene", "luminaire.pbrt", "--rays", "0", "-o", "a.exr"},
                   {"--rays"});
}

}  // namespace light_edit_test
}  // namespace lucerna
