// Surfaces that light passes in a straight line: the share that they transmit, and rays behind them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/scene.h"
#include "lights/analytic.h"
#include "tests/support/lobes.h"
#include "tests/support/media.h"
#include "tests/support/panes.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace panes_test {

using namespace lucerna::testing;

// --- The share that a surface transmits

struct SurfaceCase {
    std::string name;
    std::vector<Lobe> lobes;
    bool passes;  // whether some light goes straight on
};
std::vector<SurfaceCase> surfaces() {
    const Rgb tint(0.9F, 0.6F, 0.3F);
    const DielectricLobe nothing{1, Rgb(1), tint, 0, 0}, rough_nothing{1, Rgb(1), tint, 0.3F, 0.2F};
    const DiffuseLobe diffuse{Rgb(0.3F, 0.2F, 0.1F)};
    const GlossLobe gloss{1.5F, Rgb(0.5F), 0.2F, 0.2F};
    return {{"pane", {ThinDielectricLobe{1.5F, tint}}, true},
            {"pane of a low index", {ThinDielectricLobe{0.7F, tint}}, true},
            {"pane that absorbs", {ThinDielectricLobe{1.5F, tint, 0.6F}}, true},
            {"no boundary", {nothing}, true},
            {"rough and no boundary", {rough_nothing}, true},
            {"boundary", {glass(1.5F, 0, 0)}, false},
            {"boundary that nearly is none", {glass(1.001F, 0, 0)}, false},
            {"mirror", {MirrorLobe{Rgb(0.9F)}}, false},
            {"diffuse", {diffuse}, false},
            {"opacity", {DielectricLobe{1, Rgb(1), Rgb(0.5F), 0, 0}, diffuse, gloss}, true},
            {"half a pane",
             {ThinDielectricLobe{1.5F, Rgb(0.5F)}, MirrorLobe{Rgb(0.2F)}, DiffuseLobe{Rgb(0.25F)}},
             true},
            {"two panes in a mix",
             {ThinDielectricLobe{1.5F, Rgb(0.5F)}, ThinDielectricLobe{1.2F, Rgb(0.5F, 0.3F, 0.1F)}},
             true}};
}

std::array<RunningStats, 3> straight_weights(const Bsdf& bsdf, const V3f& wo, Transport transport) {
    constexpr std::uint32_t kSamples = 20'000;
    std::array<RunningStats, 3> weights;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
        Sampler sampler(7, Purpose::test, 0, i);
        const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, transport);
        if (sample && sample->straight) {
            EXPECT_EQ(sample->wi, -wo);
            EXPECT_TRUE(sample->delta && sample->transmission && sample->eta_scale == 1);
        }
        for (int k = 0; k < 3; ++k) {
            weights[static_cast<std::size_t>(k)].add(
                sample && sample->straight ? static_cast<double>(sample->weight[k]) : 0.0);
        }
    }
    return weights;
}

// Allows four standard errors and a float's rounding: for some surfaces all samples have equal weights.
bool is_mean(const RunningStats& stats, double share) {
    return std::fabs(stats.mean() - share) <= 4 * stats.standard_error() + 1e-6;
}

TEST(StraightShare, OfEveryLobe_IsTheMeanWeightOfStraightSamples) {
    for (const SurfaceCase& surface : surfaces()) {
        for (const V3f& normal : {kUp, tilted(20)}) {
            const Bsdf bsdf(surface.lobes, normal, kUp, kAlongX);
            for (const float angle : kAngles) {
                for (const V3f& wo : {direction(angle), below(direction(angle))}) {
                    const Rgb share = bsdf.straight_share(wo);
                    for (const Transport transport : {Transport::radiance, Transport::particles}) {
                        const auto found = straight_weights(bsdf, wo, transport);
                        for (int k = 0; k < 3; ++k) {
                            const auto& channel = found[static_cast<std::size_t>(k)];
                            const auto expected = static_cast<double>(share[k]);
                            EXPECT_TRUE(is_mean(channel, expected))
                                << surface.name << " at " << angle << ": " << channel.mean() << " +- "
                                << channel.standard_error() << ", " << expected;
                            // A share that is wrong by a tenth is rejected.
                            if (expected > 0.2) {
                                EXPECT_FALSE(is_mean(channel, 1.1 * expected)) << surface.name;
                            }
                        }
                    }
                    // The share is the same in both directions.
                    EXPECT_NEAR(share.x, bsdf.straight_share(-wo).x, 1e-6F) << surface.name;
                    if (!surface.passes) {
                        EXPECT_TRUE(is_black(share)) << surface.name;
                    }
                }
            }
            EXPECT_EQ(!is_black(bsdf.straight_share(kUp)), surface.passes) << surface.name;
        }
    }
}

TEST(StraightShare, OfAPane_IsTheSumOfAllBouncesBetweenItsFaces) {
    for (const float eta : {0.7F, 1.2F, 1.5F, 2.4F}) {
        const Bsdf bsdf = flat(ThinDielectricLobe{eta, Rgb(0.8F)});
        for (const float angle : kAngles) {
            const double truth =
                0.8 * pane_transmittance(static_cast<double>(direction(angle).z), static_cast<double>(eta));
            EXPECT_NEAR(bsdf.straight_share(direction(angle)).x, truth, 2e-6) << eta << " at " << angle;
        }
    }
}

TEST(StraightShare, OfAPaneThatAbsorbs_IsTheSumOfAllBouncesToo) {
    for (const float eta : {1.0F, 1.2F, 1.52F, 2.4F}) {
        for (const float inside : {0.05F, 0.6F, 0.958F}) {
            const Bsdf bsdf = flat(ThinDielectricLobe{eta, Rgb(1), inside});
            for (const float angle : kAngles) {
                const V3f wo = direction(angle);
                const PaneSums truth = pane_sums(double{wo.z}, double{eta}, double{inside});
                constexpr double kRounding =
                    1e-5;  // by the exponent 1 / cos near grazing, in single precision
                EXPECT_NEAR(double{bsdf.straight_share(wo).x}, truth.transmitted, kRounding)
                    << eta << ' ' << angle;
                EXPECT_NEAR(double{bsdf.albedo(wo).x}, truth.transmitted + truth.reflected, kRounding)
                    << eta << ' ' << angle;
            }
        }
    }
}

TEST(ThinDielectricMaterial, Transmittance_IsThatOfTheWholePane) {
    for (const float eta : {1.0F, 1.5F, 1.52F}) {
        for (const float share : {0.05F, 0.4F, 0.8F, 1.0F}) {
            ThinDielectricMaterial pane;
            pane.eta = FloatTexture::constant(eta);
            pane.transmittance = share * clear_pane_transmittance(eta);
            Hit hit;
            hit.at.n = hit.ns = kUp;
            hit.dpdu = kAlongX;
            const Bsdf bsdf = make_bsdf(Material{"pane", pane}, hit);
            EXPECT_NEAR(bsdf.straight_share(kUp).x, *pane.transmittance, 1e-6F) << eta << ' ' << share;
        }
    }
}

// --- Rays behind panes

constexpr float kSide = 6;
const V3f kEye(0.1F, 0.2F, -2);

ThinDielectricMaterial pane_material(float eta = 1.5F) {
    ThinDielectricMaterial material;
    material.eta = FloatTexture::constant(eta);
    return material;
}

// Adds a square pane about (0, 0, z) with normal +z, rotated by `degrees` about y.
void add_pane(SceneMaker& make, float z, std::uint32_t material, float degrees = 0) {
    const float a = degrees * kPi / 180;
    const V3f x(kSide * std::cos(a), 0, -kSide * std::sin(a)), y(0, kSide, 0);
    make.quad(V3f(0, 0, z) - x / 2 - y / 2, x, y, material);
}

Rgb passed(const Scene& scene, const V3f& from, const V3f& to, std::int32_t medium = kNoMedium,
           bool shadow = true) {
    Sampler sampler(1, Purpose::test, 0, 0);
    const V3f way = to - from;
    return passing(scene, way_from(SurfacePoint{from}, way.normalized(), way.length()), medium, sampler,
                   shadow);
}
Rgb both_ways(const Scene& scene, const V3f& from, const V3f& to) {
    const Rgb there = passed(scene, from, to), back = passed(scene, to, from);
    EXPECT_NEAR(there.x, back.x, 1e-6F);
    return there;
}

TEST(Passing, OnePaneAndTwo_AtAnyAngle_PassTheirShares) {
    for (const int panes : {1, 2, 5}) {
        SceneMaker make;
        for (int i = 0; i < panes; ++i)
            add_pane(make, 0.1F * static_cast<float>(i), make.material(pane_material()));
        const Scene scene = make.build();
        EXPECT_TRUE(scene.has_panes());
        for (const float angle : {0.0F, 30.0F, 56.3F, 75.0F}) {
            const V3f d = direction(angle);
            const V3f from = V3f(0.1F, 0.2F, 0.05F) - 0.3F / d.z * d;
            const V3f to = from + 1.0F / d.z * d;
            const double truth = std::pow(pane_transmittance(static_cast<double>(d.z)), panes);
            EXPECT_NEAR(both_ways(scene, from, to).x, truth, 1e-5) << panes << " at " << angle;
            EXPECT_NEAR(passed(scene, from, to, kNoMedium, false).x, truth, 1e-5) << "as an eye sees it";
            EXPECT_EQ(passed(scene, from, from + 0.2F / d.z * d), Rgb(1)) << "the way ends before it";
        }
    }
}

TEST(Passing, APaneTurned_PassesByTheAngleBetweenWayAndPane) {
    for (const float degrees : {20.0F, 50.0F, 80.0F}) {
        SceneMaker make;
        add_pane(make, 0, make.material(pane_material(1.7F)), degrees);
        const Scene scene = make.build();
        const double truth =
            pane_transmittance(std::cos(static_cast<double>(degrees) * std::acos(-1.0) / 180), 1.7);
        EXPECT_NEAR(both_ways(scene, kEye, kEye + V3f(0, 0, 5)).x, truth, 1e-5) << degrees;
    }
}

TEST(Passing, BehindAnOpaqueSurface_IsNothing_WhereverItStands) {
    for (const float wall : {-1.0F, 0.5F, 2.0F}) {
        SceneMaker make;
        add_pane(make, 0, make.material(pane_material()));
        add_pane(make, 1, make.material(pane_material()));
        add_pane(make, wall, make.diffuse(Rgb(0.5F)));
        EXPECT_EQ(both_ways(make.build(), kEye, kEye + V3f(0, 0, 5)), Rgb(0)) << wall;
    }
}

TEST(Passing, APaneBetweenMedia_WeakensByItsShareAndTheirLengths) {
    const double pane = pane_transmittance(1);
    for (const bool scattering : {false, true}) {
        const Rgb none(0), some(0.3F);
        SceneMaker make;
        const auto front = make.medium(homogeneous(scattering ? none : some, scattering ? some : none));
        const auto back = make.medium(homogeneous(Rgb(0.7F), Rgb(0.1F)));
        add_pane(make, 0, make.material(pane_material()));
        make.last_mesh().traits.media = {true, front, back};  // the normal points to the outside
        const Scene scene = make.build();
        const V3f end = kEye + V3f(0, 0, 5);  // 2 in front of the pane, 3 behind it
        EXPECT_NEAR(passed(scene, kEye, end, front).x, pane * std::exp(-0.3 * 2 - 0.8 * 3), 1e-5);
        EXPECT_NEAR(passed(scene, end, kEye, back).x, pane * std::exp(-0.3 * 2 - 0.8 * 3), 1e-5);
        // The value for the media in the wrong order differs.
        EXPECT_GT(std::fabs(passed(scene, kEye, end, front).x - pane * std::exp(-0.3 * 3 - 0.8 * 2)), 1e-3);
    }
}

TEST(Passing, ABallOfOtherMediumBehindAPane_IsCrossedInItsOwnMedium) {
    // Fog fills the scene; behind the pane, which is no medium interface, lies a ball without fog, bounded by
    // an interface.
    SceneMaker make;
    const auto fog = make.medium(homogeneous(Rgb(0.2F), Rgb(0.1F)));
    make.camera_in(fog);
    add_pane(make, 0, make.material(pane_material()));
    Quadric& hole = make.sphere({0.1F, 0.2F, 2}, 0.5F, make.material(InterfaceMaterial{}));
    hole.traits.media = {true, kNoMedium, fog};
    EXPECT_NEAR(passed(make.build(), kEye, kEye + V3f(0, 0, 6), fog).x,
                pane_transmittance(1) * std::exp(-0.3 * 5), 1e-5);
}

TEST(Passing, PanesThatAreCutOut_CountWhereTheyAre) {
    const auto checks = std::make_shared<const FloatTexture>(FloatTexture::checkerboard(1, 0, V2f(2, 2)));
    const auto gone = std::make_shared<const FloatTexture>(FloatTexture::constant(0));
    const double pane = pane_transmittance(1);
    SceneMaker make;
    const auto glass_pane = make.material(pane_material());
    add_pane(make, 0, glass_pane);
    make.last_mesh().uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    make.last_mesh().traits.alpha = checks;
    // The second scene has an opaque curtain behind the pane, cut out in the same way.
    SceneMaker curtained;
    const auto cloth = curtained.diffuse(Rgb(0.5F));
    add_pane(curtained, 0, curtained.material(pane_material()));
    add_pane(curtained, 0.5F, cloth);
    curtained.last_mesh().uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    curtained.last_mesh().traits.alpha = checks;
    // The third scene has two panes, the first of which is invisible to shadow rays.
    SceneMaker unseen;
    add_pane(unseen, 0, unseen.material(pane_material()));
    unseen.last_mesh().traits.shadow_alpha = gone;
    add_pane(unseen, 1, unseen.material(pane_material()));
    const Scene cut = make.build(), behind = curtained.build(), shadowless = unseen.build();
    int holes = 0;
    for (const float x : {-1.5F, 1.4F}) {
        for (const float y : {-1.3F, 1.6F}) {
            const V3f from(x, y, -1), to(x, y, 1.5F);
            const bool hole = !cut.intersect(Ray{from, {0, 0, 1}});
            holes += hole;
            EXPECT_NEAR(both_ways(cut, from, to).x, hole ? 1 : pane, 1e-5);
            EXPECT_NEAR(passed(cut, from, to, kNoMedium, false).x, hole ? 1 : pane, 1e-5);
            EXPECT_NEAR(both_ways(behind, from, to).x, hole ? pane : 0, 1e-5);
            EXPECT_NEAR(both_ways(shadowless, from, to).x, pane, 1e-5) << "shadow rays meet one of two";
            EXPECT_NEAR(passed(shadowless, from, to, kNoMedium, false).x, pane * pane, 1e-5);
        }
    }
    EXPECT_EQ(holes, 2);
}

TEST(Passing, AnEmissivePane_IsPassedLikeAnyOther_AndHidesNothingOfItsOwn) {
    SceneMaker make;
    const V3f corner(-1, -1, 0);
    make.quad_light(corner, {2, 0, 0}, {0, 2, 0}, make.material(pane_material()), Rgb(3));
    const Scene scene = make.build();
    EXPECT_NEAR(both_ways(scene, kEye, kEye + V3f(0, 0, 5)).x, pane_transmittance(1), 1e-5);
    // The shadow ray to a point on the pane ends just before it.
    int asked = 0;
    for (std::uint32_t i = 0; i < 1000; ++i) {
        Sampler sampler(3, Purpose::test, 0, i);
        const V3f x(0.3F, -0.1F, 0.5F + 3 * sampler.next());
        const auto towards = scene.lights()[0]->sample_Li(x, sampler.next2());
        if (!towards) continue;
        ++asked;
        const Ray way = way_from(SurfacePoint{x}, towards->w, towards->distance);
        ASSERT_EQ(passing(scene, way, kNoMedium, sampler), Rgb(1));
    }
    EXPECT_GT(asked, 900);
}

TEST(Passing, Instances_OfAPane_PassAsItDoes) {
    const auto parts_with = [](const std::vector<M44d>& placed) {
        SceneParts parts;
        parts.materials.push_back({"", pane_material()});
        Shapes pane;
        Mesh mesh;
        mesh.p = {{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        pane.meshes.push_back(mesh);
        Quadric disc;
        disc.kind = Quadric::Kind::disk;
        disc.radius = 3;
        disc.height = 0.25F;
        pane.quadrics.push_back(disc);
        parts.prototypes.push_back(std::move(pane));
        for (const M44d& at : placed) parts.instances.push_back({0, at});
        return Scene(std::move(parts), Workers{2});
    };
    M44d turned, moved;
    turned.rotate(V3d(0, 0.7, 0));  // both panes of the prototype
    moved.setTranslation(V3d(0, 0, 2));
    const double straight = pane_transmittance(1), oblique = pane_transmittance(std::cos(0.7));
    EXPECT_NEAR(both_ways(parts_with({moved}), kEye, kEye + V3f(0, 0, 6)).x, straight * straight, 1e-5);
    EXPECT_NEAR(both_ways(parts_with({moved, turned}), kEye, kEye + V3f(0, 0, 6)).x,
                straight * straight * oblique * oblique, 1e-5);
}

TEST(Passing, UbersOpacityAndMixesWithAnInterface_PassWhatTheyLeave) {
    UberMaterial veil;
    veil.opacity = RgbTexture::constant(Rgb(0.25F, 0.5F, 1.0F));
    MixMaterial gauze;
    gauze.first = std::make_shared<const Material>(Material{"", InterfaceMaterial{}, {}});
    gauze.second =
        std::make_shared<const Material>(Material{"", DiffuseMaterial{RgbTexture::constant(Rgb(0.5F))}, {}});
    gauze.share = FloatTexture::constant(0.3F);
    DielectricMaterial air;
    air.eta = FloatTexture::constant(1);
    const auto through = [](const MaterialModel& model) {
        SceneMaker make;
        add_pane(make, 0, make.material(model));
        return both_ways(make.build(), kEye, kEye + V3f(0.5F, 0, 5));
    };
    EXPECT_LT((through(veil) - Rgb(0.75F, 0.5F, 0)).length(), 1e-5F);
    EXPECT_LT((through(gauze) - Rgb(0.7F)).length(), 1e-5F);
    EXPECT_LT((through(air) - Rgb(1)).length(), 1e-5F);
    EXPECT_EQ(through(DielectricMaterial{}), Rgb(0)) << "glass bends light";
    EXPECT_EQ(through(UberMaterial{}), Rgb(0));
}

// A shadow ray of infinite length, to a distant light.
TEST(Passing, ToASun_PassesAllPanesOnTheWay) {
    SceneMaker make;
    add_pane(make, 0, make.material(pane_material()));
    add_pane(make, 2, make.material(pane_material()), 30);
    const Scene scene = make.build();
    Sampler sampler(1, Purpose::test, 0, 0);
    const Ray way = way_from(SurfacePoint{kEye}, {0, 0, 1}, INFINITY);
    EXPECT_NEAR(passing(scene, way, kNoMedium, sampler).x,
                pane_transmittance(1) * pane_transmittance(std::cos(std::acos(-1.0) / 6)), 1e-5);
}

}  // namespace panes_test
}  // namespace lucerna
