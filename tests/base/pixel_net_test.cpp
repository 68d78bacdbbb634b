// Nets across pixels: blocks of pixels, with any power of two of their samples, form a net together.
#include "engine/base/pixel_net.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "engine/base/sampler.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace pixel_net_test {

// Returns whether every elementary interval contains exactly one of the 2^k points.
bool is_net(int k, const std::function<V2f(std::uint32_t)>& point) {
    const std::uint32_t n = 1U << k;
    for (int a = 0; a <= k; ++a) {
        std::vector<bool> seen(n);
        for (std::uint32_t i = 0; i < n; ++i) {
            const V2f p = point(i);
            const auto column = static_cast<std::uint32_t>(p.x * static_cast<float>(1U << a));
            const auto row = static_cast<std::uint32_t>(p.y * static_cast<float>(1U << (k - a)));
            const std::uint32_t interval = (column << (k - a)) + row;
            if (seen[interval]) return false;
            seen[interval] = true;
        }
    }
    return true;
}

Sampler after(Sampler sampler, int draws) {
    for (int i = 0; i < draws; ++i) sampler.next2();
    return sampler;
}

// 2^k samples of each pixel from `first` on, in the block of 2^j × 2^j pixels whose corner is given.
struct Block {
    int k, j;
    std::uint32_t first;
    V2i corner;
};
bool is_net(const Block& block, const std::function<V2f(const V2i&, std::uint32_t)>& point) {
    return is_net(block.k + 2 * block.j, [&](std::uint32_t i) {
        const std::uint32_t pixel = i >> block.k;
        const auto side = static_cast<std::uint32_t>(block.j);
        const V2i at(static_cast<int>(pixel & ((1U << side) - 1)), static_cast<int>(pixel >> side));
        return point(block.corner + at, block.first + (i & ((1U << block.k) - 1)));
    });
}

TEST(Morton, TakesBitsInTurn) {
    EXPECT_EQ(morton(0, 0), 0U);
    EXPECT_EQ(morton(1, 0), 1U);
    EXPECT_EQ(morton(0, 1), 2U);
    EXPECT_EQ(morton(6, 3), 0b011110U);
    EXPECT_EQ(morton(0xffff, 0), 0x55555555U);
}

TEST(PixelNet, BlocksOfPixels_AnyPowerOfTwoOfSamples_AreNets) {
    const ImageSamplers samplers(3, Purpose::test);
    for (const int draws : {0, 1, 5, 70}) {  // the last exceeds the precomputed draws
        for (int k = 0; k <= 6; ++k) {
            for (int j = 0; j <= 3; ++j) {
                const Block block{k, j, 5U << k, V2i(3 << j, 10 << j)};
                EXPECT_TRUE(is_net(block,
                                   [&](const V2i& pixel, std::uint32_t sample) {
                                       return after(samplers.at(pixel, sample), draws).next2();
                                   }))
                    << draws << " draws, 2^" << k << " samples, side 2^" << j;
            }
        }
    }
}

TEST(PixelNet, NumbersOfOneDimension_AreOneInEachStratum) {
    const ImageSamplers samplers(4, Purpose::test);
    std::set<int> strata;
    for (int y = 8; y < 16; ++y) {
        for (int x = 24; x < 32; ++x) {
            for (std::uint32_t s = 0; s < 4; ++s)
                strata.insert(static_cast<int>(after(samplers.at({x, y}, s), 3).next() * 256));
        }
    }
    EXPECT_EQ(strata.size(), 256U);
}

TEST(PixelNet, BranchesOfPixels_AreNets) {
    const ImageSamplers samplers(5, Purpose::test);
    const auto alike = [&](const V2i& pixel, std::uint32_t sample) {
        return after(samplers.at(pixel, sample), 2).split_alike(7).next2();
    };
    EXPECT_TRUE(is_net(Block{3, 2, 8, V2i(4, 16)}, alike));
    // Each path is split into four samples.
    const auto four = [&](const V2i& pixel, std::uint32_t i) {
        return after(samplers.at(pixel, i / 4), 2).split_alike(7, i % 4, 4).next2();
    };
    EXPECT_TRUE(is_net(Block{5, 2, 32, V2i(4, 16)}, four));
    const auto alone = [&](const V2i& pixel, std::uint32_t sample) {
        return samplers.at(pixel, sample).split(7).next2();
    };
    EXPECT_FALSE(is_net(Block{3, 2, 8, V2i(4, 16)}, alone)) << "what this test is to refuse";
}

TEST(PixelNet, FamiliesOfTheirOwn_AreNoNet) {
    EXPECT_FALSE(is_net(Block{4, 1, 0, V2i(2, 2)}, [](const V2i& pixel, std::uint32_t sample) {
        const auto family = static_cast<std::uint64_t>(1000 * pixel.y + pixel.x);
        return Sampler::stratified(3, Purpose::test, family, sample).next2();
    }));
}

// Indices that differ only in a bit beyond the length of one sequence must give different numbers.
TEST(PixelNet, LargeNumbers_AreNumbersOfTheirOwn) {
    const ImageSamplers samplers(6, Purpose::test);
    std::set<std::array<float, 2>> seen;
    std::size_t made = 0;
    const auto add = [&](Sampler sampler) {
        const V2f u = sampler.next2();
        seen.insert({u.x, u.y});
        ++made;
    };
    for (const int x : {0, 1, 0xffff, 0x10000, 0x10001, 0x7fffffff}) {
        for (const int y : {0, 1, 0xffff, 0x10000, 0x7fffffff}) {
            for (const std::uint32_t sample : {0U, 1U, 1U << 30, 1U << 31}) {
                const Sampler sampler = samplers.at({x, y}, sample);
                add(sampler);
                for (std::uint32_t i = 0; i < 4; ++i) add(sampler.split_alike(1, i, 4));
            }
        }
    }
    EXPECT_EQ(seen.size(), made);
}

TEST(PixelNet, EveryPixelAndSample_OverSeeds_IsUniform) {
    constexpr std::uint64_t kSeeds = 1U << 16;
    const auto uniform = [](const std::function<V2f(const ImageSamplers&)>& point) {
        std::vector<std::uint64_t> counts(16 * 16);
        for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
            const V2f p = point(ImageSamplers(seed, Purpose::test));
            ++counts[static_cast<std::size_t>(p.x * 16) * 16 + static_cast<std::size_t>(p.y * 16)];
        }
        return testing::chi_square(counts, std::vector<double>(256, kSeeds / 256.0)).accepted();
    };
    EXPECT_TRUE(uniform([](const ImageSamplers& samplers) { return samplers.at({5, 9}, 3).next2(); }));
    // Different draws of neighbouring pixels are independent.
    EXPECT_TRUE(uniform([](const ImageSamplers& samplers) {
        return V2f(samplers.at({4, 9}, 3).next(), after(samplers.at({5, 9}, 3), 1).next());
    }));
    // The same draw of neighbouring pixels is well distributed together, and so not independent.
    EXPECT_FALSE(uniform([](const ImageSamplers& samplers) {
        return V2f(samplers.at({4, 9}, 3).next(), samplers.at({5, 9}, 3).next());
    }));
}

// ---- Errors of pixels and of filtered pixels ----

struct Errors {
    double pixel = 0, filtered = 0;  // mean squares: of a pixel, and of the mean of 3 × 3 pixels anywhere
};

using Numbers = std::function<Sampler(std::uint64_t seed, const V2i& pixel, std::uint32_t sample)>;

template <typename Integrand>
Errors errors(Integrand&& f, double mean, std::uint32_t count, const Numbers& numbers) {
    constexpr int kSide = 32, kSeeds = 30;
    Errors result;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        std::vector<double> error;
        for (int i = 0; i < kSide * kSide; ++i) {
            double sum = 0;
            for (std::uint32_t s = 0; s < count; ++s) sum += f(numbers(seed, {i % kSide, i / kSide}, s));
            error.push_back(sum / count - mean);
            result.pixel += sqr(error.back()) / (kSide * kSide * kSeeds);
        }
        constexpr int kWithin = kSide - 2;
        for (int i = 0; i < kWithin * kWithin; ++i) {
            double sum = 0;
            for (int v = 0; v < 3; ++v) {
                for (int u = 0; u < 3; ++u)
                    sum += error[static_cast<std::size_t>((i / kWithin + v) * kSide + i % kWithin + u)];
            }
            result.filtered += sqr(sum / 9) / (kWithin * kWithin * kSeeds);
        }
    }
    return result;
}

Sampler together(std::uint64_t seed, const V2i& pixel, std::uint32_t sample) {
    return ImageSamplers(seed, Purpose::test).at(pixel, sample);
}
Sampler apart(std::uint64_t seed, const V2i& pixel, std::uint32_t sample) {
    const auto family = static_cast<std::uint64_t>(1000 * (1 + pixel.y) + pixel.x);
    return Sampler::stratified(seed, Purpose::test, family, sample);
}

// An edge across a square is the typical integrand of a pixel, a penumbra and a lens.
double quarter_disc(Sampler sampler) {
    const V2f u = sampler.next2();
    return u.x * u.x + u.y * u.y < 1 ? 1 : 0;
}
// The integrand depends on the product of two draws and on neither alone, so no net reduces its error.
double product(Sampler sampler) {
    const double a = double{sampler.next()} - 0.5;
    return a * (double{sampler.next()} - 0.5);
}

TEST(PixelNetErrors, Filtered_AreLessThanOfFamiliesOfTheirOwn_AtAnyNumberOfSamples) {
    for (const std::uint32_t count : {1U, 2U, 5U, 16U}) {
        const Errors net = errors(quarter_disc, kPi / 4.0, count, together);
        const Errors own = errors(quarter_disc, kPi / 4.0, count, apart);
        EXPECT_LT(net.filtered, 0.75 * own.filtered) << count;  // measured: 0.60 to 0.70
        EXPECT_LT(net.pixel, 1.05 * own.pixel) << count;
        EXPECT_NEAR(own.filtered, own.pixel / 9, 0.1 * own.pixel / 9) << "independent pixels";
    }
}

// The error grows by a third, as derived for pairs of pixels whose quarters are shuffled; unshuffled, it
// would double.
TEST(PixelNetErrors, OfTwoDrawsAtOnce_AreLittleMoreThanOfFamiliesOfTheirOwn) {
    const Errors net = errors(product, 0, 4, together);
    const Errors own = errors(product, 0, 4, apart);
    EXPECT_LT(net.pixel, 1.2 * own.pixel);
    EXPECT_LT(net.filtered, 1.5 * own.filtered);
}

}  // namespace pixel_net_test
}  // namespace lucerna
