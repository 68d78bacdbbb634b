// VPLs in blocks and in a tree: what is stored, what it contributes, and whether choices are fair.
#include "engine/vpl/vpl_tree.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstring>
#include <vector>

#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/vpl/vpl_choice.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace vpl_tree_test {

using Grouping = VplStore::Grouping;
using Kind = LightReceiver::Kind;

enum class Cloud : std::uint8_t { surfaces, media, mixed, coincident, flat, kinds };

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
    light.in_medium = cloud == Cloud::media || (cloud == Cloud::mixed && sampler.next() < 0.5F);
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

// The same as the contribution estimate of a block's lane, from the light itself.
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
    const VplStore store(sets, Grouping::separate, Workers{2});
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
        const VplStore one(sets, Grouping::merged, Workers{1}), five(sets, Grouping::merged, Workers{5});
        ASSERT_EQ(one.blocks().size(), five.blocks().size());
        EXPECT_EQ(
            std::memcmp(one.blocks().data(), five.blocks().data(), one.blocks().size() * sizeof(VplBlock)),
            0);
    }
}

RC_GTEST_PROP(VplContribution, AnyLightAndPlace_IsWhatTheLightSaysItself, (std::uint32_t seed)) {
    Sampler sampler(seed, Purpose::test, 1, 0);
    const VplSets sets = cloud_of(Cloud::mixed, 40, seed);
    const VplStore store(sets, Grouping::merged, Workers{1});
    const LightReceiver at = random_receiver(sampler);
    const VplRange& range = store.range(0);
    for (std::uint32_t b = range.surfaces; b < range.end; ++b) {
        const ContributionEstimates estimate =
            estimate_contributions(store.blocks()[b], b >= range.media, at);
        for (std::uint32_t i = 0; i < kBlock; ++i) {
            const auto place = static_cast<std::uint32_t>(b * kBlock + i);
            const double expected = contribution_of(store.light(range, place), at);
            // Cosines near 0 are differences: so much of 1/d² is lost to rounding.
            const double scale = 1 / static_cast<double>((store.light(range, place).at.p - at.x).length2());
            RC_ASSERT(std::fabs(static_cast<double>(estimate[i]) - expected) <=
                      1e-4 * expected + 1e-6 * scale);
        }
    }
}

// --- the roulette of a loop

TEST(SampleByContribution, MeanOverItsNumber_IsTheSumOfAll) {
    Sampler sampler(3, Purpose::test, 0, 0);
    for (const std::size_t count : {1, 5, 16, 200, 9000}) {
        const VplStore store(cloud_of(Cloud::mixed, count, count), Grouping::merged, Workers{2});
        for (int k = 0; k < 8; ++k) {
            const LightReceiver at = random_receiver(sampler);
            // What stands for the values: as uneven as shadows make them.
            const auto lit = [](std::uint32_t place) { return place % 3 == 0 ? 0.0 : 1.0; };
            double truth = 0;
            for_each_contribution(
                store, store.range(0), 0, store.range(0).end, at,
                [&](std::uint32_t place, float w) { truth += lit(place) * static_cast<double>(w); });
            RunningStats stats;
            const int rays = 1 + k;
            for (int i = 0; i < 400; ++i) {
                double sum = 0;
                int taken = 0;
                const double u = (i + static_cast<double>(sampler.next())) / 400;
                sample_by_contribution(
                    store, store.range(0), at, rays, u, [&](std::uint32_t place, float chance, float w) {
                        sum += lit(place) * static_cast<double>(w) / static_cast<double>(chance);
                        ++taken;
                    });
                EXPECT_LE(taken, rays + 1);
                stats.add(sum);
            }
            EXPECT_TRUE(testing::agrees(stats, truth))
                << count << " lights: " << stats.mean() << " not " << truth;
            if (truth > 0 && stats.standard_error() < 0.01 * truth) {
                EXPECT_FALSE(testing::agrees(stats, 1.1 * truth));
            }
        }
    }
}

// --- the tree

class Drawing {
  public:
    Drawing(Cloud cloud, std::size_t count, std::uint64_t seed)
        : store(cloud_of(cloud, count, seed), Grouping::merged, Workers{2}), tree(store, Workers{2}) {}

    // The sum over draws of a value that is the estimate times 0 to 2, by a light's place.
    RunningStats estimate(const LightReceiver& at, std::uint32_t draws, int times, Sampler& sampler) const {
        RunningStats stats;
        for (int i = 0; i < times; ++i) {
            double sum = 0;
            tree.draw(store, at, draws, static_cast<double>(sampler.next()), [&](const VplTree::Drawn& d) {
                sum += static_cast<double>(d.weight) * static_cast<double>(d.estimate) * share(d.place);
            });
            stats.add(sum);
        }
        return stats;
    }
    double truth(const LightReceiver& at) const {
        double sum = 0;
        for_each_contribution(store, store.range(0), 0, store.range(0).end, at,
                              [&](std::uint32_t place, float estimate) {
                                  sum += static_cast<double>(estimate) * share(place);
                              });
        return sum;
    }
    static double share(std::uint32_t place) { return (place * 7 % 5) * 0.5; }

    VplStore store;
    VplTree tree;
};

TEST(VplTree, RandomPlaces_DrawsAgreeWithTheLoop) {
    Sampler sampler(4, Purpose::test, 0, 0);
    for (int c = 0; c < static_cast<int>(Cloud::kinds); ++c) {
        for (const std::size_t count : {1, 17, 300, 5000}) {
            const Drawing drawing(static_cast<Cloud>(c), count, count);
            for (int k = 0; k < 6; ++k) {
                const LightReceiver at = random_receiver(sampler);
                const RunningStats stats = drawing.estimate(at, 1 + 7 * (k % 3), 1000, sampler);
                const double truth = drawing.truth(at);
                EXPECT_TRUE(testing::agrees(stats, truth))
                    << "cloud " << c << ", " << count << " lights: " << stats.mean() << " ± "
                    << stats.standard_error() << ", not " << truth;
                if (truth > 0 && stats.standard_error() < 0.02 * truth) {
                    EXPECT_FALSE(testing::agrees(stats, 1.1 * truth));
                }
            }
        }
    }
}

TEST(VplTree, NothingThatShines_NothingIsDrawn) {
    const auto draws = [](const Drawing& drawing, const LightReceiver& at) {
        int count = 0;
        drawing.tree.draw(drawing.store, at, 8, 0.5, [&](const VplTree::Drawn&) { ++count; });
        return count;
    };
    LightReceiver below;
    below.x = {0.5F, -1, 0.5F};
    below.ns = below.ng = {0, 1, 0};
    EXPECT_EQ(draws(Drawing(Cloud::surfaces, 0, 1), below), 0);
    EXPECT_EQ(draws(Drawing(Cloud::flat, 1000, 1), below), 0);  // all face away
    LightReceiver above = below;
    above.x = {0.5F, 1, 0.5F};
    EXPECT_EQ(draws(Drawing(Cloud::flat, 1000, 1), above), 0);  // it looks away
    above.ns = above.ng = {0, -1, 0};
    EXPECT_GT(draws(Drawing(Cloud::flat, 1000, 1), above), 0);
    above.mindist = 10;
    EXPECT_EQ(draws(Drawing(Cloud::flat, 1000, 1), above), 0);  // all have faded
}

TEST(VplTree, EveryLightThatCanShine_CanBeDrawn) {
    Sampler sampler(5, Purpose::test, 0, 0);
    for (int c = 0; c < static_cast<int>(Cloud::kinds); ++c) {
        const Drawing drawing(static_cast<Cloud>(c), 2000, 6);
        for (int k = 0; k < 20; ++k) {
            const LightReceiver at = random_receiver(sampler);
            double sum = 0;
            for_each_contribution(drawing.store, drawing.store.range(0), 0, drawing.store.range(0).end, at,
                                  [&](std::uint32_t place, float) {
                                      const double p = drawing.tree.probability(drawing.store, at, place);
                                      EXPECT_GT(p, 0);
                                      sum += p;
                                  });
            EXPECT_LE(sum, 1 + 1e-5);  // less by what is drawn where bounds gave too much importance
        }
    }
}

TEST(VplTree, OneDraw_FollowsTheProbabilities) {
    Sampler sampler(6, Purpose::test, 0, 0);
    for (const Cloud cloud : {Cloud::surfaces, Cloud::media, Cloud::mixed}) {
        const Drawing drawing(cloud, 150, 7);
        const LightReceiver at = random_receiver(sampler);
        const auto places = static_cast<std::uint32_t>(drawing.store.range(0).end * kBlock);
        std::vector<std::uint64_t> seen(places + 1);
        constexpr int kDraws = 100'000;
        for (int i = 0; i < kDraws; ++i) {
            std::uint32_t found = places;
            drawing.tree.draw(drawing.store, at, 1, static_cast<double>(sampler.next()),
                              [&](const VplTree::Drawn& d) {
                                  found = d.place;
                                  const double p = drawing.tree.probability(drawing.store, at, d.place);
                                  EXPECT_NEAR(static_cast<double>(d.weight) * p, 1, 1e-4);
                              });
            ++seen[found];
        }
        std::vector<double> expected(places + 1), wrong(places + 1, 0.0);
        double left = 1, estimate = 0;
        for (std::uint32_t p = 0; p < places; ++p) {
            expected[p] = kDraws * drawing.tree.probability(drawing.store, at, p);
            left -= expected[p] / kDraws;
        }
        expected[places] = kDraws * std::max(left, 0.0);
        EXPECT_TRUE(testing::chi_square(seen, expected).accepted());
        // Chances in proportion to the contribution estimates are what bounds do not give.
        estimate = sum_of_contributions(drawing.store, at);
        for_each_contribution(
            drawing.store, drawing.store.range(0), 0, drawing.store.range(0).end, at,
            [&](std::uint32_t p, float w) { wrong[p] = kDraws * static_cast<double>(w) / estimate; });
        EXPECT_FALSE(testing::chi_square(seen, wrong).accepted());
    }
}

TEST(VplTree, AnyThreads_SameDraws) {
    const VplSets sets = cloud_of(Cloud::mixed, 30'000, 8);
    const VplStore store(sets, Grouping::merged, Workers{1});
    const VplTree one(store, Workers{1}), four(store, Workers{4});
    Sampler sampler(9, Purpose::test, 0, 0);
    for (int k = 0; k < 50; ++k) {
        const LightReceiver at = random_receiver(sampler);
        const auto u = static_cast<double>(sampler.next());
        std::vector<std::pair<std::uint32_t, float>> a, b;
        one.draw(store, at, 16, u, [&](const auto& d) { a.emplace_back(d.place, d.weight); });
        four.draw(store, at, 16, u, [&](const auto& d) { b.emplace_back(d.place, d.weight); });
        EXPECT_EQ(a, b);
    }
}

TEST(VplTree, AMillionLights_FortyFourBytesEach) {
    const Drawing drawing(Cloud::surfaces, 1'000'000, 10);
    const std::size_t bytes = drawing.store.bytes() + drawing.tree.bytes();
    EXPECT_LT(bytes, 44'000'000U);
    EXPECT_GT(bytes, 41'000'000U);
    Sampler sampler(11, Purpose::test, 0, 0);
    const LightReceiver at = random_receiver(sampler);
    const RunningStats stats = drawing.estimate(at, 16, 500, sampler);
    EXPECT_TRUE(testing::agrees(stats, drawing.truth(at)));
}

}  // namespace vpl_tree_test
}  // namespace lucerna
