// Tests passes of photon maps: their mean and variance against closed forms, with the rates that theory
// predicts.
#include <gtest/gtest.h>

#include <array>

#include "engine/integrators/integrator.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "photon/radius_schedule.h"
#include "tests/support/eye_paths.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace progressive_test {

using testing::SceneMaker;

// Makes the passes of a scene.
class Passes {
  public:
    Passes(Scene scene, const ProgressiveSettings& settings, std::uint64_t seed) : scene_(std::move(scene)) {
        OnceStatistics once;
        session_ = make_integrator(settings)->begin({scene_, seed, workers_, silent_}, once);
    }
    std::unique_ptr<const Estimator> pass(std::uint32_t number) {
        PassStatistics statistics;
        return session_->pass(number, silent_, statistics);
    }

    // Returns the radiance that the estimator of a pass finds along a camera ray.
    Rgb seen(const Estimator& estimator, const Ray& ray, Sampler& sampler) const {
        return testing::seen_along(estimator, scene_, ray, sampler);
    }

  private:
    Scene scene_;
    Workers workers_{1};
    Monitor silent_;
    std::unique_ptr<const Session> session_;
};

// --- bias: a point light over a floor ---

constexpr float kAlbedo = 0.5F;

// Returns a light of intensity 1 at height 1: irradiance (1 + ρ²)^(-3/2) at distance ρ from the point below.
Scene lamp_over_floor() {
    SceneMaker make;
    make.quad({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, make.diffuse(Rgb(kAlbedo)));
    make.light(make_point_light({0, 1, 0}, Rgb(1.0F)));
    return make.build();
}

// Returns the mean of an estimate of radius r below the lamp: the irradiance blurred by Epanechnikov's
// kernel, 2 ∫ (1-t) (1 + r² t)^(-3/2) dt with t = (ρ/r)², about 1 - r²/2.
double blurred_irradiance(double r2) {
    constexpr int kSteps = 2000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps;
        sum += 2 * (1 - t) * std::pow(1 + r2 * t, -1.5) / kSteps;
    }
    return sum;
}

ProgressiveSettings of_direct_map(float alpha) {
    ProgressiveSettings settings;
    settings.samples = 1;
    settings.photons = 3000;
    settings.direct = DirectMethod::map;
    settings.estimate.boundary = Boundary::none;
    settings.estimate.radius = 0.6F;
    settings.alpha = alpha;
    return settings;
}

// Returns the irradiance below the lamp in each of the first passes.
std::vector<double> irradiances(const ProgressiveSettings& settings, int passes) {
    Passes all(lamp_over_floor(), settings, 5);
    std::vector<double> values;
    for (int i = 0; i < passes; ++i) {
        Sampler sampler(1, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const Rgb seen =
            all.seen(*all.pass(static_cast<std::uint32_t>(i)), {{0, 0.5F, 0}, {0, -1, 0}}, sampler);
        values.push_back(double{seen.x} * M_PI / double{kAlbedo});
    }
    return values;
}

RunningStats first(const std::vector<double>& values, int n) {
    RunningStats stats;
    for (int i = 0; i < n; ++i) stats.add(values[static_cast<std::size_t>(i)]);
    return stats;
}

// Returns the expected mean of n passes.
double predicted_mean(double alpha, double first_r2, int n) {
    const RadiusSchedule schedule(alpha);
    double sum = 0;
    for (int i = 0; i < n; ++i)
        sum += blurred_irradiance(first_r2 * schedule.r2_ratio(static_cast<std::uint32_t>(i)));
    return sum / n;
}

TEST(Progressive, LampOverFloor_BiasFallsAsPredicted) {
    constexpr int kPasses = 400;
    const std::vector<double> values = irradiances(of_direct_map(2.0F / 3), kPasses);
    for (const int n : {10, 30, 100, kPasses}) {
        const RunningStats mean = first(values, n);
        EXPECT_TRUE(testing::agrees(mean, predicted_mean(2.0 / 3, 0.36, n)))
            << n << " passes: " << mean.mean() << " ± " << mean.standard_error();
    }
    // To first order the bias is that of one pass times bias_of_mean().
    const RadiusSchedule schedule(2.0 / 3);
    const double bias = 1 - first(values, kPasses).mean();
    EXPECT_NEAR(bias / (0.5 * 0.36 * schedule.bias_of_mean(kPasses)), 1, 0.15);

    // The test rejects a constant radius and other rates.
    const RunningStats all = first(values, kPasses);
    EXPECT_FALSE(testing::agrees(all, predicted_mean(1, 0.36, kPasses)));
    EXPECT_FALSE(testing::agrees(all, predicted_mean(0.8, 0.36, kPasses)));
    EXPECT_FALSE(testing::agrees(all, predicted_mean(0.5, 0.36, kPasses)));
    EXPECT_FALSE(testing::agrees(all, 1)) << "so few passes still have a bias";
}

TEST(Progressive, LampOverFloor_AlphaOneKeepsItsBias) {
    constexpr int kPasses = 200;
    const std::vector<double> values = irradiances(of_direct_map(1), kPasses);
    EXPECT_TRUE(testing::agrees(first(values, kPasses), blurred_irradiance(0.36)));
    EXPECT_LT(first(values, kPasses).mean(), 0.87);
}

// --- variance: the integrating sphere ---

// Returns rays from a point inside, in all directions.
std::vector<Ray> rays_all_over(int n) {
    std::vector<Ray> rays;
    Sampler sampler(3, Purpose::test, 0, 0);
    for (int i = 0; i < n; ++i) {
        const V2f u = sampler.next2();
        const float z = 1 - 2 * u.x, s = std::sqrt(std::max(0.0F, 1 - z * z)), phi = 2 * kPi * u.y;
        rays.push_back({{0.2F, -0.1F, 0.1F}, {s * std::cos(phi), s * std::sin(phi), z}});
    }
    return rays;
}

// Returns the mean squared relative error over the rays after each number of passes.
std::vector<double> square_errors(const ProgressiveSettings& settings, const std::vector<int>& after,
                                  std::uint64_t seed) {
    constexpr float kFlux = 12;
    const double truth = 0.5 / M_PI * double{kFlux} / (4 * M_PI) / 0.5;
    Passes all(testing::integrating_sphere(0.5F, kFlux), settings, seed);
    const std::vector<Ray> rays = rays_all_over(300);
    std::vector<double> sums(rays.size()), errors;
    for (int pass = 0; pass < after.back(); ++pass) {
        const auto estimator = all.pass(static_cast<std::uint32_t>(pass));
        for (std::size_t i = 0; i < rays.size(); ++i) {
            Sampler sampler(2, Purpose::test, static_cast<std::uint32_t>(pass), i);
            sums[i] += double{all.seen(*estimator, rays[i], sampler).x};
        }
        if (std::find(after.begin(), after.end(), pass + 1) == after.end()) continue;
        double square = 0;
        for (const double sum : sums)
            square += sqr(sum / (pass + 1) / truth - 1) / static_cast<double>(sums.size());
        errors.push_back(square);
    }
    return errors;
}

// The sphere's irradiance is uniform, and Euclidean distances measure its area exactly (a cap's area is π
// chord²), so there is no bias, and the error is variance alone. The first radius is that of the local
// density.
//
// Rays that share photons have correlated errors: the squared error of one render scatters by 10 to 20 %. The
// uncertainty of the mean over renders is estimated from that scatter.
class VarianceOfPasses {
  public:
    explicit VarianceOfPasses(float alpha) {
        ProgressiveSettings settings;
        settings.photons = 2000;
        settings.samples = 1;
        settings.estimate.k = 40;
        settings.estimate.metric = MetricKind::euclidean;
        settings.estimate.boundary = Boundary::none;
        settings.alpha = alpha;
        for (std::uint64_t seed = 0; seed < 32; ++seed)
            errors_.push_back(square_errors(settings, kAfter, seed));
    }
    // Returns the p-value of the errors if the variance falls as with the given alpha.
    double p_value(double alpha) const {
        const RadiusSchedule schedule(alpha);
        double least = 1;
        for (std::size_t i = 1; i < kAfter.size(); ++i) {
            const double predicted = schedule.variance_of_mean(static_cast<std::uint32_t>(kAfter[i]));
            RunningStats off;
            for (const std::vector<double>& e : errors_) off.add(e[i] - predicted * e[0]);
            least = std::min(least, testing::t_test(off, 0));
        }
        return std::min(1.0, least * static_cast<double>(kAfter.size() - 1));
    }

  private:
    inline static const std::vector<int> kAfter = {1, 4, 16};
    std::vector<std::vector<double>> errors_;
};

TEST(Progressive, Long_IntegratingSphere_VarianceFallsAsPredicted) {
    const VarianceOfPasses shrinking(2.0F / 3), constant(1);
    EXPECT_GT(shrinking.p_value(2.0 / 3), testing::kFalseAlarm);
    EXPECT_GT(constant.p_value(1), testing::kFalseAlarm);
    // Each must reject the other's rate.
    EXPECT_LT(shrinking.p_value(1), testing::kFalseAlarm);
    EXPECT_LT(constant.p_value(2.0 / 3), testing::kFalseAlarm);
}

// --- passes ---

TEST(Progressive, Pass_RemembersNoOther) {
    ProgressiveSettings settings;
    settings.photons = 2000;
    Passes in_order(testing::small_cornell(), settings, 4), alone(testing::small_cornell(), settings, 4);
    std::unique_ptr<const Estimator> third;
    for (std::uint32_t i = 0; i <= 3; ++i) third = in_order.pass(i);
    const auto only = alone.pass(3);
    const Ray ray{{0.5F, 0.5F, -1}, V3f(0.1F, -0.2F, 1).normalized()};
    Sampler a(1, Purpose::test, 0, 0), b(1, Purpose::test, 0, 0);
    const Rgb seen = in_order.seen(*third, ray, a);
    EXPECT_EQ(seen, alone.seen(*only, ray, b));
    Sampler c(1, Purpose::test, 0, 0);
    EXPECT_NE(seen, in_order.seen(*in_order.pass(4), ray, c));
}

// The eight samples of a pass share its photons. The variance that an image states must be that between
// images of other seeds; computed between samples it would be several times too small.
TEST(Progressive, VarianceOfTheImage_IsTakenBetweenPasses) {
    ProgressiveSettings settings;
    settings.photons = 300;
    settings.samples = 8;
    settings.estimate.radius = 0.4F;
    settings.estimate.boundary = Boundary::none;
    constexpr int kSide = 8;
    const Camera camera = testing::camera({0.3F, -0.2F, 0.1F}, {1, 0.5F, 0.2F}, kSide, kSide, 150);
    const auto picture = [&](std::uint64_t seed) {
        Monitor silent;
        const Job job = testing::make_job(testing::integrating_sphere(0.5F, 12), camera, settings, 8 * 8);
        const RenderResult result = render(job, {seed, Workers{2}}, silent);
        EXPECT_EQ(result.report.passes_done, 8);
        return result.image;
    };
    // Sums over the pixels of each pair of images; pixels are correlated, pairs are independent.
    std::vector<std::pair<double, double>> pairs;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        const Image a = picture(2 * seed), b = picture(2 * seed + 1);
        auto& [claim, measure] = pairs.emplace_back(0, 0);
        for (int y = 0; y < kSide; ++y) {
            for (int x = 0; x < kSide; ++x) {
                claim += double{a.value(x, y, 3) + b.value(x, y, 3)};
                measure += double{sqr(a.value(x, y, 0) - b.value(x, y, 0))};
            }
        }
    }
    const auto p_value = [&](double factor) {
        RunningStats off;
        for (const auto& [claim, measure] : pairs) off.add(factor * claim - measure);
        return testing::t_test(off, 0);
    };
    EXPECT_GT(p_value(1), testing::kFalseAlarm);
    // Half or twice the stated variance is rejected.
    EXPECT_LT(p_value(0.5), testing::kFalseAlarm);
    EXPECT_LT(p_value(2), testing::kFalseAlarm);
}

TEST(Progressive, SmallCornell_MeanAgreesWithPath) {
    Monitor silent;
    const auto mean = [&](const IntegratorSettings& settings, int spp) {
        const Job job =
            testing::make_job(testing::small_cornell(), testing::small_cornell_camera(32), settings, spp);
        return testing::mean_rgb(render(job, {11, Workers{2}}, silent).image);
    };
    ProgressiveSettings settings;
    settings.photons = 20'000;
    const Rgb expected = mean(PathSettings{}, 512);
    for (const DirectMethod direct : {DirectMethod::mc, DirectMethod::map}) {
        settings.direct = direct;
        const Rgb found = mean(settings, 32);
        // The Direct map is too dark where its disc extends over an edge, and more of that bias remains after
        // few passes.
        const double most = direct == DirectMethod::mc ? 0.01 : 0.03;
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, most) << c;
    }
}

// One estimate shared by the samples of a pass has the mean of one estimate per sample. Exactly one of 4
// samples estimates density, and one of 3 on average.
testing::RegionMeans of_samples(int samples) {
    ProgressiveSettings settings;
    settings.photons = 5000;
    settings.samples = samples;
    settings.estimate.k = 20;
    settings.estimate.radius = 0.05F;  // gives the same bias for all
    const Job job = testing::make_job(testing::small_cornell(), testing::small_cornell_camera(16), settings,
                                      16 * samples);
    return testing::region_means(job, 8, testing::all_but_the_lamp,
                                 [](double, double y) { return y < -0.6; });
}

TEST(Progressive, SamplesOfAPass_ShareOneEstimateWithoutBias) {
    const testing::RegionMeans each = of_samples(1);
    for (const int samples : {3, 4}) testing::expect_agrees(of_samples(samples), each, "shared", 0.01);
}

// --- structure: a lamp that a screen hides from half of the floor ---

// Returns the root mean squared error of the Direct map's irradiance, averaged over passes, at points on both
// sides of the shadow's edge.
double error_at_shadow(int passes) {
    SceneMaker make;
    make.quad({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, make.diffuse(Rgb(kAlbedo)));
    make.quad({0, 0.5F, -9}, {0, 0, 18}, {9, 0, 0}, make.diffuse(Rgb(0.0F)));  // shadows x > 0
    make.light(make_point_light({0, 1, 0}, Rgb(1.0F)));
    ProgressiveSettings settings = of_direct_map(2.0F / 3);
    settings.photons = 20'000;
    settings.estimate.radius = 0;
    Passes all(make.build(), settings, 6);
    constexpr int kPlaces = 16;
    std::array<double, kPlaces> sums{};
    for (int pass = 0; pass < passes; ++pass) {
        const auto estimator = all.pass(static_cast<std::uint32_t>(pass));
        for (int i = 0; i < kPlaces; ++i) {
            Sampler sampler(1, Purpose::test, static_cast<std::uint32_t>(pass),
                            static_cast<std::uint64_t>(i));
            const float x = 0.04F * (static_cast<float>(i) - 7.5F);
            sums[static_cast<std::size_t>(i)] +=
                double{all.seen(*estimator, {{x, 0.2F, 0.1F}, {0, -1, 0}}, sampler).x} * M_PI /
                double{kAlbedo};
        }
    }
    double square = 0;
    for (int i = 0; i < kPlaces; ++i) {
        const double x = 0.04 * (i - 7.5);
        const double truth = x < 0 ? std::pow(1 + x * x + 0.01, -1.5) : 0;
        square += sqr(sums[static_cast<std::size_t>(i)] / passes - truth) / kPlaces;
    }
    return std::sqrt(square);
}

TEST(Progressive, EdgeOfAShadow_ErrorFallsWithPasses) {
    const double first = error_at_shadow(1), some = error_at_shadow(16), many = error_at_shadow(128);
    EXPECT_LT(some, 0.9 * first);
    EXPECT_LT(many, 0.8 * some);
}

}  // namespace progressive_test
}  // namespace lucerna
