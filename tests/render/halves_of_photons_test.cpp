// If both halves of the samples have photons of their own, the halves' errors are independent, and their mean
// loses nothing against one map of all photons.
#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "engine/integrators/integrator.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace halves_of_photons_test {

Scene room_with_glass() {
    return testing::small_cornell_with([](testing::SceneMaker& make) {
        make.sphere({0.3F, 0.4F, 0.4F}, 0.2F, make.material(DielectricMaterial{}));
    });
}
// All light but that of photons is nearly noise-free: there is nothing for virtual lights to illuminate.
Scene floor_before_mirror() {
    testing::SceneMaker make;
    make.quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, make.diffuse(Rgb(0.7F)));
    make.quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, make.material(MirrorMaterial{}));
    make.light(make_point_light({0.5F, 0.7F, 0.3F}, Rgb(1)));
    return make.build();
}

struct Case {
    const char* name;
    IntegratorSettings settings;
    Scene (*scene)() = room_with_glass;
    // Photons of a point light over one mirror are so well stratified that one sequence of all of them is
    // better than two of half the length.
    bool stratified = false;
};
std::vector<Case> cases() {
    PhotonMapSettings seen;
    seen.photons = 4'000;
    seen.direct = DirectMethod::map;
    seen.indirect = IndirectMethod::map;
    PhotonMapSettings wide = seen;
    wide.estimate.k = 0;
    wide.estimate.radius = 0.1F;
    PhotonMapSettings gather;
    gather.photons = 1'000;
    gather.gather_rays = 16;
    IgiSettings igi;
    igi.caustic_paths = 20'000;
    return {{"photonmap, maps seen", seen},
            {"photonmap, fixed radius", wide},
            {"photonmap, final gather", gather},
            {"igi", igi, floor_before_mirror, true}};
}

// The luminances of a small picture by the samples of either half, many per pixel, so that the remaining
// errors are the photons'.
using Picture = std::vector<double>;
std::array<Picture, 2> pictures(const Scene& scene, const Case& which, std::uint64_t seed, bool two_halves) {
    constexpr int kSize = 8, kSamples = 16;
    const Camera camera = testing::small_cornell_camera(kSize);
    const Workers workers{2};
    Monitor silent;
    const RenderContext context{scene, seed,      workers, silent, View{&camera, V2f(0.0F), V2f(kSize)},
                                {},    two_halves};
    OnceStatistics once;
    PassStatistics statistics;
    const auto session = make_integrator(which.settings)->begin(context, once);
    const auto estimator = session->pass(0, silent, statistics);
    std::array<Picture, 2> result;
    for (int half = 0; half < 2; ++half) {
        result[static_cast<std::size_t>(half)].resize(kSize * kSize);
        parallel_each(workers, kSize * kSize, 1, [&](std::size_t i) {
            const auto pixel = static_cast<int>(i);
            const V2f at(static_cast<float>(pixel % kSize) + 0.5F, static_cast<float>(pixel / kSize) + 0.5F);
            double sum = 0;
            for (std::uint32_t s = 0; s < kSamples; ++s) {
                Sampler sampler(seed, Purpose::test, static_cast<std::uint32_t>(half), i * kSamples + s);
                SampleAccount account;
                EyePath path = EyePath::begin(scene, camera.ray(at, V2f(0.5F)), quantity_of(which.settings),
                                              max_depth_of(which.settings), account);
                path.film = at;
                path.half = half;
                estimator->follow(path, sampler);
                sum += double{luminance(account.radiance())};
            }
            result[static_cast<std::size_t>(half)][i] = sum / kSamples;
        });
    }
    return result;
}

// Returns the correlation between the errors of both halves, by pairs of seeds: the picture and the bias,
// which all seeds share, cancel in their differences.
RunningStats correlation(const Scene& scene, const Case& which, bool two_halves) {
    constexpr std::uint64_t kPairs = 10;
    RunningStats correlations;
    for (std::uint64_t pair = 0; pair < kPairs; ++pair) {
        const auto a = pictures(scene, which, 2 * pair + 100, two_halves);
        const auto b = pictures(scene, which, 2 * pair + 101, two_halves);
        double of_both = 0, of_first = 0, of_second = 0;
        for (std::size_t i = 0; i < a[0].size(); ++i) {
            const double first = a[0][i] - b[0][i], second = a[1][i] - b[1][i];
            of_both += first * second, of_first += first * first, of_second += second * second;
        }
        correlations.add(of_both / std::sqrt(of_first * of_second));
    }
    return correlations;
}

TEST(HalvesOfPhotons, Long_ErrorsOfBothHalves_DoNotDependOnEachOther) {
    for (const Case& which : cases()) {
        SCOPED_TRACE(which.name);
        const Scene scene = which.scene();
        const RunningStats own = correlation(scene, which, true);
        EXPECT_GE(testing::t_test(own, 0), testing::kFalseAlarm) << own.mean();
        // The test must reject photons that all samples share.
        const RunningStats shared = correlation(scene, which, false);
        EXPECT_LT(testing::t_test(shared, 0), testing::kFalseAlarm) << shared.mean();
    }
}

// Accumulates over seeds a picture's mean luminance, and its squared difference from the mean of all, summed
// over pixels.
struct Spread {
    RunningStats mean, square;
    explicit Spread(const std::vector<Picture>& all) {
        std::vector<RunningStats> pixels(all[0].size());
        for (const Picture& picture : all) {
            double sum = 0;
            for (std::size_t i = 0; i < picture.size(); ++i) pixels[i].add(picture[i]), sum += picture[i];
            mean.add(sum / static_cast<double>(picture.size()));
        }
        for (const Picture& picture : all) {
            double sum = 0;
            for (std::size_t i = 0; i < picture.size(); ++i) sum += sqr(picture[i] - pixels[i].mean());
            square.add(sum);
        }
    }
};
double sigmas(const RunningStats& a, const RunningStats& b) {
    return std::fabs(a.mean() - b.mean()) / std::hypot(a.standard_error(), b.standard_error());
}

TEST(HalvesOfPhotons, Long_TheirMean_IsThatOfOneMapAndAsGood) {
    constexpr std::uint64_t kSeeds = 40;
    for (const Case& which : cases()) {
        SCOPED_TRACE(which.name);
        const Scene scene = which.scene();
        std::vector<Picture> of_one_map, of_halves, of_one_half;
        const auto mean = [](const std::array<Picture, 2>& of) {
            Picture sum = of[0];
            for (std::size_t i = 0; i < sum.size(); ++i) sum[i] = 0.5 * (sum[i] + of[1][i]);
            return sum;
        };
        for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
            of_one_map.push_back(mean(pictures(scene, which, 2 * seed + 1000, false)));
            const auto halves = pictures(scene, which, 2 * seed + 1001, true);
            of_halves.push_back(mean(halves));
            of_one_half.push_back(halves[0]);
        }
        const Spread one_map(of_one_map), halves(of_halves), one_half(of_one_half);
        EXPECT_LT(sigmas(one_map.mean, halves.mean), 4);
        if (!which.stratified) {
            EXPECT_LT(sigmas(one_map.square, halves.square), 4);
        }
        // Half of the photons are measurably worse.
        EXPECT_GT(sigmas(one_map.square, one_half.square), 4);
        EXPECT_GT(sigmas(halves.square, one_half.square), 4);
    }
}

RenderResult rendered(const Case& which, int threads, bool two_halves = true) {
    Job job = testing::make_job(which.scene(), testing::small_cornell_camera(32), which.settings, 4);
    job.film.two_halves = two_halves;
    Monitor silent;
    return render(job, {11, Workers{threads}}, silent);
}

TEST(HalvesOfPhotons, AnyNumberOfThreads_SameBits) {
    for (const Case& which : cases()) {
        SCOPED_TRACE(which.name);
        const RenderResult one = rendered(which, 1), three = rendered(which, 3);
        EXPECT_EQ(one.image.data, three.image.data);
        EXPECT_EQ(one.denoised->data, three.denoised->data);
    }
}

TEST(HalvesOfPhotons, Counts_AreThoseOfBothTogether) {
    const auto agree = [](const Case& which, const char* name) {
        const double one = rendered(which, 2, false).report.numbers().at(name);
        const double two = rendered(which, 2, true).report.numbers().at(name);
        // The counts scatter about as a Poisson process does.
        EXPECT_LT(std::fabs(one - two), 6 * std::sqrt(one + two)) << name << ": " << one << ", " << two;
        EXPECT_GT(one, 100) << name;
    };
    EXPECT_EQ(rendered(cases()[2], 2).report.numbers().at("paths.emitted"), 1'000);
    agree(cases()[2], "photons.global.stored");
    agree(cases()[2], "irradiance.points");
    EXPECT_EQ(rendered(cases()[3], 2).report.numbers().at("photons.caustic.paths"), 20'000);
    agree(cases()[3], "photons.caustic.stored");
}

}  // namespace halves_of_photons_test
}  // namespace lucerna
