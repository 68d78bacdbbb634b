// From which distance on a lamp may be taken for a point: the closed form of a disc, computed through a light
// field.
#include <gtest/gtest.h>

#include <cmath>

#include "lights/measurement/plane_irradiance.h"
#include "tests/lights/field_fixtures.h"

namespace lucerna {
namespace five_times_test {

// On the axis of a Lambertian disc of radius R, E = πL R²/(R² + d²); for a point of the same intensity, E =
// πL R²/d². Their ratio is 1 + (R/d)², so the point is 10, 3 and 1 % too bright at 1.58, 2.89 and 5
// diameters.
TEST(FiveTimesRule, LambertianDisc_IsWrongByTenThreeAndOnePercentWhereTheFormulaSays) {
    constexpr double kRadius = 0.01;
    Rig rig;
    rig.views = {41, 41};
    rig.spacing = V2d(2 * kRadius / 36);
    rig.pixels = {25, 25};
    rig.pixel = V2d(0.001);  // M must hold only what passes the axis
    rig.distance = 0.04;
    const LightField field = testing::lambertian_disc(rig, kRadius);
    // A photometric file gives the intensity at nadir.
    const double intensity = far_intensity(field, {0, 0});
    for (const double error : {0.10, 0.03, 0.01}) {
        const double distance = kRadius / std::sqrt(error);
        const double near = irradiance(field, {0, 0, distance});
        EXPECT_NEAR(intensity / (distance * distance) / near, 1 + error, 0.0015 + 0.02 * error)
            << distance / (2 * kRadius) << " diameters";
    }
}

}  // namespace five_times_test
}  // namespace lucerna
