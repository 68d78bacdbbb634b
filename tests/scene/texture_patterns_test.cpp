// Patterns against closed forms, mappings, noise; and images in memory and in the tile cache.
#include "engine/scene/texture_patterns.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "engine/scene/texture_image.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace texture_patterns_test {

TexturePoint random_point(Sampler& s) {
    const auto wide = [&s] { return 200 * static_cast<double>(s.next()) - 100; };
    return {V2f(8 * s.next() - 4, 8 * s.next() - 4), V3d(wide(), wide(), wide()),
            V3f(s.next() - 0.5F, s.next() - 0.5F, s.next() - 0.5F).normalized()};
}

std::vector<FloatTexture> number_textures() {
    const Mapping3 space;
    const auto waves = fbm_texture({}, space);
    return {waves,
            wrinkled_texture({0.7, 5}, space),
            windy_texture(space),
            product_texture(waves, windy_texture(space)),
            mix_texture(waves, FloatTexture::constant(2), wrinkled_texture({}, space)),
            checkerboard_texture(waves, FloatTexture::constant(-1), space),
            dots_texture(waves, FloatTexture::constant(3), Mapping2()),
            direction_mix_texture(waves, FloatTexture::constant(3), V3d(0, 0, 1)),
            bilerp_texture<float>({-1, 0, 2, 1}, Mapping2()),
            luminance_texture(marble_texture({}, space)),
            clamped_texture(waves, -0.1F, 0.2F)};
}

TEST(Texture, Values_StayWithinTheStatedRange) {
    int number = 0;
    for (const FloatTexture& texture : number_textures()) {
        Sampler s(1, Purpose::test, 0, 0);
        float least = INFINITY, most = -INFINITY;
        for (int i = 0; i < 20000; ++i) {
            const float value = texture.at(random_point(s));
            least = std::min(least, value), most = std::max(most, value);
        }
        EXPECT_GE(least, texture.least()) << number;
        EXPECT_LE(most, texture.largest()) << number;
        EXPECT_LT(least, most) << number << " varies";
        EXPECT_FALSE(texture.constant_value()) << number;
        ++number;
    }
}

TEST(Texture, OfConstants_IsAConstant) {
    const auto a = RgbTexture::constant(Rgb(0.5F, 1, 0)), b = RgbTexture::constant(Rgb(0.5F, 0.5F, 1));
    EXPECT_EQ(product_texture(a, b).constant_value(), Rgb(0.25F, 0.5F, 0));
    EXPECT_EQ(mix_texture(a, b, FloatTexture::constant(0.5F)).constant_value(), Rgb(0.5F, 0.75F, 0.5F));
    EXPECT_EQ(grey_texture(FloatTexture::constant(-1)).constant_value(), Rgb(0.0F));
    EXPECT_EQ(clamped_texture(a, 0.2F, 0.6F).constant_value(), Rgb(0.5F, 0.6F, 0.2F));
}

TEST(Texture, Marble_IsWithinItsColoursAndGreyIsNotNegative) {
    const auto marble = marble_texture({{}, 3, 0.5}, Mapping3());
    const auto grey = grey_texture(fbm_texture({}, Mapping3()));
    Sampler s(2, Purpose::test, 0, 0);
    for (int i = 0; i < 20000; ++i) {
        const TexturePoint point = random_point(s);
        const ValueRange range = range_of(marble.at(point));
        ASSERT_GE(range.least, 0.3F - 1e-5F);
        ASSERT_LE(range.most, 0.9F + 1e-5F);
        ASSERT_GE(grey.at(point).x, 0);
    }
}

TEST(Noise, AtLatticePoints_IsZeroAndIsReproducible) {
    for (int i = -300; i < 300; i += 7) EXPECT_EQ(perlin_noise(V3d(i, 2 * i, 5 - i)), 0);
    EXPECT_NEAR(perlin_noise({0.5, 0.5, 0.5}), perlin_noise({0.5 + 256, 0.5 - 256, 0.5}), 1e-12)
        << "its period";
    EXPECT_EQ(perlin_noise({NAN, 0, 0}), 0);
    EXPECT_EQ(perlin_noise({INFINITY, 0, 0}), 0);
    EXPECT_EQ(perlin_noise({1e300, 0, 0}), 0);
}

TEST(Noise, Everywhere_IsContinuousWithItsSlope) {
    Sampler s(3, Purpose::test, 0, 0);
    double largest = 0;
    for (int i = 0; i < 200000; ++i) {
        V3d p(40 * static_cast<double>(s.next()) - 20, 40 * static_cast<double>(s.next()) - 20,
              40 * static_cast<double>(s.next()) - 20);
        if (i % 2 == 0) p.x = std::round(p.x);  // on the faces between cells
        const V3d step(1e-6, -1e-6, 1e-6);
        const double here = perlin_noise(p);
        ASSERT_LT(std::fabs(perlin_noise(p + step) - here), 1e-5) << p;
        ASSERT_LT(std::fabs(perlin_noise(p + step) - 2 * here + perlin_noise(p - step)), 1e-9) << p;
        largest = std::max(largest, std::fabs(here));
    }
    EXPECT_LE(largest, kNoiseBound);
    EXPECT_GT(largest, 0.8);
}

// Sums the octaves one by one.
double octave_by_octave(const V3d& p, const Octaves& octaves, bool absolute) {
    double sum = 0, frequency = 1, amplitude = 1;
    for (int i = 0; i < octaves.count; ++i) {
        const double noise = perlin_noise(frequency * p);
        sum += amplitude * (absolute ? std::fabs(noise) : noise);
        frequency *= 1.99;
        amplitude *= octaves.omega;
    }
    return sum;
}

TEST(Noise, OctavesTogether_AreTheBitsOfOctavesOneByOne) {
    Sampler s(4, Purpose::test, 0, 0);
    for (int i = 0; i < 20000; ++i) {
        // Points near and far, beyond the range of the vectorised code, and on faces between cells.
        const double size = std::pow(10.0, static_cast<double>(s.next()) * 24 - 4);
        V3d p(size * (2 * static_cast<double>(s.next()) - 1), size * (2 * static_cast<double>(s.next()) - 1),
              size * (2 * static_cast<double>(s.next()) - 1));
        if (i % 4 == 0) p.y = std::round(p.y);
        const Octaves octaves{0.3 + 0.6 * static_cast<double>(s.next()), i % 21};
        ASSERT_EQ(fractal_noise(p, octaves), octave_by_octave(p, octaves, false)) << p << octaves.count;
        ASSERT_EQ(turbulence(p, octaves), octave_by_octave(p, octaves, true)) << p << octaves.count;
    }
    for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY), 1e300}) {
        const Octaves six{0.5, 6};
        EXPECT_EQ(fractal_noise({bad, 0.5, 0.5}, six), octave_by_octave({bad, 0.5, 0.5}, six, false));
        EXPECT_EQ(turbulence({0.5, 0.5, -bad}, six), octave_by_octave({0.5, 0.5, -bad}, six, true));
    }
}

TEST(Noise, PlacesTogether_AreTheBitsOfPlacesOneByOne) {
    Sampler s(5, Purpose::test, 0, 0);
    for (int i = 0; i < 5000; ++i) {
        const double size = std::pow(10.0, static_cast<double>(s.next()) * 24 - 4);
        std::array<V3d, 4> at;
        for (V3d& p : at) {
            for (int c = 0; c < 3; ++c) p[c] = size * (2 * static_cast<double>(s.next()) - 1);
        }
        if (i % 16 == 0) at[1].y = static_cast<double>(NAN);
        const Octaves octaves{0.3 + 0.6 * static_cast<double>(s.next()), i % 10};
        const std::size_t count = 1 + static_cast<std::size_t>(i) % at.size();
        const std::span<const V3d> places = std::span(at).first(count);
        std::array<double, 4> plain{}, absolute{};
        fractal_noise(places, octaves, std::span(plain).first(count));
        turbulence(places, octaves, std::span(absolute).first(count));
        for (std::size_t k = 0; k < count; ++k) {
            ASSERT_EQ(plain[k], octave_by_octave(at[k], octaves, false)) << at[k] << octaves.count;
            ASSERT_EQ(absolute[k], octave_by_octave(at[k], octaves, true)) << at[k] << octaves.count;
        }
    }
}

TEST(Textures, AskedAtManyPoints_AnswerAsAtEach) {
    const FloatTexture noise =
        scaled_texture(fbm_texture({0.6, 5}, Mapping3()), wrinkled_texture({0.4, 3}, Mapping3()));
    const auto checks = FloatTexture::checkerboard(1, 2, V2f(3, 3));
    for (const FloatTexture& texture : {noise, checks, FloatTexture::constant(0.25F)}) {
        Sampler s(5, Purpose::test, 0, 0);
        std::vector<TexturePoint> points;
        for (int i = 0; i < 21; ++i) points.push_back(random_point(s));
        std::vector<float> values(points.size());
        texture.at_each(points, values);
        for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(values[i], texture.at(points[i]));
    }
}

TEST(Noise, FarFromTheOrigin_KeepsItsShape) {
    const auto waves = fbm_texture({0.5, 4}, Mapping3());
    const double far = 256e6;  // a multiple of the first octave's period
    const auto one = fbm_texture({0.5, 1}, Mapping3());
    for (double x = 0.05; x < 3; x += 0.1) {
        EXPECT_NEAR(one.at({V2f(0, 0), V3d(far + x, 0.3, 0.4)}), one.at({V2f(0, 0), V3d(x, 0.3, 0.4)}), 1e-6);
        EXPECT_LT(std::fabs(waves.at({V2f(0, 0), V3d(far + x + 1e-6, 0.3, 0.4)}) -
                            waves.at({V2f(0, 0), V3d(far + x, 0.3, 0.4)})),
                  1e-4F);
    }
}

RC_GTEST_PROP(TextureProperties, Mappings_OfAnything_AreFinite,
              (float u, float v, double x, double y, double z)) {
    for (const double bad : {x, 0.0, 1e308, static_cast<double>(INFINITY), static_cast<double>(NAN)}) {
        const TexturePoint point(V2f(u, v), V3d(bad, y, z));
        for (const Mapping2& mapping : {Mapping2(UvMapping{}), Mapping2(SphericalMapping{}),
                                        Mapping2(CylindricalMapping{}), Mapping2(PlanarMapping{})}) {
            const V2d st = texture_st(mapping, point);
            RC_ASSERT(std::isfinite(st.x) && std::isfinite(st.y));
        }
    }
}

// --- Images in memory and in the cache

Image noise_image(int width, int height) {
    Sampler s(5, Purpose::test, 0, 0);
    Image image = Image::rgb(width, height);
    for (float& value : image.data) value = s.next();
    return image;
}

class BothWays {
  public:
    BothWays() {
        write_png_display(folder_ / "a.png", noise_image(150, 90));
        write_exr(folder_ / "a.exr", noise_image(150, 90));
        std::ofstream(folder_ / "a.pgm", std::ios::binary) << "P5 3 2 255\n"
                                                           << std::string("\x10\x20\x30\x40\x50\x60");
    }
    RgbTexture texture(TextureImages& images, const std::string& name, Wrap wrap) const {
        ImageLookup lookup;
        lookup.wrap = wrap;
        return image_texture<Rgb>(images.open(folder_ / name, {}), lookup);
    }
    std::filesystem::path file(const std::string& name) const { return folder_ / name; }

  private:
    testing::TemporaryFolder folder_;
};
// No image is kept in memory; the cache holds a megabyte.
constexpr TextureMemory kNothingKept{0, 0, std::size_t{1} << 20};

TEST(TextureImages, FromTheCache_AreTheSameBitForBit) {
    const BothWays files;
    TextureImages kept, cached(kNothingKept);
    for (const std::string name : {"a.png", "a.exr", "a.pgm"}) {
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::black}) {
            const auto a = files.texture(kept, name, wrap), b = files.texture(cached, name, wrap);
            EXPECT_EQ(a.least(), b.least());
            EXPECT_EQ(a.largest(), b.largest());
            Sampler s(6, Purpose::test, 0, 0);
            for (int i = 0; i < 5000; ++i) {
                const TexturePoint point = random_point(s);
                ASSERT_EQ(a.at(point), b.at(point)) << name;
            }
        }
    }
    EXPECT_GT(kept.bytes_in_memory(), 0U);
    EXPECT_EQ(cached.bytes_in_memory(), 0U);
    EXPECT_EQ(kept.open(files.file("a.png"), {}), kept.open(files.file("a.png"), {})) << "each once";
}

TEST(TextureImages, AskedByManyThreads_AnswerTheSame) {
    const BothWays files;
    TextureImages kept, cached(kNothingKept);
    const auto a = files.texture(kept, "a.png", Wrap::repeat),
               b = files.texture(cached, "a.png", Wrap::repeat);
    std::vector<int> wrong(64, 0);
    parallel_chunks(Workers{8}, 64, [&](std::int64_t chunk) {
        Sampler s(7, Purpose::test, 0, static_cast<std::uint64_t>(chunk));
        for (int i = 0; i < 500; ++i) {
            const TexturePoint point = random_point(s);
            if (a.at(point) != b.at(point)) ++wrong[static_cast<std::size_t>(chunk)];
        }
    });
    EXPECT_EQ(wrong, std::vector<int>(64, 0));
}

TEST(TextureImages, BeyondTheBudget_GoToTheCache) {
    const BothWays files;
    TextureImages images({std::size_t{1} << 20, 150 * 90 * 3, std::size_t{1} << 20});
    images.open(files.file("a.png"), {});
    EXPECT_EQ(images.bytes_in_memory(), 150U * 90 * 3) << "bytes stay bytes";
    images.open(files.file("a.exr"), {});
    EXPECT_EQ(images.bytes_in_memory(), 150U * 90 * 3);
}

TEST(ImageTexture, BeyondItsEdge_RepeatsClampsOrIsBlack) {
    const BothWays files;
    TextureImages images;
    const auto at = [&](Wrap wrap, float u, float v) {
        return files.texture(images, "a.pgm", wrap).at(V2f(u, v)).x;
    };
    const auto stored = [](int byte) {
        return Encoding{Encoding::Kind::srgb}.decode(static_cast<float>(byte) / 255);
    };
    EXPECT_FLOAT_EQ(at(Wrap::clamp, -5, 9), stored(0x10)) << "the upper left";
    EXPECT_FLOAT_EQ(at(Wrap::clamp, 5, -9), stored(0x60));
    EXPECT_EQ(at(Wrap::black, -5, 0.5F), 0);
    EXPECT_FLOAT_EQ(at(Wrap::black, 0, 0.75F), stored(0x10) / 2) << "half of its neighbour is missing";
    EXPECT_FLOAT_EQ(at(Wrap::repeat, 0, 0.75F), (stored(0x10) + stored(0x30)) / 2);
    EXPECT_FLOAT_EQ(at(Wrap::clamp, 0.5F, 0.75F), stored(0x20));
}

}  // namespace texture_patterns_test
}  // namespace lucerna
