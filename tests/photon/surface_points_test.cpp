// Tests that rays from photons and from irradiance points do not meet the surface on which they begin.
#include <gtest/gtest.h>

#include <atomic>

#include "engine/base/vec.h"
#include "photon/irradiance.h"
#include "tests/support/photons.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace surface_points_test {

using testing::SceneMaker;

constexpr float kFar = 300;      // radius of the enclosing sphere
constexpr float kAbove = 3e-3F;  // height of the scrap above the surface

// A surface through the origin, with normal n there. Its error bound depends on its size: there, the
// coordinates themselves are near 0.
struct Surface {
    const char* name;
    V3f n;
    void (*add)(SceneParts& parts, std::uint32_t material, const V3f& n);
};

Mesh square(float half, const V3f& n, std::uint32_t material) {
    const Frame frame(n);
    // The square is rotated, and its middle is not on the diagonal.
    const V3f s = half * (0.8F * frame.s + 0.6F * frame.t), t = half * (0.8F * frame.t - 0.6F * frame.s);
    Mesh mesh;
    mesh.p = {-s - t, 1.1F * s - t, 1.1F * s + 1.2F * t, 1.2F * t - s};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.traits.material = material;
    return mesh;
}

const Surface kSurfaces[] = {
    {"plane of 200 m", V3f(1, 2, 3).normalized(),
     [](SceneParts& parts, std::uint32_t material, const V3f& n) {
         parts.meshes.push_back(square(100, n, material));
     }},
    {"tube", V3f(0, 0, 1),
     [](SceneParts& parts, std::uint32_t material, const V3f&) {
         Curves tube;
         tube.kind = Curves::Kind::round;
         tube.traits.material = material;
         for (const float x : {-2.0F, -0.7F, 0.7F, 2.0F}) tube.control.emplace_back(x, 0.0F, -0.5F, 0.5F);
         tube.segments = {{0, 1}};
         parts.curves.push_back(tube);
     }},
    {"instance", V3f(2, -1, 2).normalized(),
     [](SceneParts& parts, std::uint32_t material, const V3f& n) {
         Shapes shapes;
         shapes.meshes.push_back(square(0.1F, n, material));
         for (V3f& p : shapes.meshes[0].p) p += V3f(3, 5, 7);
         parts.prototypes.push_back(std::move(shapes));
         M44d map;
         map.setTranslation(V3d(-3, -5, -7));
         parts.instances.push_back({0, map * M44d().setScale(1000.0)});
     }},
};

// Returns the surface inside the far sphere; with `scrap`, a small square hangs above its middle.
Scene scene_of(const Surface& surface, bool scrap) {
    SceneParts parts;
    parts.materials.push_back({"", DiffuseMaterial{RgbTexture::constant(Rgb(0.5F))}});
    surface.add(parts, 0, surface.n);
    Quadric far;
    far.radius = kFar;
    far.traits.reverse_orientation = true;
    parts.quadrics.push_back(far);
    if (scrap) {
        Mesh mesh = square(5e-4F, -surface.n, 0);
        for (V3f& p : mesh.p) p += kAbove * surface.n;
        parts.meshes.push_back(mesh);
    }
    return Scene(std::move(parts), Workers{2});
}

// Returns photons where rays along about -n, from near the middle, meet the scene.
PhotonMap photons_below(const Scene& scene, const V3f& n, float from, float width) {
    Sampler sampler(3, Purpose::test, 0, 0);
    const Frame frame(n);
    Photons deposited;
    for (int i = 0; i < 4000; ++i) {
        const V2f u = sampler.next2();
        const V3f eye = from * n + width * ((2 * u.x - 1) * frame.s + (2 * u.y - 1) * frame.t);
        const V3f d = Frame(-n).to_world(square_to_cosine_hemisphere(sampler.next2()));
        const auto hit = scene.intersect({eye, (0.05F * d - n).normalized()});
        if (!hit) continue;
        const V3f& normal = hit->at.n;
        deposited.add(hit->at.p, PackedDirection(normal.dot(n) < 0 ? -normal : normal),
                      testing::photon(d, 1));
    }
    return PhotonMap(deposited);
}

TEST(SurfacePoints, BounceFromAPhotonNearTheScenesMiddle_LeavesItsSurface) {
    for (const Surface& surface : kSurfaces) {
        const Scene scene = scene_of(surface, false);
        const PhotonMap map = photons_below(scene, surface.n, 1, 0.01F);
        ASSERT_EQ(map.size(), 4000U) << surface.name;
        const SurfacePoints places = bounce_on(scene, map, {1, 1, 0}, Workers{2});
        EXPECT_EQ(places.size(), 4000U) << surface.name;  // nothing escapes the sphere
        std::size_t stayed = 0;
        for (const V3f& p : places.positions) stayed += p.length() < 0.99F * kFar ? 1 : 0;
        EXPECT_EQ(stayed, 0U) << surface.name;
    }
}

TEST(SurfacePoints, RaysFromAnIrradiancePointNearTheScenesMiddle_LeaveItsSurface) {
    Monitor silent;
    for (const Surface& surface : kSurfaces) {
        const Scene scene = scene_of(surface, true);
        // The photons lie on the lower side of the scrap, from where they bounce down.
        Photons under;
        Sampler sampler(5, Purpose::test, 0, 0);
        const Frame frame(surface.n);
        for (int i = 0; i < 2000; ++i) {
            const V2f u = sampler.next2();
            const V3f p = kAbove * surface.n + 3e-4F * ((2 * u.x - 1) * frame.s + (2 * u.y - 1) * frame.t);
            const V3f d = frame.to_world(square_to_cosine_hemisphere(sampler.next2()));
            under.add(p, PackedDirection(-surface.n), testing::photon(d, 1));
        }
        const PhotonMap map(under);
        const SurfacePoints places = bounce_on(scene, map, {1, 1, 0}, Workers{2});
        std::atomic<int> near = 0, met = 0;
        const auto check_ray = [&](std::uint32_t number, const SurfacePoint& at,
                                   IncidentLightSum& /*light*/) {
            if (at.p.length() > 0.02F) return NearLight{};
            Sampler own(7, Purpose::test, 0, number);
            for (int i = 0; i < 8; ++i) {
                const V3f w = Frame(at.n).to_world(square_to_cosine_hemisphere(own.next2()));
                const auto hit = scene.intersect({at.towards(w), w});
                ++near;
                if (hit && hit->t < 1e-3F) ++met;
            }
            return NearLight{};
        };
        const PhotonMap* maps[] = {&map};
        const DensityEstimateSettings how{50, 1};
        const IrradiancePoints points(places, {maps, how, {}, check_ray}, Workers{2}, silent);
        EXPECT_GT(near, 4000) << surface.name;
        EXPECT_EQ(met, 0) << surface.name << " of " << near;
    }
}

}  // namespace surface_points_test
}  // namespace lucerna
