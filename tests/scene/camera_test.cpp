#include "engine/scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/sampler.h"

namespace lucerna {
namespace camera_test {

Camera::Settings wide() {
    Camera::Settings s;
    s.width = 400;
    s.height = 200;
    return s;
}

void expect_near(const V3f& a, const V3f& b, float tolerance = 1e-5F) {
    EXPECT_LT((a - b).length(), tolerance) << a << b;
}

TEST(Camera, CentreOfTheFilm_LooksAlongZ) {
    const Ray ray = Camera(wide()).ray({200, 100}, {0.5F, 0.5F});
    expect_near(ray.o, {0, 0, 0});
    expect_near(ray.d, {0, 0, 1});
    EXPECT_EQ(ray.t_max, INFINITY);
}

TEST(Camera, Fov_IsThatOfTheShorterSide) {
    Camera::Settings s = wide();
    s.fov_degrees = 60;
    const Camera landscape(s);
    const float tangent = std::tan(kPi / 6);
    expect_near(landscape.ray({200, 0}, {}).d, V3f(0, tangent, 1).normalized());
    expect_near(landscape.ray({0, 100}, {}).d, V3f(-2 * tangent, 0, 1).normalized());
    std::swap(s.width, s.height);
    const Camera portrait(s);
    expect_near(portrait.ray({200, 200}, {}).d, V3f(tangent, 0, 1).normalized());
    expect_near(portrait.ray({100, 400}, {}).d, V3f(0, -2 * tangent, 1).normalized());
}

TEST(Camera, ScreenWindow_ReplacesTheAspectRatio) {
    Camera::Settings s = wide();
    s.screen[0] = -0.5F, s.screen[1] = 1, s.screen[2] = 0, s.screen[3] = 0.25F;  // the tangent is 1 at 90°
    const Camera camera(s);
    expect_near(camera.ray({0, 0}, {}).d, V3f(-0.5F, 0.25F, 1).normalized());
    expect_near(camera.ray({400, 200}, {}).d, V3f(1, 0, 1).normalized());
}

TEST(Camera, Orthographic_RaysAreParallelAndStartOnTheWindow) {
    Camera::Settings s = wide();
    s.kind = Camera::Settings::Kind::orthographic;
    const Camera camera(s);
    const Ray corner = camera.ray({0, 0}, {});
    expect_near(corner.o, {-2, 1, 0});
    expect_near(corner.d, {0, 0, 1});
    expect_near(camera.ray({400, 200}, {}).o, {2, -1, 0});
}

TEST(Camera, ThinLens_AllRaysOfAFilmPointMeetInThePlaneOfFocus) {
    for (const auto kind : {Camera::Settings::Kind::perspective, Camera::Settings::Kind::orthographic}) {
        Camera::Settings s = wide();
        s.kind = kind;
        const V2f film(37, 150);
        const Ray sharp = Camera(s).ray(film, {});
        const V3f focus = sharp.at(3 / sharp.d.z);
        s.lens_radius = 0.2F;
        s.focal_distance = 3;
        const Camera camera(s);
        Sampler sampler(1, Purpose::test, 0, 0);
        V3f mean(0.0F);
        float farthest = 0;
        for (int i = 0; i < 1000; ++i) {
            const Ray ray = camera.ray(film, sampler.next2());
            expect_near(ray.at((focus - ray.o).length()), focus);
            EXPECT_NEAR(ray.d.length(), 1, 1e-6F);
            const V3f shift = ray.o - sharp.o;
            EXPECT_NEAR(shift.z, 0, 1e-6F);
            farthest = std::max(farthest, shift.length());
            mean += shift / 1000.0F;
        }
        EXPECT_LE(farthest, 0.2F + 1e-6F);
        EXPECT_GT(farthest, 0.19F);
        EXPECT_LT(mean.length(), 4 * 0.1F / std::sqrt(1000.0F));
    }
}

TEST(Camera, MirroredTransform_MirrorsThePicture) {
    Camera::Settings s = wide();
    const V3f plain = Camera(s).ray({30, 40}, {}).d;
    s.world_from_camera.setScale(V3d(-1, 1, 1));
    const V3f mirrored = Camera(s).ray({30, 40}, {}).d;
    expect_near(mirrored, {-plain.x, plain.y, plain.z});
}

TEST(Camera, PlacedCamera_RaysAreCarriedIntoTheScene) {
    Camera::Settings s = wide();
    M44d turn, move;
    turn.setAxisAngle(V3d(0, 1, 0), 1.5707963267948966);  // rotates z to x
    move.setTranslation(V3d(5, 6, 7));
    s.world_from_camera = turn * move;
    const Ray ray = Camera(s).ray({200, 100}, {});
    expect_near(ray.o, {5, 6, 7});
    expect_near(ray.d, {1, 0, 0});
}

TEST(Camera, ImpossibleSettings_AreRefused) {
    std::vector<Camera::Settings> bad(8, wide());
    bad[0].fov_degrees = 0;
    bad[1].fov_degrees = 180;
    bad[2].fov_degrees = NAN;
    bad[3].width = 0;
    bad[4].lens_radius = -1;
    bad[5].lens_radius = 1, bad[5].focal_distance = 0;
    bad[6].world_from_camera.setScale(V3d(0, 1, 1));
    bad[7].screen[0] = 1, bad[7].screen[1] = 1, bad[7].screen[3] = 1;
    for (const Camera::Settings& s : bad) EXPECT_THROW(Camera{s}, InputError);
}

TEST(Camera, Fisheye_SpreadsAnglesEvenly) {
    Camera::Settings s = wide();
    s.kind = Camera::Settings::Kind::spherical;
    s.mapping = Camera::Settings::Mapping::fisheye;
    s.width = s.height = 512;
    const Camera fisheye(s);
    expect_near(fisheye.ray({256, 256}, {}).d, {0, 0, 1});
    expect_near(fisheye.ray({512, 256}, {}).d, {1, 0, 0}, 1e-5F);
    expect_near(fisheye.ray({256, 0}, {}).d, {0, 1, 0}, 1e-5F);
    const float half = std::sqrt(0.5F);  // half of the radius is 45 degrees, a third 30
    expect_near(fisheye.ray({256 + 128 * half, 256 - 128 * half}, {}).d, {0.5F, 0.5F, half}, 1e-5F);
    expect_near(fisheye.ray({256, 256 + 256.F / 3}, {}).d, {0, -0.5F, std::sqrt(0.75F)}, 1e-5F);
}

TEST(Camera, Spherical_SeesEveryDirectionOnce) {
    Camera::Settings s = wide();
    s.kind = Camera::Settings::Kind::spherical;
    s.width = s.height = 512;
    const Camera equal_area(s);
    s.mapping = Camera::Settings::Mapping::equirectangular;
    const Camera by_angles(s);
    // Up is +y: the film's centre and corners are the poles of the equal-area mapping, its upper and lower
    // edges those of the equirectangular one.
    expect_near(equal_area.ray({256, 256}, {}).d, {0, 1, 0});
    expect_near(equal_area.ray({0, 0}, {}).d, {0, -1, 0}, 1e-3F);
    expect_near(by_angles.ray({100, 0}, {}).d, {0, 1, 0});
    expect_near(by_angles.ray({0, 256}, {}).d, {1, 0, 0}, 1e-5F);
    expect_near(by_angles.ray({128, 256}, {}).d, {0, 0, 1}, 1e-5F);
    // Equal areas: all pixels together weight every direction equally.
    V3d first(0);
    double up2 = 0, octant = 0;
    for (int y = 0; y < 512; ++y) {
        for (int x = 0; x < 512; ++x) {
            const V3d d(equal_area.ray({static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F}, {}).d);
            first += d / (512.0 * 512.0);
            up2 += d.y * d.y / (512.0 * 512.0);
            if (d.x > 0 && d.y > 0 && d.z > 0) octant += 1 / (512.0 * 512.0);
        }
    }
    EXPECT_LT(first.length(), 1e-5);
    EXPECT_NEAR(up2, 1.0 / 3, 1e-4);
    EXPECT_NEAR(octant, 1.0 / 8, 2e-3);
}

}  // namespace camera_test
}  // namespace lucerna
