// Compares every shape with an independent answer: a fine tessellation, finite differences, its area, and the
// same shape placed by an instance.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/scene/mesh.h"
#include "engine/scene/quadric.h"
#include "engine/scene/scene.h"

namespace lucerna {
namespace shapes_test {

using Kind = Quadric::Kind;

SceneParts parts_with_materials() {
    SceneParts parts;
    parts.materials.push_back({"grey", DiffuseMaterial{}});
    return parts;
}

V3d random_direction(Sampler& s) {
    return V3d(square_to_sphere(s.next2())).normalized();
}

Quadric some_quadric(Kind kind, Sampler& s) {
    const auto within = [&](float a, float b) { return a + (b - a) * s.next(); };
    Quadric q;
    q.kind = kind;
    q.radius = within(0.5F, 2);
    if (kind != Kind::cone && kind != Kind::disk) {
        q.z_min = kind == Kind::paraboloid ? within(0, 0.25F) : within(-1, -0.1F) * q.radius;
        q.z_max = within(0.6F, 1) * q.radius;
    }
    q.height = within(0.5F, 2);
    q.inner_radius = kind == Kind::disk ? within(0, 0.4F) : 0;
    q.p1 = V3f(within(-1, 1), within(-1, 1), within(-1, -0.2F));
    q.p2 = V3f(within(-1, 1), within(-1, 1), within(0.2F, 1));
    if (s.next() < 0.5F) std::swap(q.p1, q.p2);
    q.phi_max = s.next() < 0.5F ? 2 * kPi : within(0.5F, 6);
    q.traits.reverse_orientation = s.next() < 0.5F;
    return q;
}

M44d some_map(Sampler& s, bool mirror) {
    M44d rotation, scale, shift;
    rotation.setAxisAngle(random_direction(s), 6 * static_cast<double>(s.next()));
    scale.setScale(V3d(0.5 + static_cast<double>(s.next()), 0.5 + static_cast<double>(s.next()),
                       (mirror ? -1 : 1) * (0.5 + static_cast<double>(s.next()))));
    shift.setTranslation(random_direction(s));
    return rotation * scale * rotation * shift;
}

constexpr Kind kKinds[] = {Kind::sphere, Kind::disk,       Kind::cylinder,
                           Kind::cone,   Kind::paraboloid, Kind::hyperboloid};

TEST(Shapes, QuadricDerivatives_EqualFiniteDifferences) {
    for (const Kind kind : kKinds) {
        Sampler s(11, Purpose::test, 0, static_cast<std::uint64_t>(kind));
        for (int i = 0; i < 200; ++i) {
            Quadric q = some_quadric(kind, s);
            q.world_from_object = some_map(s, i % 2 == 1);
            const QuadricShape shape(q);
            const double u = 0.05 + 0.9 * static_cast<double>(s.next());
            const double v = 0.05 + 0.9 * static_cast<double>(s.next());
            const double h = 1e-5;
            const V3d by_u = (shape.at(u + h, v).p - shape.at(u - h, v).p) / (2 * h);
            const V3d by_v = (shape.at(u, v + h).p - shape.at(u, v - h).p) / (2 * h);
            const QuadricShape::Surface at = shape.at(u, v);
            const double size = static_cast<double>(shape.extent());
            EXPECT_LT((at.dpdu - by_u).length(), 1e-6 * size * 10) << static_cast<int>(kind);
            EXPECT_LT((at.dpdv - by_v).length(), 1e-6 * size * 10) << static_cast<int>(kind);
            EXPECT_NEAR(std::fabs(by_u.cross(by_v).normalized().dot(at.n)), 1, 1e-7);
            EXPECT_NEAR(static_cast<double>(at.uv.x), u, 1e-6);
            EXPECT_NEAR(static_cast<double>(at.uv.y), v, 1e-6);
            for (int c = 0; c < 3; ++c) {
                EXPECT_GE(at.p[c], static_cast<double>(shape.bounds().min[c]));
                EXPECT_LE(at.p[c], static_cast<double>(shape.bounds().max[c]));
            }
        }
    }
}

// pbrt's convention: the normal is dpdu × dpdv in object space, for shapes of revolution.
TEST(Shapes, QuadricNormal_InObjectSpace_IsDpduCrossDpdv) {
    for (const Kind kind : {Kind::cylinder, Kind::cone, Kind::paraboloid, Kind::hyperboloid}) {
        Sampler s(12, Purpose::test, 0, static_cast<std::uint64_t>(kind));
        for (int i = 0; i < 50; ++i) {
            Quadric q = some_quadric(kind, s);
            q.traits.reverse_orientation = false;
            const QuadricShape::Surface at = QuadricShape(q).at(0.3, 0.4);
            EXPECT_GT(at.dpdu.cross(at.dpdv).normalized().dot(at.n), 1 - 1e-9) << static_cast<int>(kind);
        }
    }
}

// A ray aimed at a known point of the surface hits it there, or hits another point of the same shape before
// it; every hit lies on the ray and on the shape.
TEST(Shapes, QuadricHits_LieOnRayAndShapeAndNeverBehindAKnownPoint) {
    for (const Kind kind : kKinds) {
        Sampler s(13, Purpose::test, 0, static_cast<std::uint64_t>(kind));
        for (int i = 0; i < 2000; ++i) {
            Quadric q = some_quadric(kind, s);
            q.world_from_object = some_map(s, i % 2 == 1);
            const QuadricShape shape(q);
            const V3d target = shape
                                   .at(0.01 + 0.98 * static_cast<double>(s.next()),
                                       0.01 + 0.98 * static_cast<double>(s.next()))
                                   .p;
            const V3d from = target + 10 * static_cast<double>(shape.extent()) * random_direction(s);
            const auto t = shape.nearest(from, target - from, 0, 2);
            ASSERT_TRUE(t) << static_cast<int>(kind) << " " << i;
            EXPECT_LE(*t, 1 + 1e-9);
            const QuadricShape::Surface at = shape.at(from, target - from, *t);
            EXPECT_LT((at.p - (from + *t * (target - from))).length(), 1e-8);
            // The surface point at the hit's texture coordinates is the hit point itself.
            const V3d again = shape.at(static_cast<double>(at.uv.x), static_cast<double>(at.uv.y)).p;
            EXPECT_LT((again - at.p).length(), 1e-4 * static_cast<double>(shape.extent()))
                << static_cast<int>(kind);
            // A ray crosses the shape at most twice.
            int crossings = 0;
            for (auto next = t; next && crossings < 5; ++crossings) {
                next = shape.nearest(from, target - from, *next, 10);
            }
            EXPECT_LE(crossings, 2);
        }
    }
}

TEST(Shapes, QuadricArea_ByRandomChords_EqualsTheFormula) {
    // Uniformly distributed lines cross a surface in proportion to its area (Cauchy and Crofton): for chords
    // of a ball of radius R, the mean number of crossings is area / (2π R²).
    struct Case {
        Quadric q;
        double area;
    };
    std::vector<Case> cases;
    Quadric q;
    q.kind = Kind::cylinder, q.radius = 0.5F, q.z_min = -0.7F, q.z_max = 0.6F, q.phi_max = 4;
    cases.push_back({q, 0.5 * 1.3 * 4});
    q = {}, q.kind = Kind::cone, q.radius = 0.6F, q.height = 0.8F;
    cases.push_back({q, M_PI * 0.6 * 1.0});
    q = {}, q.kind = Kind::paraboloid, q.radius = 0.5F, q.z_min = 0, q.z_max = 0.5F;
    cases.push_back({q, M_PI * 0.5 / (6 * 0.25) * (std::pow(0.25 + 4 * 0.25, 1.5) - std::pow(0.5, 3))});
    q = {}, q.kind = Kind::hyperboloid, q.p1 = {0.5F, 0, -0.5F}, q.p2 = {0.3F, 0, 0.5F};  // a truncated cone
    cases.push_back({q, M_PI * 0.8 * std::hypot(0.2, 1.0)});
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const QuadricShape shape(cases[k].q);
        Sampler s(14, Purpose::test, 0, k);
        const int n = 200000;
        double crossings = 0;
        for (int i = 0; i < n; ++i) {
            const V3d a = random_direction(s), b = random_direction(s);  // chords of the unit ball
            double t = 0;
            while (const auto next = shape.nearest(a, b - a, t, 1)) {
                t = *next;
                ++crossings;
            }
        }
        const double mean = crossings / n;  // chords between uniform points of the unit sphere
        const double expected = cases[k].area / (2 * M_PI);  // are uniform lines: 2 area / (4π)
        EXPECT_NEAR(mean, expected, 5 * std::sqrt(expected / n) * 1.5) << k;
        EXPECT_GT(std::fabs(mean - 1.05 * expected), 5 * std::sqrt(expected / n)) << k;  // 5 % is detected
    }
}

BilinearMesh some_patch(Sampler& s) {
    BilinearMesh mesh;
    for (const V3f& corner : {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0), V3f(1, 1, 0)}) {
        mesh.p.push_back(corner + 0.4F * V3f(s.next(), s.next(), 2 * s.next()));
    }
    mesh.patches = {{0, 1, 2, 3}};
    return mesh;
}

TEST(Shapes, PatchHits_EqualAFineTessellation) {
    Sampler s(15, Purpose::test, 0, 0);
    int met = 0;
    for (int k = 0; k < 20; ++k) {
        SceneParts exact = parts_with_materials(), fine = parts_with_materials();
        const BilinearMesh mesh = some_patch(s);
        const PatchShape shape(mesh, 0);
        exact.patches = {mesh};
        constexpr int kPieces = 100;
        Mesh grid;
        for (int y = 0; y <= kPieces; ++y) {
            for (int x = 0; x <= kPieces; ++x) {
                grid.p.push_back(V3f(shape.point(x / double{kPieces}, y / double{kPieces})));
            }
        }
        for (int y = 0; y < kPieces; ++y) {
            for (int x = 0; x < kPieces; ++x) {
                const int c = y * (kPieces + 1) + x, d = c + kPieces + 1;
                grid.triangles.emplace_back(c, c + 1, d + 1);
                grid.triangles.emplace_back(c, d + 1, d);
            }
        }
        fine.meshes.push_back(grid);
        const Scene a(std::move(exact)), b(std::move(fine));
        for (int i = 0; i < 300; ++i) {
            const V3f o(3.0 * random_direction(s));
            const V3f to(shape.point(0.02 + 0.96 * static_cast<double>(s.next()),
                                     0.02 + 0.96 * static_cast<double>(s.next())));
            const Ray ray{o, (to - o).normalized()};
            const auto x = a.intersect(ray), y = b.intersect(ray);
            ASSERT_TRUE(x) << "the ray was aimed at the patch";
            if (!y) continue;  // beyond the silhouette of the grid
            // Near grazing, a ray may cross the patch once more or once less than the grid.
            if (std::fabs(x->at.n.dot(ray.d)) < 0.2F || std::fabs(y->at.n.dot(ray.d)) < 0.2F) continue;
            ++met;
            EXPECT_NEAR(x->t, y->t, 2e-3F);
            EXPECT_GT(x->at.n.dot(y->at.n), 0.999F);
            const V3d again = shape.point(static_cast<double>(x->uv.x), static_cast<double>(x->uv.y));
            EXPECT_LT((again - V3d(x->at.p)).length(), 1e-5);
            const double h = 1e-4, u = static_cast<double>(x->uv.x), v = static_cast<double>(x->uv.y);
            const V3d by_u = (shape.point(u + h, v) - shape.point(u - h, v)) / (2 * h);
            const V3d by_v = (shape.point(u, v + h) - shape.point(u, v - h)) / (2 * h);
            EXPECT_LT((V3d(x->dpdu) - by_u).length(), 1e-4);
            EXPECT_LT((V3d(x->dpdv) - by_v).length(), 1e-4);
        }
    }
    EXPECT_GT(met, 3000);
}

Curves some_curve(Curves::Kind kind, Sampler& s) {
    Curves curves;
    curves.kind = kind;
    for (int i = 0; i < 4; ++i) {
        curves.control.emplace_back(static_cast<float>(i) / 3, 0.3F * s.next(), 0.3F * s.next(), 0.05F);
        if (kind == Curves::Kind::ribbon) curves.n.emplace_back(0.0F, 0.0F, 1.0F);
    }
    curves.segments = {{0, 1}};
    return curves;
}

TEST(Shapes, RoundCurve_HitsLieAtItsRadiusFromTheAxis) {
    Sampler s(16, Purpose::test, 0, 0);
    for (int k = 0; k < 20; ++k) {
        SceneParts parts = parts_with_materials();
        const Curves curve = some_curve(Curves::Kind::round, s);
        parts.curves = {curve};
        const Scene scene(std::move(parts));
        const auto point = [&](double u) {
            V3d sum(0);
            const double w = 1 - u, b[] = {w * w * w, 3 * u * w * w, 3 * u * u * w, u * u * u};
            for (std::size_t i = 0; i < 4; ++i) {
                const auto& c = curve.control[i];
                sum += b[i] * V3d(V3f(c.x, c.y, c.z));
            }
            return sum;
        };
        for (int i = 0; i < 100; ++i) {
            const V3d axis = point(0.1 + 0.8 * static_cast<double>(s.next()));
            // The ray comes from the side: the tube is open at its ends.
            const double phi = 2 * M_PI * static_cast<double>(s.next());
            const V3f o(axis + 2.0 * V3d(0, std::cos(phi), std::sin(phi)));
            const Ray ray{o, (V3f(axis) - o).normalized()};
            const auto hit = scene.intersect(ray);
            ASSERT_TRUE(hit);
            double nearest = 1e9;
            for (int j = 0; j <= 2000; ++j) {
                nearest = std::min(nearest, (point(j / 2000.0) - V3d(hit->at.p)).length());
            }
            EXPECT_NEAR(nearest, 0.05, 2e-4);
            EXPECT_LT(hit->at.n.dot(ray.d), 0);
            // The ray along the normal leaves the tube without hitting it again.
            EXPECT_TRUE(scene.unoccluded(hit->at, hit->at.n, 0.01F));
        }
    }
}

TEST(Shapes, Ribbon_IsHitWhereItsBandLiesAndFacesItsNormals) {
    Sampler s(18, Purpose::test, 0, 0);
    for (const float tilt : {0.0F, 0.4F, 1.2F}) {
        // A straight band along x; its normal is rotated about x by the tilt.
        const V3f normal(0, std::sin(tilt), std::cos(tilt)), across(0, std::cos(tilt), -std::sin(tilt));
        SceneParts parts = parts_with_materials();
        Curves curve;
        curve.kind = Curves::Kind::ribbon;
        for (int i = 0; i < 4; ++i) {
            curve.control.emplace_back(static_cast<float>(i) / 3, 0.0F, 0.0F, 0.1F);
            curve.n.push_back(normal);
        }
        curve.segments = {{0, 1}};
        parts.curves = {curve};
        const Scene scene(std::move(parts));
        int met = 0;
        for (int i = 0; i < 1000; ++i) {
            V3f d(V3d(random_direction(s)));
            if (std::fabs(d.dot(normal)) < 0.2F) continue;  // nearly along the band, rounding decides
            const float off = 0.4F * s.next() - 0.2F, x = 0.05F + 0.9F * s.next();
            if (std::fabs(std::fabs(off) - 0.1F) < 2e-3F) continue;
            const auto hit = scene.intersect({V3f(x, 0, 0) + off * across - 2.0F * d, d});
            // Unlike a flat curve, the ribbon does not turn to the ray: only rays through the band itself hit
            // it.
            ASSERT_EQ(hit.has_value(), std::fabs(off) < 0.1F) << "tilt " << tilt << ", off " << off;
            if (!hit) continue;
            ++met;
            EXPECT_NEAR(hit->t, 2, 1e-3F);
            EXPECT_GT(std::fabs(hit->at.n.dot(normal)), 0.999F);
            EXPECT_NEAR(hit->uv.x, x, 2e-3F);
        }
        EXPECT_GT(met, 200);
    }
}

TEST(Shapes, FlatCurve_IsAsWideAsItIsSaidFromEverySide) {
    Sampler s(17, Purpose::test, 0, 0);
    SceneParts parts = parts_with_materials();
    Curves curve;
    for (int i = 0; i < 4; ++i) curve.control.emplace_back(static_cast<float>(i) / 3, 0.0F, 0.0F, 0.1F);
    curve.segments = {{0.25F, 0.5F}};
    parts.curves = {curve};
    const Scene scene(std::move(parts));
    for (int i = 0; i < 1000; ++i) {
        const double phi = 2 * M_PI * static_cast<double>(s.next());
        const V3f d(0, static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi)));
        const V3f side(0, -d.z, d.y);
        const float off = 0.4F * s.next() - 0.2F, x = 0.05F + 0.9F * s.next();
        const auto hit = scene.intersect({V3f(x, 0, 0) + off * side - 2.0F * d, d});
        if (std::fabs(std::fabs(off) - 0.1F) < 1e-3F) continue;
        ASSERT_EQ(hit.has_value(), std::fabs(off) < 0.1F) << off;
        if (!hit) continue;
        EXPECT_NEAR(hit->t, 2, 1e-4F);
        EXPECT_LT(hit->at.n.dot(d), -0.999F);
        EXPECT_NEAR(hit->uv.x, 0.25F + 0.25F * x, 1e-3F);
        EXPECT_NEAR(hit->uv.y, 0.5F + off / 0.2F * (hit->dpdv.dot(side) > 0 ? 1.0F : -1.0F), 1e-3F);
        EXPECT_NEAR(hit->dpdu.x, 4, 1e-3F);
    }
}

// --- Instances

SceneParts prototype_and_copy(Sampler& s, const M44d& map, bool placed) {
    SceneParts parts = parts_with_materials();
    Shapes shapes;
    Mesh mesh;
    for (int i = 0; i < 30; ++i) mesh.p.push_back(V3f(random_direction(s)));
    for (int i = 0; i < 30; i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
    for (const V3f& p : mesh.p) mesh.n.push_back(p.normalized());
    for (int i = 0; i < 30; ++i) mesh.uv.push_back(s.next2());
    shapes.meshes.push_back(mesh);
    Quadric q = some_quadric(Kind::cone, s);
    shapes.quadrics.push_back(q);
    shapes.patches.push_back(some_patch(s));
    if (placed) {
        parts.prototypes.push_back(shapes);
        parts.instances.push_back({0, map});
        return parts;
    }
    const bool mirrored = map.determinant() < 0;
    const M44d back = map.inverse();
    for (V3f& p : shapes.meshes[0].p) map.multVecMatrix(V3f(p), p);
    for (V3f& n : shapes.meshes[0].n) {  // by the inverse transpose
        const V3f from = n;
        for (int i = 0; i < 3; ++i) {
            n[i] = static_cast<float>(back[i][0]) * from.x + static_cast<float>(back[i][1]) * from.y +
                   static_cast<float>(back[i][2]) * from.z;
        }
    }
    // The cross product of transformed edges changes its sign with the handedness; the instance's normal does
    // not.
    shapes.meshes[0].traits.reverse_orientation = mirrored;
    shapes.quadrics[0].world_from_object = q.world_from_object * map;
    for (V3f& p : shapes.patches[0].p) map.multVecMatrix(V3f(p), p);
    shapes.patches[0].traits.reverse_orientation = mirrored;
    static_cast<Shapes&>(parts) = shapes;
    return parts;
}

TEST(Shapes, Instance_MeetsWhatTheTransformedShapesMeet) {
    for (std::uint64_t k = 0; k < 20; ++k) {
        Sampler maps(18, Purpose::test, 1, k);
        const M44d map = some_map(maps, k % 2 == 1);
        Sampler a(18, Purpose::test, 0, k), b(18, Purpose::test, 0, k);
        const Scene placed(prototype_and_copy(a, map, true)), copied(prototype_and_copy(b, map, false));
        EXPECT_EQ(placed.counts().instances, 1U);
        EXPECT_EQ(placed.counts().triangles_seen, copied.counts().triangles);
        int differ = 0, hits = 0;
        for (int i = 0; i < 500; ++i) {
            const V3f o(5.0 * random_direction(maps));
            const Ray ray{o, (V3f(random_direction(maps)) - o).normalized()};
            const auto x = placed.intersect(ray), y = copied.intersect(ray);
            if (x.has_value() != y.has_value() || (x && std::fabs(x->t - y->t) > 1e-4F)) {
                ++differ;  // at an edge
                continue;
            }
            if (!x) continue;
            ++hits;
            EXPECT_LT((x->at.p - y->at.p).length(), 1e-4F);
            EXPECT_GT(x->at.n.dot(y->at.n), 0.9999F) << k << " " << i;
            EXPECT_GT(x->ns.dot(y->ns), 0.999F) << k << " " << i;
            EXPECT_LT((x->dpdu - y->dpdu).length(), 1e-3F * y->dpdu.length());
            EXPECT_LT((x->dpdv - y->dpdv).length(), 1e-3F * y->dpdv.length());
            EXPECT_LT((x->uv - y->uv).length(), 1e-3F);
            EXPECT_EQ(x->wo, -ray.d);
            EXPECT_EQ(placed.unoccluded(x->at, -ray.d, x->t), copied.unoccluded(y->at, -ray.d, y->t));
        }
        EXPECT_LE(differ, 5);
        EXPECT_GT(hits, 50);
    }
}

// --- Cut-outs

TEST(Shapes, CutOut_LetsTheShareOfRaysPassAndTheSameRayAlways) {
    for (const float alpha : {0.0F, 0.3F, 0.8F, 1.0F}) {
        SceneParts parts = parts_with_materials();
        Mesh mesh;
        mesh.p = {{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}};
        mesh.triangles = {{0, 1, 2}};
        const auto texture = std::make_shared<const FloatTexture>(FloatTexture::constant(alpha));
        mesh.traits.alpha = texture;
        parts.meshes.push_back(mesh);
        Quadric ball;
        ball.radius = 0.5F;
        ball.world_from_object.setTranslation(V3d(0, 0, -3));
        ball.traits.alpha = texture;
        parts.quadrics.push_back(ball);
        const Scene scene(std::move(parts));
        Sampler s(19, Purpose::test, 0, 0);
        int sheet = 0, free = 0, n = 20000;
        for (int i = 0; i < n; ++i) {
            const V3f at(s.next() - 0.5F, s.next() - 0.5F, 0);
            const Ray ray{{0, 0, 4}, (at - V3f(0, 0, 4)).normalized()};
            const auto hit = scene.intersect(ray), again = scene.intersect(ray);
            ASSERT_EQ(hit.has_value(), again.has_value());
            ASSERT_EQ(hit ? hit->t : 0, again ? again->t : 0);
            sheet += hit && hit->at.p.z > -0.1F ? 1 : 0;
            free += scene.unoccluded({{0, 0, 4}}, ray.d, 5) ? 1 : 0;
        }
        const double sigma = std::sqrt(static_cast<double>(n) * 0.25);
        EXPECT_NEAR(sheet, static_cast<double>(alpha) * n, 5 * sigma);
        EXPECT_NEAR(free, (1 - static_cast<double>(alpha)) * n, 5 * sigma);
    }
}

TEST(Shapes, ShadowCutOut_IsSeenButHidesNothing) {
    SceneParts parts = parts_with_materials();
    Mesh mesh;
    mesh.p = {{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.traits.shadow_alpha = std::make_shared<const FloatTexture>(FloatTexture::constant(0));
    parts.meshes.push_back(mesh);
    const Scene scene(std::move(parts));
    EXPECT_TRUE(scene.intersect({{0, 0, 1}, {0, 0, -1}}));
    EXPECT_TRUE(scene.unoccluded({{0, 0, 1}}, {0, 0, -1}, 2));
}

// --- Subdivision

const std::vector<V3i> kOctahedron{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1},
                                   {5, 2, 1}, {5, 3, 2}, {5, 4, 3}, {5, 1, 4}};
const std::vector<V3d> kCorners{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};

TEST(Shapes, LoopLimit_DoesNotDependOnTheLevelAtWhichItIsTaken) {
    const LoopMesh coarse = subdivide_loop(kCorners, kOctahedron, 0);
    for (int level = 1; level <= 4; ++level) {
        const LoopMesh fine = subdivide_loop(kCorners, kOctahedron, level);
        EXPECT_EQ(fine.triangles.size(), 8U << (2 * level));
        for (const V3d& p : coarse.p) {
            double nearest = 1;
            for (const V3d& q : fine.p) nearest = std::min(nearest, (p - q).length());
            EXPECT_LT(nearest, 1e-6);
        }
        for (const V3i& t : fine.triangles) {
            const V3d n = (fine.p[t.y] - fine.p[t.x]).cross(fine.p[t.z] - fine.p[t.x]).normalized();
            EXPECT_GT(n.dot(fine.n[t.x]), level > 2 ? 0.98 : 0.5);
        }
    }
}

bool is_watertight(const LoopMesh& loop) {
    SceneParts parts = parts_with_materials();
    Mesh mesh;
    for (const V3d& p : loop.p) mesh.p.push_back(V3f(p));
    mesh.triangles = loop.triangles;
    parts.meshes.push_back(mesh);
    const Scene scene(std::move(parts));
    Sampler s(20, Purpose::test, 0, 0);
    for (int i = 0; i < 20000; ++i) {
        if (!scene.intersect({{0.01F, 0.02F, -0.03F}, V3f(random_direction(s))})) return false;
    }
    return true;
}

TEST(Shapes, LoopOfAClosedMesh_IsWatertightAndAHoleIsFound) {
    LoopMesh closed = subdivide_loop(kCorners, kOctahedron, 4);
    EXPECT_TRUE(is_watertight(closed));
    closed.triangles.erase(closed.triangles.begin() + 100);
    EXPECT_FALSE(is_watertight(closed));
}

TEST(Shapes, LoopOfNoSurface_IsRefused) {
    EXPECT_THROW(subdivide_loop(kCorners, {{0, 1, 1}}, 2), InputError);
    EXPECT_THROW(subdivide_loop(kCorners, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}, 2), InputError);
}

}  // namespace shapes_test
}  // namespace lucerna
