// Tests that interleaved light paths equal paths traced one by one, and that the rays to be timed are those
// of a pass.
#include "photon/light_path_group.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "engine/base/error.h"
#include "photon/build_maps.h"
#include "photon/trace_light_paths.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace light_path_group_test {

using testing::SceneMaker;

// Returns three walls with relief, glass and a mirror between them and two lights; much light escapes.
Scene varied_room() {
    SceneMaker make;
    const auto hewn = make.material(DiffuseMaterial{RgbTexture::constant(Rgb(0.8F, 0.7F, 0.6F))},
                                    {FloatTexture::checkerboard(0, 0.02F, V2f(7, 7)), std::nullopt});
    const V3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    make.quad({0, 0, 0}, z, x, hewn);
    make.quad({0, 0, 0}, y, z, hewn);
    make.quad({0, 0, 0}, x, y, hewn);
    make.sphere({0.3F, 0.3F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
    make.sphere({0.7F, 0.3F, 0.3F}, 0.15F, make.material(MirrorMaterial{}));
    make.quad_light({0.4F, 0.999F, 0.4F}, {0.2F, 0, 0}, {0, 0, 0.2F}, make.diffuse(Rgb(0)), Rgb(3, 2, 1));
    make.light(make_point_light({0.5F, 0.8F, 0.2F}, Rgb(0.1F, 0.2F, 0.3F)));
    return make.build();
}

using Seen = std::tuple<float, float, float, float, std::uint32_t>;  // place, power and bounces
Seen seen(const LightPathHit& at) {
    return {at.hit.at.p.x, at.hit.at.p.y, at.hit.at.p.z, luminance(at.power),
            at.path.non_specular + at.path.specular};
}

constexpr std::uint32_t kPaths = 3000;

template <typename Follow>
void each_start(const Scene& scene, Follow&& follow) {
    Emission emission(scene, 3, Purpose::test, 0);
    emission.for_each(0, kPaths, [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
        if (start) follow(*start, Sampler::stratified(3, Purpose::test, 0, path));
    });
}

TEST(LightPathGroup, Paths_AreThoseThatGoOneByOne) {
    const Scene scene = varied_room();
    struct Notes : LightPathVisitor {
        std::vector<Seen> hits;
        std::uint64_t left = 0;
        void hit(const LightPathHit& at) { hits.push_back(seen(at)); }
        void escape(const LightPathEscape& /*at*/) { ++left; }
    } interleaved, alone;
    const LightPathLimits no_limits;
    LightPathGroup<Notes> group(scene, no_limits, interleaved);
    each_start(scene,
               [&](const LightPathStart& start, const Sampler& sampler) { group.add(start, sampler); });
    group.finish();
    each_start(scene, [&](const LightPathStart& start, const Sampler& sampler) {
        trace_light_path(scene, start, sampler, no_limits, alone);
    });
    ASSERT_GT(alone.hits.size(), kPaths / 2);
    ASSERT_GT(alone.left, kPaths / 10);
    EXPECT_NE(interleaved.hits, alone.hits) << "they take turns";
    std::sort(interleaved.hits.begin(), interleaved.hits.end());
    std::sort(alone.hits.begin(), alone.hits.end());
    EXPECT_EQ(interleaved.hits, alone.hits);
    EXPECT_EQ(interleaved.left, alone.left);
    EXPECT_EQ(interleaved.ledger.hits, alone.ledger.hits);
    EXPECT_NEAR(interleaved.ledger.absorbed.x, alone.ledger.absorbed.x, 1e-9 * alone.ledger.absorbed.x);
    EXPECT_LT(interleaved.ledger.imbalance(), 1e-5);
}

TEST(PathRays, OfAPass_AreAsManyAsItTraces_AndMeetWhatItMeets) {
    const Scene scene = varied_room();
    MapParameters parameters;
    parameters.paths = 2 * kPaths;
    parameters.wanted = {true, true, true, false};
    parameters.seed = 3;
    const std::vector<Ray> rays = rays_of_light_paths(scene, parameters);
    for (const int threads : {1, 2}) {
        const std::uint64_t before = scene.rays();
        Monitor silent;
        const PhotonMaps maps = build_photon_maps(scene, parameters, Workers{threads}, silent);
        EXPECT_EQ(scene.rays() - before, rays.size());
        EXPECT_EQ(scene.count_hits(rays, Workers{threads}), maps.ledger.hits);
    }
    EXPECT_EQ(scene.count_hits({}, Workers{2}), 0U);
}

TEST(LightPathRequest, FirstPathsLeft_TellsWhatAllWillLeave) {
    const std::vector<std::size_t> left{3, 0, 7};
    EXPECT_EQ(expected_of(left, 20, 100, [](std::size_t found) { return found; }), 50);
    EXPECT_EQ(expected_of(left, 20, 0, [](std::size_t found) { return found; }), 0);
    EXPECT_NO_THROW(require_path_numbers("photons", 1));
    EXPECT_NO_THROW(require_path_numbers("photons", std::int64_t{1} << 32));
    EXPECT_THROW(require_path_numbers("photons", 0), InputError);
    EXPECT_THROW(require_path_numbers("photons", (std::int64_t{1} << 32) + 1), InputError);
}

TEST(SceneHit, InSteps_IsTheSame) {
    const Scene scene = varied_room();
    MapParameters parameters;
    parameters.paths = 500;
    std::size_t hits = 0;
    for (const Ray& ray : rays_of_light_paths(scene, parameters)) {
        const auto whole = scene.intersect(ray);
        const auto first = scene.closest_hit(ray);
        ASSERT_EQ(whole.has_value(), first.has_value());
        if (!first) continue;
        ++hits;
        scene.prefetch_corners(*first);
        scene.prefetch_vertices(*first);
        const Hit hit = scene.intersect(ray, *first);
        ASSERT_EQ(hit.at.p, whole->at.p);
        ASSERT_EQ(hit.ns, whole->ns);
        ASSERT_EQ(hit.uv, whole->uv);
        ASSERT_EQ(hit.material, whole->material);
    }
    EXPECT_GT(hits, 200U);
}

}  // namespace light_path_group_test
}  // namespace lucerna
