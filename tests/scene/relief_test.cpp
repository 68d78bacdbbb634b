// Normals from maps: they follow the map, and no light arrives from behind the surface.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/sampler.h"
#include "engine/scene/material.h"
#include "engine/scene/scene.h"
#include "tests/support/materials.h"

namespace lucerna {
namespace relief_test {

using namespace lucerna::testing;

Relief map_of(const V3f& n) {
    const V3f stored = (n + V3f(1)) / 2;
    return {std::nullopt, RgbTexture::constant(Rgb(stored.x, stored.y, stored.z))};
}

TEST(Relief, NormalMap_OnAFlatSurface_IsTheNormalInItsFrame) {
    Hit hit = flat_hit();
    const V3f n = V3f(0.3F, -0.2F, 0.9F).normalized();
    EXPECT_LT((bent_normal(map_of(n), hit, hit.uv) - n).length(), 1e-6F);
    hit.dpdu = V3f(0, 7, 0);  // the map's x follows the tangent, y is perpendicular
    EXPECT_LT((bent_normal(map_of(n), hit, hit.uv) - V3f(-n.y, n.x, n.z)).length(), 1e-6F);
    EXPECT_EQ(bent_normal({}, hit, hit.uv), hit.ns);
    EXPECT_EQ(bent_normal({std::nullopt, RgbTexture::constant(Rgb(0.5F))}, hit, hit.uv), hit.ns)
        << "a map of nothing";
}

// A normal that faces away from the viewer is bent towards the geometric normal ng: to n + t ng, whose
// product with wo is a tenth of ng's. Here n and ng are at 140 and 80 degrees to wo.
TEST(Relief, Normal_SeenFromBehindIt_TurnsTowardsTheViewer) {
    Hit hit = flat_hit();
    hit.wo = direction(80, kPi);
    const V3f n = direction(60, 0);
    ASSERT_LT(n.dot(hit.wo), 0);
    const double degree = std::numbers::pi / 180;
    const double t = 0.1 - std::cos(140 * degree) / std::cos(80 * degree);
    const double bent = std::atan2(std::sin(60 * degree), std::cos(60 * degree) + t) / degree;
    const V3f expected = direction(static_cast<float>(bent), 0);
    EXPECT_LT((bent_normal(map_of(n), hit, hit.uv) - expected).length(), 1e-5F);
    EXPECT_GT(expected.dot(hit.wo), 0);
    hit.wo = -hit.wo;  // from inside, the normal must be on the other side of the viewer's plane
    EXPECT_LT((bent_normal(map_of(n), hit, hit.uv) - expected).length(), 1e-5F);
    hit.wo = below(direction(80, kPi));  // from inside, where the normal is on that side already
    EXPECT_LT((bent_normal(map_of(n), hit, hit.uv) - n).length(), 1e-6F);
}

TEST(Relief, Constant_Displacement_BendsNothing) {
    Hit hit = flat_hit();
    hit.ns = V3f(0.6F, 0, 0.8F);
    const Relief level{FloatTexture::constant(3), std::nullopt};
    EXPECT_LT((bent_normal(level, hit, hit.uv) - hit.ns).length(), 1e-5F);
}

RC_GTEST_PROP(Relief, AnyMap_StaysOnTheSurfacesSideAndLeaksNothing, ()) {
    const auto unit = rc::gen::map(rc::gen::arbitrary<std::uint32_t>(), to_unit);
    const auto any = [&] {
        const float z = 2 * *unit - 1, phi = 6.2831853F * *unit, s = std::sqrt(std::max(0.0F, 1 - z * z));
        return V3f(s * std::cos(phi), s * std::sin(phi), z);
    };
    Hit hit = flat_hit();
    hit.at.n = any();
    hit.ns = any();
    if (hit.ns.dot(hit.at.n) < 0) hit.ns = -hit.ns;
    hit.dpdu = 10.0F * any();
    hit.dpdv = any();
    hit.wo = any();
    Material material{"", DiffuseMaterial{grey(1)}};
    material.relief = map_of(any());
    const V3f n = bent_normal(material.relief, hit, hit.uv);
    RC_ASSERT(std::fabs(n.length() - 1) < 1e-5F);
    RC_ASSERT(n.dot(hit.at.n) > -1e-5F);
    const float side = hit.wo.dot(hit.at.n) >= 0 ? 1.0F : -1.0F;
    RC_ASSERT(side * n.dot(hit.wo) > -1e-5F);
    const Bsdf bsdf = make_bsdf(material, hit);
    const V3f wi = any();
    if (hit.wo.dot(hit.at.n) * wi.dot(hit.at.n) < 0) {
        RC_ASSERT(is_black(bsdf.f(hit.wo, wi, Transport::radiance)));
    }
}

}  // namespace relief_test
}  // namespace lucerna
