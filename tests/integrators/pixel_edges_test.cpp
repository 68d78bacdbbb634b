// Tests which pixels are found to contain an edge.
#include "engine/integrators/pixel_edges.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace lucerna {
namespace pixel_edges_test {

TEST(PixelEdges, SphereBeforeAWall_ItsOutlineAlone) {
    testing::SceneMaker make;
    const auto white = make.diffuse(Rgb(0.5F));
    make.sphere(V3f(0.0F), 1, white);
    make.quad({-50, -50, 5}, {100, 0, 0}, {0, 100, 0}, white);
    const Scene scene = make.build();
    constexpr int kSide = 64;
    const Camera camera = testing::camera({0, 0, -4}, {0, 0, 0}, kSide, kSide, 60);
    const PixelEdges edges(scene, {&camera, V2f(0.0F), V2f(float{kSide})}, Workers{2});
    // The outline's radius in pixels is the tangent of its angle, asin(1/4), over that of half the field of
    // view, times half the image's width.
    const double outline = std::tan(std::asin(0.25)) / std::tan(M_PI / 6) * kSide / 2;
    int found = 0;
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const bool edge = edges.at({static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F});
            const double off = std::hypot(x + 0.5 - kSide / 2, y + 0.5 - kSide / 2) - outline;
            EXPECT_FALSE(edge && std::fabs(off) > 3) << x << " " << y;
            found += edge;
        }
    }
    EXPECT_GT(found, 2 * M_PI * outline * 0.8) << "all around";
    EXPECT_FALSE(edges.at({-1, 5}));
    EXPECT_FALSE(edges.at({5, float{kSide}}));
}

}  // namespace pixel_edges_test
}  // namespace lucerna
