// Tests a measured lamp that emits from a shape: for any shape the light is the same, and both strategies of
// MIS sample it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/scene/shape_set.h"
#include "engine/transport/direct_light.h"
#include "lights/emission_net.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/eye_paths.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace lamp_on_shape_test {

using ::testing::HasSubstr;
using testing::SceneMaker;

// The shape from which the lamp emits. The lamp's S lies around the origin, 4 by 6 cm, and light leaves along
// z.
enum class Glass { none, bulb, bead, pane_behind, pane_before };
constexpr Glass kAll[] = {Glass::none, Glass::bulb, Glass::bead, Glass::pane_behind, Glass::pane_before};

Rig rig() {
    Rig rig = testing::rig_b();
    rig.centre = V3d(0.0);
    return rig;
}

LightField field() {
    return testing::random_field(rig(), 0.2F, 1, 51);
}

std::unique_ptr<Light> lamp(Shapes shapes, Monitor& monitor) {
    const LightField f = field();
    auto shape = make_traced_shape(std::move(shapes));
    return make_measured_light(f, CellTable(f, {1}, monitor), {}, monitor, std::move(shape));
}

// Adds the lamp to the scene, on its glass if there is one. The glass reflects nothing.
void add_lamp(SceneMaker& make, Glass glass, Monitor& monitor) {
    const auto black = make.diffuse(Rgb(0.0F));
    Shapes shapes;
    if (glass == Glass::none) {
        const LightField f = field();
        make.light(make_measured_light(f, CellTable(f, {1}, monitor), {}, monitor));
        return;
    }
    if (glass == Glass::bulb || glass == Glass::bead) {
        Quadric& ball = make.sphere(V3f(0.0F), glass == Glass::bulb ? 0.05F : 0.01F, black);
        shapes.quadrics.push_back(ball);
        ball.traits.light = make.light(lamp(std::move(shapes), monitor));
        return;
    }
    const float z = glass == Glass::pane_behind ? -0.02F : 0.03F;
    make.quad({-0.2F, -0.2F, z}, {0.4F, 0, 0.01F}, {0, 0.4F, 0}, black);
    shapes.meshes.push_back(make.last_mesh());
    make.last_mesh().traits.light = make.light(lamp(std::move(shapes), monitor));
}

// Estimates ∫ L g over all lines of S and M, where L is the radiance that a camera beyond M sees.
RunningStats seen_flux(const Scene& scene) {
    const Rig r = rig();
    const V2d s_size(r.spacing.x * r.intervals(0), r.spacing.y * r.intervals(1));
    const V2d m_size(r.pixel.x * r.pixels.x, r.pixel.y * r.pixels.y);
    RunningStats flux;
    for (std::uint32_t i = 0; i < 100000; ++i) {
        Sampler sampler = Sampler::stratified(1, Purpose::test, 0, i);
        const V2d a(sampler.next2()), b(sampler.next2());
        const V2d on_s((a.x - 0.5) * s_size.x, (a.y - 0.5) * s_size.y);
        const V2d on_m((b.x - 0.5) * m_size.x, (b.y - 0.5) * m_size.y);
        const V2d eye = on_s + (on_m - on_s) * (0.5 / r.distance);
        const V3d way = V3d(on_s.x, on_s.y, 0) - V3d(eye.x, eye.y, 0.5);
        const Ray ray{V3f(V3d(eye.x, eye.y, 0.5)), V3f(way.normalized())};
        const Rgb seen = testing::emission_along(scene, ray);
        flux.add(double{luminance(seen)} * r.geometric_term(on_s, on_m) * s_size.x * s_size.y * m_size.x *
                 m_size.y);
    }
    return flux;
}

TEST(LampOnShape, FluxThatACameraSees_IsTheLamps) {
    for (const Glass glass : kAll) {
        SceneMaker make;
        Monitor silent;
        add_lamp(make, glass, silent);
        const Scene scene = make.build();
        const RunningStats flux = seen_flux(scene);
        EXPECT_TRUE(testing::agrees(flux, scene.lights()[0]->power()))
            << static_cast<int>(glass) << ": " << flux.mean() << " for " << scene.lights()[0]->power();
        EXPECT_LT(flux.standard_error(), 0.003 * flux.mean());
    }
}

TEST(LampOnShape, Particles_StartWhereTheirLinesLeaveIt) {
    for (const Glass glass : kAll) {
        SceneMaker make;
        Monitor silent;
        add_lamp(make, glass, silent);
        const Scene scene = make.build();
        const Light& light = *scene.lights()[0];
        SceneMaker plain_maker;
        add_lamp(plain_maker, Glass::none, silent);
        const Scene plain = plain_maker.build();
        const EmissionNet net(2, Purpose::test, 0);
        RunningStats flux;
        int on_s = 0;
        for (std::uint32_t i = 0; i < 5000; ++i) {
            const auto e = light.sample_Le(net.at(i).u);
            const auto bare = plain.lights()[0]->sample_Le(net.at(i).u);
            ASSERT_TRUE(e && bare);
            flux.add(double{luminance(e->weight)});
            // Both particles travel on the same line.
            EXPECT_EQ(e->d, bare->d);
            const V3d between = V3d(e->from.p) - V3d(bare->from.p);
            EXPECT_LT(between.cross(V3d(e->d)).length(), 1e-6);
            on_s += e->from.p == bare->from.p;
            // The particle starts outside the shape and does not meet it again.
            EXPECT_FALSE(scene.intersect(Ray{e->from.towards(e->d), e->d}));
            if (glass == Glass::bulb) {
                EXPECT_NEAR(e->from.p.length(), 0.05F, 1e-6F);
            }
        }
        EXPECT_NEAR(flux.mean(), light.power(), 1e-5 * light.power());
        if (glass == Glass::none) {
            EXPECT_EQ(on_s, 5000);
        } else if (glass == Glass::bead) {
            EXPECT_GT(on_s, 1000);
            EXPECT_LT(on_s, 5000);
        } else {
            EXPECT_EQ(on_s, 0);
        }
    }
}

// The light that a glossy floor reflects from the lamp to the eye: by light sampling, BSDF sampling and MIS.
struct Glare {
    RunningStats lights, bsdf, both;
};

Glare glare(Glass glass) {
    SceneMaker make;
    Monitor silent;
    ConductorMaterial metal;
    metal.roughness = Roughness::of_alpha(0.15F);
    make.quad({-1, -1, 0.12F}, {0, 2, 0}, {2, 0, 0}, make.material(metal));
    add_lamp(make, glass, silent);
    const Scene scene = make.build();
    const V3f eye(0.05F, 0, 0.06F);
    const Ray ray{eye, (V3f(0.033F, 0.005F, 0.12F) - eye).normalized()};
    const auto hit = scene.intersect(ray);
    const Bsdf bsdf = scene.bsdf(*hit);
    const Vertex vertex{*hit, bsdf, -ray.d};
    Glare result;
    for (std::uint32_t i = 0; i < 40000; ++i) {
        Sampler sampler = Sampler::stratified(3, Purpose::test, 0, i);
        const auto in = scene.lights()[0]->sample_Li(hit->at.p, sampler.next2());
        Rgb by_light(0.0F);
        if (in && scene.unoccluded(hit->at, in->w, in->distance)) {
            by_light = bsdf.f(vertex.wo, in->w, Transport::radiance) * in->weight *
                       std::fabs(in->w.dot(bsdf.shading_normal()));
        }
        result.lights.add(double{luminance(by_light)});
        Rgb by_bsdf(0.0F);
        const BsdfU u{sampler.next(), sampler.next2()};
        if (const auto sample = bsdf.sample(vertex.wo, u, Transport::radiance)) {
            const Ray on{hit->at.towards(sample->wi), sample->wi};
            by_bsdf = sample->weight * testing::emission_along(scene, on);
        }
        result.bsdf.add(double{luminance(by_bsdf)});
        result.both.add(double{luminance(testing::direct_radiance(scene, vertex, sampler))});
    }
    return result;
}

TEST(LampOnShape, GlareOnAGlossyFloor_LightsBsdfAndBoth_AreOne) {
    const Glare plain = glare(Glass::none);
    for (const Glass glass : kAll) {
        const Glare g = glare(glass);
        EXPECT_GT(g.both.mean(), 0);
        const auto same = [](const RunningStats& a, const RunningStats& b) {
            const double sigma = std::sqrt(sqr(a.standard_error()) + sqr(b.standard_error()));
            EXPECT_LT(sigma, 0.02 * a.mean());
            EXPECT_NEAR(a.mean(), b.mean(), 4 * sigma);
        };
        SCOPED_TRACE(static_cast<int>(glass));
        same(g.lights, g.both);
        same(g.bsdf, g.both);
        // The glass does not attenuate light: the floor is lit as by the bare lamp.
        same(g.both, plain.both);
        // MIS has less variance than the worse of the two strategies.
        EXPECT_LT(g.both.variance(), std::max(g.lights.variance(), g.bsdf.variance()));
    }
}

TEST(LampOnShape, FromWithin_ItIsDark) {
    SceneMaker make;
    Monitor silent;
    add_lamp(make, Glass::bulb, silent);
    const Scene scene = make.build();
    for (const V3f& d : {V3f(0, 0, -1), V3f(0, 0, 1), V3f(1, 0, 0)}) {
        const Ray ray{{0, 0, 0.01F}, d};
        EXPECT_TRUE(is_black(testing::emission_along(scene, ray)));
    }
    EXPECT_FALSE(scene.lights()[0]->sample_Li({0, 0, 0.01F}, {0.5F, 0.5F}));
    const Ray from_outside{{0, 0, 1}, {0, 0, -1}};
    EXPECT_FALSE(is_black(testing::emission_along(scene, from_outside)));
}

TEST(LampOnShape, APointBehindSButBeforeItsPane_IsLit) {
    // The pane lies two centimetres behind S, as the glass of a lamp measured from a distance does.
    SceneMaker make;
    Monitor silent;
    add_lamp(make, Glass::pane_behind, silent);
    const Scene scene = make.build();
    RunningStats lit;
    for (std::uint32_t i = 0; i < 2000; ++i) {
        Sampler sampler = Sampler::stratified(4, Purpose::test, 0, i);
        const auto in = scene.lights()[0]->sample_Li({0.005F, 0, -0.01F}, sampler.next2());
        lit.add(in ? double{luminance(in->weight)} : 0.0);
        if (!in) continue;
        const Ray back{{0.005F, 0, -0.01F}, in->w};
        const auto hit = scene.intersect(back);
        ASSERT_TRUE(hit);
        const EmittedRadiance seen =
            scene.lights()[0]->Le_on_surface(back, hit->t, hit->at.n, hit->primitive);
        EXPECT_NEAR(seen.pdf_w, in->pdf_w, 2e-3F * in->pdf_w);
        EXPECT_TRUE(scene.unoccluded({{0.005F, 0, -0.01F}}, in->w, in->distance));
    }
    EXPECT_GT(lit.mean(), 0);
}

TEST(LampOnShape, LightThatMissesTheShape_GivesAWarning) {
    SceneMaker make;
    testing::ListeningMonitor bead;
    add_lamp(make, Glass::bead, bead);
    ASSERT_EQ(bead.warnings.size(), 1U);
    EXPECT_THAT(bead.warnings[0], HasSubstr("misses its shape"));
    testing::ListeningMonitor bulb;
    add_lamp(make, Glass::bulb, bulb);
    EXPECT_TRUE(bulb.warnings.empty());
}

}  // namespace lamp_on_shape_test
}  // namespace lucerna
