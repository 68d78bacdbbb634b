// Tests the energy of every combination of maps: emitted = absorbed + escaped + still carried; and the flux
// that the maps hold [tests/support/closed_forms.h].
#include <gtest/gtest.h>

#include "engine/base/sampler.h"
#include "engine/colour/spectrum.h"
#include "engine/render/render.h"
#include "lights/field_colour.h"
#include "lights/measured.h"
#include "photon/build_maps.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace energy_test {

using testing::SceneMaker;

// Returns a room with glass, mirror, rough metal, colours and two lights.
Scene shiny_room() {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.8F, 0.7F, 0.6F)));
    make.sphere({0.3F, 0.3F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
    make.sphere({0.7F, 0.3F, 0.3F}, 0.15F, make.material(MirrorMaterial{}));
    ConductorMaterial metal;
    metal.roughness = Roughness::of_alpha(0.3F);
    make.sphere({0.5F, 0.3F, 0.7F}, 0.15F, make.material(metal));
    make.quad_light({0.4F, 0.999F, 0.4F}, {0.2F, 0, 0}, {0, 0, 0.2F}, make.diffuse(Rgb(0)), Rgb(3, 2, 1));
    make.light(make_spot_light({0.2F, 0.9F, 0.5F}, V3f(0.2F, -1, 0).normalized(), Rgb(1, 1, 1), {30, 10}));
    return make.build();
}

double flux(const PhotonMaps& maps, MapKind kind) {
    const PhotonMap* map = maps.find(kind);
    if (!map) return 0;
    double sum = 0;
    for (const Photon& photon : map->photons()) sum += static_cast<double>(photon.power.y);
    return sum;
}

PhotonMaps build(const Scene& scene, std::int64_t paths, unsigned kinds) {
    MapParameters parameters;
    parameters.paths = paths;
    parameters.seed = 11;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) parameters.wanted[kind] = (kinds >> kind & 1U) != 0;
    Monitor silent;
    return build_photon_maps(scene, parameters, Workers{2}, silent);
}

constexpr unsigned kEvery = (1U << kMapKinds) - 1;

TEST(Energy, EveryMapBuild_ClosesToRounding_AndHoldsTheSamePhotons) {
    for (const auto& make_scene : {std::function<Scene()>(shiny_room),
                                   std::function<Scene()>([] { return testing::small_cornell(); })}) {
        const Scene scene = make_scene();
        const PhotonMaps every = build(scene, 20'000, kEvery);
        for (unsigned kinds = 0; kinds <= kEvery; ++kinds) {
            const PhotonMaps maps = build(scene, 20'000, kinds);
            EXPECT_LT(maps.ledger.imbalance(), 1e-5) << kinds;
            // Paths end where no requested map takes what follows, and the ledger records what they carried.
            const bool to_their_end = kinds == 0 || (kinds & (1U << static_cast<unsigned>(MapKind::global) |
                                                              1U << static_cast<unsigned>(MapKind::volume)));
            if (to_their_end) {
                EXPECT_EQ(maps.ledger.absorbed, every.ledger.absorbed) << kinds;
                EXPECT_EQ(maps.ledger.not_followed, V3d(0.0)) << kinds;
            } else {
                EXPECT_LT(maps.ledger.absorbed.y, every.ledger.absorbed.y) << kinds;
                EXPECT_GT(maps.ledger.not_followed.y, 0.1 * maps.ledger.emitted.y) << kinds;
                EXPECT_LT(4 * maps.ledger.hits, 3 * every.ledger.hits) << kinds;
            }
            for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
                const bool wanted = (kinds >> kind & 1U) != 0;
                EXPECT_EQ(maps.maps[kind].has_value(), wanted);
                EXPECT_EQ(maps.counts[kind].stored, wanted ? every.counts[kind].stored : 0U);
            }
        }
    }
}

// With flux Φ from the centre of a sphere of albedo ρ the Direct map holds Φ, the Global map Φ ρ/(1-ρ), and
// the walls absorb Φ. Light paths have some ρ/(1-ρ) hits, with as large a standard deviation; 4 sigmas.
TEST(Energy, IntegratingSphere_MapsHoldItsFluxes) {
    constexpr float kFlux = 12;
    for (const auto& [albedo, paths] : {std::pair(0.0F, 20'000), std::pair(0.5F, 100'000),
                                        std::pair(0.9F, 50'000), std::pair(0.999F, 2000)}) {
        const Scene scene = testing::integrating_sphere(albedo, kFlux);
        const PhotonMaps maps = build(scene, paths, kEvery);
        const double indirect = kFlux * static_cast<double>(albedo) / (1 - static_cast<double>(albedo));
        const double noise = 4 / std::sqrt(static_cast<double>(paths));
        EXPECT_NEAR(flux(maps, MapKind::direct), static_cast<double>(kFlux), 1e-3);
        EXPECT_NEAR(flux(maps, MapKind::global), indirect, noise * indirect) << "albedo " << albedo;
        EXPECT_EQ(flux(maps, MapKind::caustic), 0);
        EXPECT_LT(maps.ledger.imbalance(), 1e-5);
        EXPECT_EQ(maps.ledger.escaped, V3d(0.0));
    }
}

// Tests a lamp whose red, green and blue differ independently by place and direction, in a coloured room.
TEST(Energy, LampOfSeveralColours_ClosesInEveryChannel) {
    Rig rig;
    rig.views = {4, 4};
    rig.spacing = {0.02, 0.02};
    rig.pixels = {8, 8};
    rig.pixel = {0.03, 0.03};
    rig.distance = 0.1;
    Sampler sampler(5, Purpose::test, 0, 0);
    std::vector<float> x, y, z;
    for (std::size_t i = 0; i < rig.coefficients(); ++i) {
        const V3d xyz = rgb_to_xyz(Rgb(2 * sampler.next(), sampler.next(), 3 * sampler.next()));
        x.push_back(static_cast<float>(xyz.x)), y.push_back(static_cast<float>(xyz.y)),
            z.push_back(static_cast<float>(xyz.z));
    }
    const LightField field(rig, x, y, z);
    const double flux = field.flux();
    const Rgb colour = FieldColour(field, {}).mean();
    Monitor silent;
    CellTable table(field, {}, silent);
    SceneMaker make;
    make.sphere(V3f(0.0F), 1.0F, make.diffuse(Rgb(0.7F, 0.5F, 0.2F)));
    make.sphere({0.2F, 0.1F, 0.5F}, 0.2F, make.material(DielectricMaterial{}));
    make.light(make_measured_light(field, std::move(table), {}, silent));
    constexpr int kPaths = 100'000;
    const PhotonMaps maps = build(make.build(), kPaths, kEvery);
    const Ledger& ledger = maps.ledger;
    EXPECT_LT(ledger.imbalance(), 1e-5) << "the worst of red, green and blue";
    // The ledger must close in X, Y and Z, too.
    const auto xyz_of = [](const V3d& rgb) { return rgb_to_xyz(Rgb(V3f(rgb))); };
    const V3d ends =
        ledger.absorbed + ledger.media + ledger.escaped + ledger.not_followed + ledger.cut + ledger.roulette;
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(xyz_of(ends)[c] / xyz_of(ledger.emitted)[c], 1, 1e-5) << c;
        // The emitted flux is the lamp's in its mean colour, with the noise of the colours drawn.
        EXPECT_NEAR(ledger.emitted[c] / (flux * double{colour[c]}), 1, 5 / std::sqrt(kPaths)) << c;
        EXPECT_GT(std::fabs(ledger.emitted[c] / (flux * double{colour[(c + 1) % 3]}) - 1), 0.1)
            << "another channel's value is rejected";
    }
}

}  // namespace energy_test
}  // namespace lucerna
