// Adaptive sampling: samples go where the noise is, the image stays unbiased, and the allocation depends only
// on sums.
#include "engine/render/allocation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/stats.h"
#include "engine/denoise/denoise.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace allocation_test {

constexpr int kBlock = SampleAllocation::kBlock;

// An image whose samples are drawn from a distribution instead of rendered.
class Drawn {
  public:
    // `light`(at, sampler) draws a sample. `by_itself` lets a half's samples decide on their own number,
    // which is the error that the tests must detect.
    template <typename Light>
    Drawn(const V2i& size, std::uint64_t seed, int end, Light light, bool by_itself = false)
        : film_(size.x, size.y, {1, false, true, true}), allocation_(film_) {
        allocation_.look_at(Image(size.x, size.y, feature_channels()));
        for (int done = 0; done < end;) {
            const int next = std::min(end, std::max(done + 1, 2 * done));
            for (int b = 0; b < allocation_.blocks(); ++b) {
                for (const int half : {0, 1}) take(b, half, done, next, seed, light, by_itself);
            }
            done = next;
            allocation_.decide(done);
        }
    }
    const Film& film() const { return film_; }
    const SampleAllocation& allocation() const { return allocation_; }

  private:
    template <typename Light>
    void take(int block, int half, int done, int next, std::uint64_t seed, Light& light, bool by_itself) {
        const int across = (film_.width() + kBlock - 1) / kBlock, last = allocation_.upto(block, half, next);
        const int to = by_itself ? 1 - half : half;  // the film's index of the half
        for (int from = allocation_.upto(block, half, done); from < last;) {
            const int seen = SampleAllocation::next_seen(from), upto = std::min(seen, last);
            for (int i = 0; i < kBlock * kBlock; ++i) {
                const V2i at(block % across * kBlock + i % kBlock, block / across * kBlock + i / kBlock);
                if (at.x >= film_.width() || at.y >= film_.height()) continue;
                const auto pixel = static_cast<std::uint64_t>(at.y * film_.width() + at.x);
                for (int s = from; s < upto; ++s) {
                    Sampler sampler(seed, Purpose::test, static_cast<std::uint32_t>(2 * s + half), pixel);
                    film_.add(at.x, at.y, Rgb(light(at, sampler)), 1, to);
                }
            }
            if (upto == seen) allocation_.see(block, to, seen);
            from = upto;
        }
    }

    Film film_;
    SampleAllocation allocation_;
};

double mean_of(const Film& film) {
    const Image image = film.develop(1);
    double sum = 0;
    for (std::size_t i = 0; i < image.data.size() / 6; ++i) sum += double{image.data[6 * i]};
    return sum / static_cast<double>(image.data.size() / 6);
}

// Rare light, as in a caustic: an estimator that lets a pixel's own samples decide on their number is biased
// low. One pixel is the worst case.
TEST(Allocation, OfRareLight_HasNoBias) {
    constexpr double kChance = 0.05, kTruth = 1;
    constexpr int kImages = 16000, kEnd = 64;
    const auto mean = [](bool by_itself) {
        RunningStats means;
        for (int i = 0; i < kImages; ++i) {
            // Light is rare in the left half. The blocks are close enough together to count as one
            // neighbourhood.
            const Drawn drawn(
                {4 * kBlock, 1}, static_cast<std::uint64_t>(i) + 1, kEnd,
                [](const V2i& at, Sampler& sampler) {
                    const float u = sampler.next();
                    if (at.x >= 2 * kBlock) return 1 + 0.5F * (u - 0.5F);
                    return u < static_cast<float>(kChance) ? static_cast<float>(1 / kChance) : 0.0F;
                },
                by_itself);
            means.add(mean_of(drawn.film()));
        }
        return means;
    };
    const RunningStats right = mean(false), wrong = mean(true);
    EXPECT_NEAR(right.mean(), kTruth, 4 * right.standard_error());
    EXPECT_LT(wrong.mean(), kTruth - 8 * wrong.standard_error()) << "the test would not see a bias";
}

// Noisier regions receive more samples, by the power given in allocation.h, and the total is the requested
// number.
TEST(Allocation, OfTwoKindsOfNoise_GoesByIts0_7thPower) {
    constexpr int kEnd = 256;
    constexpr float kNoise = 4;
    const V2i size(64, 30);  // blocks at the lower edge are cropped
    const Drawn drawn(size, 5, kEnd, [](const V2i& at, Sampler& sampler) {
        const float u = sampler.next() - 0.5F;
        return 10 + (at.x < 32 ? kNoise * u : u);
    });
    double total = 0;
    std::array<RunningStats, 2> counts;
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            for (const int half : {0, 1}) {
                const int count = drawn.allocation().upto(drawn.allocation().block_of({x, y}), half, kEnd);
                total += count;
                const bool beside_the_other = std::abs(x - 32) < 3 * kBlock;
                if (!beside_the_other) counts[x < 32 ? 0 : 1].add(count);
            }
        }
    }
    EXPECT_NEAR(total / (size.x * size.y), kEnd, 0.01 * kEnd);
    EXPECT_NEAR(counts[0].mean() / counts[1].mean(), std::pow(double{kNoise}, 0.7), 0.3);
}

TEST(Allocation, WhereNothingVaries_AllGetAsMany) {
    for (const float light : {0.0F, 1.0F, 1e30F}) {
        const Drawn drawn({20, 12}, 1, 64,
                          [light](const V2i& /*at*/, Sampler& /*sampler*/) { return light; });
        for (int b = 0; b < drawn.allocation().blocks(); ++b) {
            for (const int half : {0, 1}) EXPECT_EQ(drawn.allocation().upto(b, half, 64), 32) << light;
        }
    }
}

TEST(Allocation, TakenUpAgain_IsTheSame) {
    const auto light = [](const V2i& at, Sampler& sampler) {
        return 1 + sampler.next() * static_cast<float>(at.x);
    };
    const Drawn drawn({21, 10}, 3, 48, light);
    Film film(21, 10, {1, false, true, true});
    SampleAllocation other(film);
    ASSERT_TRUE(other.restore(drawn.allocation().state()));
    for (int b = 0; b < other.blocks(); ++b) {
        for (const int end : {33, 40, 64})
            EXPECT_EQ(other.upto(b, 1, end), drawn.allocation().upto(b, 1, end));
    }
    auto cut = drawn.allocation().state();
    cut.pop_back();
    EXPECT_FALSE(other.restore(cut));
    Film larger(40, 10, {1, false, true, true});
    EXPECT_FALSE(SampleAllocation(larger).restore(drawn.allocation().state()));
}

// A room with a small bright lamp: any number of threads takes the same samples, and some pixels receive more
// than the minimum.
TEST(Allocation, OfAnImage_IsTheSameForAnyNumberOfThreads) {
    const auto image = [](int threads) {
        Job job = testing::make_job(testing::small_cornell(), testing::small_cornell_camera(40),
                                    PathSettings{}, 40);
        job.film.two_halves = job.film.adaptive = job.film.parts = true;
        Monitor silent;
        return render(job, {11, Workers{threads}}, silent);
    };
    const RenderResult one = image(1);
    for (const int threads : {2, 3}) {
        const RenderResult more = image(threads);
        EXPECT_EQ(one.image.data, more.image.data);
        EXPECT_EQ(one.denoised->data, more.denoised->data);
    }
    // The layers are weighted as the image is.
    const Image& parts = *one.parts;
    for (std::size_t i = 0; i < parts.data.size() / parts.channels.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (std::size_t part = 0; part < kLayers; ++part)
                sum += double{parts.data[parts.channels.size() * i + 6 * part + c]};
            const double whole = double{one.image.data[6 * i + c]};
            ASSERT_NEAR(sum, whole, 1e-6 * std::max(1.0, whole));
        }
    }
    float least = INFINITY, most = 0;
    double all = 0;
    for (const Image& half : one.denoiser_input->halves) {
        for (std::size_t i = 0; i < half.data.size() / kHalfChannels; ++i) {
            const float samples = half.data[kHalfChannels * i + kSamples];
            least = std::min(least, samples), most = std::max(most, samples);
            all += double{samples};
        }
    }
    EXPECT_LT(2 * least, most);
    EXPECT_NEAR(all / static_cast<double>(one.image.data.size() / 6), 40, 1);
}

}  // namespace allocation_test
}  // namespace lucerna
