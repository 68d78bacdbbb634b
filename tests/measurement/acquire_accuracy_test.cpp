// A measured field must light the world as the emitter does. A smooth lamp with a formula is measured and
// compared with its own irradiance by quadrature over the emitter.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "tests/support/smooth_lamp.h"

namespace lucerna {
namespace acquire_accuracy_test {

using testing::irradiance_of;
using testing::kLampRadius;
using testing::measured;
using testing::rms_error;
using testing::SmoothLamp;

// Compares at 0.1, 0.5, 1 and 5 times the lamp's width. The last point lies beyond M, which stands at 2.5
// times the width.
TEST(AcquireAccuracy, IrradianceAtFourDistances_IsTheEmitters) {
    const SmoothLamp lamp(8);
    const LightField field = measured(lamp, 19, 80);
    for (const double z : {0.002, 0.01, 0.02, 0.1}) {
        const double axis = irradiance_of(lamp, {0, 0, z});
        double worst = 0;
        for (const double x : {0.0, 0.1, 0.25, 0.4, 0.55, 0.7}) {
            const V3d point(x * (0.6 * kLampRadius + 0.6 * z), -0.3 * x * (0.6 * kLampRadius + 0.6 * z), z);
            const double error = irradiance(field, point) - irradiance_of(lamp, point);
            worst = std::max(worst, std::fabs(error) / axis);
        }
        std::cout << "at " << z << " m: worst error " << 100 * worst << " % of the axis\n";
        EXPECT_LT(worst, 0.01) << "at " << z << " m";
        // The comparison must detect a wrong scale and a displaced lamp.
        EXPECT_GT(std::fabs(1.02 * irradiance(field, {0, 0, z}) - axis), 0.01 * axis);
    }
}

// Shifts of the bell reproduce constants but no straight line, so on S itself the error falls as Δ. Slightly
// in front of S the errors of neighbouring filters cancel.
TEST(AcquireAccuracy, Error_FallsWithTheSpacing) {
    const SmoothLamp lamp(30);
    const LightField few = measured(lamp, 13, 32), many = measured(lamp, 33, 32);  // Δ falls to a third
    for (const double z : {0.0, 0.002}) {
        const double coarse = rms_error(lamp, few, z), fine = rms_error(lamp, many, z);
        const double order = std::log(coarse / fine) / std::log(3.0);
        std::cout << "at " << z << " m: errors " << coarse << " and " << fine << ", order " << order << "\n";
        EXPECT_GT(order, z == 0 ? 0.9 : 2.0);
        EXPECT_LT(order, z == 0 ? 1.2 : 6.0);
    }
}

}  // namespace acquire_accuracy_test
}  // namespace lucerna
