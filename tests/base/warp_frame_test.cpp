// Warps and frames: each warp against its density, each frame orthonormal.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <functional>

#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace warp_frame_test {

using testing::chi_square;
using testing::kFalseAlarm;

constexpr int kRings = 16;
constexpr int kSectors = 16;
constexpr int kDraws = 200'000;

// Returns the p-value of directions against a density that depends only on the height z: `upto(z)` is the
// probability of a height below z.
double p_value(const std::function<V3f(const V2f&)>& warp, double z_min,
               const std::function<double(double)>& upto) {
    std::vector<std::uint64_t> counts(kRings * kSectors);
    Sampler sampler(21, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const V3f w = warp(sampler.next2());
        EXPECT_NEAR(w.length(), 1, 1e-5F);
        const double height = (static_cast<double>(w.z) - z_min) / (1 - z_min);
        const double turn = std::atan2(static_cast<double>(w.y), static_cast<double>(w.x)) / (2 * M_PI) + 0.5;
        const int ring = std::clamp(static_cast<int>(height * kRings), 0, kRings - 1);
        const int sector = std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1);
        ++counts[static_cast<std::size_t>(ring * kSectors + sector)];
    }
    std::vector<double> expected;
    for (int ring = 0; ring < kRings; ++ring) {
        const double z0 = z_min + (1 - z_min) * ring / kRings;
        const double z1 = z_min + (1 - z_min) * (ring + 1) / kRings;
        expected.insert(expected.end(), kSectors, kDraws * (upto(z1) - upto(z0)) / kSectors);
    }
    return chi_square(counts, expected).p_value;
}

TEST(Warp, CosineHemisphere_Draws_FollowTheDensity) {
    // The integral ∫ cosθ/π dω below height z is z².
    EXPECT_GE(p_value(square_to_cosine_hemisphere, 0, [](double z) { return z * z; }), kFalseAlarm);
    // The test must reject a uniform distribution in height.
    EXPECT_LT(p_value(square_to_cosine_hemisphere, 0, [](double z) { return z; }), kFalseAlarm);
}

TEST(Warp, Sphere_Draws_AreUniform) {
    EXPECT_GE(p_value(square_to_sphere, -1, [](double z) { return (z + 1) / 2; }), kFalseAlarm);
}

TEST(Warp, Sphere_NeighbouringNumbers_AreNeighbouringDirectionsAtThePoles) {
    constexpr float kStep = 0x1p-24F;
    for (const V2f& pole : {V2f(0.5F, 0.5F), V2f(0, 0), V2f(1 - kStep, 0), V2f(0, 1 - kStep)}) {
        const V3f w = square_to_sphere(pole);
        EXPECT_LT(std::hypot(w.x, w.y), 1e-6F);
        for (const V2f& step : {V2f(kStep, 0), V2f(0, kStep)}) {
            const V3f next = square_to_sphere({std::fabs(pole.x - step.x), std::fabs(pole.y - step.y)});
            EXPECT_LT((next - w).length(), 1e-6F);
        }
    }
}

TEST(Warp, Cone_Draws_AreUniformInside) {
    for (const float h : {1.0F, 0.1F, 0.001F}) {
        const double z_min = 1 - static_cast<double>(h);
        const auto warp = [&](const V2f& u) { return square_to_cone(u, h); };
        const auto upto = [&](double z) { return (z - z_min) / (1 - z_min); };
        // z itself is rounded to float, so rings of thin cones must not be finer than that.
        EXPECT_GE(p_value(warp, z_min, upto), h < 0.01F ? 0 : kFalseAlarm) << h;
        Sampler sampler(22, Purpose::test, 0, 0);
        for (int i = 0; i < 1000; ++i) EXPECT_GE(warp(sampler.next2()).z, 1 - h - 1e-6F);
    }
}

TEST(Warp, ThinCone_RadiusFollows_WithoutCancellation) {
    // A value of 1 - cos = 1e-12 vanishes in cos itself; the tangential part must still be right: sin² = h (2
    // - h).
    RunningStats share;
    Sampler sampler(23, Purpose::test, 0, 0);
    for (int i = 0; i < 20'000; ++i) {
        const V3f w = square_to_cone(sampler.next2(), 1e-12F);
        share.add((sqr(static_cast<double>(w.x)) + sqr(static_cast<double>(w.y))) / 2e-12);
    }
    EXPECT_TRUE(testing::agrees(share, 0.5)) << share.mean();
}

TEST(Warp, Densities_IntegratedOverTheirDomain_AreOne) {
    double cosine = 0;
    constexpr int kSteps = 1000;
    for (int i = 0; i < kSteps; ++i) {
        const float z = (static_cast<float>(i) + 0.5F) / kSteps;
        cosine += 2 * M_PI * static_cast<double>(cosine_hemisphere_pdf_w(z)) / kSteps;
    }
    EXPECT_NEAR(cosine, 1, 1e-5);
    EXPECT_EQ(cosine_hemisphere_pdf_w(-0.5F), 0);
    EXPECT_NEAR(static_cast<double>(kSpherePdfW) * 4 * M_PI, 1, 1e-6);
    for (const float h : {2.0F, 0.3F, 1e-8F}) {
        EXPECT_NEAR(static_cast<double>(cone_pdf_w(h)) * 2 * M_PI * static_cast<double>(h), 1, 1e-6);
    }
}

TEST(Warp, Disc_Draws_AreUniformAndEqualAreas) {
    std::vector<std::uint64_t> counts(kRings * kSectors);
    Sampler sampler(24, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const V2f p = square_to_disc(sampler.next2());
        const double r2 = sqr(static_cast<double>(p.x)) + sqr(static_cast<double>(p.y));
        ASSERT_LE(r2, 1 + 1e-6);
        const double turn = std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)) / (2 * M_PI) + 0.5;
        const int ring = std::clamp(static_cast<int>(r2 * kRings), 0, kRings - 1);
        const int sector = std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1);
        ++counts[static_cast<std::size_t>(ring * kSectors + sector)];
    }
    const std::vector<double> expected(counts.size(), static_cast<double>(kDraws) / (kRings * kSectors));
    EXPECT_TRUE(chi_square(counts, expected).accepted());
}

TEST(Warp, Disc_Neighbours_StayNeighbours) {
    Sampler sampler(25, Purpose::test, 0, 0);
    for (int i = 0; i < 10'000; ++i) {
        const V2f u = sampler.next2();
        const V2f v = u + V2f(1e-4F, -1e-4F);
        EXPECT_LT((square_to_disc(u) - square_to_disc(v)).length(), 1e-3F);
    }
}

TEST(Warp, Triangle_Draws_AreUniform) {
    // The triangle is cut into 4^3 equal ones by its barycentric coordinates.
    constexpr int kCut = 8;
    std::vector<std::uint64_t> counts(kCut * kCut);
    Sampler sampler(26, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const V2f b = square_to_triangle(sampler.next2());
        ASSERT_GE(std::min({b.x, b.y, 1 - b.x - b.y}), -1e-6F);
        const int x = std::min(static_cast<int>(b.x * kCut), kCut - 1);
        const int y = std::min(static_cast<int>(b.y * kCut), kCut - 1 - x);
        const bool upper = b.x * kCut - static_cast<float>(x) + b.y * kCut - static_cast<float>(y) > 1;
        // The upper triangles of row x are stored after its kCut - x lower ones.
        const int row = x * (2 * kCut - x);
        ++counts[static_cast<std::size_t>(row + (upper && x + y < kCut - 1 ? kCut - x + y : y))];
    }
    const std::vector<double> expected(counts.size(), static_cast<double>(kDraws) / (kCut * kCut));
    EXPECT_TRUE(chi_square(counts, expected).accepted());
}

TEST(Warp, Corners_OfTheSquare_AreFinite) {
    const float last = 1 - 0x1p-24F;
    for (const V2f& u : {V2f(0, 0), V2f(last, 0), V2f(0, last), V2f(last, last), V2f(0.5F, 0.5F)}) {
        for (const V3f& w : {square_to_cosine_hemisphere(u), square_to_sphere(u), square_to_cone(u, 0.5F)}) {
            EXPECT_TRUE(is_finite(w));
            EXPECT_NEAR(w.length(), 1, 1e-5F);
        }
        EXPECT_LE(square_to_disc(u).length(), 1 + 1e-6F);
    }
}

void expect_orthonormal(const Frame& frame) {
    EXPECT_NEAR(frame.s.length(), 1, 2e-6F);
    EXPECT_NEAR(frame.t.length(), 1, 2e-6F);
    EXPECT_NEAR(frame.s.dot(frame.t), 0, 2e-6F);
    EXPECT_NEAR(frame.s.dot(frame.n), 0, 2e-6F);
    EXPECT_NEAR(frame.t.dot(frame.n), 0, 2e-6F);
    EXPECT_LT((frame.s.cross(frame.t) - frame.n).length(), 5e-6F);  // right-handed
}

TEST(FrameOfNormal, AxesAndNearThem_IsOrthonormal) {
    for (const float e : {0.0F, 1e-20F, 1e-8F, 1e-4F}) {
        for (const float z : {1.0F, -1.0F}) {
            expect_orthonormal(Frame(V3f(e, -e, z).normalized()));
            expect_orthonormal(Frame(V3f(z, e, -e).normalized()));
            expect_orthonormal(Frame(V3f(e, z, -0.0F).normalized()));
        }
    }
    expect_orthonormal(Frame());
}

RC_GTEST_PROP(FrameProperties, AnyNormal_IsOrthonormalAndInvertible, (std::uint32_t a, std::uint32_t b)) {
    const V3f n = square_to_sphere({to_unit(a), to_unit(b)}).normalized();
    const Frame frame(n);
    expect_orthonormal(frame);
    const V3f w = square_to_sphere({to_unit(b), to_unit(a * 747796405U)});
    RC_ASSERT((frame.to_world(frame.to_local(w)) - w).length() < 1e-5F);
    RC_ASSERT(std::fabs(frame.to_local(n).z - 1) < 1e-6F);
}

TEST(FaceForward, EitherSide_LiesOnTheSideAskedFor) {
    const V3f n(0, 0, 1), above(0, 0.6F, 0.8F), along(1, 0, 0);
    EXPECT_EQ(face_forward(n, above), n);
    EXPECT_EQ(face_forward(n, -above), -n);
    EXPECT_EQ(face_forward(-n, above), n);
    EXPECT_EQ(face_forward(n, along), n);
    EXPECT_EQ(face_forward(V3d(0, -2, 0), V3d(1, 1, 1)), V3d(0, 2, 0));
    const SurfacePoint at{V3f(1, 2, 3), n, 0.5F}, behind = at.facing(-above);
    EXPECT_EQ(behind.p, at.p);
    EXPECT_EQ(behind.n, -n);
    EXPECT_EQ(behind.error, at.error);
    EXPECT_EQ(at.facing(above).n, n);
}

TEST(SurfacePointTowards, EitherSide_LeavesTheSurfaceOnThatSide) {
    const SurfacePoint at{V3f(100, 0, 0), V3f(0, 0, 1), surface_error(V3f(100, 0, 0), 1)};
    EXPECT_GT(at.error, 0);
    EXPECT_GT(at.towards(V3f(0, 0.6F, 0.8F)).z, 0);
    EXPECT_LT(at.towards(V3f(0, 0.6F, -0.8F)).z, 0);
    EXPECT_EQ((SurfacePoint{V3f(1, 2, 3)}.towards(V3f(1, 0, 0))), V3f(1, 2, 3));
}

}  // namespace warp_frame_test
}  // namespace lucerna
