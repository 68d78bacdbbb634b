// Measures how the error of a virtual acquisition falls with the filter spacing, for acquire_order.py. Each
// line has Δ in metres, the distance from S in metres, and the root mean square error over a square of 0.6 of
// the lamp's radius, relative to the irradiance on the axis. M has 64 pixels of 2.5 mm at 50 mm.
#include <fmt/core.h>

#include "tests/support/smooth_lamp.h"

int main() {
    const lucerna::testing::SmoothLamp lamp(30);
    fmt::print("# spacing distance error\n");
    for (const int views : {8, 13, 18, 23, 33, 43}) {
        const lucerna::LightField field = lucerna::testing::measured(lamp, views, 64);
        for (const double z : {0.0, 0.001, 0.002, 0.005}) {
            fmt::print("{:.6g} {:g} {:.6g}\n", field.rig().spacing.x, z,
                       lucerna::testing::rms_error(lamp, field, z));
        }
    }
    return 0;
}
