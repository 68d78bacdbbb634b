// How the error of a virtual acquisition falls with the filter spacing: numbers for acquire_order.py.
// One line each: Δ in metres, distance from S in metres, root mean square error over the square of 0.6 of the
// lamp's radius, relative to the irradiance on the axis. M has 64 pixels, of 2.5 mm, at 50 mm.
#include <fmt/core.h>

#include "tests/support/smooth_lamp.h"

int main() {
    const lucerna::EmitterModel lamp = lucerna::testing::smooth_lamp(1);
    fmt::print("# spacing distance error\n");
    for (const double z : {1e-9, 0.002, 0.01}) {
        for (const int views : {8, 13, 18, 23, 33, 43}) {
            fmt::print("{:.6g} {:g} {:.6g}\n", lucerna::testing::rig_before_lamp(views, 64).spacing.x, z,
                       lucerna::testing::rms_error(lamp, views, z));
        }
    }
    return 0;
}
