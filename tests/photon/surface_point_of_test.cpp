// Tests that the position of a photon gets the error bound of its surface.
#include "photon/irradiance.h"

#include <gtest/gtest.h>

#include "engine/base/vec.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace surface_point_of_test {

using testing::SceneMaker;

// The scene has large and small tilted squares, one close above the other, and a ball.
TEST(RestingPoint, WhereARayMetASurface_HasTheErrorOfThatHit) {
    const Frame frame(V3f(1, 2, 3).normalized());
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(0.5F));
    const auto square = [&](float half, float height) {
        make.quad(height * frame.n - half * (frame.s + frame.t), 2 * half * frame.s, 2 * half * frame.t,
                  grey);
    };
    square(100, 0);
    square(0.5F, 0.002F);
    square(3, -0.004F);
    make.sphere(40.0F * frame.s + 2.0F * frame.n, 1, grey);
    const Scene scene = make.build();
    Sampler sampler(1, Purpose::test, 0, 0);
    double least = 1, most = 0;
    for (int i = 0; i < 3000; ++i) {
        const V2f u = sampler.next2();
        const float width = i % 3 == 0 ? 0.6F : 60.0F;
        const float side = i % 2 == 0 ? 1.0F : -1.0F;  // from above and from below
        const V3f eye = side * 5 * frame.n + width * ((2 * u.x - 1) * frame.s + (2 * u.y - 1) * frame.t);
        const auto hit = scene.intersect({eye, -side * frame.n});
        ASSERT_TRUE(hit);
        const V3f n = hit->at.n.dot(frame.n) * side < 0 ? -hit->at.n : hit->at.n;
        const SurfacePoint rests = surface_point_of(scene, hit->at.p, n);
        EXPECT_EQ(rests.p, hit->at.p);
        EXPECT_EQ(rests.n, n);
        EXPECT_NEAR(rests.error / hit->at.error, 1, 1e-3F) << hit->at.p;
        least = std::min(least, double{rests.error}), most = std::max(most, double{rests.error});
    }
    EXPECT_LT(least, 0.02 * most);  // the errors differ
}

TEST(RestingPoint, OnNothing_HasTheErrorOfItsPlaceAlone) {
    SceneMaker make;
    make.sphere(V3f(9, 0, 0), 1, make.diffuse(Rgb(0.5F)));
    const Scene scene = make.build();
    const SurfacePoint rests = surface_point_of(scene, V3f(1, 2, 3), V3f(0, 1, 0));
    EXPECT_EQ(rests.error, surface_error(V3f(1, 2, 3), 0));
}

}  // namespace surface_point_of_test
}  // namespace lucerna
