// Final gather: whatever is computed ahead of time, the light is the same.
#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace {

struct Ahead {
    int precompute, lights;
    DirectMethod direct;
};

// The image's mean against path's; the noise of each is some 0.2 %.
TEST(FinalGather, AheadOfTimeOrNot_MeanWithinOnePercentOfPath) {
    Monitor silent;
    const auto mean = [&](const IntegratorSettings& settings, int spp) {
        const Job job =
            testing::make_job(testing::small_cornell(), testing::small_cornell_camera(24), settings, spp);
        return testing::mean_rgb(render(job, {7, Workers{}}, silent).image);
    };
    const Rgb truth = mean(PathSettings{}, 512);
    for (const Ahead& ahead :
         {Ahead{0, 0, DirectMethod::mc}, Ahead{4, 0, DirectMethod::mc}, Ahead{4, 4, DirectMethod::mc},
          Ahead{16, 1, DirectMethod::mc}, Ahead{4, 0, DirectMethod::map}}) {
        PhotonMapSettings settings;
        settings.photons = 300'000;
        settings.gather_rays = 8;
        settings.direct = ahead.direct;
        settings.precompute = ahead.precompute;
        settings.precompute_lights = ahead.lights;
        // The Direct map seen by the camera is dark along edges.
        const float within = ahead.direct == DirectMethod::map ? 0.03F : 0.01F;
        const Rgb seen = mean(settings, 32);
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(seen[c] / truth[c], 1, within)
                << "precompute " << ahead.precompute << ", lights " << ahead.lights << ", channel " << c;
        }
    }
}

TEST(FinalGather, OneThreadOrTwo_SameImage) {
    Monitor silent;
    PhotonMapSettings settings;
    settings.photons = 20'000;
    settings.boundary = Boundary::probes;
    settings.specular_below = 0.3F;
    const auto image = [&](int threads) {
        const Job job =
            testing::make_job(testing::small_cornell(), testing::small_cornell_camera(12), settings, 2);
        return render(job, {7, Workers{threads}}, silent).image.data;
    };
    EXPECT_EQ(image(1), image(2));
}

}  // namespace
}  // namespace lucerna
