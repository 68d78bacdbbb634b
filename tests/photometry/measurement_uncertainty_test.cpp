// The uncertainty due to the lamps' measurement, from scatters of which both parts are known.
#include "engine/photometry/measurement_uncertainty.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/photometry/illuminance_text.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace measurement_uncertainty_test {

using ::testing::HasSubstr;
using testing::kFalseAlarm;
using ::testing::Not;

constexpr int kReplicates = 20, kHeads = 64;

// Returns values of replicates: normal, with the standard deviations `lamps` of the lamps and `monte_carlo`
// of the runs.
std::vector<Reading95> values(double lamps, double monte_carlo, std::mt19937& random,
                              int replicates = kReplicates) {
    std::normal_distribution<double> normal;
    std::vector<Reading95> all;
    for (int b = 0; b < replicates; ++b) {
        all.push_back(
            {100 + lamps * normal(random) + monte_carlo * normal(random), student_95(kHeads) * monte_carlo});
    }
    return all;
}

// Tests by chi-square whether a mean of `trials` sample variances agrees with `variance`.
bool is_variance(double mean, double variance, int trials) {
    const int freedom = trials * (kReplicates - 1);
    const double upper = testing::chi_square_tail(mean / variance * freedom, freedom);
    return std::min(upper, 1 - upper) > kFalseAlarm / 2;
}

TEST(MeasurementUncertainty, MonteCarloNoise_IsTakenOff) {
    constexpr int kTrials = 500;
    std::mt19937 random(1);
    const double lamps = 3, noise = 1.2;
    RunningStats variances;
    for (int t = 0; t < kTrials; ++t) {
        const LampUncertainty found = lamp_uncertainty(values(lamps, noise, random), kHeads);
        EXPECT_FALSE(
            found.upper_bound);  // the bound is a scatter of 1.58 times the noise's; here it is 7 times
        // s² is the sum of this variance and the noise's.
        const double variance = sqr(found.expanded / 2) + sqr(noise);
        variances.add(variance);
        EXPECT_NEAR(found.relative, variance / (sqr(found.expanded / 2) * std::sqrt(2.0 * 19)), 1e-9);
    }
    EXPECT_TRUE(is_variance(variances.mean(), sqr(lamps) + sqr(noise), kTrials));
    // The test must reject noise that is not subtracted, and noise of twice as many samples.
    EXPECT_FALSE(is_variance(variances.mean() - sqr(noise), sqr(lamps) + sqr(noise), kTrials));
    EXPECT_FALSE(is_variance(variances.mean() - sqr(noise) / 2, sqr(lamps) + sqr(noise), kTrials));
}

TEST(MeasurementUncertainty, UnderNoise_IsAnUpperBoundThatHolds) {
    constexpr int kTrials = 2000;
    const auto rarely = [](int misses) {
        return cdf(complement(boost::math::binomial(kTrials, 0.05), std::max(0, misses - 1))) > kFalseAlarm;
    };
    std::mt19937 random(2);
    for (const double lamps : {0.0, 0.3, 1.0}) {
        int told = 0, below = 0, below_half = 0;
        for (int t = 0; t < kTrials; ++t) {
            const LampUncertainty found = lamp_uncertainty(values(lamps, 1, random), kHeads);
            told += !found.upper_bound;
            if (!found.upper_bound) continue;
            EXPECT_GT(found.expanded, 0);
            below += found.expanded < 2 * lamps;
            below_half += found.expanded / 2 < 2 * lamps;
        }
        EXPECT_TRUE(rarely(below)) << below << " with lamps of " << lamps;
        if (lamps == 0) {
            EXPECT_TRUE(rarely(told)) << told << " told from noise that is all there is";
        }
        if (lamps == 1) {
            EXPECT_FALSE(rarely(below_half)) << "half of the bound is none";
        }
    }
    // A dark scene has no uncertainty.
    const std::vector<Reading95> dark(kReplicates);
    EXPECT_EQ(lamp_uncertainty(dark, kHeads).expanded, 0);
    EXPECT_FALSE(lamp_uncertainty(dark, kHeads).upper_bound);
}

TEST(MeasurementUncertainty, ChiSquareQuantile_IsBoosts) {
    for (const int n : {4, 9, 19, 99}) {
        for (const double p : {0.05, 0.95}) {
            const double z = p < 0.5 ? -1.6448536269 : 1.6448536269;
            const double exact = quantile(boost::math::chi_squared(n), p);
            EXPECT_NEAR(chi_square_quantile(z, n) / exact, 1, n < 19 ? 0.04 : 0.002) << n << ' ' << p;
        }
    }
}

// Reports a surface of two points; the lamps make both scatter together.
IlluminanceReport report(double first, double second, double half_width) {
    IlluminanceReport made;
    made.unit = "lx";
    made.sensors = kHeads;
    SurfaceIlluminance surface;
    surface.surface.name = "desk, left";
    surface.surface.points = {2, 1};
    for (const double e : {first, second}) {
        PointIlluminance point;
        point.all = {e, half_width};
        surface.points.push_back(point);
    }
    surface.mean = {(first + second) / 2, half_width / std::sqrt(2)};
    surface.least = {std::min(first, second), half_width};
    surface.uniformity = {surface.least.value / surface.mean.value, half_width / surface.mean.value};
    made.surfaces.push_back(surface);
    return made;
}

TEST(MeasurementUncertainty, OfReports_StandsInTableCsvAndJson) {
    const IlluminanceReport whole = report(100, 200, 0.2);
    std::vector<IlluminanceReport> by_replicate;
    for (int b = 0; b < 5; ++b) by_replicate.push_back(report(100 + b, 200, 0.2));
    MeasurementUncertainty made = measurement_uncertainty(whole, by_replicate);
    LightFieldInfo info;
    info.errors = {{0, 0.04, 0.1}, {INFINITY, 0.0025, 0.01}};
    Rig rig;
    rig.spacing = rig.pixel = {0.01, 0.01};
    rig.distance = 0.1;
    const LightField known(rig, {1.0F}, info), unknown(rig, {1.0F});
    const LightField* const both[] = {&known, &unknown};
    made.fields = {field_error("a.exr", std::span(both).first(1)), field_error("b.exr", both)};
    ASSERT_EQ(made.surfaces.size(), 1U);
    const SurfaceUncertainty& of = made.surfaces[0];
    // 0, 1 … 4 have the variance 2.5, and the mean of the surface a quarter of it.
    const double noise = sqr(0.2 / student_95(kHeads));
    EXPECT_NEAR(of.points[0].expanded, 2 * std::sqrt(2.5 - noise), 1e-9);
    EXPECT_NEAR(of.least.expanded, of.points[0].expanded, 1e-9);
    EXPECT_NEAR(of.mean.expanded, 2 * std::sqrt(2.5 / 4 - noise / 2), 1e-9);
    EXPECT_TRUE(of.points[1].upper_bound);
    EXPECT_EQ(of.upper_bounds, 1U);
    EXPECT_NEAR(of.rms, 2 * std::sqrt(((2.5 - noise) / 1e4 - noise / 4e4) / 2), 1e-9);
    EXPECT_NEAR(combined({100, 0.2}, of.points[0]), std::hypot(0.2, of.points[0].expanded), 1e-12);
    EXPECT_THAT(uncertainty_text(whole, made),
                ::testing::AllOf(
                    HasSubstr("from 5 bootstrap replicates"), HasSubstr("± 35 %"), HasSubstr("± 3.2"),
                    HasSubstr("at 1 of 2 points"), HasSubstr("U_0"),
                    HasSubstr("a.exr: error of the light field by held-out rays, its bias included: 5 %"),
                    HasSubstr("up to 20 %"), HasSubstr("b.exr: the file does not say")));
    const std::string csv = illuminance_csv(whole, made);
    EXPECT_THAT(csv, HasSubstr(",U of lamps [lx],upper bound,half-width of both [lx]\n"));
    EXPECT_THAT(csv, HasSubstr(",3.16,0,3.16\n"));
    EXPECT_THAT(csv, HasSubstr(",1,"));
    EXPECT_THAT(illuminance_csv(whole), Not(HasSubstr("lamps")));
    const auto json = nlohmann::json::parse(illuminance_json(whole, made));
    EXPECT_EQ(json["replicates"], 5);
    EXPECT_DOUBLE_EQ(json["light_fields"][0]["greatest_error"], 0.2);
    EXPECT_FALSE(json["light_fields"][1].contains("greatest_error"));
    EXPECT_NEAR(json["surfaces"][0]["lamps"]["mean"]["U"], of.mean.expanded, 1e-9);
    EXPECT_EQ(json["surfaces"][0]["values"][1]["lamps"]["upper_bound"], true);
    EXPECT_FALSE(nlohmann::json::parse(illuminance_json(whole)).contains("replicates"));
}

}  // namespace measurement_uncertainty_test
}  // namespace lucerna
