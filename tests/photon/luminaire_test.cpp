// Tests tracing of luminaires: a mirror against its closed form, and the account of the flux.
#include "photon/luminaire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "tests/support/error_of.h"
#include "tests/support/media.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace luminaire_test {

using ::testing::HasSubstr;
using testing::SceneMaker;

constexpr float kFocal = 0.01F;
constexpr float kRim = 0.03F;

// Adds a perfect parabolic mirror that opens towards +z, with its focus at the origin.
void add_mirror(SceneMaker& make) {
    const auto silver = make.material(MirrorMaterial{RgbTexture::constant(Rgb(1.0F))});
    Quadric& bowl = make.sphere({0, 0, -kFocal}, kRim, silver);
    bowl.kind = Quadric::Kind::paraboloid;
    bowl.z_min = 0;
    bowl.z_max = kRim * kRim / (4 * kFocal);
}

// Adds an emitting ball that reflects nothing.
void add_ball(SceneMaker& make, const V3f& centre, float radius) {
    Quadric& ball = make.sphere(centre, radius, make.diffuse(Rgb(0.0F)));
    ball.traits.light = make.light(make_area_light(SphereEmitter{centre, radius}, Rgb(1.0F), false));
}

LuminaireParameters parameters(std::int64_t paths, std::int64_t block = 1 << 20) {
    LuminaireParameters made;
    made.paths = paths;
    made.block = block;
    made.seed = 3;
    return made;
}

// Returns the largest ratio of the sine of a ray's angle to that of the cone that the ball subtends at the
// mirror: max of sin angle / (a / ρ).
double widest(const Scene& scene, float radius) {
    double worst = 0;
    for (const LampRay& ray : trace_luminaire(scene, parameters(100'000), 0, Workers{2}).rays) {
        if (ray.o.length() < 2 * radius) continue;  // straight from the ball
        // A point of the paraboloid is as far from the focus as from the directrix.
        const double rho = 2 * double{kFocal} + double{ray.o.z};
        const double sine = std::hypot(double{ray.d.x}, double{ray.d.y});
        worst = std::max(worst, sine * rho / double{radius});
    }
    return worst;
}

TEST(Luminaire, PointAtTheFocusOfAParabola_GivesAParallelBeamOfItsClosedForm) {
    SceneMaker make;
    add_mirror(make);
    make.light(make_point_light(V3f(0.0F), Rgb(1 / (4 * kPi))));
    const Scene scene = make.build();
    const LuminaireBlock block = trace_luminaire(scene, parameters(200'000), 0, Workers{2});
    constexpr int kRings = 24;
    std::vector<std::uint64_t> counted(kRings);
    double mirrored = 0;
    for (const LampRay& ray : block.rays) {
        if (ray.o.length() < 1e-6F) continue;  // straight from the source
        EXPECT_LT(std::hypot(ray.d.x, ray.d.y), 2e-6F);
        const double r = std::hypot(double{ray.o.x}, double{ray.o.y});
        ++counted[static_cast<std::size_t>(std::min(kRings - 1.0, r / double{kRim} * kRings))];
        mirrored += double{ray.flux};
    }
    // A ray at the angle θ from the mirror's axis meets it where tan θ/2 = r / 2f, so 1 - cos θ = 2 q² / (1 +
    // q²).
    const auto share = [](double r) {
        const double q2 = sqr(r / (2 * double{kFocal}));
        return q2 / (1 + q2);
    };
    const double all = share(double{kRim});
    double rays = 0;
    for (const std::uint64_t count : counted) rays += static_cast<double>(count);
    std::vector<double> expected, uniform;
    for (int i = 0; i < kRings; ++i) {
        const double inner = i * double{kRim} / kRings;
        const double outer = (i + 1) * double{kRim} / kRings;
        expected.push_back(rays * (share(outer) - share(inner)) / all);
        uniform.push_back(rays * (outer * outer - inner * inner) / sqr(double{kRim}));
    }
    EXPECT_TRUE(testing::chi_square(counted, expected).accepted());
    EXPECT_FALSE(testing::chi_square(counted, uniform).accepted());
    EXPECT_NEAR(mirrored / 200'000, all, 2e-3);  // of 1 W
    EXPECT_LT(block.flux.ledger.imbalance(), 1e-5);
}

TEST(Luminaire, BallAtTheFocus_SpreadsByItsSizeSeenFromTheMirror) {
    SceneMaker make;
    add_mirror(make);
    add_ball(make, V3f(0.0F), 2e-4F);
    const double spread = widest(make.build(), 2e-4F);
    EXPECT_LE(spread, 1.001);
    EXPECT_GT(spread, 0.98);
    SceneMaker beside;
    add_mirror(beside);
    add_ball(beside, {0, 0, 2e-4F}, 2e-4F);
    EXPECT_GT(widest(beside.build(), 2e-4F), 1.5);
}

// Returns a lamp with mirror, glass, a coloured diffuse wall and an opening, so that light ends in every way.
Scene busy_lamp() {
    SceneMaker make;
    add_mirror(make);
    add_ball(make, {0.001F, 0, 0.001F}, 1e-3F);
    make.sphere({0, 0, 0.03F}, 0.008F, make.material(DielectricMaterial{}));
    make.quad({0.02F, -0.02F, 0}, {0, 0.04F, 0}, {0, 0, 0.05F}, make.diffuse(Rgb(0.8F, 0.5F, 0.2F)));
    return make.build();
}

TEST(Luminaire, Ledger_ClosesAndTellsForwardFromBackward) {
    const LuminaireBlock block = trace_luminaire(busy_lamp(), parameters(100'000), 0, Workers{2});
    const Ledger& ledger = block.flux.ledger;
    EXPECT_LT(ledger.imbalance(), 1e-5);
    double rays = 0;
    for (const LampRay& ray : block.rays) {
        EXPECT_GT(ray.d.z, 0);
        rays += double{ray.flux};
    }
    EXPECT_NEAR(double{luminance(Rgb(V3f(block.flux.forward)))} / rays, 1, 1e-5);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR((block.flux.forward[c] + block.flux.backward[c]) / ledger.escaped[c], 1, 1e-12);
        EXPECT_GT(block.flux.backward[c], 0);
        EXPECT_GT(ledger.absorbed[c], 0);
    }
    EXPECT_GT(block.flux.forward.x, block.flux.forward.z);  // the wall is red
}

bool same(const LampRay& a, const LampRay& b) {
    return a.o == b.o && a.d == b.d && a.flux == b.flux;
}

TEST(Luminaire, OnAnyThreadsAndInAnyBlocks_SendsTheSameRays) {
    const Scene lamp = busy_lamp();
    const LuminaireBlock once = trace_luminaire(lamp, parameters(30'000), 0, Workers{1});
    for (const int threads : {2, 3}) {
        const LuminaireBlock again = trace_luminaire(lamp, parameters(30'000), 0, Workers{threads});
        ASSERT_EQ(once.rays.size(), again.rays.size());
        EXPECT_TRUE(std::equal(once.rays.begin(), once.rays.end(), again.rays.begin(), same));
        EXPECT_EQ(once.flux.ledger.absorbed, again.flux.ledger.absorbed);
    }
    const LuminaireParameters blocks = parameters(30'000, 7'000);
    EXPECT_EQ(blocks.blocks(), 5);
    std::vector<LampRay> joined;
    std::uint64_t paths = 0;
    for (std::int64_t i = 0; i < blocks.blocks(); ++i) {
        const LuminaireBlock block = trace_luminaire(lamp, blocks, i, Workers{2});
        joined.insert(joined.end(), block.rays.begin(), block.rays.end());
        paths += block.flux.ledger.paths;
    }
    EXPECT_EQ(paths, 30'000U);
    ASSERT_EQ(joined.size(), once.rays.size());
    EXPECT_TRUE(std::equal(joined.begin(), joined.end(), once.rays.begin(), same));
}

double absorbed_light(const std::vector<V3d>& absorbed, std::size_t material) {
    return material < absorbed.size() ? double{luminance(Rgb(V3f(absorbed[material])))} : 0.0;
}

// A point between a grey and a black board sends half of its light to each.
TEST(Luminaire, Losses_AreBookedOnTheMaterialThatAbsorbs) {
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(0.75F)), black = make.diffuse(Rgb(0.0F));
    constexpr float kWide = 1000;
    make.quad({-kWide, -kWide, -0.1F}, {2 * kWide, 0, 0}, {0, 2 * kWide, 0}, black);
    make.quad({-kWide, -kWide, 0.1F}, {2 * kWide, 0, 0}, {0, 2 * kWide, 0}, grey);
    make.light(make_point_light(V3f(0.0F), Rgb(1 / (4 * kPi))));
    const Scene scene = make.build();
    for (const int threads : {1, 3}) {
        const LuminaireBlock block = trace_luminaire(scene, parameters(100'000), 0, Workers{threads});
        const Ledger& ledger = block.flux.ledger;
        // The grey board absorbs a quarter of its half, and the rest of the light ends on the black one.
        EXPECT_NEAR(absorbed_light(block.absorbed, grey) / 1e5, 0.125, 2e-3);
        EXPECT_NEAR(absorbed_light(block.absorbed, black) / 1e5, 0.875, 6e-3);
        V3d sum(0, 0, 0);
        for (const V3d& absorbed : block.absorbed) sum += absorbed;
        EXPECT_LT((sum - ledger.absorbed).length(), 1e-9 * ledger.absorbed.length());
    }
}

TEST(Luminaire, TowardsAnotherSide_HasItsRaysInTheAxesOfThatSide) {
    SceneMaker make;
    make.quad_light({0, 0, 0}, {0, 0.01F, 0}, {0.01F, 0, 0}, make.diffuse(Rgb(0.0F)), Rgb(1.0F));
    const Scene scene = make.build();
    LuminaireParameters below = parameters(1000);
    below.side = SlabAxes::facing(1);
    const LuminaireBlock block = trace_luminaire(scene, below, 0, Workers{2});
    EXPECT_EQ(block.rays.size(), 1000U) << "all light leaves towards -z";
    for (const LampRay& ray : block.rays) {
        EXPECT_GT(ray.d.z, 0);
        EXPECT_LE(ray.o.x, 0) << "u of that side is -x";
    }
    EXPECT_TRUE(trace_luminaire(scene, parameters(1000), 0, Workers{2}).rays.empty()) << "none towards +z";
}

TEST(Luminaire, TowardsAllSides_HasRaysThatStartOnTheBoxOfItsSurfaces) {
    const Scene scene = busy_lamp();
    LuminaireParameters all = parameters(50'000);
    all.all_sides = true;
    const LuminaireBlock block = trace_luminaire(scene, all, 0, Workers{2});
    EXPECT_EQ(block.flux.backward, V3d(0));
    EXPECT_EQ(block.flux.forward, block.flux.ledger.escaped);
    const V3f middle = scene.bounds().center(), half = scene.bounds().size() * 0.5F;
    bool below = false;
    for (const LampRay& ray : block.rays) {
        const V3f at = ray.o - V3f(scene.origin()) - middle;
        float reach = 0;
        for (int a = 0; a < 3; ++a) reach = std::max(reach, std::fabs(at[a]) / half[a]);
        EXPECT_NEAR(reach, 1, 1e-4);
        below = below || ray.d.z < 0;
    }
    EXPECT_TRUE(below);
    // The lines are those of the rays to one side.
    const LuminaireBlock up = trace_luminaire(scene, parameters(50'000), 0, Workers{2});
    std::size_t i = 0;
    for (const LampRay& ray : block.rays) {
        if (!(ray.d.z > kLeastForward)) continue;
        ASSERT_LT(i, up.rays.size());
        EXPECT_EQ(ray.d, up.rays[i].d);
        EXPECT_LT((ray.o - up.rays[i].o).cross(ray.d).length(), 1e-6F);
        ++i;
    }
    EXPECT_EQ(i, up.rays.size());
}

TEST(Luminaire, AsARaySet_CarriesItsFluxAndColour) {
    SceneMaker make;
    make.quad_light({0, 0, 0}, {0.01F, 0, 0}, {0, 0.01F, 0}, make.diffuse(Rgb(0.0F)), Rgb(2, 1, 0.5F));
    Monitor silent;
    const Scene scene = make.build();
    const RaySet set = trace_rays(scene, parameters(10'000), FluxUnit::lumen, Workers{2}, silent);
    const double expected = scene.lights()[0]->power();  // all of it leaves upwards
    double sum = 0;
    for (const LampRay& ray : set.rays) sum += double{ray.flux};
    EXPECT_NEAR(sum / expected, 1, 1e-4);
    EXPECT_NEAR(set.flux / expected, 1, 1e-4);
    EXPECT_EQ(set.unit, FluxUnit::lumen);
    EXPECT_NEAR(set.colour().x / set.colour().z, 4, 1e-3);
    EXPECT_NEAR(luminance(set.colour()), 1, 1e-5);
    EXPECT_FALSE(set.coloured()) << "all rays have one";
}

TEST(Luminaire, OfTwoColours_HasRaysInBoth) {
    SceneMaker make;
    make.quad_light({0, 0, 0}, {0.01F, 0, 0}, {0, 0.01F, 0}, make.diffuse(Rgb(0.0F)), Rgb(2, 1, 0.5F));
    make.quad_light({0.02F, 0, 0}, {0.01F, 0, 0}, {0, 0.01F, 0}, make.diffuse(Rgb(0.0F)), Rgb(0.1F, 1, 2));
    Monitor silent;
    const Scene scene = make.build();
    const RaySet set = trace_rays(scene, parameters(10'000, 1 << 12), FluxUnit::lumen, Workers{2}, silent);
    ASSERT_EQ(set.tristimulus.size(), set.rays.size());
    V3d sum(0, 0, 0);
    double flux = 0;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        const Rgb expected = set.rays[i].o.x < 0.015F ? Rgb(2, 1, 0.5F) : Rgb(0.1F, 1, 2);
        const V3d xyz = rgb_to_xyz(expected / luminance(expected));
        EXPECT_LT((V3d(set.tristimulus[i]) - xyz).length(), 1e-4);
        sum += double{set.rays[i].flux} * V3d(set.tristimulus[i]);
        flux += double{set.rays[i].flux};
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c] / flux, set.xyz[c], 1e-4);
    EXPECT_EQ(trace_rays(scene, parameters(10'000), FluxUnit::lumen, Workers{1}, silent).tristimulus,
              set.tristimulus)
        << "in any blocks";
}

TEST(Luminaire, OfAPlaceFarFromTheWorldsOrigin_StaysThere) {
    SceneParts parts;
    parts.origin = V3d(2, -1, 0.5);
    parts.lights.push_back(make_point_light(V3f(0.25F, 0, 0), Rgb(1.0F)));
    const Scene scene(std::move(parts), Workers{1});
    const LuminaireBlock block = trace_luminaire(scene, parameters(100), 0, Workers{1});
    ASSERT_FALSE(block.rays.empty());
    EXPECT_EQ(block.rays[0].o, V3f(2.25F, -1, 0.5F));
}

std::string refusal(const Scene& scene, const LuminaireParameters& of) {
    return testing::error_of([&] { check_luminaire(scene, of); });
}

TEST(Luminaire, ThatCannotBeTraced_IsRefusedWithTheCause) {
    SceneMaker dark;
    EXPECT_THAT(refusal(dark.build(), parameters(10)), HasSubstr("no light with any power"));
    SceneMaker sun;
    sun.light(make_distant_light({0, 0, -1}, Rgb(1.0F), {}));
    EXPECT_THAT(refusal(sun.build(), parameters(10)), HasSubstr("of type distant"));
    SceneMaker fog;
    fog.light(make_point_light(V3f(0.0F), Rgb(1.0F)));
    fog.region(testing::homogeneous(Rgb(1.0F), Rgb(1.0F)));
    EXPECT_THAT(refusal(fog.build(), parameters(10)), HasSubstr("media"));
    SceneMaker lamp;
    lamp.light(make_point_light(V3f(0.0F), Rgb(1.0F)));
    const Scene scene = lamp.build();
    EXPECT_EQ(refusal(scene, parameters(10)), "no error");
    EXPECT_THAT(refusal(scene, parameters(0)), HasSubstr("1 to 4294967296"));
    EXPECT_THAT(refusal(scene, parameters((std::int64_t{1} << 32) + 1)), HasSubstr("1 to 4294967296"));
}

}  // namespace luminaire_test
}  // namespace lucerna
