// The denoiser, on pictures whose truth is known.
#include "engine/denoise/denoise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "engine/base/error.h"
#include "engine/base/stats.h"

namespace lucerna {
namespace denoise_test {

constexpr int kWide = 96, kHigh = 64;

struct Picture {
    Image truth = Image::rgb(kWide, kHigh);
    DenoiserInput layers;
};

// Sets a pixel of a half to the mean of `samples` samples, which draw() returns, and its variance.
template <typename Draw>
void set_pixel(Image& half, int x, int y, int samples, Draw&& draw) {
    double sum = 0, squares = 0;
    for (int s = 0; s < samples; ++s) {
        const double v = draw();
        sum += v / samples, squares += v * v / samples;
    }
    float* const to = &half.data[half.index(x, y)];
    const double variance = samples > 1 ? std::max(0.0, squares - sum * sum) / (samples - 1) : 0;
    for (int c = 0; c < 3; ++c) {
        to[kLight + c] = static_cast<float>(sum);
        to[kVariance + c] = static_cast<float>(variance);
    }
    to[kSamples] = static_cast<float>(samples);
}

// Returns two walls that meet in the middle, lit by `light`. The right one has a fine pattern of colours; the
// edge of a shadow, which no feature shows, crosses the left one. A share `met` of the samples deviates from
// the mean, by a factor that preserves the mean.
Picture walls(double light = 1, double noise = 0.5, std::array<int, 2> samples = {8, 8}, unsigned seed = 1) {
    Picture picture;
    Image features(kWide, kHigh, feature_channels());
    std::mt19937 random(seed);
    // The factor of a sample has mean 1 and deviation 1.
    std::exponential_distribution<double> sample(1);
    for (Image& half : picture.layers.halves) half = Image(kWide, kHigh, half_channels());
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const bool right = x >= kWide / 2;
            float* const f = &features.data[features.index(x, y)];
            const float albedo = right ? ((x / 2 + y / 3) % 2 == 0 ? 0.8F : 0.2F) : 0.5F;
            for (int c = 0; c < 3; ++c) f[kAlbedo + c] = albedo;
            const V3f normal = right ? V3f(-0.6F, 0, -0.8F) : V3f(0, 0, -1);
            for (int c = 0; c < 3; ++c) f[kNormal + c] = f[kGeometricNormal + c] = normal[c];
            const float across = static_cast<float>(x) - 0.5F * kWide;
            f[kPosition] = across, f[kPosition + 1] = static_cast<float>(y);
            f[kPosition + 2] = right ? -0.75F * across : 0;
            f[kDepth] = 100;
            const bool shadow = !right && 3 * y > x + 60;
            const double irradiance = light * (shadow ? 0.3 : 1 + 0.004 * x + 0.002 * y);
            const double value = albedo * irradiance;
            picture.truth.set_rgb(x, y, Rgb(static_cast<float>(value)));
            for (std::size_t h = 0; h < 2; ++h) {
                set_pixel(picture.layers.halves[h], x, y, samples[h],
                          [&] { return value * (1 + noise * (sample(random) - 1)); });
            }
        }
    }
    picture.layers.features = std::move(features);
    return picture;
}

// Computes the error as Film::ErrorEstimate does.
double error_of(const Picture& picture, const std::function<double(int, int)>& shown) {
    double mean = 0, sum = 0;
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) mean += double{picture.truth.value(x, y, 0)} / (kWide * kHigh);
    }
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const double truth = double{picture.truth.value(x, y, 0)};
            sum += sqr(shown(x, y) - truth) / error_scale2(truth, mean) / (kWide * kHigh);
        }
    }
    return std::sqrt(sum);
}
double error_of(const Picture& picture, const Image& image) {
    return error_of(picture, [&](int x, int y) { return double{image.value(x, y, 0)}; });
}
double measured_error(const Picture& picture) {
    const auto& halves = picture.layers.halves;
    return error_of(picture, [&](int x, int y) {
        return 0.5 * (double{halves[0].value(x, y, 0)} + double{halves[1].value(x, y, 0)});
    });
}

TEST(Denoise, Noise_IsRemovedAndWhatIsLeftIsSaid) {
    for (const double noise : {0.1, 0.5, 2.0}) {
        const Picture picture = walls(1, noise);
        const Denoised denoised = denoise(picture.layers, {});
        const double error = error_of(picture, denoised.image);
        EXPECT_LT(error, 0.5 * measured_error(picture)) << noise;
        EXPECT_GT(denoised.relative_error, error / 1.5) << noise;
        EXPECT_LT(denoised.relative_error, error * 1.5) << noise;
    }
}

// A single sample carries no information about its variance, and the halves need not be equal. With so few
// samples the error estimate is less certain, and which of three images looks best is partly chance: its
// standard error is more than half of it in one picture, so that the mean over seeds is compared.
TEST(Denoise, OfOneSampleAHalf_OrOneAndTwo_NoiseIsRemovedAndSaid) {
    struct Case {
        std::array<int, 2> samples;
        double known_to;  // a factor
    };
    for (const Case& of : {Case{{1, 1}, 2}, Case{{2, 1}, 1.5}, Case{{1, 6}, 1.5}}) {
        SCOPED_TRACE(of.samples[1]);
        RunningStats said, error;
        for (unsigned seed = 1; seed <= 8; ++seed) {
            const Picture picture = walls(1, 0.3, of.samples, seed);
            const Denoised denoised = denoise(picture.layers, {});
            said.add(sqr(denoised.relative_error));
            error.add(sqr(error_of(picture, denoised.image)));
            EXPECT_LT(std::sqrt(error.mean()), 0.5 * measured_error(picture));
        }
        EXPECT_GT(std::sqrt(said.mean() / error.mean()), 1 / of.known_to);
        EXPECT_LT(std::sqrt(said.mean() / error.mean()), of.known_to);
    }
}

// Halves of one sample have met too little of the error to estimate it; halves of two can. For a picture of a
// few pixels, or where a few pixels dominate, the error is unknown.
TEST(Denoise, ErrorThatIsNotKnown_IsNotSaidToBe) {
    for (const int samples : {1, 2, 4, 8}) {
        EXPECT_EQ(denoise(walls(1, 0.02, {samples, samples}).layers, {}).error_is_known, samples > 1)
            << samples;
    }
    Picture rare = walls(1, 0.5, {8, 8});
    std::mt19937 random(9);
    for (Image& half : rare.layers.halves) {
        for (int i = 0; i < 20; ++i) {
            const int x = static_cast<int>(random() % kWide), y = static_cast<int>(random() % kHigh);
            const float value = std::pow(10.0F, 1 + 0.1F * static_cast<float>(i));
            for (int c = 0; c < 3; ++c) {
                half.value(x, y, kLight + c) += value;
                half.value(x, y, kVariance + c) += value * value;
            }
        }
    }
    EXPECT_FALSE(denoise(rare.layers, {}).error_is_known);
}

// The mixture's shares are optimised by the same errors that judge it, which biases these low. With few
// samples of a heavy tail, the mean over seeds of the squared statement must be that of the squared error.
TEST(Denoise, ErrorOfFewSamples_IsNotTooSmallByTheChoiceOfShares) {
    RunningStats said, error;
    for (unsigned seed = 1; seed <= 100; ++seed) {
        const Picture picture = walls(1, 1, {4, 4}, seed);
        const Denoised denoised = denoise(picture.layers, {});
        said.add(sqr(denoised.relative_error));
        error.add(sqr(error_of(picture, denoised.image)));
    }
    // 100 seeds determine the ratio to 2.5 %; of 200 it is 0.85.
    EXPECT_GT(std::sqrt(said.mean() / error.mean()), 0.8);
    EXPECT_LT(std::sqrt(said.mean() / error.mean()), 1.15);
}

// Light in only a few pixels, and in one half alone, must neither dominate the error of the whole image nor
// make it zero.
TEST(Denoise, AFewPixelsOfMuchLight_DoNotDecideTheError) {
    Picture picture = walls();
    const double before = denoise(picture.layers, {}).relative_error;
    Image& half = picture.layers.halves[0];
    for (int c = 0; c < 3; ++c) {
        half.value(20, 20, kLight + c) = 1e4F;
        half.value(20, 20, kVariance + c) = 1e8F;
    }
    const double after = denoise(picture.layers, {}).relative_error;
    EXPECT_GT(after, 0.8 * before);
    EXPECT_LT(after, 2 * before);
}

// Lamps as small as pixels, which no feature shows, lie on walls that are nearly black. Patches of 7 x 7
// separate them only partly: some of their light leaks, but at most doubles the error.
TEST(Denoise, LampsOfAPixel_AreNotSpreadOverTheDark) {
    Picture picture = walls(1e-3, 0.5);
    std::mt19937 random(5);
    std::normal_distribution<float> noise(1, 0.1F);
    for (int y = 8; y < kHigh; y += 16) {
        for (int x = 8; x < kWide; x += 16) {
            picture.truth.set_rgb(x, y, Rgb(1));
            for (Image& half : picture.layers.halves) {
                const float value = noise(random);
                for (int c = 0; c < 3; ++c) {
                    half.value(x, y, kLight + c) = value;
                    half.value(x, y, kVariance + c) = sqr(0.1F);
                }
            }
        }
    }
    const double error = error_of(picture, denoise(picture.layers, {}).image);
    EXPECT_LT(error, 2 * measured_error(picture));
}

// Three fireflies, each a single sample of one half, must not be seen afterwards, neither as they are nor
// spread over a window of any scale. Halves of one sample do not say that its variance is large.
TEST(Denoise, Fireflies_AreNotSpread) {
    for (const int samples : {1, 2, 4}) {
        for (const float brightness : {30.0F, 1e3F, 1e6F}) {
            SCOPED_TRACE(testing::Message() << samples << " samples of brightness " << brightness);
            Picture picture = walls(1, 0.5, {samples, samples});
            const Image without = denoise(picture.layers, {}).image;
            for (const V2i& at : {V2i(12, 20), V2i(30, 22), V2i(70, 40)}) {
                float* const pixel =
                    &picture.layers.halves[0].data[picture.layers.halves[0].index(at.x, at.y)];
                const float n = pixel[kSamples], share = brightness / n;
                for (int c = 0; c < 3; ++c) {
                    pixel[kLight + c] += share;
                    if (n > 1) pixel[kVariance + c] += sqr(share);
                }
            }
            const Image image = denoise(picture.layers, {}).image;
            for (int y = 0; y < kHigh; ++y) {
                for (int x = 0; x < kWide; ++x)
                    ASSERT_NEAR(image.value(x, y, 1), without.value(x, y, 1), 0.25) << x << ' ' << y;
            }
        }
    }
}

// If few samples meet the light, most pixels hold none of it and have no variance. Those that hold it then
// look like outliers, and clusters of dark pixels look like shadows.
TEST(Denoise, LightThatFewSamplesMeet_IsNeitherLostNorInClouds) {
    Picture picture = walls();
    std::mt19937 random(11);
    std::uniform_real_distribution<float> uniform(0, 1);
    constexpr float kChance = 0.03F;
    constexpr int kSamplesOfHalf = 2;
    double measured = 0;
    for (Image& half : picture.layers.halves) {
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                const float albedo = picture.layers.features.value(x, y, kAlbedo);
                picture.truth.set_rgb(x, y, Rgb(albedo));
                int met = 0;
                for (int s = 0; s < kSamplesOfHalf; ++s) met += uniform(random) < kChance ? 1 : 0;
                const float share = static_cast<float>(met) / kSamplesOfHalf;
                const float variance = share * (1 - share) / (kSamplesOfHalf - 1) * sqr(albedo / kChance);
                for (int c = 0; c < 3; ++c) {
                    half.value(x, y, kLight + c) = share * albedo / kChance;
                    half.value(x, y, kVariance + c) = variance;
                }
                half.value(x, y, kSamples) = kSamplesOfHalf;
                measured += double{share / kChance} / (2 * kWide * kHigh);
            }
        }
    }
    const Image image = denoise(picture.layers, {}).image;
    double sum = 0;
    float least = INFINITY;
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const float light = image.value(x, y, 1) / picture.layers.features.value(x, y, kAlbedo);
            sum += double{light} / (kWide * kHigh);
            least = std::min(least, light);
        }
    }
    EXPECT_NEAR(sum / measured, 0.95, 0.1);
    EXPECT_GT(least, 0.2);
    EXPECT_LT(error_of(picture, image), 0.3);
}

constexpr double kOfPanel = 0.06, kOfWall = 0.5;  // radiances
// Returns a dark panel before a bright wall, with a curved edge between them. Pixels at the edge see shares
// of both, in features and light alike. A sample meets light with probability `met`.
Picture panel(double met, int samples, unsigned seed) {
    Picture picture;
    Image features(kWide, kHigh, feature_channels());
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    for (Image& half : picture.layers.halves) half = Image(kWide, kHigh, half_channels());
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            // The area of the pixel that sees the panel, in the middle of its height.
            const double edge = 0.4 * kWide + 9 * std::sin(0.15 * y);
            const double share = std::clamp(edge - x, 0.0, 1.0);
            const auto mixed = [share](double of_panel, double of_wall) {
                return static_cast<float>(share * of_panel + (1 - share) * of_wall);
            };
            float* const f = &features.data[features.index(x, y)];
            for (int c = 0; c < 3; ++c) f[kAlbedo + c] = mixed(0.15, 0.5);
            f[kNormal + 2] = f[kGeometricNormal + 2] = -1;
            f[kPosition] = mixed(0.6 * x, x), f[kPosition + 1] = mixed(0.6 * y, y);
            f[kPosition + 2] = mixed(60, 100);
            f[kDepth] = mixed(60, 100);
            picture.truth.set_rgb(x, y, Rgb(mixed(kOfPanel, kOfWall)));
            for (Image& half : picture.layers.halves) {
                set_pixel(half, x, y, samples, [&] {
                    const double lit = uniform(random) < share ? kOfPanel : kOfWall;
                    return uniform(random) < met ? lit / met : 0;
                });
            }
        }
    }
    picture.layers.features = std::move(features);
    return picture;
}

// Sets the light on the walls to what draw(x, y) returns for a sample.
template <typename Draw>
void light_walls(Picture& picture, int samples, Draw&& draw) {
    for (Image& half : picture.layers.halves) {
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                const double albedo = double{picture.layers.features.value(x, y, kAlbedo)};
                set_pixel(half, x, y, samples, [&] { return albedo * draw(x, y); });
            }
        }
    }
}
double light_at(const Picture& picture, const Image& image, int x, int y) {
    return double{image.value(x, y, 0)} / double{picture.layers.features.value(x, y, kAlbedo)};
}

// Light that one sample in a hundred meets is in so many pixels that it is no accident. Of all light 0.91 was
// kept when such pixels were distrusted like single ones.
TEST(Denoise, LightInManyPixels_IsNotTakenForFireflies) {
    RunningStats kept;
    for (unsigned seed = 1; seed <= 4; ++seed) {
        Picture picture = walls();
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform;
        light_walls(picture, 6, [&](int /*x*/, int /*y*/) {
            return uniform(random) < 0.01 ? 100 * uniform(random) : 0.5;
        });
        const Image image = denoise(picture.layers, {}).image;
        double measured = 0, sum = 0;
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                for (const Image& half : picture.layers.halves) measured += light_at(picture, half, x, y) / 2;
                sum += light_at(picture, image, x, y);
            }
        }
        kept.add(sum / measured);
    }
    EXPECT_GT(kept.mean(), 0.93);
}

// Where most samples meet nothing, some pixels and their neighbours meet little light by chance, and say with
// certainty that they are dark. On the plain wall 2.4 % of the pixels had less than 0.85 of the light about
// them.
TEST(Denoise, PixelsThatMissedRareLight_AreNotDarkSpots) {
    constexpr int kReach = 10;
    RunningStats dark;
    for (unsigned seed = 1; seed <= 16; ++seed) {
        Picture picture = walls();
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform;
        std::exponential_distribution<double> bright(0.03);
        light_walls(picture, 6,
                    [&](int /*x*/, int /*y*/) { return uniform(random) < 0.03 ? bright(random) : 0; });
        const Image image = denoise(picture.layers, {}).image;
        for (int y = kReach; y < kHigh - kReach; ++y) {
            for (int x = kReach; x < kWide / 2 - kReach; ++x) {
                double about = 0;
                for (int v = y - kReach; v <= y + kReach; ++v) {
                    for (int u = x - kReach; u <= x + kReach; ++u) about += light_at(picture, image, u, v);
                }
                dark.add(light_at(picture, image, x, y) * sqr(2.0 * kReach + 1) < 0.85 * about ? 1 : 0);
            }
        }
    }
    EXPECT_LT(dark.mean(), 0.01);
}

// Beside the edge of a shadow, which no feature shows, linear fits and corrections by coarser scales continue
// the slope of the edge into the dark. 3.2 % of the pixels there had less than half of their light.
TEST(Denoise, ShadowsBesideLight_AreNotTooDark) {
    constexpr double kShadow = 0.02;
    RunningStats dark;
    for (unsigned seed = 1; seed <= 8; ++seed) {
        Picture picture = walls();
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform;
        std::exponential_distribution<double> indirect(1 / kShadow);
        // The share of the lamp that is seen.
        const auto seen = [](int x, int y) { return std::clamp((y - 24 - 0.3 * x) / 2, 0.0, 1.0); };
        light_walls(picture, 3,
                    [&](int x, int y) { return indirect(random) + (uniform(random) < seen(x, y) ? 1 : 0); });
        const Image image = denoise(picture.layers, {}).image;
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide / 2; ++x) {
                if (seen(x, y) == 0 && seen(x, y + 5) > 0)
                    dark.add(light_at(picture, image, x, y) < 0.5 * kShadow ? 1 : 0);
            }
        }
    }
    EXPECT_LT(dark.mean(), 0.015);
}

// Few other pixels resemble those at an edge, so that a regression leaves dark and bright dots. The errors
// were 0.43, 0.31 and 0.19 before such pixels were mixed from both sides.
TEST(Denoise, PixelsAtEdges_AreMixturesOfBothSides) {
    struct Case {
        double met, most;  // the error
    };
    for (const Case& of : {Case{0.05, 0.37}, Case{0.1, 0.25}, Case{0.3, 0.17}}) {
        RunningStats squares;
        for (unsigned seed = 1; seed <= 4; ++seed) {
            const Picture picture = panel(of.met, 2, seed);
            const Image denoised = denoise(picture.layers, {}).image;
            for (int y = 0; y < kHigh; ++y) {
                for (int x = 0; x < kWide; ++x) {
                    const double truth = double{picture.truth.value(x, y, 0)};
                    const bool sees_both = truth > 1.5 * kOfPanel && truth < 0.9 * kOfWall;
                    if (sees_both) squares.add(sqr(double{denoised.value(x, y, 0)} / truth - 1));
                }
            }
        }
        EXPECT_LT(std::sqrt(squares.mean()), of.most) << of.met;
    }
}

// The stated error is meaningful only if the halves are independent: for one half given twice it is nearly
// zero.
TEST(Denoise, OfHalvesThatAreTheSame_SaysTooLittle) {
    Picture picture = walls();
    picture.layers.halves[1] = picture.layers.halves[0];
    const Denoised denoised = denoise(picture.layers, {});
    EXPECT_LT(denoised.relative_error, error_of(picture, denoised.image) / 1.5);
}

// No feature shows this pattern of light, which is as fine as pixels, so the denoiser must not blur it.
TEST(Denoise, WhereItWouldHarm_TheMeasuredImageStands) {
    Picture picture = walls(1, 0.02);
    std::mt19937 random(7);
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const float factor = random() % 2 == 0 ? 1.0F : 0.5F;
            for (int c = 0; c < 3; ++c) {
                picture.truth.value(x, y, c) *= factor;
                for (Image& half : picture.layers.halves) {
                    half.value(x, y, kLight + c) *= factor;
                    half.value(x, y, kVariance + c) *= factor * factor;
                }
            }
        }
    }
    const double error = error_of(picture, denoise(picture.layers, {}).image);
    EXPECT_LT(error, 1.05 * measured_error(picture));
}

TEST(Denoise, AnyNumberOfThreads_GivesTheSameBits) {
    const Picture picture = walls();
    const Denoised one = denoise(picture.layers, {1});
    for (const int threads : {2, 3}) {
        const Denoised more = denoise(picture.layers, {threads});
        EXPECT_EQ(one.image.data, more.image.data) << threads;
        EXPECT_EQ(one.relative_error, more.relative_error) << threads;
    }
}

// Scales the light from 1e-18 to 1e18 W/(m² sr), whose squares underflow and overflow float32.
TEST(Denoise, AtTheExtremesOfLight_ItIsTheSamePicture) {
    const Picture usual = walls();
    const Denoised expected = denoise(usual.layers, {});
    for (const double light : {1e-18, 1e18}) {
        Picture picture = walls(light);
        for (Image& half : picture.layers.halves) {
            for (int y = 0; y < kHigh; ++y) {
                for (int x = 0; x < kWide; ++x) {
                    EXPECT_TRUE(std::isfinite(half.value(x, y, kVariance)));
                }
            }
        }
        const Denoised denoised = denoise(picture.layers, {});
        EXPECT_NEAR(error_of(picture, denoised.image), error_of(usual, expected.image), 1e-3) << light;
        EXPECT_NEAR(denoised.relative_error, expected.relative_error, 1e-3) << light;
    }
    const Denoised black = denoise(walls(0).layers, {});
    EXPECT_EQ(black.relative_error, 0);
    for (const float v : black.image.data) EXPECT_EQ(v, 0);
}

TEST(Denoise, OnePixel_IsItself) {
    const Picture picture = walls();
    const auto corner = [](const Image& image) {
        Image one(1, 1, image.channels);
        std::copy_n(image.data.begin(), image.channels.size(), one.data.begin());
        return one;
    };
    const DenoiserInput& all = picture.layers;
    const DenoiserInput one{{corner(all.halves[0]), corner(all.halves[1])}, corner(all.features)};
    const Denoised denoised = denoise(one, {});
    EXPECT_NEAR(denoised.image.data[0], 0.5F * (one.halves[0].data[0] + one.halves[1].data[0]), 1e-6F);
}

TEST(DenoiseLayers, AddedToAnImage_AreFoundAgain) {
    const Picture picture = walls();
    Image image = picture.truth;
    add_denoiser_input(image, picture.layers);
    const DenoiserInput found = denoiser_input_of(image, "room.exr");
    EXPECT_EQ(found.halves[1].data, picture.layers.halves[1].data);
    EXPECT_EQ(found.features.data, picture.layers.features.data);
    try {
        denoiser_input_of(picture.truth, "room.exr");
        ADD_FAILURE() << "there are none";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("room.exr: has no channel first.R"), std::string::npos)
            << error.what();
    }
}

}  // namespace denoise_test
}  // namespace lucerna
