// Albedos of exactly 0 and 1, and closed rooms without absorption: every method ends, with the right result
// or with a warning about the light that was cut off [docs/development/extremes.md].
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/every_light.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace lossless_test {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// Methods with few paths: each path has up to a thousand bounces.
std::vector<Method> short_methods() {
    return {{"path", "path", {}},
            {"direct", "direct", {}},
            {"gather", "photonmap", {{"photons", "200"}, {"gatherrays", "1"}}},
            {"guided", "photonmap", {{"photons", "200"}, {"gatherrays", "1"}, {"direct", "guided"}}},
            {"map", "photonmap", {{"photons", "200"}, {"direct", "map"}, {"indirect", "map"}}},
            {"igi", "igi", {{"nlights", "16"}, {"nsets", "8"}}},
            {"progressive", "progressive", {{"photons", "200"}}}};
}

std::string ball(const std::string& material) {
    return "Material " + material + " Shape \"sphere\" \"float radius\" 4\n";
}
std::string grey(double albedo) {
    return ball(fmt::format("\"diffuse\" \"rgb reflectance\" [{0} {0} {0}]", albedo));
}

const LightCase& point() {
    static const LightCase light = lights().cases().front();
    return light;
}

struct Rendered {
    RenderResult result;
    std::vector<std::string> warnings;
    double number(const std::string& name) const {
        const auto numbers = result.report.numbers();
        const auto found = numbers.find(name);
        return found == numbers.end() ? 0 : found->second;
    }
};

Rendered rendered(const Method& method, const std::string& room) {
    RecordingMonitor monitor;
    const Job job = lights().job(lights().scene(point(), {}, 1, room), method, 2, monitor);
    RenderResult result = render(job, {1, Workers{2}}, monitor);
    EXPECT_TRUE(is_finite(result.image)) << method.name;
    return {std::move(result), monitor.warnings};
}

class Lossless : public ::testing::TestWithParam<Method> {
  protected:
    static bool walks() { return GetParam().integrator != "path" && GetParam().integrator != "direct"; }
    static auto cut_off() { return Contains(HasSubstr("cut off after many bounces")); }
};

TEST_P(Lossless, ClosedAndWhite_EndsAndSaysWhatWasCutOff) {
    const Rendered seen = rendered(GetParam(), grey(1));
    if (!walks()) return;
    EXPECT_THAT(seen.warnings, cut_off());
    EXPECT_THAT(seen.warnings, Contains(HasSubstr("100 %")));
    // Roulette and the limit on bounces end all paths: no light is absorbed, escapes or vanishes.
    const double emitted = seen.number("energy.emitted");
    EXPECT_GT(emitted, 0);
    EXPECT_LT(seen.number("energy.absorbed") + seen.number("energy.escaped"), 1e-3 * emitted);
    EXPECT_NEAR(seen.number("energy.roulette") + seen.number("energy.cut"), emitted, 1e-3 * emitted);
    EXPECT_LT(seen.number("energy.imbalance"), 1e-3);
}

// A metal's "reflectance" of 1 is replaced by the slightly smaller value that a metal can have: about 1 % is
// absorbed in a hundred bounces, all paths end, and no light vanishes.
TEST_P(Lossless, ClosedBoxOfMirrors_EndsWithAllLightAccountedFor) {
    const Rendered seen =
        rendered(GetParam(), ball("\"conductor\" \"rgb reflectance\" [1 1 1] \"float roughness\" 0"));
    EXPECT_EQ(mean_luminance(seen.result.image), 0) << "no mirror shows a point";
    if (!walks()) return;
    ASSERT_GT(seen.number("paths.emitted"), 0);
    const double emitted = seen.number("energy.emitted");
    EXPECT_GT(seen.number("paths.hits"), 100 * seen.number("paths.emitted"));
    EXPECT_LT(seen.number("energy.imbalance"), 1e-3);
    EXPECT_TRUE(seen.number("energy.absorbed") > 0.5 * emitted || !seen.warnings.empty())
        << seen.number("energy.absorbed") / emitted;
}

TEST_P(Lossless, UsualRooms_NoSuchWarning) {
    for (const double albedo : {0.0, 0.5, 0.9}) {
        EXPECT_THAT(rendered(GetParam(), grey(albedo)).warnings, Not(cut_off())) << albedo;
    }
    EXPECT_THAT(rendered(GetParam(), std::string(kRoom)).warnings, Not(cut_off()));
}

TEST_P(Lossless, AlbedoOfNothing_NothingComesBack) {
    const Rendered seen = rendered(GetParam(), grey(0));
    EXPECT_EQ(mean_luminance(seen.result.image), 0);
    if (!walks()) return;
    const double emitted = seen.number("energy.emitted");
    EXPECT_GT(emitted, 0);
    EXPECT_NEAR(seen.number("energy.absorbed"), emitted, 1e-5 * emitted);
}

INSTANTIATE_TEST_SUITE_P(Methods, Lossless, ::testing::ValuesIn(short_methods()), name_of);

}  // namespace lossless_test
}  // namespace lucerna
