// Tests boundary bias: known irradiance on surfaces with edges.
#include "photon/probes.h"

#include <gtest/gtest.h>

#include "engine/base/vec.h"
#include "photon/density_estimate.h"
#include "tests/support/photons.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace boundary_test {

using testing::kUp;
using testing::photon;
using testing::SceneMaker;
using testing::uniform_map;

Scene unit_square() {
    SceneMaker make;
    make.quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, make.diffuse(Rgb(0.5F)));
    return make.build();
}

struct Where {
    const char* name;
    V3f begin, end;      // a line of equivalent places
    double uncorrected;  // estimate without correction; exact is 1
    double probes;       // largest error with probes
};

// The disc's radius is some 0.08, for 100 of 5000 photons.
const Where kWheres[] = {{"middle", {0.3F, 0.4F, 0}, {0.7F, 0.5F, 0}, 1, 0.01},
                         {"edge", {0.0F, 0.3F, 0}, {0.0F, 0.7F, 0}, 0.5, 0.03},
                         {"near the edge", {0.02F, 0.3F, 0}, {0.02F, 0.7F, 0}, 0.65, 0.04},
                         {"corner", {0.0F, 0.0F, 0}, {0.001F, 0.001F, 0}, 0.25, 0.05}};

class UnitSquare : public ::testing::TestWithParam<KernelShape> {};

TEST_P(UnitSquare, MiddleEdgeAndCorner_ProbesMendWhatIsLost) {
    const Scene scene = unit_square();
    constexpr Boundary kBoundaries[] = {Boundary::none, Boundary::probes};
    RunningStats stats[std::size(kWheres)][2];
    for (std::uint64_t seed = 0; seed < 150; ++seed) {
        const PhotonMap map = uniform_map(5000, seed);
        for (std::size_t w = 0; w < std::size(kWheres); ++w) {
            for (int i = 0; i < 6; ++i) {
                const V3f x =
                    kWheres[w].begin + static_cast<float>(i) / 5 * (kWheres[w].end - kWheres[w].begin);
                for (int b = 0; b < 2; ++b) {
                    const DensityEstimateSettings settings{
                        100, 1, 2, GetParam(), MetricKind::projected, kBoundaries[b]};
                    const SurfacePoint at{x, kUp, surface_error(x, 1)};
                    const Probing probing{
                        scene, Sampler(seed, Purpose::test, 1, w * 6 + static_cast<std::size_t>(i))};
                    stats[w][b].add(
                        static_cast<double>(DensityEstimate(map, settings, probing).irradiance(at).value.x));
                }
            }
        }
    }
    for (std::size_t w = 0; w < std::size(kWheres); ++w) {
        const Where& where = kWheres[w];
        const double none = stats[w][0].mean(), probes = stats[w][1].mean();
        EXPECT_NEAR(none, where.uncorrected, where.uncorrected == 0.65 ? 0.06 : 0.02) << where.name;
        EXPECT_NEAR(probes, 1, where.probes) << where.name;
        RecordProperty(where.name, fmt::format("none {:.4f} probes {:.4f} ± {:.2f}", none, probes,
                                               std::sqrt(stats[w][1].variance())));
    }
}

INSTANTIATE_TEST_SUITE_P(Kernels, UnitSquare,
                         ::testing::Values(KernelShape::constant, KernelShape::cone,
                                           KernelShape::epanechnikov));

// 400 photons lie on a disc of radius 0.1, and the estimate's radius is 0.15: half of its disc is empty.
TEST(SmallDisc, RadiusBeyondIt_ProbesMendWhatIsLost) {
    constexpr float kDisc = 0.1F;
    SceneMaker make;
    Quadric& disk = make.sphere(V3f(0.0F), kDisc, make.diffuse(Rgb(0.5F)));
    disk.kind = Quadric::Kind::disk;
    const Scene scene = make.build();
    for (const float distance : {0.0F, 0.05F, 0.0999F}) {
        RunningStats none, probes;
        for (std::uint64_t seed = 0; seed < 400; ++seed) {
            Sampler sampler(seed, Purpose::test, 5, 0);
            Photons deposited;
            for (int i = 0; i < 400; ++i) {
                const V2f p = kDisc * square_to_disc(sampler.next2());
                deposited.add({p.x, p.y, 0}, PackedDirection(kUp),
                              photon(-square_to_cosine_hemisphere(sampler.next2()),
                                     kPi * sqr(kDisc) / 400));  // irradiance 1
            }
            const PhotonMap map(deposited);
            const SurfacePoint at{{distance, 0, 0}, kUp, 1e-6F};
            DensityEstimateSettings settings{
                0, 0.15F, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
            const auto add = [&](Boundary boundary, RunningStats& stats) {
                settings.boundary = boundary;
                const Probing probing{scene, Sampler(seed, Purpose::test, 6, 0)};
                stats.add(
                    static_cast<double>(DensityEstimate(map, settings, probing).irradiance(at).value.x));
            };
            add(Boundary::none, none);
            add(Boundary::probes, probes);
        }
        EXPECT_LT(none.mean(), 0.75) << distance;
        EXPECT_NEAR(probes.mean(), 1, 0.07) << distance;
        RecordProperty(fmt::format("at{:.2f}", distance),
                       fmt::format("none {:.4f} probes {:.4f}", none.mean(), probes.mean()));
    }
}

// Computes, on a grid, the share of the kernel's disc through which photons along d are stored where the
// metric counts them, in the corner of a floor (x > 0) and a wall (z > 0).
double corner_share(const V3f& x, const V3f& d, const TangentMetric& metric, float r2) {
    constexpr int kSide = 64;
    int counted = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
        const V2f u((static_cast<float>(i % kSide) + 0.5F) / kSide,
                    (std::floor(static_cast<float>(i) / kSide) + 0.5F) / kSide);
        const float rho = std::sqrt((1 - std::sqrt(1 - u.x)) * r2), phi = 2 * kPi * u.y;  // Epanechnikov's
        V3f p = x + V3f(rho * std::cos(phi), rho * std::sin(phi), 0);
        if (p.x < 0) p -= p.x / d.x * d;  // on the wall, above
        counted += metric(p, d, (p - x).length2()) <= 1.01F * r2;
    }
    return static_cast<double>(counted) / (kSide * kSide);
}

// In a concave corner the wall's photons fill the disc, except those so high up that the metric excludes
// them: the probes find that share missing.
TEST(ConcaveCorner, Probes_FindTheDiscFilledByTheWall) {
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(0.5F));
    make.quad({0, -5, 0}, {5, 0, 0}, {0, 10, 0}, grey);  // floor, x > 0
    make.quad({0, -5, 0}, {0, 10, 0}, {0, 0, 5}, grey);  // wall, z > 0
    const Scene scene = make.build();
    Sampler sampler(1, Purpose::test, 6, 0);
    RunningStats found, exact;
    constexpr float kRadius2 = 0.01F;
    const V3f x(0.02F, 0, 0);
    const TangentMetric metric(x, kUp, MetricKind::projected, 4);
    for (int i = 0; i < 2000; ++i) {
        V3f d = -square_to_cosine_hemisphere(sampler.next2());
        d.x = -std::fabs(d.x);  // from the half of the sky that the wall leaves
        const ProbedPhoton photon{x, d};
        const ProbeNumbers chance{sampler.next(), sampler.next2()};
        const ProbedDisc disc{x, kUp, kRadius2, metric.ball2(kRadius2), KernelShape::epanechnikov, 0};
        found.add(static_cast<double>(probe(scene, disc, metric, {&photon, 1}, chance).share));
        exact.add(corner_share(x, d, metric, kRadius2));
    }
    EXPECT_LT(exact.mean(), 0.99);
    EXPECT_NEAR(found.mean(), exact.mean(), 0.004);
    RecordProperty("shares", fmt::format("{:.4f}, exact {:.4f}", found.mean(), exact.mean()));
}

// Photons on a shelf above a floor project onto the floor, and leak there unless a ray tests whether they are
// visible from it. Photons on the far side of a thin wall leak in the same way.
TEST(HiddenPhotons, UnderAShelfAndBehindAThinWall_CountOnlyWithoutProbes) {
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(0.5F));
    make.quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, grey);    // floor
    make.quad({-5, -5, 0.1F}, {4, 0, 0}, {0, 10, 0}, grey);  // shelf, x < -1
    make.quad({1, -5, 0}, {0, 10, 0}, {0, 0, 5}, grey);      // wall at x = 1
    const Scene scene = make.build();
    Sampler sampler(1, Purpose::test, 7, 0);
    Photons deposited;
    for (int i = 0; i < 20'000; ++i) {
        const V2f u = sampler.next2();
        const V3f d = V3f(-0.3F, 0.1F, -1).normalized();
        const float y = 4 * u.y - 2;
        if (i % 2 == 0) {
            deposited.add({-1 - 2 * u.x, y, 0.1F}, PackedDirection(kUp), photon(d, 4e-4F));  // on the shelf
        } else {
            deposited.add({1 + 2 * u.x, y, 0}, PackedDirection(kUp), photon(d, 4e-4F));  // beyond the wall
        }
    }
    const PhotonMap map(deposited);
    const Probing probing{scene, sampler.split(1)};
    DensityEstimateSettings settings{
        0, 0.2F, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
    for (const V3f& x : {V3f(-2, 0, 0), V3f(0.95F, 0, 0)}) {
        const SurfacePoint at{x, kUp, surface_error(x, 1)};
        settings.boundary = Boundary::none;
        EXPECT_GT(DensityEstimate(map, settings, probing).irradiance(at).value.x, 0.1F) << x.x;
        settings.boundary = Boundary::probes;
        EXPECT_EQ(DensityEstimate(map, settings, probing).irradiance(at).value.x, 0) << x.x;
    }
    // On their own surfaces they count fully.
    for (const V3f& x : {V3f(-2, 0, 0.1F), V3f(2, 0, 0)}) {
        const SurfacePoint at{x, kUp, surface_error(x, 1)};
        EXPECT_NEAR(DensityEstimate(map, settings, probing).irradiance(at).value.x, 0.5F, 0.1F) << x.x;
    }
}

// On a wide, tilted plane the disc of a narrow spot is hardly larger than the error of the plane in float32,
// or smaller. The plane has no edge nearby, so probes must change nothing.
TEST(Probes, DiscNearTheSurfacesError_OnATiltedPlane_ChangesNothing) {
    const V3f n = V3f(1, 2, 3).normalized();
    const Frame frame(n);
    SceneMaker make;
    make.quad(-100.0F * frame.s - 100.0F * frame.t, 200.0F * frame.s, 200.0F * frame.t,
              make.diffuse(Rgb(0.5F)));
    const Scene scene = make.build();
    const V3f middle = 31.0F * frame.s - 17.0F * frame.t;
    const auto hit = scene.intersect({middle + n, -n});
    ASSERT_TRUE(hit);
    for (const float flat : {0.0F, 0.95F}) {  // light from all around, and along the plane
        for (const float errors : {1.0F, 2.0F, 5.0F, 20.0F, 100.0F, 1000.0F}) {
            const float radius = errors * hit->at.error;
            Sampler sampler(1, Purpose::test, 8, 0);
            Photons deposited;
            while (deposited.size() < 4000) {
                const V2f u = 3 * radius * square_to_disc(sampler.next2());
                V3f d = -square_to_cosine_hemisphere(sampler.next2());
                d = frame.to_world(V3f(d.x + 20 * flat, d.y, d.z)).normalized();
                const auto found = scene.intersect({middle + u.x * frame.s + u.y * frame.t - d, d});
                if (found) deposited.add(found->at.p, PackedDirection(n), photon(d, 1));
            }
            const PhotonMap map(deposited);
            RunningStats ratio;
            for (std::uint64_t i = 0; i < 100; ++i) {
                const Probing probing{scene, Sampler(2, Purpose::test, 8, i)};
                DensityEstimateSettings settings{
                    0, radius, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
                const SurfacePoint at{hit->at.p, n, hit->at.error};
                const float none = DensityEstimate(map, settings, probing).irradiance(at).value.x;
                settings.boundary = Boundary::probes;
                ASSERT_GT(none, 0);
                ratio.add(static_cast<double>(DensityEstimate(map, settings, probing).irradiance(at).value.x /
                                              none));
            }
            EXPECT_NEAR(ratio.mean(), 1, 0.03) << errors << " errors, flat " << flat;
        }
    }
}

}  // namespace boundary_test
}  // namespace lucerna
