// A virtual rig photographs a lamp, and `light assemble` reproduces the lamp.
#include "engine/cli/run.h"
#include "lights/light_field.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace assemble_test {

using testing::lucerna_run;
using testing::Outcome;

using ::testing::AllOf;
using ::testing::HasSubstr;

using RunAssemble = testing::RunTest;

constexpr const char* kRigFile = R"(
[rig]
setup = "B"
views = 5
spacing = "10mm"
pixels = 8
screen = "1m"
distance = "0.3m"
[emitter]
kind = "disc"
radius = "12mm"
setback = "3mm"
flux = 100
[camera]
exposures = [0.1, 1]
oversampling = 2
margin = 1
bits = 32
darks = 1
dark_current = 5
)";

double difference(const LightField& a, const LightField& b) {
    double most = 0, peak = 0;
    for (std::size_t i = 0; i < a.coefficients().size(); ++i) {
        most = std::max(most, std::fabs(double{a.coefficients()[i]} - double{b.coefficients()[i]}));
        peak = std::max(peak, std::fabs(double{a.coefficients()[i]}));
    }
    return most / peak;
}

TEST_F(RunAssemble, VirtualPhotographs_GiveTheLampBack) {
    write("rig.toml", kRigFile);
    std::string bare = kRigFile;
    write("bare.toml", bare.substr(0, bare.find("[camera]")));
    ASSERT_EQ(lucerna_run({"light", "acquire", "bare.toml", "-o", "bare.exr", "--quiet"}).code, 0);
    const Outcome taken =
        lucerna_run({"light", "acquire", "rig.toml", "-o", "seen.exr", "--photographs", "shots"});
    ASSERT_EQ(taken.code, 0) << taken.err;
    const Outcome made = lucerna_run({"light", "assemble", "shots/manifest.toml", "-o", "back.exr"});
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_THAT(made.out, AllOf(HasSubstr("photographs          100 of 18 x 18 pixels, 4 per pixel of M"),
                                HasSubstr("saturated pixels     0")));
    const LightField bare_field = read_light_field("bare.exr"), seen = read_light_field("seen.exr"),
                     back = read_light_field("back.exr");
    EXPECT_LT(difference(bare_field, back), 1e-3);  // all three are stored in half precision
    EXPECT_LT(difference(seen, back), 1e-6);
    EXPECT_EQ(back.rig().centre, seen.rig().centre);
    EXPECT_NEAR(back.info().missed, bare_field.info().missed, 1e-3);
}

TEST_F(RunAssemble, Mistakes_AreRefusedInOneLine) {
    expect_refused({"light", "assemble", "none.toml", "-o", "a.exr"}, {"none.toml"});
    write("m.toml", "unit = \"lm\"\n");
    expect_refused({"light", "assemble", "m.toml", "-o", "a.exr"}, {"m.toml", "lacks \"rig\""});
    expect_refused({"light", "assemble", "m.toml", "-o", "a.png"}, {"a.png"});
    write("rig.toml", kRigFile);
    expect_refused({"light", "acquire", "rig.toml", "-o", "a.exr", "--photographs", "none/shots", "--quiet"},
                   {"none/shots", "cannot be created"});
}

TEST_F(RunAssemble, MissingPhotograph_IsNamed) {
    write("rig.toml", kRigFile);
    ASSERT_EQ(
        lucerna_run({"light", "acquire", "rig.toml", "-o", "a.exr", "--photographs", "shots", "--quiet"})
            .code,
        0);
    std::filesystem::remove("shots/view_002_003_negative_1.exr");
    expect_refused({"light", "assemble", "shots/manifest.toml", "-o", "b.exr", "--quiet"},
                   {"shots/manifest.toml: 1 of 102 photographs are missing", "view [2, 3] negative, 1 s"});
}

TEST_F(RunAssemble, Help_Teaches) {
    const Outcome outcome = lucerna_run({"light", "assemble", "--help"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.out,
                AllOf(HasSubstr("Examples:"), HasSubstr("--photographs"), HasSubstr("manifest")));
}

}  // namespace assemble_test
}  // namespace lucerna
