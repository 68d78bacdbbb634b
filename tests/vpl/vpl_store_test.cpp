// Tests how VPLs are stored, the estimates of their contributions, and the roulette that selects among them.
#include "engine/vpl/vpl_store.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/vpl/vpl_choice.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace vpl_store_test {

using Kind = LightReceiver::Kind;

enum class Cloud : std::uint8_t { mixed, coincident, flat };

V3f random_point(Sampler& sampler) {
    const V2f a = sampler.next2();
    return {a.x, a.y, sampler.next()};
}
V3f random_direction(Sampler& sampler) {
    return square_to_sphere(sampler.next2()).normalized();
}

Vpl random_light(Sampler& sampler, Cloud cloud) {
    Vpl light;
    light.at.p = cloud == Cloud::coincident ? V3f(0.5F, 0.25F, 0.125F) : random_point(sampler);
    if (cloud == Cloud::flat) light.at.p.y = 0;
    light.contribution = Rgb(0.1F + sampler.next(), 0.1F + sampler.next(), sampler.next());
    light.in_medium = cloud == Cloud::mixed && sampler.next() < 0.5F;
    const V3f d = cloud == Cloud::flat ? V3f(0, 1, 0) : random_direction(sampler);
    if (light.in_medium) {
        light.d = d;
        light.g = 1.2F * sampler.next() - 0.6F;
    } else {
        light.at.n = d;
        light.at.error = 1e-7F;
    }
    return light;
}

VplSets cloud_of(Cloud cloud, std::size_t count, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    VplSets sets;
    for (std::size_t i = 0; i < count; ++i) sets.lights.push_back(random_light(sampler, cloud));
    sets.begins = {0, static_cast<std::uint32_t>(count)};
    return sets;
}

LightReceiver random_receiver(Sampler& sampler) {
    LightReceiver at;
    at.x = 1.4F * random_point(sampler) - V3f(0.2F);
    if (sampler.next() < 0.3F) {
        at.kind = Kind::medium;
        at.wo = random_direction(sampler);
        at.phase_g = 1.6F * sampler.next() - 0.8F;
    } else {
        const V3f n = random_direction(sampler);
        at.through = sampler.next() < 0.2F;
        if (!at.through) at.ng = n;
        at.ns = (n + 0.3F * random_direction(sampler)).normalized();
        at.below = sampler.next() < 0.5F ? 0.0F : -1.0F;
    }
    at.weight = {0.2F, 0.7F, 0.1F};
    if (sampler.next() < 0.5F) at.mindist = 0.3F * sampler.next();
    return at;
}

// Computes the same as the contribution estimate of a block's lane, from the VPL itself.
double contribution_of(const Vpl& light, const LightReceiver& at) {
    const V3f way = light.at.p - at.x;
    const float d2 = way.length2();
    if (!(d2 > 1e-30F)) return 0;
    const V3f w = way / std::sqrt(d2);
    float received;
    if (at.kind == Kind::medium) {
        received = HenyeyGreenstein(at.phase_g).value(at.wo, w);
    } else {
        const float cosine = at.ns.dot(w);
        received = cosine >= 0 ? cosine : at.below * cosine;
        if (!at.through && !(at.ng.dot(w) > 0)) received = 0;
    }
    const float min2 = sqr(at.mindist), low = 0.8F * min2, high = 1.2F * min2;
    float fade = 1;
    if (d2 <= low) fade = 0;
    if (d2 > low && d2 < high) fade = sqr((d2 - low) / (high - low)) * (3 - 2 * (d2 - low) / (high - low));
    const Rgb c = at.weight * light.contribution;
    return static_cast<double>((c.x + c.y + c.z) * light.towards(-w) * received * fade / d2);
}

double sum_of_contributions(const VplStore& store, const LightReceiver& at) {
    double sum = 0;
    for_each_contribution(store, store.range(0), store.range(0).surfaces, store.range(0).end, at,
                          [&](std::uint32_t, float estimate) { sum += static_cast<double>(estimate); });
    return sum;
}

// --- the store

TEST(VplStore, EveryLight_IsKeptOnceInItsSet) {
    VplSets sets = cloud_of(Cloud::mixed, 1000, 1);
    sets.begins = {0, 1, 1, 40, 500, 1000};  // one light, none, few, many
    const VplStore store(sets, Workers{2});
    ASSERT_EQ(store.sets(), 5U);
    const auto key = [](const Vpl& l) {
        return std::array<float, 11>{l.at.p.x, l.at.p.y, l.at.p.z,   l.at.n.x,         l.at.n.y,        l.d.x,
                                     l.d.y,    l.g,      l.at.error, l.contribution.x, l.contribution.z};
    };
    for (std::size_t s = 0; s < 5; ++s) {
        std::vector<std::array<float, 11>> kept, given;
        for (std::uint32_t i = sets.begins[s]; i < sets.begins[s + 1]; ++i)
            given.push_back(key(sets.lights[i]));
        const VplRange& range = store.range(s);
        for (auto place = static_cast<std::uint32_t>(range.surfaces * kBlock); place < range.end * kBlock;
             ++place) {
            const Vpl light = store.light(range, place);
            if (!is_black(light.contribution)) kept.push_back(key(light));
        }
        std::sort(kept.begin(), kept.end());
        std::sort(given.begin(), given.end());
        EXPECT_EQ(kept, given) << "set " << s;
    }
}

TEST(VplStore, AnyThreads_SameBlocks) {
    for (const Cloud cloud : {Cloud::mixed, Cloud::coincident, Cloud::flat}) {
        const VplSets sets = cloud_of(cloud, 50'000, 2);
        const VplStore one(sets, Workers{1}), five(sets, Workers{5});
        ASSERT_EQ(one.blocks().size(), five.blocks().size());
        EXPECT_EQ(
            std::memcmp(one.blocks().data(), five.blocks().data(), one.blocks().size() * sizeof(VplBlock)),
            0);
    }
}

RC_GTEST_PROP(VplContribution, AnyLightAndPlace_IsWhatTheLightSaysItself, (std::uint32_t seed)) {
    Sampler sampler(seed, Purpose::test, 1, 0);
    const VplSets sets = cloud_of(Cloud::mixed, 40, seed);
    const VplStore store(sets, Workers{1});
    const LightReceiver at = random_receiver(sampler);
    const VplRange& range = store.range(0);
    for (std::uint32_t b = range.surfaces; b < range.end; ++b) {
        const ContributionEstimates estimate =
            estimate_contributions(store.blocks()[b], b >= range.media, at);
        for (std::uint32_t i = 0; i < kBlock; ++i) {
            const auto place = static_cast<std::uint32_t>(b * kBlock + i);
            const double expected = contribution_of(store.light(range, place), at);
            // Cosines near 0 are differences, which lose this share of 1/d² to rounding.
            const double scale = 1 / static_cast<double>((store.light(range, place).at.p - at.x).length2());
            RC_ASSERT(std::fabs(static_cast<double>(estimate[i]) - expected) <=
                      1e-4 * expected + 1e-6 * scale);
        }
    }
}

// --- the roulette of a loop

// Represents the visibility, as uneven as shadows make it.
double lit(std::uint32_t place) {
    return place % 3 == 2 ? 0 : 1;
}

// Estimates the light of all lit VPLs, from about `rays` of them. Each of the replicates is the mean over
// stratified numbers. Of few VPLs, the one that is taken most rarely matters, so there are more replicates.
RunningStats sampled_sums(const VplStore& store, const LightReceiver& at, int rays, Sampler& sampler) {
    constexpr int kStrata = 20;
    const int replicates = store.range(0).end < 100 ? 1000 : 20;
    RunningStats stats;
    for (int replicate = 0; replicate < replicates; ++replicate) {
        double mean = 0;
        for (int i = 0; i < kStrata; ++i) {
            int taken = 0;
            const double u = (i + static_cast<double>(sampler.next())) / kStrata;
            sample_by_contribution(
                store, store.range(0), at, rays, u, [&](std::uint32_t place, float chance, float w) {
                    mean += lit(place) * static_cast<double>(w) / static_cast<double>(chance) / kStrata;
                    ++taken;
                });
            EXPECT_LE(taken, rays + 1);
        }
        stats.add(mean);
    }
    return stats;
}

TEST(SampleByContribution, MeanOverItsNumber_IsTheSumOfAll) {
    constexpr std::array<std::size_t, 5> kCounts{1, 5, 16, 200, 9000};
    constexpr int kReceivers = 8;
    // All comparisons together fail with probability kFalseAlarm, and float32 rounds by less than 1e-6.
    const auto is_mean = [&](const RunningStats& stats, double truth) {
        return std::fabs(stats.mean() - truth) <= 1e-6 * truth ||
               testing::t_test(stats, truth) >= testing::kFalseAlarm / (kCounts.size() * kReceivers);
    };
    Sampler sampler(3, Purpose::test, 0, 0);
    int reached = 0, rejected = 0;
    for (const std::size_t count : kCounts) {
        const VplStore store(cloud_of(Cloud::mixed, count, count), Workers{2});
        for (int k = 0; k < kReceivers; ++k) {
            const LightReceiver at = random_receiver(sampler);
            double truth = 0;
            for_each_contribution(
                store, store.range(0), 0, store.range(0).end, at,
                [&](std::uint32_t place, float w) { truth += lit(place) * static_cast<double>(w); });
            const RunningStats stats = sampled_sums(store, at, 1 + k, sampler);
            EXPECT_TRUE(is_mean(stats, truth)) << count << " lights: " << stats.mean() << " not " << truth;
            if (!(truth > 0)) continue;
            ++reached;
            rejected += !is_mean(stats, 1.1 * truth);
        }
    }
    EXPECT_GE(reached, 30) << "receivers that light reaches";
    EXPECT_GE(rejected, 20) << "means that are wrong by a tenth";
}

}  // namespace vpl_store_test
}  // namespace lucerna
