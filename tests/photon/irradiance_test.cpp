// Tests precomputed irradiance: where its points may lie, and which point a lookup finds.
#include "photon/irradiance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "photon/photon_map.h"
#include "tests/support/photons.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace irradiance_test {

using testing::kUp;
using testing::SceneMaker;
using testing::uniform_map;

constexpr int kPhotons = 20'000;
constexpr int kStride = 4;
constexpr DensityEstimateSettings kSettings{
    40, 0.3F, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};

SurfacePoints random_places(std::size_t n, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 1, 0);
    SurfacePoints places;
    for (std::size_t i = 0; i < n; ++i) {
        const V2f at = sampler.next2();
        places.add({V3f(at.x, at.y, 0), kUp, 0}, static_cast<std::uint32_t>(i));
    }
    return places;
}

SurfacePoints every_nth_photon(const PhotonMap& map) {
    SurfacePoints places;
    for (std::size_t i = 0; i < map.size(); i += kStride) {
        places.add({map.positions()[i], kUp, 0}, static_cast<std::uint32_t>(i));
    }
    return places;
}

V3f inner_place(Sampler& sampler) {
    return {0.2F + 0.6F * sampler.next(), 0.2F + 0.6F * sampler.next(), 0};
}

double mean_looked_up(const PhotonMap& map, const SurfacePoints& places, std::uint64_t seed) {
    Monitor silent;
    const PhotonMap* maps[] = {&map};
    const IrradiancePoints points(places, {maps, kSettings}, Workers{2}, silent);
    Sampler sampler(seed, Purpose::test, 2, 0);
    RunningStats looked_up;
    for (int i = 0; i < 1000; ++i) {
        const V3f x = inner_place(sampler);
        const auto found = points.nearest(x, kUp, 0.2F);
        looked_up.add(static_cast<double>(
            found ? found->irradiance.x : DensityEstimate(map, kSettings).irradiance({x, kUp, 0}).value.x));
    }
    return looked_up.mean();
}

// Returns the estimate at photon `own` from all other photons.
double without(const PhotonMap& map, std::uint32_t own) {
    const V3f& x = map.positions()[own];
    const TangentMetric metric(x, kUp, kSettings.metric, kSettings.ratio);
    const NearPhotons near(map, x, metric, static_cast<std::size_t>(kSettings.k) + 1, sqr(kSettings.radius));
    double sum = 0;
    for (const Neighbour& n : near.found()) {
        if (n.index == own) continue;
        sum += static_cast<double>(map.photons()[n.index].power.x *
                                   kernel(kSettings.kernel, n.key / near.radius2()));
    }
    return sum / static_cast<double>(near.radius2());
}

struct LeftOut {
    double at_photons, looked_up;
};
LeftOut mean_left_out(const PhotonMap& map, std::uint64_t seed) {
    std::vector<double> values;
    RunningStats at_photons;
    for (std::uint32_t i = 0; i < map.size(); i += kStride) {
        values.push_back(without(map, i));
        const V3f& p = map.positions()[i];
        if (std::max(std::fabs(p.x - 0.5F), std::fabs(p.y - 0.5F)) < 0.3F) at_photons.add(values.back());
    }
    Sampler sampler(seed, Purpose::test, 2, 0);
    RunningStats looked_up;
    for (int i = 0; i < 1000; ++i) {
        const V3f x = inner_place(sampler);
        std::size_t best = 0;
        float best2 = INFINITY;
        for (std::size_t j = 0; j < values.size(); ++j) {
            const float r2 = (map.positions()[j * kStride] - x).length2();
            if (!(r2 < best2)) continue;
            best2 = r2;
            best = j;
        }
        looked_up.add(values[best]);
    }
    return {at_photons.mean(), looked_up.mean()};
}

// Looks up a uniform irradiance of 1 at places independent of the photons. Points that are independent of the
// photons, too, are unbiased. Points at photons are too bright if the photon itself counts, though by less
// than the 2/k expected at the photon. If it does not count they are unbiased at the photon but too dark when
// looked up, because points with few photons around are nearest to more places.
TEST(IrradiancePoints, LookedUpOnAUniformFloor_UnbiasedOnlyIfTheyAreNotThePhotons) {
    RunningStats others, themselves, left_out, left_out_at_photons;
    for (std::uint64_t seed = 0; seed < 24; ++seed) {
        const PhotonMap map = uniform_map(kPhotons, seed);
        others.add(mean_looked_up(map, random_places(kPhotons / kStride, seed), seed));
        themselves.add(mean_looked_up(map, every_nth_photon(map), seed));
        const LeftOut left = mean_left_out(map, seed);
        left_out.add(left.looked_up);
        left_out_at_photons.add(left.at_photons);
    }
    EXPECT_TRUE(testing::agrees(others, 1)) << others.mean() << " ± " << others.standard_error();
    EXPECT_TRUE(testing::agrees(left_out_at_photons, 1)) << left_out_at_photons.mean();
    EXPECT_FALSE(testing::agrees(themselves, 1)) << themselves.mean() << " ± " << themselves.standard_error();
    EXPECT_FALSE(testing::agrees(left_out, 1)) << left_out.mean() << " ± " << left_out.standard_error();
    EXPECT_GT(themselves.mean(), 1);
    EXPECT_LT(left_out.mean(), 1);
    RecordProperty("others", fmt::format("{:.4f} ± {:.4f}", others.mean(), others.standard_error()));
    RecordProperty("themselves", fmt::format("{:.4f}", themselves.mean()));
    RecordProperty("left_out", fmt::format("{:.4f}", left_out.mean()));
}

TEST(IrradiancePoints, Lookup_OnlyOnItsSideAndWithinItsDisc) {
    Monitor silent;
    const PhotonMap map = uniform_map(kPhotons, 1);
    const PhotonMap* maps[] = {&map};
    const IrradiancePoints points(random_places(5000, 1), {maps, kSettings}, Workers{2}, silent);
    EXPECT_EQ(points.size(), 5000U);
    EXPECT_TRUE(points.nearest(V3f(0.5F, 0.5F, 0), kUp, 0.1F));
    EXPECT_FALSE(points.nearest(V3f(0.5F, 0.5F, 0), -kUp, 0.1F));
    EXPECT_FALSE(points.nearest(V3f(0.5F, 0.5F, 1), kUp, 0.1F));
    // Discs of 40 photons in 20,000 have a radius of 0.025.
    EXPECT_FALSE(points.nearest(V3f(0.5F, 0.5F, 0.09F), kUp, 0.1F));
}

// Light from a lamp 4 cm away changes within a centimetre; where the lamp contributes a tenth, the sum is
// nearly constant up to ten times as far away.
TEST(IrradiancePoints, BesideANearLamp_AreLookedUpNearby) {
    Monitor silent;
    const PhotonMap map = uniform_map(kPhotons, 1);
    const PhotonMap* maps[] = {&map};
    SurfacePoints one;
    one.add({V3f(0.5F, 0.5F, 0), kUp, 0}, 0);
    const auto found_at = [&](float distance, float share, float lamp) {
        const auto near = [&](std::uint32_t, const SurfacePoint& at, IncidentLightSum& light) {
            light.add(Rgb(1e6F), at.n);  // outweighs the photons
            return NearLight{share * 1e6F, lamp};
        };
        const IrradiancePoints points(one, {maps, kSettings, {}, near}, Workers{1}, silent);
        return points.nearest(V3f(0.5F + distance, 0.5F, 0), kUp, 1).has_value();
    };
    // Its disc has a radius of 0.025.
    EXPECT_TRUE(found_at(0.009F, 1, 0.04F));
    EXPECT_FALSE(found_at(0.011F, 1, 0.04F));
    EXPECT_TRUE(found_at(0.015F, 0.5F, 0.04F));
    EXPECT_TRUE(found_at(0.02F, 0.1F, 0.04F));
    EXPECT_TRUE(found_at(0.02F, 1, 0.5F));
    EXPECT_TRUE(found_at(0.02F, 0, 1e-6F));
    EXPECT_FALSE(found_at(0.04F, 1, 0.5F)) << "beyond the disc";
}

// Returns photons of paths of 0 to 9 bounces, whose power depends on the number of bounces.
PhotonMap map_of_many_bounces() {
    Sampler sampler(5, Purpose::test, 0, 0);
    Photons deposited;
    for (int i = 0; i < kPhotons; ++i) {
        const V3f p(sampler.next(), sampler.next(), 0);
        const auto bounces = static_cast<std::uint32_t>(i % 10);
        const float power = static_cast<float>(1 + bounces) / kPhotons;
        deposited.add(p, PackedDirection(kUp),
                      testing::photon(-square_to_cosine_hemisphere(sampler.next2()), power),
                      kept_bounces(bounces));
    }
    return PhotonMap(deposited, IndexKind::tree, Workers{1});
}

// Points that count photons of up to 7 bounces return the light of shorter paths as points do that count only
// those; for paths shorter than the stored range they return nothing.
TEST(IrradiancePoints, ShorterPaths_BringTheShareThatAnEstimateOfTheirsFinds) {
    const PhotonMap map = map_of_many_bounces();
    const PhotonMap* maps[] = {&map};
    Monitor silent;
    const SurfacePoints places = random_places(200, 9);
    const auto points_of = [&](int most_bounces) {
        DensityEstimateSettings how = kSettings;
        how.most_bounces = most_bounces;
        return IrradiancePoints(places, {maps, how}, Workers{2}, silent);
    };
    const IrradiancePoints all = points_of(7);
    double worst = 0, longest = 0;
    for (int most = 1; most <= 7; ++most) {
        const IrradiancePoints own = points_of(most);
        for (std::size_t i = 0; i < places.size(); ++i) {
            const auto found = all.nearest(places.positions[i], kUp, 0.2F, most);
            const auto expected = own.nearest(places.positions[i], kUp, 0.2F, most);
            ASSERT_TRUE(found && expected);
            const float sum = luminance(found->irradiance), part = luminance(expected->irradiance);
            worst = std::max(worst, std::fabs(double{found->share * sum - part}) / double{sum});
            longest = std::max(longest, std::fabs(double{sum - part}) / double{sum});
        }
    }
    EXPECT_LT(worst, 2e-5);
    EXPECT_GT(longest, 0.5) << "without the shares most would be wrong by much";
    EXPECT_FALSE(all.nearest(places.positions[0], kUp, 0.2F, 0)) << "seven bounces fewer are not kept";
}

// A bounce that rounding sends elsewhere adds or removes a point: the random light of the other points must
// not depend on how many come before them.
TEST(IrradiancePoints, OnePlaceLess_ChangesNothingAtTheOthers) {
    Monitor silent;
    const PhotonMap map = uniform_map(kPhotons, 3);
    const PhotonMap* maps[] = {&map};
    const auto by_chance = [](std::uint32_t number, const SurfacePoint& at, IncidentLightSum& light) {
        light.add(Rgb(Sampler(1, Purpose::test, 0, number).next()), at.n);
        return NearLight{};
    };
    const IrradianceSources sources{maps, kSettings, {}, by_chance};
    const SurfacePoints places = random_places(200, 5);
    SurfacePoints fewer;
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (i != 17) fewer.add(places[i], places.numbers[i]);
    }
    const IrradiancePoints all(places, sources, Workers{2}, silent);
    const IrradiancePoints rest(fewer, sources, Workers{2}, silent);
    for (std::size_t i = 0; i < fewer.size(); ++i) {
        const auto a = all.nearest(fewer.positions[i], kUp, 0.2F),
                   b = rest.nearest(fewer.positions[i], kUp, 0.2F);
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->irradiance, b->irradiance) << i;
    }
}

TEST(BounceOn, FromAFloor_LandsOnTheCeilingAndNotOnTheMirror) {
    SceneMaker make;
    make.quad({-500, -500, 1}, {0, 1000, 0}, {1000, 0, 0}, make.diffuse(Rgb(0.5F)));  // ceiling, facing down
    const auto mirror = make.material(MirrorMaterial{});
    make.quad({-500, 2, -1}, {0, 0, 2}, {1000, 0, 0}, mirror);  // a wall beside the floor
    const Scene scene = make.build();
    const PhotonMap map = uniform_map(5000, 3);
    const SurfacePoints places = bounce_on(scene, map, {2, 1, 0}, Workers{2});
    EXPECT_NEAR(static_cast<double>(places.size()), 2500, 5 * std::sqrt(1250.0));
    for (std::size_t i = 0; i < places.size(); ++i) {
        EXPECT_NEAR(places.positions[i].z, 1, 1e-5F);
        EXPECT_LT(places.normals[i].unpack().z, -0.999F);
    }
    const SurfacePoints from_each = bounce_on(scene, map, {1, 1, 0}, Workers{2});
    EXPECT_EQ(from_each.size(), 5000U);
    const SurfacePoints again = bounce_on(scene, map, {2, 1, 0}, Workers{1});
    EXPECT_EQ(again.positions, places.positions);
    EXPECT_NE(bounce_on(scene, map, {2, 1, 1}, Workers{1}).positions, places.positions);
}

// Rounding may change the order of all photons of a map, and the place of one of them.
TEST(BounceOn, PhotonsInAnotherOrderAndOneLess_LeadToTheSamePlaces) {
    SceneMaker make;
    make.quad({-500, -500, 1}, {0, 1000, 0}, {1000, 0, 0}, make.diffuse(Rgb(0.5F)));
    const Scene scene = make.build();
    const PhotonMap map = uniform_map(2000, 3);
    Photons others;
    for (std::size_t i = map.size(); i-- > 1;) {
        others.add(map.positions()[i], map.normals()[i], map.photons()[i]);
    }
    const PhotonMap fewer(others, IndexKind::tree, Workers{1});
    const auto found = [&](const PhotonMap& from) {
        const SurfacePoints places = bounce_on(scene, from, {4, 1, 0}, Workers{2});
        std::set<std::pair<std::uint32_t, float>> all;
        for (std::size_t i = 0; i < places.size(); ++i)
            all.insert({places.numbers[i], places.positions[i].x});
        return all;
    };
    const auto a = found(map), b = found(fewer);
    EXPECT_GT(b.size(), 400U);
    std::vector<std::pair<std::uint32_t, float>> apart;
    std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(apart));
    EXPECT_LE(apart.size(), 1U);
}

}  // namespace irradiance_test
}  // namespace lucerna
