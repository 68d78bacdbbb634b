// Filling pixels without a sample by features.
#include "engine/render/feature_filter.h"

#include <gtest/gtest.h>

#include "engine/denoise/denoise.h"

namespace lucerna {
namespace feature_filter_test {

constexpr int kWide = 37, kHigh = 22, kEdge = 18;  // the edge is on no lattice

// Two walls that meet at the column kEdge, each with stripes of two albedos, under different light.
float light_at(int x) {
    return x < kEdge ? 2.0F : 0.25F;
}
Rgb albedo_at(int x, int y) {
    const float stripe = (x + y) % 3 == 0 ? 0.2F : 0.8F;
    return {stripe, 0.5F * stripe, 0.1F};
}

Image features() {
    Image image(kWide, kHigh, feature_channels());
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            float* const f = &image.data[image.index(x, y)];
            const Rgb albedo = albedo_at(x, y);
            const V3f normal = x < kEdge ? V3f(0, 0, 1) : V3f(-1, 0, 0);
            const V3f position = x < kEdge ? V3f(static_cast<float>(x), static_cast<float>(y), 0)
                                           : V3f(kEdge, static_cast<float>(y), static_cast<float>(x - kEdge));
            for (int c = 0; c < 3; ++c) {
                f[kAlbedo + c] = albedo[c];
                f[kNormal + c] = f[kGeometricNormal + c] = normal[c];
                f[kPosition + c] = position[c];
            }
            f[kDepth] = 10;
        }
    }
    return image;
}

// The filter divides by the albedo plus 0.01.
Rgb radiance_at(int x, int y) {
    return light_at(x) * (albedo_at(x, y) + Rgb(0.01F));
}

Film film_of_steps(int steps) {
    Film film(kWide, kHigh);
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            if (Film::step_of({x, y}) < steps) film.add(x, y, radiance_at(x, y));
        }
    }
    return film;
}

FeatureFilter filter_of(const Film& film, const Image& features) {
    return FeatureFilter({kWide, kHigh}, sampled_pixels(film, Workers{2}), film.spacing(), features,
                         Workers{2});
}

// Light that is the same over each wall is restored in all pixels, whichever have a sample.
TEST(FeatureFilter, FilledPixels_HaveTheLightOfTheirWallAndTheirOwnAlbedo) {
    const Image seen = features();
    for (const int steps : {1, 2}) {
        const Film film = film_of_steps(steps);
        EXPECT_EQ(film.spacing(), steps == 1 ? 4 : 2);
        Image image = film.develop(1);
        filter_of(film, seen).fill({&image});
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                const Rgb expected = radiance_at(x, y), found = image.rgb_at(x, y);
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(found[c], expected[c], 0.01F * expected[c]) << x << ' ' << y << ' ' << steps;
            }
        }
    }
}

TEST(FeatureFilter, WithoutFeatures_NoPixelIsBlack) {
    const Image none;
    const Film film = film_of_steps(1);
    Image image = film.develop(1);
    filter_of(film, none).fill({&image});
    for (const float value : image.data) EXPECT_TRUE(std::isfinite(value));
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) EXPECT_GT(image.rgb_at(x, y).x, 0) << x << ' ' << y;
    }
}

// After one sample of each pixel of the lattice, each half has every second of them, and the other half's
// samples have no influence on it.
TEST(CompleteHalves, OfOneSample_AreIndependentAndHaveTheLightOfTheirWall) {
    const Image seen = features();
    for (const int steps : {1, 2, 3}) {
        Film::Kind kind;
        kind.two_halves = true;
        Film film(kWide, kHigh, kind), other(kWide, kHigh, kind);
        const int spacing = 4 >> (steps - 1);
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                if (Film::step_of({x, y}) >= steps) continue;
                film.add(x, y, radiance_at(x, y));
                const bool in_first = ((x / spacing + y / spacing) & 1) == 0;
                other.add(x, y, radiance_at(x, y) * (in_first ? 1.0F : 3.0F));
            }
        }
        std::array<Image, 2> halves{film.develop_half(0, 1), film.develop_half(1, 1)};
        std::array<Image, 2> changed{other.develop_half(0, 1), other.develop_half(1, 1)};
        complete_halves(halves, spacing, seen, Workers{2});
        complete_halves(changed, spacing, seen, Workers{2});
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                const float expected = radiance_at(x, y).x;
                for (const Image& half : halves)
                    EXPECT_NEAR(half.rgb_at(x, y).x, expected, 0.01F * expected) << x << ' ' << y;
                EXPECT_EQ(changed[0].rgb_at(x, y), halves[0].rgb_at(x, y)) << x << ' ' << y;
                EXPECT_NEAR(changed[1].rgb_at(x, y).x, 3 * expected, 0.03F * expected) << x << ' ' << y;
                EXPECT_EQ(halves[0].value(x, y, kSamples) + halves[1].value(x, y, kSamples),
                          Film::step_of({x, y}) < steps ? 1.0F : 0.0F);
            }
        }
    }
}

}  // namespace feature_filter_test
}  // namespace lucerna
