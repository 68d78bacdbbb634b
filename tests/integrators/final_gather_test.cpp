// Tests that final gather yields the same light with and without precomputed irradiance.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "engine/integrators/integrator.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace final_gather_test {

using testing::SceneMaker;

struct Precomputed {
    int precompute;
    DirectMethod direct;
};

// Compares the image's mean with the path tracer's; the noise of each is some 0.2 %.
TEST(FinalGather, PrecomputedOrNot_MeanWithinOnePercentOfPath) {
    Monitor silent;
    const auto mean = [&](const IntegratorSettings& settings, int spp) {
        const Job job =
            testing::make_job(testing::small_cornell(), testing::small_cornell_camera(24), settings, spp);
        return testing::mean_rgb(render(job, {7, Workers{}}, silent).image);
    };
    const Rgb truth = mean(PathSettings{}, 512);
    for (const Precomputed& precomputed :
         {Precomputed{0, DirectMethod::mc}, Precomputed{4, DirectMethod::mc},
          Precomputed{16, DirectMethod::mc}, Precomputed{4, DirectMethod::map}}) {
        PhotonMapSettings settings;
        settings.photons = 150'000;
        settings.gather_rays = 8;
        settings.direct = precomputed.direct;
        settings.precompute = precomputed.precompute;
        // The Direct map seen by the camera is too dark along edges.
        const float within = precomputed.direct == DirectMethod::map ? 0.03F : 0.01F;
        const Rgb seen = mean(settings, 16);
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(seen[c] / truth[c], 1, within)
                << "precompute " << precomputed.precompute << ", channel " << c;
        }
    }
}

// Returns a wall with normals bent by 45°, by vertex normals or a relief, towards a light that grazes the
// floor. The floor is lit by the wall alone, which reflects by the bent normal: √2 of what the geometric
// normal would give.
Scene bent_wall(bool relief) {
    SceneMaker make;
    constexpr float kHalf = 0.70710678F;
    const auto grey = make.diffuse(Rgb(0.5F));
    make.quad({-2, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);               // floor
    const V3f ramp(0.5F * kHalf + 0.5F, 0.5F, 0.5F * kHalf + 0.5F);  // (1, 0, 1)/√2 in the frame of the wall
    const auto bent = make.material(DiffuseMaterial{RgbTexture::constant(Rgb(0.8F))},
                                    relief ? Relief{{}, RgbTexture::constant(Rgb(ramp))} : Relief{});
    make.quad({-2, 0, 0}, {4, 0, 0}, {0, 3, 0}, bent);  // faces +z
    if (!relief) make.last_mesh().n.assign(4, V3f(kHalf, 0, kHalf));
    make.light(make_distant_light(V3f(-kHalf, 0, -kHalf), Rgb(1), {V3f(0, 1, 1), 4}));
    return make.build();
}

TEST(FinalGather, BentNormals_SamePrecomputedOrNotAndByPath) {
    Monitor silent;
    const Workers workers{2};
    for (const bool relief : {false, true}) {
        const Scene scene = bent_wall(relief);
        const auto floor = [&](const IntegratorSettings& settings, int samples) {
            const testing::OnePass estimator(settings, {scene, 7, workers, silent});
            RunningStats stats;
            for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(samples); ++i) {
                Sampler sampler(7, Purpose::test, 0, i);
                const V2f u = sampler.next2();
                const V3f target(u.x - 0.5F, 0, 0.2F + 0.5F * u.y), eye(0, 1, 2);
                stats.add(static_cast<double>(estimator.Li({eye, (target - eye).normalized()}, sampler).x));
            }
            return stats;
        };
        const RunningStats path = floor(PathSettings{}, 100'000);
        ASSERT_GT(path.mean(), 10 * path.standard_error());
        for (const int precompute : {0, 4}) {
            PhotonMapSettings settings;
            settings.photons = 100'000;
            settings.precompute = precompute;
            const RunningStats found = floor(settings, 3000);
            EXPECT_NEAR(found.mean() / path.mean(), 1, 0.03)
                << "relief " << relief << ", precompute " << precompute;
            RecordProperty(fmt::format("relief{}precompute{}", int{relief}, precompute),
                           fmt::format("{:.3f}", found.mean() / path.mean()));
        }
    }
}

TEST(FinalGather, OneThreadOrTwo_SameImage) {
    Monitor silent;
    PhotonMapSettings settings;
    settings.photons = 20'000;
    settings.estimate.boundary = Boundary::probes;
    settings.specular_below = 0.3F;
    const auto image = [&](int threads) {
        const Job job =
            testing::make_job(testing::small_cornell(), testing::small_cornell_camera(12), settings, 2);
        return render(job, {7, Workers{threads}}, silent).image.data;
    };
    EXPECT_EQ(image(1), image(2));
}

}  // namespace final_gather_test
}  // namespace lucerna
