// Virtual lights in blocks and in a tree: what is kept, what it is worth, and whether choices are fair.
#include "photon/virtual_light_tree.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstring>
#include <vector>

#include "engine/base/frame.h"
#include "engine/base/warp.h"
#include "photon/virtual_light_choice.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace virtual_light_tree_test {

using Keep = VirtualLightStore::Keep;
using Kind = LightReceiver::Kind;

enum class Cloud : std::uint8_t { surfaces, media, mixed, coincident, flat, kinds };

V3f random_point(Stream& stream) {
    const V2f a = stream.next2();
    return {a.x, a.y, stream.next()};
}
V3f random_direction(Stream& stream) {
    return square_to_sphere(stream.next2()).normalized();
}

VirtualLight random_light(Stream& stream, Cloud cloud) {
    VirtualLight light;
    light.at.p = cloud == Cloud::coincident ? V3f(0.5F, 0.25F, 0.125F) : random_point(stream);
    if (cloud == Cloud::flat) light.at.p.y = 0;
    light.contribution = Rgb(0.1F + stream.next(), 0.1F + stream.next(), stream.next());
    light.in_medium = cloud == Cloud::media || (cloud == Cloud::mixed && stream.next() < 0.5F);
    const V3f d = cloud == Cloud::flat ? V3f(0, 1, 0) : random_direction(stream);
    if (light.in_medium) {
        light.d = d;
        light.g = 1.2F * stream.next() - 0.6F;
    } else {
        light.at.n = d;
        light.at.error = 1e-7F;
    }
    return light;
}

VirtualLightSets cloud_of(Cloud cloud, std::size_t count, std::uint64_t seed) {
    Stream stream(seed, Purpose::test, 0, 0);
    VirtualLightSets sets;
    for (std::size_t i = 0; i < count; ++i) sets.lights.push_back(random_light(stream, cloud));
    sets.begins = {0, static_cast<std::uint32_t>(count)};
    return sets;
}

LightReceiver random_receiver(Stream& stream) {
    LightReceiver at;
    at.x = 1.4F * random_point(stream) - V3f(0.2F);
    if (stream.next() < 0.3F) {
        at.kind = Kind::medium;
        at.wo = random_direction(stream);
        at.phase_g = 1.6F * stream.next() - 0.8F;
    } else {
        const V3f n = random_direction(stream);
        at.through = stream.next() < 0.2F;
        if (!at.through) at.ng = n;
        at.ns = (n + 0.3F * random_direction(stream)).normalized();
        at.below = stream.next() < 0.5F ? 0.0F : -1.0F;
    }
    at.weight = {0.2F, 0.7F, 0.1F};
    if (stream.next() < 0.5F) at.mindist = 0.3F * stream.next();
    return at;
}

// The same as the worth of a block's lane, from the light itself.
double worth_of(const VirtualLight& light, const LightReceiver& at) {
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

double sum_of_worths(const VirtualLightStore& store, const LightReceiver& at) {
    double sum = 0;
    for_each_worth(store, store.range(0), store.range(0).surfaces, store.range(0).end, at,
                   [&](std::uint32_t, float worth) { sum += static_cast<double>(worth); });
    return sum;
}

// --- the store

TEST(VirtualLightStore, EveryLight_IsKeptOnceInItsSet) {
    VirtualLightSets sets = cloud_of(Cloud::mixed, 1000, 1);
    sets.begins = {0, 1, 1, 40, 500, 1000};  // one light, none, few, many
    const VirtualLightStore store(sets, Keep::apart, Workers{2});
    ASSERT_EQ(store.sets(), 5U);
    const auto key = [](const VirtualLight& l) {
        return std::array<float, 11>{l.at.p.x, l.at.p.y, l.at.p.z,   l.at.n.x,         l.at.n.y,        l.d.x,
                                     l.d.y,    l.g,      l.at.error, l.contribution.x, l.contribution.z};
    };
    for (std::size_t s = 0; s < 5; ++s) {
        std::vector<std::array<float, 11>> kept, given;
        for (std::uint32_t i = sets.begins[s]; i < sets.begins[s + 1]; ++i)
            given.push_back(key(sets.lights[i]));
        const VirtualLightRange& range = store.range(s);
        for (auto place = static_cast<std::uint32_t>(range.surfaces * kBlock); place < range.end * kBlock;
             ++place) {
            const VirtualLight light = store.light(range, place);
            if (!is_black(light.contribution)) kept.push_back(key(light));
        }
        std::sort(kept.begin(), kept.end());
        std::sort(given.begin(), given.end());
        EXPECT_EQ(kept, given) << "set " << s;
    }
}

TEST(VirtualLightStore, AnyThreads_SameBlocks) {
    for (const Cloud cloud : {Cloud::mixed, Cloud::coincident, Cloud::flat}) {
        const VirtualLightSets sets = cloud_of(cloud, 50'000, 2);
        const VirtualLightStore one(sets, Keep::together, Workers{1}), five(sets, Keep::together, Workers{5});
        ASSERT_EQ(one.blocks().size(), five.blocks().size());
        EXPECT_EQ(std::memcmp(one.blocks().data(), five.blocks().data(),
                              one.blocks().size() * sizeof(VirtualLightBlock)),
                  0);
    }
}

RC_GTEST_PROP(VirtualLightWorth, AnyLightAndPlace_IsWhatTheLightSaysItself, (std::uint32_t seed)) {
    Stream stream(seed, Purpose::test, 1, 0);
    const VirtualLightSets sets = cloud_of(Cloud::mixed, 40, seed);
    const VirtualLightStore store(sets, Keep::together, Workers{1});
    const LightReceiver at = random_receiver(stream);
    const VirtualLightRange& range = store.range(0);
    for (std::uint32_t b = range.surfaces; b < range.end; ++b) {
        const Worths worth = worths(store.blocks()[b], b >= range.media, at);
        for (std::uint32_t i = 0; i < kBlock; ++i) {
            const auto place = static_cast<std::uint32_t>(b * kBlock + i);
            const double expected = worth_of(store.light(range, place), at);
            // Cosines near 0 are differences: so much of 1/d² is lost to rounding.
            const double scale = 1 / static_cast<double>((store.light(range, place).at.p - at.x).length2());
            RC_ASSERT(std::fabs(static_cast<double>(worth[i]) - expected) <= 1e-4 * expected + 1e-6 * scale);
        }
    }
}

// --- the roulette of a loop

TEST(TakeByWorth, MeanOverItsNumber_IsTheSumOfAll) {
    Stream stream(3, Purpose::test, 0, 0);
    for (const std::size_t count : {1, 5, 16, 200, 9000}) {
        const VirtualLightStore store(cloud_of(Cloud::mixed, count, count), Keep::together, Workers{2});
        for (int k = 0; k < 8; ++k) {
            const LightReceiver at = random_receiver(stream);
            // What stands for the values: as uneven as shadows make them.
            const auto lit = [](std::uint32_t place) { return place % 3 == 0 ? 0.0 : 1.0; };
            double truth = 0;
            for_each_worth(
                store, store.range(0), 0, store.range(0).end, at,
                [&](std::uint32_t place, float w) { truth += lit(place) * static_cast<double>(w); });
            RunningStats stats;
            const int rays = 1 + k;
            for (int i = 0; i < 400; ++i) {
                double sum = 0;
                int taken = 0;
                const double u = (i + static_cast<double>(stream.next())) / 400;
                take_by_worth(store, store.range(0), at, rays, u,
                              [&](std::uint32_t place, float chance, float w) {
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
        : store(cloud_of(cloud, count, seed), Keep::together, Workers{2}), tree(store, Workers{2}) {}

    // The sum over draws of a value that is `worth` times 0 to 2, by a light's place.
    RunningStats estimate(const LightReceiver& at, std::uint32_t draws, int times, Stream& stream) const {
        RunningStats stats;
        for (int i = 0; i < times; ++i) {
            double sum = 0;
            tree.draw(
                store, at, draws, static_cast<double>(stream.next()), [&](const VirtualLightTree::Drawn& d) {
                    sum += static_cast<double>(d.weight) * static_cast<double>(d.worth) * share(d.place);
                });
            stats.add(sum);
        }
        return stats;
    }
    double truth(const LightReceiver& at) const {
        double sum = 0;
        for_each_worth(
            store, store.range(0), 0, store.range(0).end, at,
            [&](std::uint32_t place, float worth) { sum += static_cast<double>(worth) * share(place); });
        return sum;
    }
    static double share(std::uint32_t place) { return (place * 7 % 5) * 0.5; }

    VirtualLightStore store;
    VirtualLightTree tree;
};

TEST(VirtualLightTree, RandomPlaces_DrawsAgreeWithTheLoop) {
    Stream stream(4, Purpose::test, 0, 0);
    for (int c = 0; c < static_cast<int>(Cloud::kinds); ++c) {
        for (const std::size_t count : {1, 17, 300, 5000}) {
            const Drawing drawing(static_cast<Cloud>(c), count, count);
            for (int k = 0; k < 6; ++k) {
                const LightReceiver at = random_receiver(stream);
                const RunningStats stats = drawing.estimate(at, 1 + 7 * (k % 3), 1000, stream);
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

TEST(VirtualLightTree, NothingThatShines_NothingIsDrawn) {
    const auto draws = [](const Drawing& drawing, const LightReceiver& at) {
        int count = 0;
        drawing.tree.draw(drawing.store, at, 8, 0.5, [&](const VirtualLightTree::Drawn&) { ++count; });
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

TEST(VirtualLightTree, EveryLightThatCanShine_CanBeDrawn) {
    Stream stream(5, Purpose::test, 0, 0);
    for (int c = 0; c < static_cast<int>(Cloud::kinds); ++c) {
        const Drawing drawing(static_cast<Cloud>(c), 2000, 6);
        for (int k = 0; k < 20; ++k) {
            const LightReceiver at = random_receiver(stream);
            double sum = 0;
            for_each_worth(drawing.store, drawing.store.range(0), 0, drawing.store.range(0).end, at,
                           [&](std::uint32_t place, float) {
                               const double p = drawing.tree.probability(drawing.store, at, place);
                               EXPECT_GT(p, 0);
                               sum += p;
                           });
            EXPECT_LE(sum, 1 + 1e-5);  // less by what is drawn where bounds promised too much
        }
    }
}

TEST(VirtualLightTree, OneDraw_FollowsTheProbabilities) {
    Stream stream(6, Purpose::test, 0, 0);
    for (const Cloud cloud : {Cloud::surfaces, Cloud::media, Cloud::mixed}) {
        const Drawing drawing(cloud, 150, 7);
        const LightReceiver at = random_receiver(stream);
        const auto places = static_cast<std::uint32_t>(drawing.store.range(0).end * kBlock);
        std::vector<std::uint64_t> seen(places + 1);
        constexpr int kDraws = 100'000;
        for (int i = 0; i < kDraws; ++i) {
            std::uint32_t found = places;
            drawing.tree.draw(drawing.store, at, 1, static_cast<double>(stream.next()),
                              [&](const VirtualLightTree::Drawn& d) {
                                  found = d.place;
                                  const double p = drawing.tree.probability(drawing.store, at, d.place);
                                  EXPECT_NEAR(static_cast<double>(d.weight) * p, 1, 1e-4);
                              });
            ++seen[found];
        }
        std::vector<double> expected(places + 1), wrong(places + 1, 0.0);
        double left = 1, worth = 0;
        for (std::uint32_t p = 0; p < places; ++p) {
            expected[p] = kDraws * drawing.tree.probability(drawing.store, at, p);
            left -= expected[p] / kDraws;
        }
        expected[places] = kDraws * std::max(left, 0.0);
        EXPECT_TRUE(testing::chi_square(seen, expected).accepted());
        // Chances in proportion to the worths are what bounds do not give.
        worth = sum_of_worths(drawing.store, at);
        for_each_worth(drawing.store, drawing.store.range(0), 0, drawing.store.range(0).end, at,
                       [&](std::uint32_t p, float w) { wrong[p] = kDraws * static_cast<double>(w) / worth; });
        EXPECT_FALSE(testing::chi_square(seen, wrong).accepted());
    }
}

TEST(VirtualLightTree, AnyThreads_SameDraws) {
    const VirtualLightSets sets = cloud_of(Cloud::mixed, 30'000, 8);
    const VirtualLightStore store(sets, Keep::together, Workers{1});
    const VirtualLightTree one(store, Workers{1}), four(store, Workers{4});
    Stream stream(9, Purpose::test, 0, 0);
    for (int k = 0; k < 50; ++k) {
        const LightReceiver at = random_receiver(stream);
        const auto u = static_cast<double>(stream.next());
        std::vector<std::pair<std::uint32_t, float>> a, b;
        one.draw(store, at, 16, u, [&](const auto& d) { a.emplace_back(d.place, d.weight); });
        four.draw(store, at, 16, u, [&](const auto& d) { b.emplace_back(d.place, d.weight); });
        EXPECT_EQ(a, b);
    }
}

TEST(VirtualLightTree, AMillionLights_FortyThreeBytesEach) {
    const Drawing drawing(Cloud::surfaces, 1'000'000, 10);
    const std::size_t bytes = drawing.store.bytes() + drawing.tree.bytes();
    EXPECT_LT(bytes, 43'000'000U);
    EXPECT_GT(bytes, 40'000'000U);
    Stream stream(11, Purpose::test, 0, 0);
    const LightReceiver at = random_receiver(stream);
    const RunningStats stats = drawing.estimate(at, 16, 500, stream);
    EXPECT_TRUE(testing::agrees(stats, drawing.truth(at)));
}

}  // namespace virtual_light_tree_test
}  // namespace lucerna
