// Rays through media and their interfaces.
#include "engine/scene/media_traversal.h"

#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "tests/support/media.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace passage_test {

using testing::homogeneous;
using testing::SceneMaker;

// A ball of one medium that contains a smaller ball of another, and a box that overlaps both.
Scene onion() {
    SceneMaker make;
    const auto outer = make.medium(homogeneous({0.1F, 0.2F, 0}, Rgb(0)));
    const auto inner = make.medium(homogeneous(Rgb(0), {1, 0, 0.5F}));
    make.ball_of(outer, V3f(0.0F), 2);
    make.ball_of(inner, V3f(0.0F), 1).traits.media.outside = outer;
    make.region(testing::in_box(homogeneous(Rgb(0.3F), Rgb(0)), {0, -5, -5}, {5, 5, 5}));
    make.light(make_point_light({0, 0, 0}, Rgb(1)));
    make.light(make_point_light({1.5F, 0, 0}, Rgb(1)));
    make.light(make_point_light({7, 1, 0}, Rgb(1)));
    make.light(make_distant_light({0, 0, -1}, Rgb(1), SceneSphere{V3f(0.0F), 3}));
    return make.build();
}

TEST(Passage, BallsInABox_WeakenAsTheirLengthsSay) {
    const Scene scene = onion();
    Sampler sampler(1, Purpose::test, 0, 0);
    // From -3 to 3 the ray crosses 2 of the outer shell, 2 of the inner ball, and 3 of the box.
    const Rgb through = transmittance(scene, Ray{{-3, 0, 0}, {1, 0, 0}, 6}, kNoMedium, sampler);
    EXPECT_NEAR(through.x, std::exp(-0.1 * 2 - 1 * 2 - 0.3 * 3), 1e-6);
    EXPECT_NEAR(through.y, std::exp(-0.2 * 2 - 0.3 * 3), 1e-6);
    EXPECT_NEAR(through.z, std::exp(-0.5 * 2 - 0.3 * 3), 1e-6);
    // This ray goes from the centre to a point in the shell.
    const Rgb half = transmittance(scene, Ray{V3f(0.0F), {0, 1, 0}, 1.5F}, 1, sampler);
    EXPECT_NEAR(half.x, std::exp(-1 - 0.05 - 0.3 * 1.5), 1e-6);
}

TEST(Passage, Pieces_TellWhatTheWayEndsIn) {
    const Scene scene = onion();
    const auto at_end = [&](float length) {
        return for_each_piece(scene, Ray{{-3, 0, 0}, {1, 0, 0}, length}, kNoMedium,
                              [](const MediumPiece&) { return true; });
    };
    EXPECT_EQ(at_end(0.5F), kNoMedium);
    EXPECT_EQ(at_end(1.5F), 0);
    EXPECT_EQ(at_end(3), 1);
    EXPECT_EQ(at_end(4.5F), 0);
    EXPECT_EQ(at_end(100), kNoMedium);
}

TEST(MediumOfALight, IsWhatItStandsInHoweverItShines) {
    const Scene scene = onion();
    EXPECT_EQ(scene.medium_of_light(0), 1);
    EXPECT_EQ(scene.medium_of_light(1), 0);
    EXPECT_EQ(scene.medium_of_light(2), kNoMedium);
    EXPECT_EQ(scene.medium_of_light(3), kNoMedium);
}

TEST(MediumOfALight, WithoutAnyInterface_IsThatOfTheCamera) {
    SceneMaker make;
    make.camera_in(make.medium(homogeneous(Rgb(1), Rgb(0))));
    make.light(make_point_light({0, 0, 0}, Rgb(1)));
    EXPECT_EQ(make.build().medium_of_light(0), 0);
}

TEST(MediumOfALight, OnTheInsideOfALampsGlass_IsWhatTheGlassHolds) {
    // A light in a glass ball that is full of gas, in a room of fog that no medium interface bounds.
    SceneMaker make;
    const auto fog = make.medium(homogeneous(Rgb(1), Rgb(0)));
    const auto gas = make.medium(homogeneous(Rgb(2), Rgb(0)));
    make.camera_in(fog);
    make.sphere(V3f(0.0F), 1, make.material(DielectricMaterial{})).traits.media = {true, gas, fog};
    make.quad_light({-0.1F, 0, -0.1F}, {0, 0, 0.2F}, {0.2F, 0, 0}, make.diffuse(Rgb(0)), Rgb(1));
    make.quad_light({-0.1F, 5, -0.1F}, {0, 0, 0.2F}, {0.2F, 0, 0}, make.diffuse(Rgb(0)), Rgb(1));
    const Scene scene = make.build();
    EXPECT_EQ(scene.medium_of_light(0), gas);
    EXPECT_EQ(scene.medium_of_light(1), fog);
}

TEST(MediumAround, APointFarFromTheOnlyInterface_IsWhatLiesOnItsSide) {
    // A camera in a ball of fog so small that random rays from the other points would miss it.
    SceneMaker make;
    const auto fog = make.medium(homogeneous(Rgb(1), Rgb(0)));
    make.camera_in(fog);
    make.ball_of(fog, V3f(0.0F), 0.01F);
    const Scene scene = make.build();
    for (const V3f& p : {V3f(100, 3, -20), V3f(0, 0, 5), V3f(-0.02F, 0.01F, 0)})
        EXPECT_EQ(medium_around(scene, {p}, {0.6F, 0, 0.8F}), kNoMedium);
    EXPECT_EQ(medium_around(scene, {V3f(0.004F, 0, 0)}, {0, 1, 0}), fog);
}

TEST(CrossMedia, Particles_AbsorbedScatteredOrThrough_AreShares) {
    SceneMaker make;
    const auto cloud = make.medium(homogeneous(Rgb(0.2F), Rgb(0.6F), 0.4F));
    make.ball_of(cloud, V3f(0.0F), 1);
    make.quad({3, -1, -1}, {0, 2, 0}, {0, 0, 2}, make.diffuse(Rgb(0.5F)));
    const Scene scene = make.build();
    const Ray ray{{-2, 0, 0}, {1, 0, 0}};
    const auto hit = scene.intersect(ray);
    ASSERT_TRUE(hit);
    RunningStats through, scattered;
    for (std::uint64_t i = 0; i < 50'000; ++i) {
        Sampler sampler(3, Purpose::test, 0, i);
        const MediaTraversal crossing = traverse_media(scene, ray, hit, kNoMedium, Rgb(2), sampler);
        const auto power = static_cast<double>(crossing.power.x);
        through.add(crossing.scattered ? 0.0 : power);
        scattered.add(crossing.scattered ? power : 0.0);
        EXPECT_EQ(crossing.medium, crossing.scattered ? cloud : kNoMedium);
        if (crossing.scattered) {
            ASSERT_LT(crossing.scattered->p.length(), 1 + 1e-5F);
            ASSERT_EQ(crossing.scattered->g, 0.4F);
        }
    }
    EXPECT_TRUE(testing::agrees(through, 2 * std::exp(-1.6)));
    EXPECT_TRUE(testing::agrees(scattered, 2 * 0.75 * (1 - std::exp(-1.6))));
    EXPECT_FALSE(testing::agrees(scattered, 2 * 0.80 * (1 - std::exp(-1.6))));
}

TEST(ScatteringAt, OverlappingMedia_AddUpWithinTheirBoxes) {
    SceneMedia media =
        testing::regions({testing::in_box(homogeneous(Rgb(1), {1, 2, 3}), {0, 0, 0}, {1, 1, 1}),
                          testing::even_grid(homogeneous(Rgb(0), Rgb(4)), {0, 0, 0}, {2, 1, 1}, 0.5F)});
    EXPECT_EQ(scattering_at(media, kNoMedium, {0.5F, 0.5F, 0.5F}), Rgb(3, 4, 5));
    EXPECT_EQ(scattering_at(media, kNoMedium, {1.5F, 0.5F, 0.5F}), Rgb(2, 2, 2));
    EXPECT_EQ(scattering_at(media, kNoMedium, {1.5F, 1.5F, 0.5F}), Rgb(0));
    media.all.push_back(homogeneous(Rgb(0), Rgb(0.25F)));
    EXPECT_EQ(scattering_at(media, 2, {1.5F, 1.5F, 0.5F}), Rgb(0.25F));
    EXPECT_TRUE(scatters(media));
    EXPECT_FALSE(scatters(testing::regions({homogeneous(Rgb(1), Rgb(0))})));
}

}  // namespace passage_test
}  // namespace lucerna
