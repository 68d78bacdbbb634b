// Meshes in a scene: position, normals, texture coordinates, and the triangles that are left out.
#include "engine/scene/mesh.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/scene/scene.h"

namespace lucerna {
namespace mesh_test {

Scene scene_of(std::vector<Mesh> meshes) {
    SceneParts parts;
    parts.materials.push_back({"grey", DiffuseMaterial{}});
    parts.meshes = std::move(meshes);
    return Scene(std::move(parts), Workers{2});
}

Mesh triangle(const V3f& a, const V3f& b, const V3f& c) {
    Mesh mesh;
    mesh.p = {a, b, c};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

V3f random_direction(Sampler& s) {
    return square_to_sphere(s.next2()).normalized();
}

struct MediaTraversal {
    double t, b1, b2;
};

// Solves o + t d = p0 + b1 e1 + b2 e2 by Cramer's rule in double precision.
MediaTraversal plain_crossing(const Mesh& mesh, const Ray& ray) {
    const V3d p0(mesh.p[0]);
    const V3d e1 = V3d(mesh.p[1]) - p0;
    const V3d e2 = V3d(mesh.p[2]) - p0;
    const V3d d(ray.d), o = V3d(ray.o) - p0;
    const double determinant = -d.dot(e1.cross(e2));
    return {o.dot(e1.cross(e2)) / determinant, -d.dot(o.cross(e2)) / determinant,
            -d.dot(e1.cross(o)) / determinant};
}

RC_GTEST_PROP(Mesh, RandomTriangle_HitEqualsPlainDouble, ()) {
    Sampler s(*rc::gen::arbitrary<std::uint64_t>(), Purpose::test, 0, 0);
    const auto size = static_cast<float>(std::pow(10.0, *rc::gen::inRange(-6, 7)));
    Mesh mesh = triangle(size * random_direction(s), size * random_direction(s), size * random_direction(s));
    mesh.uv = {{0.5F, 0}, {2, 0.25F}, {1, 3}};
    mesh.traits.reverse_orientation = *rc::gen::arbitrary<bool>();
    const V3f e1 = mesh.p[1] - mesh.p[0], e2 = mesh.p[2] - mesh.p[0];
    RC_PRE(e1.cross(e2).length() > 0.01F * size * size);
    // The ray aims at a point of the plane, inside or outside the triangle, away from its edges and not at a
    // grazing angle.
    const V2f b(1.6F * s.next() - 0.3F, 1.6F * s.next() - 0.3F);
    const V3f origin = 3 * size * random_direction(s);
    const Ray ray{origin, (mesh.p[0] + b.x * e1 + b.y * e2 - origin).normalized()};
    RC_PRE(std::fabs(e1.cross(e2).normalized().dot(ray.d)) > 0.05F);
    const MediaTraversal expected = plain_crossing(mesh, ray);
    const double inside = std::min({expected.b1, expected.b2, 1 - expected.b1 - expected.b2});
    RC_PRE(std::fabs(inside) > 1e-4);

    const Scene scene = scene_of({mesh});
    const auto hit = scene.intersect(ray);
    RC_ASSERT(hit.has_value() == (inside > 0));
    if (!hit) return;
    const auto scale = static_cast<double>(size);
    // t errs by at most one rounding to float32, whatever approximations precede it.
    RC_ASSERT(std::fabs(static_cast<double>(hit->t) - expected.t) <= 0x1p-23 * expected.t);
    RC_ASSERT((V3d(hit->at.p) - (V3d(ray.o) + expected.t * V3d(ray.d))).length() < 1e-4 * scale);
    // The point lies much closer to the plane than along the ray: within its own error bound.
    V3d n = V3d(e1).cross(V3d(e2)).normalized();
    RC_ASSERT(std::fabs((V3d(hit->at.p) - V3d(mesh.p[0])).dot(n)) < static_cast<double>(hit->at.error) / 2);
    if (mesh.traits.reverse_orientation) n.negate();
    RC_ASSERT((V3d(hit->at.n) - n).length() < 1e-5);
    RC_ASSERT((hit->ns - hit->at.n).length() == 0.0F);
    const double b1 = expected.b1, b2 = expected.b2, b0 = 1 - b1 - b2;
    RC_ASSERT(std::fabs(static_cast<double>(hit->uv.x) - (0.5 * b0 + 2 * b1 + b2)) < 1e-3);
    RC_ASSERT(std::fabs(static_cast<double>(hit->uv.y) - (0.25 * b1 + 3 * b2)) < 1e-3);
    // dp/du is the displacement for which u grows by 1 and v stays constant, found by solving for
    // barycentrics.
    const double det = 1.5 * 3 - 0.25 * 0.5;
    const V3d dpdu = (3.0 * V3d(e1) - 0.25 * V3d(e2)) / det;
    RC_ASSERT((V3d(hit->dpdu) - dpdu).length() < 1e-4 * scale);
}

TEST(Mesh, WithoutUv_UsesPbrtsTriangleCoordinates) {
    const Scene scene = scene_of({triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})});
    const auto hit = scene.intersect({{0.25F, 0.5F, 1}, {0, 0, -1}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->uv.x, 0.75F, 1e-6F);  // b1 + b2
    EXPECT_NEAR(hit->uv.y, 0.5F, 1e-6F);   // b2
    EXPECT_GT(hit->dpdu.length(), 0);
    EXPECT_EQ(hit->at.n, V3f(0, 0, 1));
}

TEST(Mesh, EqualUv_StillHasATangent) {
    Mesh mesh = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    mesh.uv = {{0.5F, 0.5F}, {0.5F, 0.5F}, {0.5F, 0.5F}};
    const auto hit = scene_of({mesh}).intersect({{0.25F, 0.5F, 1}, {0, 0, -1}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->dpdu.length(), 1, 1e-5F);
    EXPECT_NEAR(hit->dpdu.dot(hit->at.n), 0, 1e-5F);
}

TEST(Mesh, ShadingNormals_AreInterpolatedAndTurnedToTheGeometricOne) {
    Mesh mesh = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const V3f tilted = V3f(0.6F, 0, 0.8F);
    mesh.n = {tilted, tilted, tilted};
    const Ray ray{{0.25F, 0.25F, 1}, {0, 0, -1}};
    auto hit = scene_of({mesh}).intersect(ray);
    EXPECT_LT((hit->ns - tilted).length(), 1e-6F);
    EXPECT_EQ(hit->at.n, V3f(0, 0, 1));
    // Reversing the orientation flips the geometric normal and with it the shading normal.
    mesh.traits.reverse_orientation = true;
    hit = scene_of({mesh}).intersect(ray);
    EXPECT_EQ(hit->at.n, V3f(0, 0, -1));
    EXPECT_LT((hit->ns + tilted).length(), 1e-6F);
    // Normals that cancel or are not numbers are replaced by the geometric one.
    for (const V3f& bad : {V3f(0, 0, 0), V3f(NAN, 0, 1)}) {
        mesh.n = {bad, bad, bad};
        EXPECT_EQ(scene_of({mesh}).intersect(ray)->ns, V3f(0, 0, -1));
    }
}

TEST(Mesh, DegenerateTriangles_AreLeftOutAndCounted) {
    Mesh mesh = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    mesh.p.insert(mesh.p.end(), {{NAN, 0, 0}, {INFINITY, 0, 0}, {2, 0, 0}, {1e30F, 0, 0}});
    mesh.triangles = {{0, 0, 1}, {0, 1, 5}, {0, 1, 3}, {4, 1, 2}, {0, 1, 6}, {0, 1, 2}};
    const Scene scene = scene_of({mesh});
    EXPECT_EQ(scene.counts().triangles, 1U);
    EXPECT_EQ(scene.counts().degenerate_triangles, 5U);
    EXPECT_EQ(scene.bounds(), Box3f(V3f(0, 0, 0), V3f(1, 1, 0)));
    const auto hit = scene.intersect({{0.25F, 0.25F, 1}, {0, 0, -1}});
    ASSERT_TRUE(hit);
    EXPECT_LT((hit->at.p - V3f(0.25F, 0.25F, 0)).length(), 1e-6F);
    EXPECT_FALSE(scene.intersect({{0.25F, -0.25F, 1}, {0, 0, -1}}));
}

TEST(Mesh, OnlyDegenerateTriangles_IsAnEmptyScene) {
    const Scene scene = scene_of({triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0})});
    EXPECT_EQ(scene.counts().triangles, 0U);
    EXPECT_TRUE(scene.bounds().isEmpty());
    EXPECT_FALSE(scene.intersect({{0, 0, 1}, {0, 0, -1}}));
}

}  // namespace mesh_test
}  // namespace lucerna
