// Tiles: reports must not depend on the order in which tiles finish.
#include "engine/render/tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/render/feature_filter.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace tiles_test {

// Yields NaN in the right half, for about every second sample, and never in the left half.
class Faulty final : public Estimator {
  public:
    void follow(const EyePath& path, Sampler& sampler) const override {
        const bool bad = path.ray.d.x > 0.05F && sampler.next() < 0.5F;
        path.add_emitted(Rgb(bad ? std::numeric_limits<float>::quiet_NaN() : 1.0F), kNoLight);
    }
};

struct Found {
    std::uint64_t count;
    std::string first;
};
// Renders all tiles in ascending or descending order, in rounds of `round` samples.
Found render_tiles(bool backwards, int round) {
    constexpr int kSamples = 6, kWide = 70, kHigh = 40;
    const Job job =
        testing::make_job(testing::integrating_sphere(0.5F, 1),
                          testing::camera({0, 0, 0}, {0, 0, 1}, kWide, kHigh, 60), PathSettings{}, kSamples);
    Film film(kWide, kHigh);
    TileRenderer tiles(job, 7, film, 0);
    for (int first = 0; first < kSamples; first += round) {
        for (int i = 0; i < tiles.tiles(); ++i) {
            tiles.render(Faulty{}, backwards ? tiles.tiles() - 1 - i : i, first, first + round);
        }
    }
    return {tiles.bad_samples().count, tiles.bad_samples().first};
}

TEST(Tiles, FirstBadSample_IsTheFirstInOrder_NotInTime) {
    const Found forwards = render_tiles(false, 6);
    ASSERT_GT(forwards.count, 1000U);
    EXPECT_NE(forwards.first.find(", 0) sample 0 seed 7"), std::string::npos) << forwards.first;
    for (const bool backwards : {false, true}) {
        for (const int round : {1, 3, 6}) {
            const Found other = render_tiles(backwards, round);
            EXPECT_EQ(other.count, forwards.count);
            EXPECT_EQ(other.first, forwards.first) << backwards << ' ' << round;
        }
    }
}

TEST(Tiles, FirstBadSampleOfARenderThatGoesOn_StaysTheFirst) {
    const Job job = testing::make_job(testing::integrating_sphere(0.5F, 1),
                                      testing::camera({0, 0, 0}, {0, 0, 1}, 40, 16, 60), PathSettings{}, 2);
    Film film(40, 16);
    TileRenderer tiles(job, 7, film, 0);
    tiles.resume_bad({3, "pixel (39, 15) sample 0", {}});
    for (int i = 0; i < tiles.tiles(); ++i) tiles.render(Faulty{}, i, 1, 2);
    EXPECT_EQ(tiles.bad_samples().first, "pixel (39, 15) sample 0");
    EXPECT_GT(tiles.bad_samples().count, 3U);
}

// The radiance depends on the position only, so all samples of a pixel are equal.
class Gradient final : public Estimator {
  public:
    void follow(const EyePath& path, Sampler& /*sampler*/) const override {
        path.add_emitted(Rgb(2 + path.ray.d.x, 2 + path.ray.d.y, 1), kNoLight);
    }
};

std::ptrdiff_t without_sample(const Film& film) {
    const std::vector<std::uint8_t> sampled = sampled_pixels(film, Workers{2});
    return std::count(sampled.begin(), sampled.end(), 0);
}

TEST(Tiles, FirstSamplesInSteps_ShowAWholeImageFromTheFirstStepOn) {
    constexpr int kWide = 37, kHigh = 21;
    const Job job =
        testing::make_job(testing::integrating_sphere(0.5F, 1),
                          testing::camera({0, 0, 0}, {0, 0, 1}, kWide, kHigh, 60), PathSettings{}, 2);
    Film film(kWide, kHigh), whole(kWide, kHigh);
    TileRenderer tiles(job, 7, film, 0), at_once(job, 7, whole, 0);
    std::ptrdiff_t without = kWide * kHigh;
    const Image no_features;
    for (int step = 0; step < TileRenderer::kFirstSteps; ++step) {
        for (int tile = 0; tile < tiles.tiles(); ++tile) tiles.render_first(Gradient{}, tile, 2, step);
        EXPECT_LT(without_sample(film), without) << step;
        without = without_sample(film);
        EXPECT_EQ(film.spacing(), 4 >> step);
        Image image = film.develop(1);
        FeatureFilter({kWide, kHigh}, sampled_pixels(film, Workers{2}), film.spacing(), no_features,
                      Workers{1})
            .fill({&image});
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) EXPECT_GT(luminance(image.rgb_at(x, y)), 0.5F) << x << ' ' << y;
        }
        // A second call gives no further sample to a pixel that has one.
        for (int tile = 0; tile < tiles.tiles(); ++tile) tiles.render_first(Gradient{}, tile, 2, step);
    }
    EXPECT_EQ(without_sample(film), 0);
    for (int tile = 0; tile < tiles.tiles(); ++tile) at_once.render(Gradient{}, tile, 0, 2);
    EXPECT_EQ(film.develop(1).data, whole.develop(1).data);
}

}  // namespace tiles_test
}  // namespace lucerna
