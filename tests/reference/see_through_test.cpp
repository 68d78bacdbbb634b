// Compares VPLs with the path tracer where surfaces transmit light: straight on, through holes, diffusely to
// both sides and over rough glass (scenes/see-through).
#include <gtest/gtest.h>

#include "engine/pbrt/read_scene.h"
#include "tests/support/region_means.h"

namespace lucerna {
namespace see_through_test {

using testing::expect_agrees;
using testing::expect_differs;
using testing::region_means;
using testing::RegionMeans;

Job job_of(const std::string& scene, const std::string& integrator, int spp, const V2i& size) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.integrator = integrator;
    overrides.spp = spp;
    overrides.resolution = size;
    const std::filesystem::path root(LUCERNA_SOURCE_DIR);
    return read_scene(root / "scenes" / "see-through" / (scene + ".pbrt"), overrides, Workers{}, silent);
}

bool everywhere(double, double) {
    return true;
}

// Returns the illuminance at distance d from the axis of a disc of radius r and radiance L, at height h above
// a plane.
double below_a_disc(double radiance, double r, double h, double d) {
    const double sum = h * h + d * d + r * r;
    return M_PI * radiance / 2 * (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * r * r * d * d));
}

// Returns the mean over the patch that the camera of sheet.pbrt sees, 0.2 wide.
double below_the_sheet(double height) {
    constexpr int kCells = 64;
    RunningStats mean;
    const double half = 0.5 * std::tan(11.3 * M_PI / 180);
    for (int j = 0; j < kCells; ++j) {
        for (int i = 0; i < kCells; ++i) {
            const double x = half * (2 * (i + 0.5) / kCells - 1), y = half * (2 * (j + 0.5) / kCells - 1);
            mean.add(below_a_disc(10, 0.3, height, std::hypot(x, y)));
        }
    }
    return mean.mean();
}

TEST(SeeThrough, UnderASheetOfOpacityZero_IgiShowsTheLampsLight) {
    const double expected = below_the_sheet(2);
    EXPECT_NEAR(expected, 0.6891, 0.0001);
    for (const bool compensate : {false, true}) {
        Job job = job_of("sheet", "igi", 4, V2i(16, 16));
        IgiSettings& igi = std::get<IgiSettings>(job.integrator);
        igi.quantity = Quantity::illuminance;
        igi.gather_samples = compensate ? 1 : 0;
        const RegionMeans means = region_means(job, 6, everywhere, everywhere);
        EXPECT_LT(means.whole.standard_error(), 0.0025 * expected);
        EXPECT_NEAR(means.whole.mean() / expected, 1, 0.01) << "compensate " << compensate;
        EXPECT_GT(std::fabs(means.whole.mean() / below_the_sheet(1.95) - 1), 0.01)
            << "another lamp is detected";
        std::printf("compensate %d: %.4f ± %.4f\n", compensate, means.whole.mean() / expected,
                    means.whole.standard_error() / expected);
    }
}

// Compares the means of the image and of the floor in front of the sheet with `path` of the scene
// `reference`: by VPLs without a least distance, and with one and compensation.
void expect_igi_agrees(const std::string& scene, const std::string& reference) {
    const V2i size(24, 16);
    const auto part = [](double, double y) { return y < 0; };
    const auto means = [&](const std::string& of, const std::string& integrator, int spp) {
        return region_means(job_of(of, integrator, spp, size), 4, everywhere, part);
    };
    const RegionMeans path = means(reference, "path", 2048);
    const auto by_igi = [&](float mindist, bool compensate) {
        Job job = job_of(scene, "igi", 128, size);
        IgiSettings& igi = std::get<IgiSettings>(job.integrator);
        igi.nsets = 128;
        igi.mindist = mindist;
        igi.gather_samples = compensate ? 1 : 0;
        return region_means(job, 6, everywhere, part);
    };
    expect_agrees(by_igi(1e-6F, false), path, scene, 0.004);
    expect_agrees(by_igi(0.2F, true), path, scene + ", compensated", 0.004);
    expect_differs(means(reference, "direct", 64), path, scene + ", direct light alone");
}

TEST(SeeThrough, LeafWithHoles_IgiAgreesWithPath) {
    expect_igi_agrees("cut-out", "cut-out-alpha");
    expect_igi_agrees("cut-out-alpha", "cut-out-alpha");
}

TEST(SeeThrough, TranslucentSheet_IgiAgreesWithPath) {
    expect_igi_agrees("translucent", "translucent");
}

}  // namespace see_through_test
}  // namespace lucerna
