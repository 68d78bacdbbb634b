// Tests chains over mirrors and glass: their derivatives, how they are found, and that the path tracer that
// searches for them keeps its mean, for lamps on surfaces, without geometry and without size.
#include "engine/guiding/chain_guide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/integrators/integrator.h"
#include "lights/measured.h"
#include "tests/support/media.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"
#include "tests/support/smooth_lamp.h"

namespace lucerna {
namespace chain_guide_test {

using testing::OnePass;
using testing::SceneMaker;
using enum SpecularEvent;

ChainEvents events_of(std::initializer_list<SpecularEvent> list) {
    ChainEvents events;
    for (const SpecularEvent event : list) events.append(event);
    return events;
}

// ---- One chain

// Returns the solid angle at x per area at distance t along the chain, by finite differences.
double traced_solid_angle(const Scene& scene, const SurfacePoint& x, const Chain& chain,
                          const ChainEvents& events, double t) {
    constexpr float kStep = 1e-3F;
    const Frame frame(chain.first);
    const auto moved = [&](float u, float v) {
        const auto beside =
            follow_chain(scene, x, (chain.first + u * frame.s + v * frame.t).normalized(), events);
        if (!beside) return V3d(NAN);
        const V3d o(beside->ray().o), d(beside->d), plane = V3d(chain.ray().o) + t * V3d(chain.d);
        return o + (plane - o).dot(V3d(chain.d)) / d.dot(V3d(chain.d)) * d;
    };
    const V3d u = moved(kStep, 0) - moved(-kStep, 0), v = moved(0, kStep) - moved(0, -kStep);
    return sqr(2.0 * double{kStep}) / u.cross(v).length();
}

// Follows chains from x into a cone about `towards`, and compares derivatives with differences.
void expect_true_derivatives(const Scene& scene, const V3f& towards, float spread,
                             const ChainEvents& events) {
    const SurfacePoint x{{0, 0, 0}};
    Sampler sampler(7, Purpose::test, 0, 0);
    int followed = 0;
    for (int i = 0; i < 200; ++i) {
        const V3f first = (towards + spread * square_to_sphere(sampler.next2())).normalized();
        const auto chain = follow_chain(scene, x, first, events);
        if (!chain) continue;
        ++followed;
        for (const double t : {0.3, 2.0}) {
            const double traced = traced_solid_angle(scene, x, *chain, events, t);
            if (!std::isfinite(traced)) continue;  // at a rim
            // Near a focus the area vanishes and differences say little.
            if (traced > 30) continue;
            EXPECT_NEAR(chain->solid_angle_per_area(t) / traced, 1, 0.02) << i << ", " << t;
        }
    }
    EXPECT_GT(followed, 100);
}

TEST(SpecularChain, OverAPlaneMirror_SeesAsFarAsThatOfItsImage) {
    SceneMaker make;
    make.quad({-9, -9, 2}, {0, 18, 0}, {18, 0, 0}, make.material(MirrorMaterial{}));
    const Scene scene = make.build();
    const V3f first = V3f(0.3F, 0.2F, 1).normalized();
    const auto chain = follow_chain(scene, {{0, 0, 0}}, first, events_of({reflection}));
    ASSERT_TRUE(chain);
    const double way = 2 / double{first.z};
    EXPECT_NEAR(chain->solid_angle_per_area(1.5) * sqr(way + 1.5), 1, 1e-5);
    EXPECT_FLOAT_EQ(chain->passed.x, 0.9F);
    EXPECT_FALSE(follow_chain(scene, {{0, 0, 0}}, first, events_of({refraction})));
    EXPECT_FALSE(follow_chain(scene, {{0, 0, 0}}, -first, events_of({reflection})));
}

TEST(SpecularChain, Derivatives_OnQuadrics_AreThoseOfTracedNeighbours) {
    SceneMaker ball;
    ball.sphere({0, 0, 3}, 1, ball.material(DielectricMaterial{}));
    const Scene glass = ball.build();
    expect_true_derivatives(glass, {0, 0, 1}, 0.25F, events_of({refraction, refraction}));
    expect_true_derivatives(glass, {0, 0, 1}, 0.25F, events_of({reflection}));
    expect_true_derivatives(glass, {0, 0, 1}, 0.25F, events_of({refraction, reflection, refraction}));

    SceneMaker egg;
    Quadric& stretched = egg.sphere({0.2F, 0, 3}, 1, egg.material(DielectricMaterial{}));
    stretched.world_from_object.scale(V3d(1.4, 0.8, 1));
    expect_true_derivatives(egg.build(), {0, 0, 1}, 0.2F, events_of({refraction, refraction}));
}

TEST(SpecularChain, Derivatives_WithInterpolatedNormals_AreThoseOfTracedNeighbours) {
    SceneMaker make;
    make.quad({-2, -2, 2}, {4, 0, 0}, {0, 4, 0}, make.material(DielectricMaterial{}));
    Mesh& mesh = make.last_mesh();
    mesh.n = {V3f(0.2F, 0.1F, 1), V3f(-0.3F, 0.2F, 1), V3f(-0.1F, -0.2F, 1), V3f(0.3F, -0.1F, 1)};
    const Scene scene = make.build();
    expect_true_derivatives(scene, {0, 0, 1}, 0.4F, events_of({refraction}));
    expect_true_derivatives(scene, {0, 0, 1}, 0.4F, events_of({reflection}));
}

TEST(SpecularChain, ThroughALens_FindsTheGivenPoint) {
    SceneMaker make;
    make.sphere({0, 0, 3}, 1, make.material(DielectricMaterial{}));
    const Scene scene = make.build();
    const SurfacePoint x{{0.1F, 0.05F, 0}};
    const ChainEvents events = events_of({refraction, refraction});
    Sampler sampler(8, Purpose::test, 0, 0);
    int found = 0;
    for (int i = 0; i < 100; ++i) {
        const V2f u = sampler.next2();
        const V3f y(0.1F * u.x - 0.05F, 0.1F * u.y - 0.05F, 9);
        const auto chain = find_chain(scene, x, V3f(0, 0, 1), events, y);
        if (!chain) continue;
        ++found;
        const V3f to = y - chain->from.p;
        EXPECT_LT((to - to.dot(chain->d) * chain->d).length(), 1e-5F * to.length());
        EXPECT_TRUE(chain->begins_as(chain->first, double{to.length()}));
        EXPECT_FALSE(chain->begins_as((chain->first + V3f(0.02F, 0, 0)).normalized(), double{to.length()}));
    }
    EXPECT_EQ(found, 100);
}

TEST(SpecularChain, EventsBeyondTheirNumber_AreRefused) {
    ChainEvents events;
    for (int i = 0; i < ChainEvents::kMost; ++i) EXPECT_TRUE(events.append(straight));
    EXPECT_FALSE(events.append(refraction));
    EXPECT_EQ(events.size(), ChainEvents::kMost);
    EXPECT_EQ(events[ChainEvents::kMost - 1], straight);
}

// ---- Paths

// Returns a floor below a ball of glass. `add_lamp` puts a lamp at (0.3, 2.5, 0.2) that shines down.
Scene below_glass(const std::function<void(SceneMaker&)>& add_lamp, bool fog = false) {
    SceneMaker make;
    make.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, make.diffuse(Rgb(0.6F)));
    make.sphere({0, 1.1F, 0}, 0.4F, make.material(DielectricMaterial{}));
    add_lamp(make);
    if (fog) {
        make.region(testing::in_box(testing::homogeneous(Rgb(0.5F, 0.2F, 0.1F), Rgb(0.0F)), V3d(-2, -0.1, -2),
                                    V3d(2, 3, 2)));
    }
    return make.build();
}
void add_quad(SceneMaker& make) {
    make.quad_light({0.22F, 2.5F, 0.12F}, {0.16F, 0, 0}, {0, 0, 0.16F}, make.diffuse(Rgb(0)),
                    Rgb(30, 20, 10));
}
void add_ball(SceneMaker& make) {
    Quadric& ball = make.sphere({0.3F, 2.5F, 0.2F}, 0.08F, make.diffuse(Rgb(0)));
    ball.traits.light = make.light(make_area_light(SphereEmitter{{0.3F, 2.5F, 0.2F}, 0.08F}, Rgb(30), false));
}
// Adds a measured light field on a plane without geometry.
void add_field(SceneMaker& make) {
    Monitor silent;
    LightField field = testing::measured(testing::SmoothLamp(2), 9, 16);
    CellTable table(field, Workers{2}, silent);
    MeasuredSettings settings;
    settings.power = 10;
    settings.world_from_light =  // 6 times as large, +z turned down
        M44d(6, 0, 0, 0, 0, 0, 6, 0, 0, -6, 0, 0, 0.3, 2.5, 0.2, 1);
    make.light(make_measured_light(std::move(field), std::move(table), settings, silent));
}

PathSettings path(std::int64_t chains) {
    PathSettings settings;
    settings.chains = chains;
    return settings;
}

// Samples the radiance of a place in the ball's caustic.
RunningStats radiance(const Scene& scene, const IntegratorSettings& settings, std::uint64_t seed,
                      std::uint64_t count, const Workers& workers = {}) {
    Monitor silent;
    const V3f eye(1.2F, 0.3F, 0.1F), target(-0.15F, 0, -0.05F);
    const Camera camera = testing::camera(eye, target, 16, 16, 30);
    const OnePass pass(settings, {scene, 5, workers, silent, View{&camera, V2f(0.0F), V2f(16.0F)}});
    RunningStats stats;
    for (std::uint64_t i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 1, i);
        stats.add(double{luminance(pass.Li({eye, (target - eye).normalized()}, sampler))});
    }
    return stats;
}

double sigmas_apart(const RunningStats& a, const RunningStats& b, double scale = 1) {
    return std::fabs(scale * a.mean() - b.mean()) /
           std::hypot(scale * a.standard_error(), b.standard_error());
}

void expect_same_mean_and_less_noise(const Scene& scene) {
    const RunningStats plain = radiance(scene, path(0), 1, 600'000);
    const RunningStats searched = radiance(scene, path(1 << 20), 2, 20'000);
    EXPECT_LT(sigmas_apart(searched, plain), 4) << searched.mean() << " beside " << plain.mean();
    EXPECT_GT(sigmas_apart(searched, plain, 1.25), 4) << "a weight that is wrong by a quarter is refused";
    EXPECT_LT(searched.variance(), 0.1 * plain.variance());
}

TEST(ChainGuide, LampOnAMesh_KeepsItsMean) {
    expect_same_mean_and_less_noise(below_glass(add_quad));
}
TEST(ChainGuide, LampOnASphere_KeepsItsMean) {
    expect_same_mean_and_less_noise(below_glass(add_ball));
}
TEST(ChainGuide, MeasuredLamp_KeepsItsMean) {
    expect_same_mean_and_less_noise(below_glass(add_field));
}
TEST(ChainGuide, InAMedium_KeepsItsMean) {
    expect_same_mean_and_less_noise(below_glass(add_quad, true));
}

// With photons as few as here, most chains are unknown, and the light over them must still be found by
// chance.
TEST(ChainGuide, WithFewPhotons_KeepsItsMean) {
    const Scene scene = below_glass(add_quad);
    EXPECT_LT(sigmas_apart(radiance(scene, path(4'000), 3, 40'000), radiance(scene, path(0), 4, 200'000)), 4);
}

// The lamp's image over a plane mirror lights the floor by the inverse square law.
TEST(ChainGuide, PointLampOverAMirror_IsThatOfItsImage) {
    SceneMaker make;
    make.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, make.diffuse(Rgb(0.6F)));
    make.quad({1.5F, -1, -2}, {0, 0, 4}, {0, 4, 0}, make.material(MirrorMaterial{}));
    make.quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, make.diffuse(Rgb(0)));  // shades the lamp itself
    make.light(make_point_light({0, 2, 0}, Rgb(10)));
    const Scene scene = make.build();
    const V3d x(-0.15, 0, -0.05), image(3, 2, 0);
    const double irradiance = 0.9 * 10 * 2 / std::pow((image - x).length2(), 1.5);
    PathSettings settings = path(20'000);
    settings.max_depth = 2;
    const RunningStats found = radiance(scene, settings, 1, 200);
    EXPECT_NEAR(found.mean() / (0.6 / M_PI * irradiance), 1, 1e-3);
    EXPECT_EQ(radiance(scene, path(0), 1, 200).mean(), 0);
    settings.max_depth = 1;
    EXPECT_EQ(radiance(scene, settings, 1, 200).mean(), 0) << "the mirror is a bounce";
}

TEST(ChainGuide, Radiance_OnOneTwoAndThreeThreads_IsTheSame) {
    const Scene scene = below_glass(add_quad);
    const double one = radiance(scene, path(20'000), 1, 500, Workers{1}).mean();
    EXPECT_EQ(one, radiance(scene, path(20'000), 1, 500, Workers{2}).mean());
    EXPECT_EQ(one, radiance(scene, path(20'000), 1, 500, Workers{3}).mean());
}

// Large lamps are met by chance, and a search would only take time.
TEST(ChainGuide, WhereTheLampIsLarge_IsLeftAlone) {
    const Scene scene = below_glass([](SceneMaker& make) {
        make.quad_light({-1, 2.5F, -1}, {2, 0, 0}, {0, 0, 2}, make.diffuse(Rgb(0)), Rgb(1));
    });
    Monitor silent;
    EXPECT_EQ(build_chain_guide(scene, {100'000, 1}, Workers{2}, silent), nullptr);
    EXPECT_NE(build_chain_guide(below_glass(add_quad), {100'000, 1}, Workers{2}, silent), nullptr);
}

// No light path meets the glass, and the number of photons is 0.
TEST(ChainGuide, WhereNoLightMeetsTheGlass_IsLeftAlone) {
    SceneMaker make;
    make.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, make.diffuse(Rgb(0.6F)));
    make.sphere({0, -5, 0}, 0.4F, make.material(DielectricMaterial{}));
    add_quad(make);
    const Scene scene = make.build();
    Monitor silent;
    EXPECT_EQ(build_chain_guide(scene, {100'000, 1}, Workers{2}, silent), nullptr);
}

// A thousandth of the image's light is not worth a search at each place.
TEST(ChainGuide, WhereLittleLightGoesOverChains_IsLeftAlone) {
    const Scene scene = below_glass([](SceneMaker& make) {
        add_quad(make);
        make.quad_light({-1, 2.6F, -1}, {2, 0, 0}, {0, 0, 2}, make.diffuse(Rgb(0)), Rgb(900));
    });
    EXPECT_EQ(radiance(scene, path(100'000), 1, 500).mean(), radiance(scene, path(0), 1, 500).mean());
}

}  // namespace chain_guide_test
}  // namespace lucerna
