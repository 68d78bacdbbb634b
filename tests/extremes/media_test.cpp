// Participating media in rooms: the size and place of the room and the power of the light change the image
// only as they should, and media of zero or enormous density, without absorption, and with cameras and lights
// inside them give finite images [docs/development/extremes.md].
#include <gtest/gtest.h>

#include "tests/support/every_light.h"
#include "tests/support/same_image.h"

namespace lucerna {
namespace media_test {

using namespace testing;

constexpr int kSpp = 4;

// Coefficients are per world unit: in a room `scale` times as large they are smaller by that factor.
struct Fog {
    double sigma_a = 0.3, sigma_s = 0.9;  // per unit of the room
    double g = 0.4;
    bool grid = false;
    double glow = 0;  // radiance that the medium emits per unit of absorption; only `path` renders it
};

std::string numbers(double x, double scale) {
    return fmt::format("{0:.9g} {1:.9g} {2:.9g}", x / scale, 0.75 * x / scale, 0.5 * x / scale);
}

// Returns the room with a ball of the medium.
std::string foggy_room(const Fog& fog, double scale = 1, double power = 1) {
    std::string text(kRoom);
    text += fmt::format(
        "\nMakeNamedMedium \"fog\" \"string type\" \"{}\" \"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}] "
        "\"float g\" {:.9g}",
        fog.grid ? "uniformgrid" : "homogeneous", numbers(fog.sigma_a, scale), numbers(fog.sigma_s, scale),
        fog.g);
    if (fog.grid) {
        text +=
            " \"point3 p0\" [-0.8 -0.5 -0.5] \"point3 p1\" [0.2 0.5 0.5]"
            " \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2"
            " \"float density\" [0.2 1 0.5 2 0 1 1.5 0.7]";
    }
    if (fog.glow > 0) text += fmt::format(" \"rgb Le\" [1 1 1] \"float Lescale\" {:.9g}", fog.glow * power);
    return text +
           "\nAttributeBegin MediumInterface \"fog\" \"\" Material \"interface\" Translate -0.3 0 0 "
           "Shape \"sphere\" \"float radius\" 0.5 AttributeEnd\n";
}

class MediaExtremes : public ::testing::TestWithParam<Method> {
  protected:
    // Returns one light of each kind of emission: from a point, from a surface, and by a measured field.
    static std::vector<LightCase> some_lights() {
        std::vector<LightCase> some;
        for (LightCase& light : lights().cases()) {
            if (light.name == "point" || light.name == "area of a sphere" ||
                light.name == "measured light field")
                some.push_back(std::move(light));
        }
        return some;
    }
    static Image image(const LightCase& light, const Fog& fog, const Placing& at = {}, double power = 1) {
        return lights().image(lights().scene(light, at, power, foggy_room(fog, at.scale, power)), GetParam(),
                              kSpp);
    }
    static std::vector<Fog> fogs() {
        Fog even, grid, glowing;
        grid.grid = true;
        glowing.glow = 0.5;
        return {even, grid, glowing};
    }
    static std::string name(const LightCase& light, const Fog& fog) {
        return light.name + (fog.grid ? ", grid" : fog.glow > 0 ? ", glowing" : ", even");
    }
};

TEST_P(MediaExtremes, APowerOfTwo_SameImageToTheBit) {
    for (const LightCase& light : some_lights()) {
        for (const Fog& fog : fogs()) {
            const Image one = image(light, fog);
            for (const int exponent : {-20, 20}) {
                const Image scaled = image(light, fog, {std::ldexp(1.0, exponent), V3d(0.0)});
                EXPECT_TRUE(same(one, scaled))
                    << name(light, fog) << " 2^" << exponent << ": " << difference(one, scaled).pixels;
            }
        }
    }
}

TEST_P(MediaExtremes, AMillionthAMillionAndFarAway_SameImageToRounding) {
    for (const LightCase& light : some_lights()) {
        for (const Fog& fog : fogs()) {
            const Image one = image(light, fog);
            for (const double scale : {1e-6, 1e6}) {
                for (const double shift : {0.0, 1e5}) {
                    const Placing placed{scale, shift * scale * V3d(1, -2, 0.7)};
                    const Difference d = difference(one, image(light, fog, placed));
                    EXPECT_LT(d.pixels, 0.04) << name(light, fog) << " " << scale << " " << shift;
                    EXPECT_LT(std::fabs(d.mean), 0.01) << name(light, fog) << " " << scale << " " << shift;
                }
            }
        }
    }
}

TEST_P(MediaExtremes, FromTiniestToHugestPower_ImageIsInProportion) {
    for (const LightCase& light : some_lights()) {
        for (const Fog& fog : fogs()) {
            const Image one = image(light, fog);
            for (const double power : {1e-20, 1e20}) {
                const Image other = image(light, fog, {}, power);
                EXPECT_TRUE(is_finite(other)) << name(light, fog) << " " << power;
                const Difference d = difference(one, other, 1 / power);
                EXPECT_LT(d.pixels, 0.04) << name(light, fog) << " " << power;
                EXPECT_LT(std::fabs(d.mean), 0.01) << name(light, fog) << " " << power;
            }
        }
    }
}

// The tests above would fail here: in a room of twice the size, unchanged coefficients are twice the fog.
TEST_P(MediaExtremes, CoefficientsThatDoNotScale_AreAnotherImage) {
    const LightCase light = some_lights().front();
    const Fog fog;
    const Image one = image(light, fog);
    const Image twice =
        lights().image(lights().scene(light, {2, V3d(0.0)}, 1, foggy_room(fog, 1)), GetParam(), kSpp);
    EXPECT_GT(difference(one, twice).pixels, 0.1);
}

TEST_P(MediaExtremes, NoDensity_AsIfItWereNotThere) {
    const LightCase light = some_lights().front();
    const Image without = lights().image(lights().scene(light), GetParam(), 64);
    const Fog nothing{0, 0, 0, false, 0};
    const Image with = lights().image(lights().scene(light, {}, 1, foggy_room(nothing)), GetParam(), 64);
    EXPECT_TRUE(is_finite(with));
    EXPECT_NEAR(difference(without, with).mean, 0, 0.05);
}

TEST_P(MediaExtremes, EnormousOrLosslessMedia_GiveFiniteImages) {
    for (const Fog& fog : {Fog{1e12, 0, 0, false, 0}, Fog{0, 1e4, 0.9, false, 0}, Fog{0, 5, -0.9, true, 0},
                           Fog{1e-12, 1e-12, 0.999, false, 0}}) {
        for (const LightCase& light : some_lights())
            EXPECT_TRUE(is_finite(image(light, fog))) << name(light, fog) << " " << fog.sigma_s;
    }
}

TEST_P(MediaExtremes, CameraAndLightInFog_GiveALitFiniteImage) {
    const std::string inside =
        "MakeNamedMedium \"air\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.01 0.01 0.01] "
        "\"rgb sigma_s\" [0.05 0.05 0.05]\nMediumInterface \"\" \"air\"\n";
    for (const LightCase& light : some_lights()) {
        const std::string text = lights().scene(light);
        const Image image = lights().image(inside + text, GetParam(), kSpp);
        EXPECT_TRUE(is_finite(image)) << light.name;
        EXPECT_GT(mean_luminance(image), 0) << light.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Methods, MediaExtremes, ::testing::ValuesIn(every_method()), name_of);

}  // namespace media_test
}  // namespace lucerna
