// Transformations against points worked out by hand, in pbrt's order.
#include "engine/pbrt/transforms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/scene_text.h"

namespace lucerna {
namespace transforms_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

// Returns the world-space position of an object-space point under the directives.
V3d placed(const std::string& directives, const V3d& p) {
    const std::string text = directives + fmt::format(
                                              " Shape \"trianglemesh\" \"point3 P\" [{:.17g} {:.17g} {:.17g} "
                                              "9 0 0 0 9 0]",
                                              p.x, p.y, p.z);
    return read_world(text).draft.meshes.at(0).p.at(0);
}

void expect_near(const V3d& a, const V3d& b) {
    EXPECT_TRUE((a - b).length() <= 1e-12 * (1 + b.length()))
        << a.x << ' ' << a.y << ' ' << a.z << " for " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Transforms, Single_MovePointsAsPbrtDoes) {
    expect_near(placed("Translate 1 2 3", {10, 20, 30}), {11, 22, 33});
    expect_near(placed("Scale 2 3 -4", {1, 1, 1}), {2, 3, -4});
    expect_near(placed("Rotate 90 0 0 1", {1, 0, 0}), {0, 1, 0});  // right-handed
    expect_near(placed("Rotate 90 1 0 0", {0, 1, 0}), {0, 0, 1});
    expect_near(placed("Rotate 90 0 5 0", {0, 0, 1}), {1, 0, 0});
    expect_near(placed("Rotate 120 1 1 1", {1, 2, 3}), {3, 1, 2});
    expect_near(placed("Identity", {1, 2, 3}), {1, 2, 3});
}

TEST(Transforms, Composition_LastWrittenIsAppliedFirst) {
    expect_near(placed("Translate 1 0 0 Scale 2 2 2", {1, 1, 1}), {3, 2, 2});
    expect_near(placed("Scale 2 2 2 Translate 1 0 0", {1, 1, 1}), {4, 2, 2});
    expect_near(placed("Translate 5 0 0 Rotate 90 0 0 1 Translate 1 0 0", {0, 0, 0}), {5, 1, 0});
}

TEST(Transforms, SixteenNumbers_AreColumns) {
    // x' = 2x + 10, y' = z + 20, z' = y + 30, column by column.
    const std::string m = "[2 0 0 0  0 0 1 0  0 1 0 0  10 20 30 1]";
    expect_near(placed("Transform " + m, {1, 2, 3}), {12, 23, 32});
    expect_near(placed("Translate 100 0 0 Transform " + m, {1, 2, 3}), {12, 23, 32});
    expect_near(placed("Translate 100 0 0 ConcatTransform " + m, {1, 2, 3}), {112, 23, 32});
}

TEST(Transforms, LookAt_TakesTheWorldToTheCamera) {
    // The camera is left-handed: x right, y up, z forward. From (1,2,3) along +x with z up, right is up ×
    // forward = +y.
    const std::string view = "LookAt 1 2 3  5 2 3  0 0 1";
    expect_near(placed(view, {1, 2, 3}), {0, 0, 0});
    expect_near(placed(view, {5, 2, 3}), {0, 0, 4});
    expect_near(placed(view, {1, 2, 4}), {0, 1, 0});
    expect_near(placed(view, {1, 3, 3}), {1, 0, 0});
}

TEST(Transforms, Camera_StandsWhereLookAtPutIt) {
    const Read read = read_file_text(
        "Scale -1 1 1 LookAt 1 2 3  5 2 3  0 0 1 Camera \"perspective\" Film \"rgb\" WorldBegin");
    const M44d& m = read.draft.camera.world_from_camera;
    expect_near(transform_point(m, V3d(0)), {1, 2, 3});
    expect_near(transform_vector(m, V3d(0, 0, 1)), {1, 0, 0});
    expect_near(transform_vector(m, V3d(0, 1, 0)), {0, 0, 1});
    expect_near(transform_vector(m, V3d(1, 0, 0)), {0, -1, 0});  // mirrored by the Scale
}

TEST(Transforms, CoordinateSystems_AreRemembered) {
    expect_near(
        placed("Translate 1 0 0 CoordinateSystem \"a\" Translate 5 5 5 CoordSysTransform \"a\"", {0, 0, 0}),
        {1, 0, 0});
    expect_near(placed("Translate 1 0 0 CoordSysTransform \"world\"", {7, 8, 9}), {7, 8, 9});
    const Read read = read_file_text(
        "LookAt 1 2 3  5 2 3  0 0 1 Camera \"perspective\" Film \"rgb\" WorldBegin CoordSysTransform "
        "\"camera\" "
        "LightSource \"point\"");
    expect_near(std::get<PointSpec>(read.draft.lights.at(0).spec).position, {1, 2, 3});
    EXPECT_THAT(refusal_of_world("CoordSysTransform \"kamera\""),
                HasSubstr("scene.pbrt:2:1: there is no coordinate system \"kamera\"; did you mean "
                          "\"camera\"? 2 are defined"));
}

TEST(Transforms, WhatCannotBeUndone_IsRefusedWithItsNumbers) {
    EXPECT_THAT(refusal_of_world("Scale 1 0 1"), HasSubstr("scene.pbrt:2:1: Scale 1 0 1: not invertible"));
    EXPECT_THAT(refusal_of_world("Rotate 30 0 0 0"), HasSubstr("the axis has no length"));
    EXPECT_THAT(refusal_of_world("LookAt 1 1 1 1 1 1 0 1 0"),
                HasSubstr("LookAt 1 1 1 1 1 1 0 1 0: eye and target"));
    EXPECT_THAT(refusal_of_world("LookAt 0 0 0 0 5 0 0 -1 0"),
                HasSubstr("up is parallel to the viewing direction"));
    EXPECT_THAT(refusal_of_world("Transform [1 0 0 0 0 1 0 0 1 1 0 0 0 0 0 1]"), HasSubstr("not invertible"));
    EXPECT_THAT(refusal_of_world("Transform [1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1]"), HasSubstr("not invertible"));
    EXPECT_THAT(refusal_of_world("Scale 1e200 1e200 1e200 Scale 1e200 1 1"), HasSubstr("not invertible"));
    EXPECT_THAT(refusal_of_world("Translate 1 2"),
                HasSubstr("Translate expects 3 numbers, x y z; found \"the end of the file\" after 2"));
    EXPECT_THAT(refusal_of_world("Rotate 1 2 \"x\""), HasSubstr("scene.pbrt:2:12: Rotate expects 4 numbers"));
}

TEST(Transforms, SmallAndLargeScales_AreNoReasonToRefuse) {
    EXPECT_EQ(refusal_of_world("Scale 1e-9 1e-9 1e-9"), "");
    EXPECT_EQ(refusal_of_world("Scale 1e30 1e-30 1"), "");
    EXPECT_FALSE(inverse(scaling({1e-200, 1e-200, 1e-200})).has_value()) << "no inverse in double precision";
}

RC_GTEST_PROP(Transforms, Normal_StaysPerpendicularUnderAnyMap, (const std::array<int, 12>& raw)) {
    M44d m;
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 3; ++k) m[i][k] += raw[static_cast<std::size_t>(3 * i + k)] % 100 / 10.0;
    }
    const auto back = inverse(m);
    RC_PRE(back.has_value() && std::fabs(m.determinant()) > 1e-3);
    const V3d tangent(1, 2, 0), other(0, 1, -3), n = tangent.cross(other);
    const V3d moved = transform_normal(*back, n);
    const V3d a = transform_vector(m, tangent), b = transform_vector(m, other);
    RC_ASSERT(std::fabs(moved.dot(a)) <= 1e-9 * moved.length() * a.length());
    RC_ASSERT(std::fabs(moved.dot(b)) <= 1e-9 * moved.length() * b.length());
    // The cross product of transformed tangents reverses exactly where the map mirrors.
    RC_ASSERT((a.cross(b).dot(moved) < 0) == swaps_handedness(m));
}

TEST(Transforms, UniformScale_IsDistinguishedFromStretching) {
    EXPECT_NEAR(uniform_scale(then(rotation(33, {1, 2, 3}), scaling({2, 2, 2}))).value(), 2, 1e-12);
    EXPECT_NEAR(uniform_scale(scaling({-3, 3, 3})).value(), 3, 1e-12);
    EXPECT_FALSE(uniform_scale(scaling({2, 2, 2.01})).has_value());
    M44d shear;
    shear[0][1] = 0.01;
    EXPECT_FALSE(uniform_scale(shear).has_value());
}

}  // namespace transforms_test
}  // namespace lucerna
