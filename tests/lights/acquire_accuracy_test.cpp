// Does a measured field light the world as the emitter does? A smooth lamp with a formula, measured, against
// its own irradiance by quadrature over the emitter.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/smooth_lamp.h"

namespace lucerna {
namespace {

using testing::irradiance_of;
using testing::kLampRadius;
using testing::rig_before_lamp;
using testing::rms_error;
using testing::smooth_lamp;

// At 0.1, 0.5, 2.5 and 10 times the lamp's width; M stands at 2.5 times.
TEST(AcquireAccuracy, IrradianceAtFourDistances_IsTheEmitters) {
    const EmitterModel lamp = smooth_lamp(8);
    Monitor silent;
    AcquireOptions options;
    options.s_nodes = options.m_nodes = 2;
    const LightField field = acquire(lamp, rig_before_lamp(23, 96), {}, silent, options);
    for (const double z : {0.002, 0.01, 0.05, 0.2}) {
        const double axis = irradiance_of(lamp, {0, 0, z});
        double worst = 0;
        for (const double x : {0.0, 0.1, 0.25, 0.4, 0.55, 0.7}) {
            const V3d point(x * (0.6 * kLampRadius + 0.6 * z), -0.3 * x * (0.6 * kLampRadius + 0.6 * z), z);
            const double truth = irradiance_of(lamp, point);
            const double error = irradiance(field, point) - truth;
            worst = std::max(worst, std::fabs(error) / axis);
        }
        RecordProperty("worst_at_" + std::to_string(z), std::to_string(worst));
        EXPECT_LT(worst, 0.01) << "at " << z << " m";
        // The comparison sees an error of scale, or of place.
        EXPECT_GT(std::fabs(1.02 * irradiance(field, {0, 0, z}) - axis), 0.01 * axis);
    }
}

// Shifts of the bell hold constants, but no straight line: the field's own error on S falls as Δ.
TEST(AcquireAccuracy, ErrorOnS_FallsAsTheSpacing) {
    const EmitterModel lamp = smooth_lamp(1);
    const double coarse = rms_error(lamp, 13, 1e-9), fine = rms_error(lamp, 33, 1e-9);  // Δ falls to a third
    const double order = std::log(coarse / fine) / std::log(3.0);
    RecordProperty("order", std::to_string(order));
    EXPECT_GT(order, 0.8);
    EXPECT_LT(order, 1.4);
}

}  // namespace
}  // namespace lucerna
