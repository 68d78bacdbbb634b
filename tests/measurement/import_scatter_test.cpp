// Compares the errors stated for an imported lamp with independent ray files of the lamp, each imported with
// the command's own choices: the uncertainty by replicates, and the error by held-out rays.
#include <gtest/gtest.h>

#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <numeric>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "lights/measurement/held_out.h"
#include "lights/measurement/lumigraph_fit.h"
#include "lights/measurement/ray_bootstrap.h"
#include "lights/measurement/ray_projection.h"
#include "lights/measurement/round_to_rays.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace import_scatter_test {

using testing::kFalseAlarm;

constexpr double kRadius = 0.01, kFlux = 100, kExponent = 10;

// Returns independent rays of a disc with the intensity cos^kExponent, as measurement `number` of the same
// lamp.
RaySet disc_rays(int count, std::uint32_t number) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = set.header_lumens = kFlux;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(21, Purpose::test, number, static_cast<std::uint64_t>(i));
        const V2d p = kRadius * V2d(square_to_disc(sampler.next2()));
        const V2f u = sampler.next2();
        const double z = std::pow(1 - double{u.x}, 1 / (kExponent + 1)), r = std::sqrt(1 - z * z);
        const double turn = 2 * M_PI * double{u.y};
        set.rays.push_back({V3f(V3d(p.x, p.y, 0)), V3f(V3d(r * std::cos(turn), r * std::sin(turn), z)),
                            static_cast<float>(kFlux / count)});
    }
    return set;
}

// Returns the irradiance at a point in front of a field from the emitted light max(0, h), scaled to the
// measured flux, by the midpoint rule over S and so without Monte Carlo noise.
double emitted_irradiance(const LightField& field, double gain, const V3d& at) {
    constexpr int kParts = 2;  // subdivisions of an interval
    const Rig& rig = field.rig();
    const V3d p = at - rig.centre;
    std::vector<double> place[2], width[2];
    for (int a = 0; a < 2; ++a) {
        for (int i = 0; i < rig.intervals(a) * kParts; ++i) {
            const double step = rig.spacing[a] / kParts;
            const double on_s = rig.s_coordinate.on_plane(rig.interval_edge_x(a, 0) + (i + 0.5) * step);
            place[a].push_back(on_s);
            width[a].push_back(step / rig.s_coordinate.slope(on_s));
        }
    }
    double sum = 0;
    for (std::size_t i = 0; i < place[0].size(); ++i) {
        for (std::size_t j = 0; j < place[1].size(); ++j) {
            const V2d on_s(place[0][i], place[1][j]), across = V2d(p.x, p.y) - on_s;
            const double r2 = across.length2() + sqr(p.z);
            const auto radiance = double{field.radiance(on_s, on_s + across * (rig.distance / p.z))};
            sum += radiance * sqr(p.z / r2) * width[0][i] * width[1][j];
        }
    }
    return gain * sum;
}

// Returns the mean over a square of 1.2 m, one metre in front of the lamp, on 6 x 6 points.
double mean_illuminance(const Lumigraph& lamp) {
    constexpr int kPoints = 6;
    double sum = 0;
    for (const Slab& slab : lamp.slabs()) {
        const double gain = slab.field.flux() / slab.field.clamped_flux({});
        for (int i = 0; i < kPoints * kPoints; ++i) {
            const auto at = [](int k) { return 1.2 * ((k + 0.5) / kPoints - 0.5); };
            sum += emitted_irradiance(slab.field, gain, {at(i % kPoints), at(i / kPoints), 1});
        }
    }
    return sum / (kPoints * kPoints);
}

// Imports the rays as `lucerna light import` does.
Lumigraph imported(const RaySet& set) {
    Monitor silent;
    return fit_lumigraph(set, {}, {}, silent).lamp;
}

// Tests by Fisher's F whether two variance estimates with the given degrees of freedom agree. It rejects a
// true agreement with probability kFalseAlarm.
bool one_variance(double a, double freedom_a, double b, double freedom_b) {
    const boost::math::fisher_f f(freedom_a, freedom_b);
    const double upper = cdf(complement(f, a / b));
    return std::min(upper, 1 - upper) > kFalseAlarm / 2;
}

// U is twice the standard deviation of replicates, and replicates must scatter as independent files do.
// Replicates of a quarter of the rays scatter more and must be rejected.
TEST(ImportScatter, Long_OfReplicates_IsThatOfIndependentRayFiles) {
    constexpr int kRays = 10'000, kFiles = 60, kSets = 8, kReplicates = 8;
    RunningStats files;
    double replicated = 0, of_a_quarter = 0;
    for (std::uint32_t m = 0; m < kFiles; ++m) {
        const RaySet set = disc_rays(kRays, m);
        files.add(mean_illuminance(imported(set)));
        if (m >= kSets) continue;
        const RaySet quarter = disc_rays(kRays / 4, m);
        RunningStats replicates, fewer;
        for (int b = 1; b <= kReplicates; ++b) {
            replicates.add(mean_illuminance(imported(resampled(set, {m, b, 0}, {}))));
            fewer.add(mean_illuminance(imported(resampled(quarter, {m, b, 0}, {}))));
        }
        replicated += replicates.variance() / kSets;
        of_a_quarter += fewer.variance() / kSets;
    }
    std::cout << "mean " << files.mean() << ", standard deviation of files " << std::sqrt(files.variance())
              << ", of replicates " << std::sqrt(replicated) << ", of replicates of a quarter of the rays "
              << std::sqrt(of_a_quarter) << "\n";
    constexpr int kFreedom = kSets * (kReplicates - 1);
    EXPECT_TRUE(one_variance(files.variance(), kFiles - 1, replicated, kFreedom));
    EXPECT_FALSE(one_variance(files.variance(), kFiles - 1, of_a_quarter, kFreedom));
}

// The errors that an import states are unbiased against fresh rays. Estimates by the rays that chose the
// resolution are biased and must be rejected: the least of many estimates is too small, and cells weighted by
// the very rays that are counted in them make it too large, which is the stronger effect.
TEST(ImportScatter, Long_ErrorsStated_AreNotTheLeastOfManyEstimates) {
    constexpr int kRays = 20'000, kFiles = 40, kFresh = 200'000;
    Monitor silent;
    const RaySet fresh = disc_rays(kFresh, 1000);
    std::vector<std::size_t> all(kFresh), those(kRays);
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::iota(those.begin(), those.end(), std::size_t{0});
    const std::vector<std::size_t> choosers = held_out_parts(those).choosing;
    RunningStats found, stated, chosen;
    for (std::uint32_t m = 0; m < kFiles; ++m) {
        const RaySet set = disc_rays(kRays, 100 + m);
        const RayPlanes planes = choose_planes(set, {}, {}, silent);
        const LightField exact = project_rays(set, planes.rig, {}, silent, planes.weights).field;
        const LightField field = rounded_to_rays(exact, set);
        const HeldOutRays choosing(set, choosers, kRays, planes.rig.centre.z, kRays);
        const double truth = total_error(HeldOutRays(fresh, all, kFresh, choosing).errors(field));
        const auto emitted = [&](std::vector<PlaneError> errors) {
            planes.judge->add_change(errors, exact, field, {});
            return total_error(errors);
        };
        found.add(truth);
        stated.add(emitted(planes.errors) - truth);
        chosen.add(emitted(choosing.find_errors(planes.rig, planes.weights, {}).errors) - truth);
    }
    std::cout << "found " << found.mean() << ", stated less found " << stated.mean() << " +- "
              << stated.standard_error() << ", by the rays that chose " << chosen.mean() << " +- "
              << chosen.standard_error() << "\n";
    EXPECT_GT(testing::t_test(stated, 0), kFalseAlarm);
    EXPECT_LT(testing::t_test(chosen, 0), kFalseAlarm);
    // This number of files suffices to tell the error from 0 and from twice itself.
    EXPECT_LT(5 * stated.standard_error(), found.mean());
}

}  // namespace import_scatter_test
}  // namespace lucerna
