#include "engine/scene/quadric.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"

namespace lucerna {
namespace quadric_test {

Quadric sphere_at(const V3d& centre, float radius) {
    Quadric q;
    q.radius = radius;
    q.world_from_object.setTranslation(centre);
    return q;
}

Quadric disk(float radius, float inner, float height) {
    Quadric q;
    q.kind = Quadric::Kind::disk;
    q.radius = radius;
    q.inner_radius = inner;
    q.height = height;
    return q;
}

V3f random_direction(Sampler& s) {
    return square_to_sphere(s.next2()).normalized();
}

// Returns a rotation, unequal scales (one of them negative if `mirror`) and a translation.
M44d random_affine(Sampler& s, double size, bool mirror) {
    M44d m;
    m.setAxisAngle(V3d(random_direction(s)), 6.28 * static_cast<double>(s.next()));
    M44d scale;
    const auto factor = [&] { return size * (0.5 + static_cast<double>(s.next())); };
    scale.setScale(V3d(mirror ? -factor() : factor(), factor(), factor()));
    M44d translation;
    translation.setTranslation(size * V3d(random_direction(s)));
    return scale * m * translation;
}

// Solves the textbook quadratic in long double, for a sphere that is only translated.
std::optional<double> textbook_sphere(const V3d& centre, double radius, const Ray& ray) {
    using L = long double;
    L b = 0, c = 0, a = 0;
    for (int i = 0; i < 3; ++i) {
        const L o = static_cast<L>(ray.o[i]) - static_cast<L>(centre[i]);
        const L d = static_cast<L>(ray.d[i]);
        a += d * d;
        b += o * d;
        c += o * o;
    }
    c -= static_cast<L>(radius) * static_cast<L>(radius);
    const L disc = b * b - a * c;
    if (disc < 0) return std::nullopt;
    for (const L t : {(-b - std::sqrt(disc)) / a, (-b + std::sqrt(disc)) / a}) {
        if (t > 0) return static_cast<double>(t);
    }
    return std::nullopt;
}

TEST(Quadric, SphereRandomRay_EqualsTextbookQuadratic) {
    for (int scale = -6; scale <= 6; ++scale) {
        const double size = std::pow(10.0, scale);
        Sampler s(1, Purpose::test, 0, static_cast<std::uint64_t>(scale + 6));
        int hits = 0;
        for (int i = 0; i < 2000; ++i) {
            const V3d centre = size * V3d(random_direction(s));
            const auto radius = static_cast<float>(size * (0.1 + static_cast<double>(s.next())));
            const QuadricShape shape(sphere_at(centre, radius));
            const V3f from(3 * size * V3d(random_direction(s)));
            const Ray ray{from, (V3f(centre) - from + V3f(size * V3d(random_direction(s)))).normalized()};
            const auto expected = textbook_sphere(centre, static_cast<double>(radius), ray);
            const auto found = shape.nearest(ray);
            ASSERT_EQ(found.has_value(), expected.has_value()) << size << " " << i;
            if (!found) continue;
            ++hits;
            EXPECT_NEAR(*found, *expected, 1e-9 * size);
            const QuadricShape::Surface surface = shape.at(ray, *found);
            EXPECT_NEAR((surface.p - centre).length(), static_cast<double>(radius), 1e-13 * size);
            EXPECT_GT(surface.n.dot(surface.p - centre), 0);
        }
        EXPECT_GT(hits, 500);
    }
}

TEST(Quadric, SphereSeenFromAMillionRadii_KeepsItsSilhouette) {
    // From z = -1e6, offsets of 0.9999 and 1.0001 radii must be told apart; b² - ac in float could not.
    const QuadricShape shape(sphere_at({0, 0, 0}, 1));
    EXPECT_TRUE(shape.nearest({{0.9999F, 0, -1e6F}, {0, 0, 1}}));
    EXPECT_FALSE(shape.nearest({{1.0001F, 0, -1e6F}, {0, 0, 1}}));
}

RC_GTEST_PROP(Quadric, SphereUnderAnyAffineMap_HitSatisfiesItsEquation, ()) {
    Sampler s(*rc::gen::arbitrary<std::uint64_t>(), Purpose::test, 0, 0);
    Quadric q;
    q.radius = 0.25F + s.next();
    q.world_from_object =
        random_affine(s, std::pow(10.0, *rc::gen::inRange(-5, 6)), *rc::gen::arbitrary<bool>());
    q.traits.reverse_orientation = *rc::gen::arbitrary<bool>();
    const QuadricShape shape(q);
    V3d centre;
    q.world_from_object.multVecMatrix(V3d(0, 0, 0), centre);
    const V3f origin(centre + 3 * static_cast<double>(shape.extent()) * V3d(random_direction(s)));
    const V3f to = V3f(centre) - origin + 0.2F * shape.extent() * random_direction(s);
    const Ray ray{origin, to.normalized()};
    const auto t = shape.nearest(ray);
    RC_PRE(t.has_value());
    const QuadricShape::Surface surface = shape.at(ray, *t);
    V3d object;
    q.world_from_object.inverse().multVecMatrix(surface.p, object);
    RC_ASSERT(std::fabs(object.length() - static_cast<double>(q.radius)) < 1e-9);
    // The point is on the ray; the normal is perpendicular to both tangents and points outwards unless
    // reversed.
    RC_ASSERT((surface.p - (V3d(ray.o) + *t * V3d(ray.d))).length() < 1e-9 * *t);
    RC_ASSERT(std::fabs(surface.n.length() - 1) < 1e-12);
    RC_ASSERT(std::fabs(surface.n.dot(surface.dpdu.normalized())) < 1e-6);
    RC_ASSERT((surface.n.dot(surface.p - centre) > 0) != q.traits.reverse_orientation);
    RC_ASSERT(shape.bounds().intersects(V3f(surface.p)));
}

TEST(Quadric, MirroringTransform_NormalStaysOutward) {
    Quadric q = sphere_at({0, 0, 0}, 1);
    q.world_from_object.setScale(V3d(-1, 1, 1));
    const Ray ray{{3, 0, 0}, {-1, 0, 0}};
    const QuadricShape shape(q);
    EXPECT_DOUBLE_EQ(shape.at(ray, *shape.nearest(ray)).n.x, 1.0);
}

TEST(Quadric, RayFromJustOutside_LeavesWithoutHittingTheSphere) {
    for (const float radius : {1e-6F, 1e-3F, 1.0F, 1e3F, 1e6F}) {
        const QuadricShape shape(sphere_at({0, 0, 0}, radius));
        Sampler s(2, Purpose::test, 0, 0);
        for (int i = 0; i < 20000; ++i) {
            const V3f n = random_direction(s);
            const SurfacePoint at{radius * n, n, surface_error(radius * n, shape.extent())};
            const V3f w = random_direction(s);
            const auto t = shape.nearest({at.towards(w), w});
            if (n.dot(w) > 0) {
                EXPECT_FALSE(t) << radius;
            } else {
                // Inwards, the distance is the chord 2 r cos, never zero.
                ASSERT_TRUE(t || -n.dot(w) < 1e-3F) << radius;
                const double chord = -2 * static_cast<double>(radius) * static_cast<double>(n.dot(w));
                if (t) {
                    EXPECT_NEAR(*t, chord, 2e-2 * static_cast<double>(radius));
                }
            }
        }
    }
}

TEST(Quadric, CapOfASphere_IsBoundedByItsRim) {
    for (const float side : {1.0F, -1.0F}) {
        Quadric q = sphere_at({1, 2, 3}, 5);
        (side > 0 ? q.z_min : q.z_max) = 4 * side;
        const Box3d box = QuadricShape(q).box();
        for (int axis = 0; axis < 2; ++axis) {
            EXPECT_NEAR(box.min[axis], 1 + axis - 3, 1e-12);
            EXPECT_NEAR(box.max[axis], 1 + axis + 3, 1e-12);
        }
        EXPECT_NEAR(box.min.z, side > 0 ? 7 : -2, 1e-12);
        EXPECT_NEAR(box.max.z, side > 0 ? 8 : -1, 1e-12);
    }
}

TEST(Quadric, PartialSphere_MeetsOnlyWhatIsThere) {
    Quadric q = sphere_at({0, 0, 0}, 2);
    q.z_min = -1;
    q.z_max = 1.5F;
    q.phi_max = kPi;  // y >= 0
    const QuadricShape shape(q);
    Sampler s(3, Purpose::test, 0, 0);
    int through = 0;
    for (int i = 0; i < 20000; ++i) {
        const Ray ray{5.0F * random_direction(s), random_direction(s)};
        // The reference takes both crossings of the full sphere and keeps the first that lies in the part.
        std::optional<V3d> expected;
        const V3d o(ray.o), d(ray.d);
        const double b = o.dot(d);
        const double disc = b * b - (o.length2() - 4) * d.length2();
        if (disc >= 0) {
            for (const double t :
                 {(-b - std::sqrt(disc)) / d.length2(), (-b + std::sqrt(disc)) / d.length2()}) {
                const V3d p = o + t * d;
                if (!expected && t > 0 && p.z >= -1 && p.z <= 1.5 && p.y >= 0) expected = p;
            }
        }
        const auto t = shape.nearest(ray);
        ASSERT_EQ(t.has_value(), expected.has_value());
        if (!t) continue;
        ++through;
        const QuadricShape::Surface surface = shape.at(ray, *t);
        EXPECT_LT((surface.p - *expected).length(), 1e-6);
        EXPECT_TRUE(shape.bounds().intersects(V3f(surface.p)));
        // Inverts pbrt's parametrisation.
        const double phi = static_cast<double>(surface.uv.x) * 3.14159265358979;
        const double low = std::acos(-0.5), high = std::acos(0.75);
        const double theta = low + static_cast<double>(surface.uv.y) * (high - low);
        const V3d back(2 * std::sin(theta) * std::cos(phi), 2 * std::sin(theta) * std::sin(phi),
                       2 * std::cos(theta));
        EXPECT_LT((back - surface.p).length(), 1e-5);
    }
    EXPECT_GT(through, 300);
}

RC_GTEST_PROP(Quadric, DiskUnderAnyAffineMap_EqualsPlaneAndRadius, ()) {
    Sampler s(*rc::gen::arbitrary<std::uint64_t>(), Purpose::test, 0, 0);
    Quadric q = disk(1, 0.5F * s.next(), s.next() - 0.5F);
    q.world_from_object =
        random_affine(s, std::pow(10.0, *rc::gen::inRange(-5, 6)), *rc::gen::arbitrary<bool>());
    q.phi_max = *rc::gen::arbitrary<bool>() ? 2 * kPi : 4.0F;
    const QuadricShape shape(q);
    // The ray aims at a known point of the disk's plane, from either side.
    const V2f at = 1.5F * square_to_disc(s.next2());
    V3d target;
    q.world_from_object.multVecMatrix(
        V3d(static_cast<double>(at.x), static_cast<double>(at.y), static_cast<double>(q.height)), target);
    const V3f origin(target + 2 * static_cast<double>(shape.extent()) * V3d(random_direction(s)));
    const Ray ray{origin, (V3f(target) - origin).normalized()};
    const float r = at.length();
    const float phi = std::atan2(at.y, at.x);
    const float phi2 = phi < 0 ? phi + 2 * kPi : phi;
    // Near an edge, float32 cannot decide.
    RC_PRE(std::fabs(r - 1) > 1e-3F && std::fabs(r - q.inner_radius) > 1e-3F && std::fabs(phi2 - 4) > 1e-2F);
    const auto t = shape.nearest(ray);
    RC_ASSERT(t.has_value() == (r < 1 && r > q.inner_radius && phi2 < q.phi_max));
    if (t) {
        const QuadricShape::Surface surface = shape.at(ray, *t);
        RC_ASSERT((surface.p - target).length() < 1e-4 * static_cast<double>(shape.extent()));
        RC_ASSERT(std::fabs(surface.uv.x - phi2 / q.phi_max) < 1e-3F);
        RC_ASSERT(std::fabs(surface.uv.y - (1 - r) / (1 - q.inner_radius)) < 1e-3F);
        RC_ASSERT(shape.bounds().intersects(V3f(surface.p)));
    }
}

TEST(Quadric, DiskNormal_IsObjectZAndReverses) {
    Quadric q = disk(1, 0, 0.5F);
    const Ray down{{0.25F, 0, 3}, {0, 0, -1}};
    QuadricShape shape(q);
    EXPECT_DOUBLE_EQ(*shape.nearest(down), 2.5);
    EXPECT_EQ(shape.at(down, 2.5).n, V3d(0, 0, 1));
    q.traits.reverse_orientation = true;
    EXPECT_EQ(QuadricShape(q).at(down, 2.5).n, V3d(0, 0, -1));
}

TEST(Quadric, PoleAndCentre_HaveATangent) {
    const Ray down{{0, 0, 3}, {0, 0, -1}};
    for (const Quadric& q : {sphere_at({0, 0, 0}, 1), disk(1, 0, 0)}) {
        const QuadricShape shape(q);
        EXPECT_GT(shape.at(down, *shape.nearest(down)).dpdu.length(), 0.1);
    }
}

TEST(Quadric, RayWithAnEnd_MeetsNothingBeyondIt) {
    const QuadricShape shape(sphere_at({0, 0, 0}, 1));
    EXPECT_FALSE(shape.nearest({{0, 0, -3}, {0, 0, 1}, 1.99F}));
    EXPECT_TRUE(shape.nearest({{0, 0, -3}, {0, 0, 1}, 2.0F}));
}

TEST(Quadric, RayThatIsNotANumber_MeetsNothing) {
    for (const Quadric& q : {sphere_at({0, 0, 0}, 1), disk(1, 0, 0)}) {
        EXPECT_FALSE(QuadricShape(q).nearest({{NAN, 0, 0}, {0, 0, 1}}));
        EXPECT_FALSE(QuadricShape(q).nearest({{0, 0, 0}, {0, NAN, 1}}));
    }
}

TEST(Quadric, ImpossibleShape_IsRefusedInOneLine) {
    std::vector<Quadric> bad(6);
    bad[0].radius = 0;
    bad[1].radius = NAN;
    bad[2].z_min = 0.5F, bad[2].z_max = -0.5F;
    bad[3].world_from_object.setScale(V3d(1, 0, 1));
    bad[4].world_from_object[3][0] = INFINITY;
    bad[5] = disk(1, 1, 0);
    for (const Quadric& q : bad) {
        try {
            QuadricShape{q};
            ADD_FAILURE() << "accepted";
        } catch (const InputError& error) {
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
            EXPECT_NE(std::string(error.what()).find("expected "), std::string::npos) << error.what();
        }
    }
}

}  // namespace quadric_test
}  // namespace lucerna
