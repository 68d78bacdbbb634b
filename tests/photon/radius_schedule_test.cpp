// Tests the sequence of radii against its recurrence, and the sums over it against closed forms.
#include "photon/radius_schedule.h"

#include <gtest/gtest.h>

namespace lucerna {
namespace radius_schedule_test {

constexpr double kAlphas[] = {0.1, 0.5, 2.0 / 3, 0.9, 1.0};

TEST(RadiusSchedule, Share_FollowsTheRecurrence) {
    for (const double alpha : kAlphas) {
        const RadiusSchedule schedule(alpha);
        double share = 1;
        for (std::uint32_t i = 1; i <= 100'000; ++i) {
            if (i < 10 || i % 9'999 == 0) {
                EXPECT_NEAR(schedule.r2_ratio(i - 1) / share, 1, 1e-8) << alpha << " " << i;
            }
            share *= (i + alpha) / (i + 1.0);
        }
    }
}

TEST(RadiusSchedule, SumsOverPasses_AreTheClosedForms) {
    for (const double alpha : kAlphas) {
        const RadiusSchedule schedule(alpha);
        double sum = 0, inverse = 0;
        for (std::uint32_t n = 1; n <= 5000; ++n) {
            sum += schedule.r2_ratio(n - 1);
            inverse += 1 / schedule.r2_ratio(n - 1);
            if (n > 10 && n % 499 != 0) continue;
            EXPECT_NEAR(schedule.bias_of_mean(n) / (sum / n), 1, 1e-8) << alpha << " " << n;
            EXPECT_NEAR(schedule.variance_of_mean(n) / (inverse / n / n), 1, 1e-8) << alpha << " " << n;
        }
    }
}

// Variance falls as N^-α and bias as N^(α-1): checks the slopes between 10⁴ and 10⁶ passes.
TEST(RadiusSchedule, Slopes_AreThePredicted) {
    for (const double alpha : {0.5, 2.0 / 3, 0.9}) {
        const RadiusSchedule schedule(alpha);
        const auto slope = [](double first, double last) { return std::log10(last / first) / 2; };
        EXPECT_NEAR(slope(schedule.variance_of_mean(10'000), schedule.variance_of_mean(1'000'000)), -alpha,
                    0.005);
        EXPECT_NEAR(slope(schedule.bias_of_mean(10'000), schedule.bias_of_mean(1'000'000)), alpha - 1, 0.005);
    }
}

TEST(RadiusSchedule, AlphaOne_KeepsRadiusAndBias) {
    const RadiusSchedule schedule(1);
    for (const std::uint32_t n : {1U, 7U, 1000U}) {
        EXPECT_NEAR(schedule.r2_ratio(n), 1, 1e-9);
        EXPECT_NEAR(schedule.bias_of_mean(n), 1, 1e-9);
        EXPECT_NEAR(schedule.variance_of_mean(n) * n, 1, 1e-9);
    }
}

}  // namespace radius_schedule_test
}  // namespace lucerna
