// An area light on a shape that all rays pass (alpha 0): its light arrives by every method, and the light
// itself is invisible.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "engine/image/image.h"
#include "engine/render/render.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace unseen_light_test {

using namespace lucerna::testing;
using ::testing::IsEmpty;

struct Method {
    std::string name, integrator;
    std::vector<std::pair<std::string, std::string>> set;

    friend void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }
};

std::vector<Method> methods() {
    return {{"path", "path", {{"maxdepth", "3"}}},
            {"direct", "direct", {}},
            {"gather", "photonmap", {{"photons", "20000"}, {"gatherrays", "2"}}},
            {"guided", "photonmap", {{"photons", "20000"}, {"indirect", "none"}, {"direct", "guided"}}},
            {"map", "photonmap", {{"photons", "100000"}, {"direct", "map"}, {"indirect", "none"}}},
            {"igi", "igi", {{"nlights", "64"}, {"nsets", "4"}}},
            {"progressive", "progressive", {{"photons", "5000"}}}};
}

// Returns a panel that shines down on a somewhat glossy floor, two wide, one above it; `look` is the camera's
// LookAt.
std::string panel(const std::string& look, const std::string& material, const std::string& more) {
    return look +
           "Camera \"perspective\" \"float fov\" 40\n"
           "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\n" +
           material +
           "\nShape \"bilinearmesh\" \"point3 P\" [ -9 0 -9  9 0 -9  -9 0 9  9 0 9 ]\n"
           "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n"
           "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\n"
           "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -1 1 -1  1 1 -1  1 1 1 "
           " -1 1 1 ] " +
           more + "\n";
}
constexpr const char* kAtTheFloor = "LookAt 0 0.9 -3  0 0 -1  0 1 0\n";
constexpr const char* kAtThePanel = "LookAt 0 0.1 0  0 1 0  0 0 1\n";
constexpr const char* kMatt = "Material \"diffuse\" \"rgb reflectance\" [ 0.5 0.5 0.5 ]";
// Directions sampled from the glossy lobe would hit the panel; that share of the light must not be lost.
constexpr const char* kGloss =
    "Material \"conductor\" \"rgb reflectance\" [ 0.8 0.8 0.8 ] \"float roughness\" 0.3";

class UnseenLight : public ::testing::TestWithParam<Method> {
  protected:
    static double mean(const std::string& text) {
        RecordingMonitor monitor;
        SceneOverrides overrides;
        overrides.integrator = GetParam().integrator;
        overrides.set = GetParam().set;
        overrides.spp = 64;
        overrides.strict = true;
        const Job job = read_scene_text(text, "scene.pbrt", overrides, {2}, monitor);
        const Image image = render(job, {1, {2}}, monitor).image;
        EXPECT_THAT(monitor.warnings, IsEmpty());
        double sum = 0;
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x)
                sum += static_cast<double>(luminance(image.rgb_at(x, y))) / 64;
        }
        return sum;
    }
};

TEST_P(UnseenLight, LightsAsTheSeenOneDoes) {
    for (const char* material : {kMatt, kGloss}) {
        // Photons are not gathered on glossy surfaces.
        if (GetParam().name == "map" && material == kGloss) continue;
        const double seen = mean(panel(kAtTheFloor, material, ""));
        ASSERT_GT(seen, 0.01);
        EXPECT_NEAR(mean(panel(kAtTheFloor, material, "\"float alpha\" 0")), seen, 0.03 * seen) << material;
    }
}

TEST_P(UnseenLight, IsNotSeen) {
    EXPECT_NEAR(mean(panel(kAtThePanel, kMatt, "")), 1, 1e-3);
    EXPECT_EQ(mean(panel(kAtThePanel, kMatt, "\"float alpha\" 0")), 0);
}

INSTANTIATE_TEST_SUITE_P(Methods, UnseenLight, ::testing::ValuesIn(methods()),
                         [](const auto& method) { return method.param.name; });

}  // namespace unseen_light_test
}  // namespace lucerna
