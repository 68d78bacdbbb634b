// Scenes with too little in them, or with contents that no scene should have: each render ends with the right
// result or with a refusal that names the cause; never with NaN [docs/development/extremes.md].
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/every_light.h"

namespace lucerna {
namespace degenerate_test {

using namespace testing;
using ::testing::HasSubstr;

constexpr int kSpp = 2;

const LightCase& light_named(std::string_view name) {
    static const std::vector<LightCase> all = lights().cases();
    return *std::find_if(all.begin(), all.end(), [&](const LightCase& light) { return light.name == name; });
}

class Degenerate : public ::testing::TestWithParam<Method> {
  protected:
    Image look(const std::string& text, int spp = kSpp) const {
        Image image = lights().image(text, GetParam(), spp);
        EXPECT_TRUE(is_finite(image));
        return image;
    }
};

TEST_P(Degenerate, NothingButALight_OnlyWhatTheCameraSeesOfIt) {
    for (const LightCase& light : lights().cases()) {
        const Image image = look(lights().scene(light, {}, 1, ""));
        const bool is_sky = light.name.starts_with("sky");
        if (is_sky) {
            EXPECT_GT(mean_luminance(image), 0.1) << light.name;
        }
        const bool is_point =
            light.name == "point" || light.name == "spot" || light.name == "distant" || light.name == "ies";
        if (is_point) {
            EXPECT_EQ(mean_luminance(image), 0) << light.name;
        }
    }
}

TEST_P(Degenerate, NoLight_Black) {
    EXPECT_EQ(mean_luminance(look(lights().scene({"none", "# {}", true, false}))), 0);
    EXPECT_EQ(mean_luminance(look(lights().scene({"none", "# {}", true, false}, {}, 1, ""))), 0);
}

TEST_P(Degenerate, LightOfNoPower_Black) {
    for (const LightCase& light : lights().cases()) {
        EXPECT_EQ(mean_luminance(look(lights().scene(light, {}, 0))), 0) << light.name;
    }
}

TEST_P(Degenerate, LightInsideAWall_Black) {
    const std::string closed = std::string(kRoom) +
                               "AttributeBegin Translate 0.5 0.8 -0.4 Shape \"sphere\" \"float radius\" 0.05 "
                               "AttributeEnd";
    EXPECT_EQ(mean_luminance(look(lights().scene(light_named("point"), {}, 1, closed))), 0);
}

TEST_P(Degenerate, CameraInsideASolid_Black) {
    const std::string around = std::string(kRoom) +
                               "AttributeBegin Translate 0.1 0.1 -2.6 Shape \"sphere\" \"float radius\" 0.2 "
                               "AttributeEnd";
    EXPECT_EQ(mean_luminance(look(lights().scene(light_named("point"), {}, 1, around))), 0);
}

TEST_P(Degenerate, BlackSurfaces_NothingComesBack) {
    const std::string black = R"(Material "diffuse" "rgb reflectance" [0 0 0]
        Shape "sphere" "float radius" 4)";
    EXPECT_EQ(mean_luminance(look(lights().scene(light_named("point"), {}, 1, black))), 0);
}

// The room is open, white and lossless: paths end because they escape.
TEST_P(Degenerate, AlbedoOfOneInAnOpenRoom_EndsAndIsFinite) {
    std::string white(kRoom);
    white.replace(white.find("0.6 0.5 0.4"), 11, "1 1 1");
    for (const LightCase& light : lights().cases()) {
        if (!light.suits(GetParam())) continue;
        EXPECT_GT(mean_luminance(look(lights().scene(light, {}, 1, white))), 0) << light.name;
    }
}

// A closed box of mirrors around camera and light: no light is absorbed, so paths end at the limit on
// bounces.
TEST_P(Degenerate, ClosedBoxOfMirrors_Ends) {
    const std::string mirrors = R"(Material "conductor" "rgb reflectance" [1 1 1] "float roughness" 0
        Shape "sphere" "float radius" 4
        Material "diffuse" "rgb reflectance" [0.5 0.5 0.5] Shape "sphere" "float radius" 0.3)";
    look(lights().scene(light_named("point"), {}, 1, mirrors));
    look(lights().scene(light_named("area of a sphere"), {}, 1, mirrors));
}

// Tests slivers, triangles without area, coincident surfaces, and a surface without extent.
TEST_P(Degenerate, SliversAndTrianglesOfNoArea_ChangeNothing) {
    const std::string odd =
        std::string(kRoom) +
        R"(Shape "trianglemesh" "point3 P" [0 0 0  0 0 0  0 0 0  1 0 0  2 0 0  3 0 0  -1 0.5 0  1 0.5 0  0 0.50000001 0]
           "integer indices" [0 1 2  3 4 5  0 0 3])";
    const Image plain = look(lights().scene(light_named("point")));
    const Image with = look(lights().scene(light_named("point"), {}, 1, odd));
    EXPECT_LT(difference(plain, with).pixels, 0.02);
    const std::string sliver = std::string(kRoom) +
                               R"(Shape "trianglemesh" "point3 P" [-1 0.5 0  1 0.5 0  0 0.500001 0]
           "integer indices" [0 1 2])";
    EXPECT_LT(difference(plain, look(lights().scene(light_named("point"), {}, 1, sliver))).pixels, 0.05);
}

// The light grazes the floor: its photons are spread far in the plane in which they are gathered.
TEST_P(Degenerate, LightAlongTheFloor_GivesAFiniteImage) {
    const std::string floor = R"(Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
        Shape "trianglemesh" "point3 P" [-1 -0.5 -1  1 -0.5 -1  1 -0.5 1  -1 -0.5 1]
        "integer indices" [0 2 1 0 3 2])";
    const auto from = [](double x, double y, double z) {
        return LightCase{
            "distant",
            fmt::format("LightSource \"distant\" \"point3 from\" [{} {:.9g} {}] \"point3 to\" [0 0 0] "
                        "\"rgb L\" [1 1 1] \"float scale\" {{}}",
                        x, y, z),
            false, false};
    };
    // The floor's share of the image, under perpendicular irradiance of 1.
    const double upright = mean_luminance(look(lights().scene(from(0, 1, 0), {}, 1, floor), 64));
    EXPECT_NEAR(upright, 0.226 * 0.5 / kPiD, 0.01 * 0.5 / kPiD);
    for (const double slope : {1e-2, 1e-5, 1e-8, 0.0, -1e-8}) {
        const LightCase grazing = from(-1, slope, -3);
        EXPECT_GT(mean_luminance(look(lights().scene(grazing))), 0) << "the room's other walls, " << slope;
        const double lit = mean_luminance(look(lights().scene(grazing, {}, 1, floor), 16));
        const double expected = upright * std::max(0.0, slope) / std::hypot(1, 3, slope);
        if (GetParam().name != "map") {
            EXPECT_NEAR(lit, expected, 0.02 * expected) << slope;
        } else {  // about forty photons at the first slope, none or one at the others
            EXPECT_LE(lit, std::max(slope, 1e-6)) << slope;
            if (slope == 1e-2) {
                EXPECT_NEAR(lit, expected, 4 * expected / std::sqrt(40)) << slope;
            }
        }
    }
}

TEST_P(Degenerate, OnePixel_IsAnImage) {
    std::string text = lights().scene(light_named("point"));
    text.replace(text.find("xresolution\" 12"), 15, "xresolution\" 1");
    text.replace(text.find("yresolution\" 12"), 15, "yresolution\" 1");
    const Image image = look(text, 64);
    EXPECT_EQ(image.width, 1);
    EXPECT_EQ(image.height, 1);
    EXPECT_GT(mean_luminance(image), 0);
}

// The reader (engine/pbrt/tokens.h) gives a warning, or an error under `strict`; it never substitutes a
// number silently.
TEST_P(Degenerate, NotANumberInTheFile_IsReportedByNameAndPlace) {
    for (const std::string_view bad : {"nan", "inf", "1e400"}) {
        std::string text = lights().scene(light_named("point"));
        const std::size_t at = text.find("\"rgb I\" [1 ");
        text.replace(at + 9, 1, bad);
        const auto names_it = ::testing::AllOf(HasSubstr("scene.pbrt"), HasSubstr(std::string(bad)));
        ListeningMonitor lenient;
        try {
            lights().job(text, GetParam(), 1, lenient);
            EXPECT_EQ(bad, "nan") << "a light of infinite power was read";
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("the light's power is inf W")) << bad;
        }
        EXPECT_THAT(lenient.warnings, ::testing::Contains(names_it));
        Monitor silent;
        try {
            lights().job(text, GetParam(), 1, silent, true);
            ADD_FAILURE() << bad << " was read";
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), names_it);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Methods, Degenerate, ::testing::ValuesIn(every_method()), name_of);

// --- Few photons, and many at one place ---

struct FewPhotons {
    std::vector<std::pair<std::string, std::string>> set;
    const char* name;
};

TEST(PhotonExtremes, OneOfThem_OneNeighbour_OrAll_GiveFiniteImages) {
    const std::vector<FewPhotons> all = {{{{"photons", "1"}}, "one light path"},
                                         {{{"k", "1"}, {"gatherk", "1"}}, "one neighbour"},
                                         {{{"k", "1000000"}, {"gatherk", "1000000"}}, "everything"},
                                         {{{"k", "0"}, {"radius", "1e-9"}}, "a radius of nothing"},
                                         {{{"k", "0"}, {"radius", "1e9"}}, "a radius of the world"}};
    for (const FewPhotons& few : all) {
        const std::string_view what = few.name;
        const bool has_bounces = what == "one neighbour" || what == "everything";
        for (const char* indirect : {"map", "gather"}) {
            Method method{few.name, "photonmap", {{"photons", "3000"}, {"indirect", indirect}}};
            if (std::string_view(indirect) == "gather") method.set.emplace_back("gatherrays", "2");
            method.set.insert(method.set.end(), few.set.begin(), few.set.end());
            for (const char* name : {"point", "area of triangles", "measured light field"}) {
                const Image image = lights().image(lights().scene(light_named(name)), method, kSpp);
                EXPECT_TRUE(is_finite(image)) << few.name << " " << indirect << " " << name;
                // Direct light is always present. Photons add to it where the lookup disc has a significant
                // size; this is tested with the point light, whose direct part has no noise.
                const double direct = mean_luminance(
                    lights().image(lights().scene(light_named(name)), {"direct", "direct", {}}, 64));
                const bool all_of_it = has_bounces && std::string_view(name) == "point";
                EXPECT_GT(mean_luminance(image), (all_of_it ? 1.5 : 0.8) * direct)
                    << few.name << " " << indirect << " " << name;
            }
        }
    }
}

// A beam as thin as float32 allows: all photons and VPLs of the first hit are at one place.
LightCase beam(std::string_view to) {
    return {"beam",
            fmt::format("LightSource \"spot\" \"point3 from\" [0 0.9 0] \"point3 to\" [{}] \"rgb I\" [1 1 1] "
                        "\"float coneangle\" 1e-3 \"float conedelta\" 1e-4 \"float scale\" {{}}",
                        to),
            true, false};
}

TEST(PhotonExtremes, AllInOnePlace_GiveAFiniteImage) {
    for (const Method& method : every_method()) {
        const Image image = lights().image(lights().scene(beam("0.1 -1 0.2")), method, kSpp);
        EXPECT_TRUE(is_finite(image)) << method.name;
        // Paths from the eye do not find so small a place; light paths do, and the place illuminates the
        // room.
        if (method.integrator != "path" && method.integrator != "direct") {
            EXPECT_GT(mean_luminance(image), 3e-13) << method.name << ", of 1e-9 W";
        }
    }
}

// The camera is so close to the VPLs that the points which it sees coincide with them: the distances are
// zero, and only the program bounds the VPLs' contributions.
TEST(VplExtremes, AtNoDistance_GiveAFiniteImage) {
    std::string text = lights().scene(beam("0 -1 0"));
    const std::size_t at = text.find("LookAt"), end = text.find('\n', at);
    text.replace(at, end - at, "LookAt 0 -0.99999 0.00001  0 -1 0  0 1 0");
    for (const char* mindist : {"0", "1e-30"}) {
        const Method method{
            "igi",
            "igi",
            {{"nlights", "64"}, {"nsets", "4"}, {"causticpaths", "20000"}, {"mindist", mindist}}};
        const Image image = lights().image(text, method, 16);
        EXPECT_TRUE(is_finite(image)) << mindist;
        EXPECT_GT(mean_luminance(image), 0.01) << mindist;
        Method compensated = method;
        compensated.set.emplace_back("gathersamples", "1");
        const Image whole = lights().image(text, compensated, 16);
        EXPECT_TRUE(is_finite(whole)) << mindist;
        EXPECT_GT(mean_luminance(whole), 0.01) << mindist;
    }
}

}  // namespace degenerate_test
}  // namespace lucerna
