// Lights on surfaces under mirroring transformations must light the mirror image of what they light without
// it, for every shape, every way of mirroring and every sampling strategy.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace mirrored_lights_test {

using namespace lucerna::testing;

constexpr const char* kShapes[] = {
    "Shape \"sphere\" \"float radius\" 1.5",
    "Shape \"sphere\" \"float radius\" 1.5 \"float zmin\" -0.5 \"float phimax\" 200",
    "Shape \"disk\" \"float radius\" 1.5",
    "Shape \"disk\" \"float radius\" 1.5 \"float innerradius\" 0.5 \"float phimax\" 250 \"float height\" 0.4",
    "Shape \"cylinder\" \"float radius\" 1.2 \"float phimax\" 200",
    "Shape \"cone\" \"float radius\" 1.5 \"float height\" 1",
    "Shape \"paraboloid\" \"float radius\" 1.5 \"float zmax\" 1.2",
    "Shape \"hyperboloid\" \"point3 p1\" [1 0 -1] \"point3 p2\" [1.5 0.5 1]",
    "Shape \"trianglemesh\" \"point3 P\" [0 0 0 2 0 0.3 0 2 0.5]",
    "Shape \"trianglemesh\" \"point3 P\" [0 0 0 2 0 0.3 0 2 0.5] \"normal3 N\" [0 0 -1 0 0 -1 0 0 -1]",
    "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0 1 -1 0.5 -1 1 0.3 1 1 -0.4]",
    "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0 1 -1 0 -1 1 0 1 1 0] \"normal3 N\" [0 0 -1 0 0 -1 0 0 -1 0 "
    "0 -1]",
    "Shape \"loopsubdiv\" \"integer levels\" 2 \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-1 -1 0 1 -1 "
    "0 1 1 0.5 "
    "-1 1 0]",
    "Shape \"curve\" \"string type\" \"cylinder\" \"point3 P\" [-1 0 0 -0.3 0.5 0 0.4 -0.5 0.3 1 0 0] "
    "\"float width\" "
    "0.8",
    "Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 0.3 0.2 0.1]",
};

struct Mirror {
    const char* text;
    V3d axes;
};
constexpr Mirror kNone{"", {1, 1, 1}};
const Mirror kMirrors[] = {{"Scale -1 1 1 ", {-1, 1, 1}},
                           {"Scale 1 -1 1 ", {1, -1, 1}},
                           {"Scale 1 1 -1 ", {1, 1, -1}},
                           {"Scale -1 -1 -1 ", {-1, -1, -1}},
                           {"Transform [-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1] ", {-1, 1, 1}},
                           {"ConcatTransform [1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1] ", {1, 1, -1}}};

Scene scene_of(const Mirror& mirror, const char* turn, const char* shape) {
    const std::string text =
        std::string(mirror.text) + turn +
        "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] Translate 0.2 0.1 -0.3 Rotate 35 1 2 3 ";
    return Scene(parts_of_world(text + shape), {1});
}

// The irradiance at a point that sees the shape from one side, by next-event estimation and by rays that hit
// the light.
struct Irradiance {
    RunningStats asked, met;
};

Irradiance irradiance(const Scene& scene, const Mirror& mirror, const V3d& at, const V3d& facing) {
    const auto moved = [&mirror](const V3d& v) { return V3d(v * mirror.axes); };
    const V3f x(moved(at) - scene.origin()), n(moved(facing));
    Irradiance result;
    constexpr int kRays = 2000;
    for (int i = 0; i < kRays; ++i) {
        Sampler sampler(3, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const auto from_light = scene.lights()[0]->sample_Li(x, sampler.next2(), {});
        const bool seen =
            from_light && !scene.intersect(Ray{x, from_light->w, from_light->distance}).has_value();
        result.asked.add(
            seen ? static_cast<double>(luminance(from_light->weight) * std::max(0.0F, n.dot(from_light->w)))
                 : 0.0);
        // Traces the same ray in each world, mirrored with it.
        const V3f w(moved(V3d(Frame(V3f(facing)).to_world(square_to_cosine_hemisphere(sampler.next2())))));
        const Ray ray{x, w.normalized()};
        double radiance = 0;
        if (const auto hit = scene.intersect(ray)) {
            const auto light = scene.lights()[static_cast<std::size_t>(hit->light)]->Le_on_surface(
                ray, hit->t, hit->at.n, hit->primitive);
            radiance = static_cast<double>(luminance(light.radiance));
        }
        result.met.add(M_PI * radiance);
    }
    return result;
}

TEST(MirroredLights, EveryShape_LightsTheMirrorImage) {
    const std::pair<V3d, V3d> receivers[] = {{{0.3, -0.2, -4}, {0, 0, 1}}, {{0.1, 0.4, 4}, {0, 0, -1}}};
    for (const char* shape : kShapes) {
        for (const char* turn : {"", "ReverseOrientation "}) {
            SCOPED_TRACE(std::string(turn) + shape);
            const Scene plain = scene_of(kNone, turn, shape);
            double lit = 0;
            std::vector<Irradiance> expected;
            for (const auto& [at, facing] : receivers) {
                expected.push_back(irradiance(plain, kNone, at, facing));
                const Irradiance& both = expected.back();
                lit += both.met.mean();
                EXPECT_NEAR(both.asked.mean(), both.met.mean(),
                            5 * std::hypot(both.asked.standard_error(), both.met.standard_error()));
            }
            if (*turn == '\0') {  // a closed shape with reversed orientation emits inward
                EXPECT_GT(lit, 0.02);
            }
            for (const Mirror& mirror : kMirrors) {
                SCOPED_TRACE(mirror.text);
                const Scene mirrored = scene_of(mirror, turn, shape);
                EXPECT_NEAR(mirrored.lights()[0]->power(), plain.lights()[0]->power(),
                            1e-4 * plain.lights()[0]->power());
                for (std::size_t i = 0; i < expected.size(); ++i) {
                    const Irradiance found =
                        irradiance(mirrored, mirror, receivers[i].first, receivers[i].second);
                    EXPECT_NEAR(found.met.mean(), expected[i].met.mean(), 0.01 * lit);
                    EXPECT_NEAR(
                        found.asked.mean(), expected[i].asked.mean(),
                        5 * std::hypot(found.asked.standard_error(), expected[i].asked.standard_error()) +
                            1e-6);
                }
            }
        }
    }
}

// Mirroring also preserves the outside of glass and media.
TEST(MirroredShapes, Outside_StaysOutside) {
    for (const Mirror& mirror : kMirrors) {
        for (const char* shape :
             {"Shape \"sphere\"", "Shape \"cylinder\"", "Shape \"cone\"",
              "Shape \"curve\" \"string type\" \"cylinder\" \"point3 P\" [0 -1 0 0 -0.3 0 0 "
              "0.3 0 0 1 0] \"float width\" 1"}) {
            const Scene scene(parts_of_world(std::string(mirror.text) + shape), {1});
            const V3f from(V3d(4, 0.1, 0.2) * mirror.axes - scene.origin());
            const auto hit = scene.intersect(Ray{from, V3f(V3d(-1, 0, 0) * mirror.axes)});
            ASSERT_TRUE(hit) << mirror.text << shape;
            EXPECT_GT(hit->at.n.x * static_cast<float>(mirror.axes.x), 0.1F) << mirror.text << shape;
        }
    }
    // An instance mirrors its object.
    const Scene scene(
        parts_of_world("ObjectBegin \"ball\" Shape \"sphere\" ObjectEnd Scale -1 1 1 Translate 3 0 0 "
                       "ObjectInstance \"ball\""),
        {1});
    const auto hit = scene.intersect(Ray{V3f(V3d(-9, 0.1, 0.2) - scene.origin()), {1, 0, 0}});
    ASSERT_TRUE(hit);
    EXPECT_LT(hit->at.n.x, -0.9F);
}

}  // namespace mirrored_lights_test
}  // namespace lucerna
