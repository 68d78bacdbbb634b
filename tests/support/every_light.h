// Describes one small room as scene text, at any size and place, lit by any light and rendered by any method,
// for tests that must hold for all of them.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/warp.h"
#include "engine/image/image.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/temporary_folder.h"

namespace lucerna::testing {

// The room's place in world units: a room of some 2 × 2 × 2 units, times `scale`, about `shift`.
struct Placing {
    double scale = 1;
    V3d shift{0, 0, 0};
};

struct Method {
    std::string name, integrator;
    std::vector<std::pair<std::string, std::string>> set;

    friend void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }
};
inline std::vector<Method> every_method() {
    return {{"path", "path", {}},
            {"direct", "direct", {}},
            {"gather", "photonmap", {{"photons", "20000"}, {"gatherrays", "4"}}},
            {"guided", "photonmap", {{"photons", "20000"}, {"gatherrays", "4"}, {"direct", "guided"}}},
            {"map", "photonmap", {{"photons", "20000"}, {"direct", "map"}, {"indirect", "map"}}},
            {"igi", "igi", {{"nlights", "64"}, {"nsets", "4"}, {"causticpaths", "20000"}}},
            {"progressive", "progressive", {{"photons", "5000"}}}};
}

inline std::string name_of(const ::testing::TestParamInfo<Method>& method) {
    std::string name = method.param.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

struct LightCase {
    std::string name;
    std::string text;          // in the room's own units; {} stands for the factor of its power
    bool by_intensity = true;  // the factor grows with the square of the scale to preserve radiance
    bool only_particles = false;

    // Tells whether the method can render the light.
    bool suits(const Method& method) const { return !only_particles || method.name == "map"; }
};

// The differences between two images.
struct Difference {
    double pixels = 0;  // share of pixels that differ by more than a thousandth
    double mean = 0;    // relative difference of the means
};
// Multiplies the second image by `scale` before the comparison. Expects that the first image is not black,
// since two black images show nothing.
inline Difference difference(const Image& a, const Image& b, double scale = 1) {
    Difference d;
    double sum = 0, other = 0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const double l = double{luminance(a.rgb_at(x, y))}, m = scale * double{luminance(b.rgb_at(x, y))};
            if (!(std::fabs(l - m) <= 1e-3 * l)) ++d.pixels;
            sum += l;
            other += m;
        }
    }
    d.pixels /= a.width * a.height;
    EXPECT_GT(sum, 0);
    d.mean = other / sum - 1;
    return d;
}
inline double mean_luminance(const Image& image) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) sum += double{luminance(image.rgb_at(x, y))};
    }
    return sum / (image.width * image.height);
}
inline bool is_finite(const Image& image) {
    return std::all_of(image.data.begin(), image.data.end(),
                       [](float v) { return std::isfinite(v) && v >= 0; });
}

// The room is open at the front; in it are a diffuse sphere and one of glass.
inline constexpr std::string_view kRoom = R"(
Material "diffuse" "rgb reflectance" [0.6 0.5 0.4]
Shape "trianglemesh" "point3 P" [-1 -1 -1  1 -1 -1  1 -1 1  -1 -1 1] "integer indices" [0 2 1 0 3 2]
Shape "trianglemesh" "point3 P" [-1 1 -1  1 1 -1  1 1 1  -1 1 1] "integer indices" [0 1 2 0 2 3]
Shape "trianglemesh" "point3 P" [-1 -1 1  1 -1 1  1 1 1  -1 1 1] "integer indices" [0 2 1 0 3 2]
Shape "trianglemesh" "point3 P" [-1 -1 -1  -1 1 -1  -1 1 1  -1 -1 1] "integer indices" [0 1 2 0 2 3]
AttributeBegin Translate -0.4 -0.6 0.3 Shape "sphere" "float radius" 0.35 AttributeEnd
AttributeBegin Material "dielectric" Translate 0.45 -0.65 -0.2 Shape "sphere" "float radius" 0.3 AttributeEnd
)";

// Holds one light of each kind, with their files in a temporary folder.
class EveryLight {
  public:
    EveryLight() {
        write_light_field(folder_ / "field.exr", lambertian_disc(rig_b(), 0.008));
        write_ies();
        write_image();
        write_ray_file();
    }

    const TemporaryFolder& folder() const { return folder_; }

    std::vector<LightCase> cases() const {
        return {
            {"point",
             R"(LightSource "point" "point3 from" [0.5 0.8 -0.4] "rgb I" [1 0.9 0.8] "float scale" {})"},
            {"spot",
             R"(LightSource "spot" "point3 from" [0.5 0.9 -0.4] "point3 to" [0 -1 0.2] "rgb I" [2 2 1] "float coneangle" 40 "float scale" {})"},
            {"distant",
             R"(LightSource "distant" "point3 from" [0.3 1 -1] "point3 to" [0 0 0] "rgb L" [1 1 1] "float scale" {})",
             false},
            {"sky", R"(LightSource "infinite" "rgb L" [0.5 0.6 0.8] "float scale" {})", false},
            {"sky and sun",
             R"(LightSource "sky" "string type" "cie-12" "vector3 up" [0 1 0] "vector3 sun" [0.3 1 -1] "float illuminance" 1 "float sunilluminance" 2 "float scale" {})",
             false},
            {"sky of an image", R"(LightSource "infinite" "string filename" "image.exr" "float scale" {})",
             false},
            {"goniometric",
             R"(AttributeBegin Translate 0.4 0.6 -0.3 LightSource "goniometric" "string filename" "image.exr" "rgb I" [1 1 1] "float scale" {} AttributeEnd)"},
            {"projection",
             R"(AttributeBegin Translate 0 0 -0.9 LightSource "projection" "string filename" "image.exr" "float fov" 70 "float scale" {} AttributeEnd)"},
            {"ies",
             R"(AttributeBegin Translate 0.3 0.7 -0.2 Rotate 90 1 0 0 LightSource "ies" "string filename" "lamp.ies" "float scale" {} AttributeEnd)"},
            {"area of triangles",
             R"(AttributeBegin AreaLightSource "diffuse" "rgb L" [3 3 2] "float scale" {} Shape "trianglemesh" "point3 P" [-0.3 0.97 -0.3  0.3 0.97 -0.3  0.3 0.97 0.3  -0.3 0.97 0.3] "integer indices" [0 1 2 0 2 3] AttributeEnd)",
             false},
            {"area of a sphere",
             R"(AttributeBegin AreaLightSource "diffuse" "rgb L" [9 8 7] "float scale" {} Translate 0.5 0.5 -0.3 Shape "sphere" "float radius" 0.1 AttributeEnd)",
             false},
            {"measured light field",
             R"(AttributeBegin Translate 0 0.2 -0.9 Scale 5 5 5 LightSource "lightfield" "string filename" "field.exr" "float scale" {} AttributeEnd)"},
            {"file of rays",
             R"(AttributeBegin Translate 0 0.2 -0.9 LightSource "rayfile" "string filename" "lamp.ray" "float scale" {} AttributeEnd)",
             true, true},
        };
    }

    // Returns the scene's text. `power` multiplies the light; `room` describes the geometry.
    std::string scene(const LightCase& light, const Placing& at = {}, double power = 1,
                      std::string_view room = kRoom) const {
        const double s = at.scale;
        const auto place = [&](double x, double y, double z) {
            return fmt::format("{:.17g} {:.17g} {:.17g}", at.shift.x + s * x, at.shift.y + s * y,
                               at.shift.z + s * z);
        };
        const double strength = power * (light.by_intensity ? s * s : 1);
        return fmt::format("LookAt {}  {}  0 1 0\n", place(0.1, 0.1, -2.6), place(0, -0.1, 0)) +
               "Camera \"perspective\" \"float fov\" 45\n"
               "Film \"rgb\" \"integer xresolution\" 12 \"integer yresolution\" 12\nWorldBegin\n" +
               fmt::format("Translate {:.17g} {:.17g} {:.17g} Scale {:.17g} {:.17g} {:.17g}\n", at.shift.x,
                           at.shift.y, at.shift.z, s, s, s) +
               fmt::format(fmt::runtime(light.text), fmt::format("{:.9g}", strength)) + "\n" +
               std::string(room);
    }

    Job job(const std::string& text, const Method& method, int spp, Monitor& monitor,
            bool strict = false) const {
        SceneOverrides overrides;
        overrides.strict = strict;
        overrides.integrator = method.integrator;
        overrides.set = method.set;
        overrides.spp = spp;
        return read_scene_text(text, folder_ / "scene.pbrt", overrides, Workers{2}, monitor);
    }
    Image image(const std::string& text, const Method& method, int spp, std::uint64_t seed = 1) const {
        ListeningMonitor monitor;
        return render(job(text, method, spp, monitor), {seed, Workers{2}}, monitor).image;
    }

  private:
    void write_ies() const {
        std::ofstream(folder_ / "lamp.ies")
            << "IESNA:LM-63-2002\nTILT=NONE\n1 10 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n1 0.8 0.1\n";
    }
    void write_image() const {
        Image image = Image::rgb(8, 8);
        for (int y = 0; y < 8; ++y) {
            for (int x = 0; x < 8; ++x)
                image.set_rgb(x, y,
                              Rgb(0.2F + 0.1F * static_cast<float>(x), 0.5F, 0.1F * static_cast<float>(y)));
        }
        write_exr(folder_ / "image.exr", image);
    }
    void write_ray_file() const {
        RaySet set;
        Sampler sampler(1, Purpose::test, 0, 0);
        for (int i = 0; i < 1000; ++i) {
            const V2f p = 0.01F * square_to_disc(sampler.next2());
            set.rays.push_back({{p.x, p.y, 0}, square_to_cosine_hemisphere(sampler.next2()), 0.01F});
        }
        set.flux = 10;
        write_rays(folder_ / "lamp.ray", set);
    }

    TemporaryFolder folder_;
};

// Returns the lights, made once for all tests of a program.
inline const EveryLight& lights() {
    static const EveryLight all;
    return all;
}

}  // namespace lucerna::testing
