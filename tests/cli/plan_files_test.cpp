// Surfaces as plans show them.
#include "engine/cli/photometry/plan_files.h"

#include <gtest/gtest.h>

namespace lucerna {
namespace plan_files_test {

constexpr int kUp = 2;

// A wall, which faces +y, or a level surface.
CalculationSurface surface(bool is_level) {
    CalculationSurface made;
    made.corner = V3d(1, 2, 3);
    made.u = V3d(-4, 0, 0);
    made.v = is_level ? V3d(0, -3, 0) : V3d(0, 0, 3);
    made.normal = made.up = V3f(made.u.cross(made.v).normalized());
    made.points = V2i(8, 3);
    return made;
}

std::vector<double> values_at(const CalculationSurface& surface) {
    std::vector<double> values;
    for (int y = 0; y < surface.points.y; ++y) {
        for (int x = 0; x < surface.points.x; ++x)
            values.push_back(surface.position(x, y).dot(V3d(1, 100, 10'000)));
    }
    return values;
}

// With u to the right and v upwards, a right-handed world shows the side from which the turn from u to v is
// counterclockwise, and a left-handed one the other.
TEST(AsSeen, SidesAndValues_AreThoseOfTheViewer) {
    for (const bool is_level : {true, false}) {
        for (const bool right_handed : {true, false}) {
            const CalculationSurface given = surface(is_level);
            std::vector<double> values = values_at(given);
            const CalculationSurface seen = as_seen(given, kUp, right_handed, &values);
            EXPECT_EQ(seen.u.cross(seen.v).dot(V3d(given.normal)) > 0, right_handed);
            EXPECT_EQ(seen.v.z > 0, !is_level);  // up is up on a wall
            const std::vector<double> expected = values_at(seen);
            ASSERT_EQ(values.size(), expected.size());
            for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-9);
        }
    }
}

// A level surface is seen from above, also one that faces down.
TEST(AsSeen, LevelSurfaceThatFacesDown_IsSeenFromAbove) {
    CalculationSurface ceiling = surface(true);
    std::swap(ceiling.u, ceiling.v);
    ceiling.normal = -ceiling.normal;
    const CalculationSurface seen = as_seen(ceiling, kUp, true);
    EXPECT_GT(seen.u.cross(seen.v)[kUp], 0);
}

}  // namespace plan_files_test
}  // namespace lucerna
