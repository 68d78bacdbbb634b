// Rays emitted as a light of a scene, exported as files for optics programs, and projected back into a light
// field.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "lights/measured.h"
#include "lights/measurement/emit_rays.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ray_light_test {

using ::testing::HasSubstr;

RaySet five_rays() {
    RaySet set;
    set.unit = FluxUnit::lumen;
    const Rgb colour(0.5F, 1.1F, 1.5F);
    set.xyz = rgb_to_xyz(colour / luminance(colour));
    const float flux[] = {1, 0, 4, 0.5F, 2.5F};
    for (int i = 0; i < 5; ++i) {
        set.rays.push_back({{0.001F * static_cast<float>(i), 0.002F, -0.003F}, {0.6F, 0, 0.8F}, flux[i]});
        set.flux += double{flux[i]};
    }
    return set;
}

LeSampleU numbers(std::uint64_t i) {
    Sampler sampler(21, Purpose::test, 0, i);
    const V2f position = sampler.next2();
    return {position, sampler.next2(), sampler.bits()};
}

TEST(RayLight, Rays_AreChosenByFlux) {
    const RaySet set = five_rays();
    const auto light = make_ray_light(set, RayLightSettings{"five", M44d(), 1, 0});
    std::array<std::uint64_t, 5> seen{};
    constexpr int kDraws = 80000;
    for (int i = 0; i < kDraws; ++i) {
        const auto e = light->sample_Le(numbers(static_cast<std::uint64_t>(i)));
        ASSERT_TRUE(e);
        ++seen[static_cast<std::size_t>(std::lround(e->from.p.x * 1000))];
        EXPECT_NEAR(luminance(e->weight), 8, 1e-5F);
        EXPECT_NEAR(e->d.z, 0.8F, 1e-6F);
    }
    const std::array<double, 5> expected{1 * 1e4, 0, 4e4, 0.5e4, 2.5e4};
    const auto fit = testing::chi_square(seen, expected);
    EXPECT_TRUE(fit.accepted()) << fit.statistic;
    const std::array<double, 5> wrong{1.2e4, 0, 3.8e4, 0.5e4, 2.5e4};
    EXPECT_FALSE(testing::chi_square(seen, wrong).accepted());
}

// Returns five_rays() in watts, with three wavelengths and one ray without, written by hand.
RaySet coloured_rays() {
    RaySet set = five_rays();
    set.unit = FluxUnit::watt;
    const V3d xyz[] = {cie_xyz(455), cie_xyz(500), cie_xyz(610), V3d(0, 0, 0), cie_xyz(540)};
    V3d sum(0, 0, 0);
    for (std::size_t i = 0; i < 5; ++i) sum += double{set.rays[i].flux} * xyz[i];
    for (const V3d& c : xyz) set.tristimulus.push_back(V3f(c * (set.flux / sum.y)));
    set.xyz = sum / sum.y;
    set.lumens_per_watt = 683 * sum.y / set.flux;
    return set;
}

// The light of the rays, and what each ray adds to the mean of its particles, found by drawing with evenly
// spaced numbers: each share is known to within 1 / kDraws.
struct Drawn {
    std::array<Rgb, 5> weight;  // of a ray's particles; 0: never drawn
    std::array<double, 5> share{};
    std::unique_ptr<Light> light;

    explicit Drawn(const RaySet& set) : light(make_ray_light(set, RayLightSettings{"five", M44d(), 1, 0})) {
        weight.fill(Rgb(0));
        for (int i = 0; i < kDraws; ++i) {
            const float u = (static_cast<float>(i) + 0.5F) / kDraws;
            const auto e = light->sample_Le({{u, 0}, {0, 0}, 0});
            const auto ray = static_cast<std::size_t>(std::lround(e->from.p.x * 1000));
            weight[ray] = e->weight;
            share[ray] += 1.0 / kDraws;
        }
    }
    static constexpr int kDraws = 80000;
};

TEST(RayLight, ColouredRays_KeepTheLampsFluxAndColour) {
    const RaySet set = coloured_rays();
    const Drawn drawn(set);
    EXPECT_NEAR(drawn.light->power(), 8, 1e-5);
    EXPECT_NEAR((drawn.light->flux() - 8.0F * set.colour()).length(), 0, 1e-5F);
    EXPECT_GT(std::min({set.colour().x, set.colour().y, set.colour().z}), 0.1F) << "the lamp is inside sRGB";
    V3d sum(0, 0, 0);
    const Rgb all = drawn.light->flux();
    for (std::size_t i = 0; i < 5; ++i) {
        const Rgb& w = drawn.weight[i];
        sum += drawn.share[i] * V3d(w);
        if (i == 1 || i == 3) {
            EXPECT_EQ(drawn.share[i], 0) << "no flux, no light";
            continue;
        }
        EXPECT_GE(std::min({w.x, w.y, w.z}), 0);
        EXPECT_NEAR((w.x + w.y + w.z) / (all.x + all.y + all.z), 1, 1e-5F);
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], double{all[c]}, 0.01) << c;
    // Replacing colours outside the gamut by grey would change the lamp's colour.
    V3d greyed(0, 0, 0);
    for (std::size_t i = 0; i < 5; ++i) {
        const V3d xyz(set.tristimulus[i]);
        if (xyz.y > 0)
            greyed += double{set.rays[i].flux} * xyz.y * V3d(colour_of_luminance_one(xyz_to_rgb(xyz)));
    }
    EXPECT_GT(std::fabs(greyed.z - double{all.z}), 0.1);
    // Blue rays are blue and red ones red.
    EXPECT_GT(drawn.weight[0].z, 10 * std::max(drawn.weight[0].x, drawn.weight[0].y));
    EXPECT_GT(drawn.weight[2].x, 2 * std::max(drawn.weight[2].y, drawn.weight[2].z));
    EXPECT_GT(drawn.weight[4].y, 2 * std::max(drawn.weight[4].x, drawn.weight[4].z));
}

TEST(RayLight, ColoursInsideTheGamut_AreEmittedAsTheyAre) {
    RaySet set = five_rays();
    const Rgb colours[] = {{0.5F, 1, 2}, {1, 1, 1}, {2, 0.7F, 0.5F}, {0.9F, 1, 1}, {0.3F, 1.2F, 0.1F}};
    V3d sum(0, 0, 0);
    for (std::size_t i = 0; i < 5; ++i) {
        set.tristimulus.push_back(V3f(rgb_to_xyz(colours[i] / luminance(colours[i]))));
        sum += double{set.rays[i].flux} * V3d(set.tristimulus.back());
    }
    set.xyz = sum / sum.y;
    const Drawn drawn(set);
    for (std::size_t i = 0; i < 5; ++i) {
        if (!(set.rays[i].flux > 0)) continue;
        const Rgb own = colours[i] / luminance(colours[i]);
        EXPECT_NEAR((drawn.weight[i] / luminance(drawn.weight[i]) - own).length(), 0, 1e-5F) << i;
        // The ray adds its flux, in lumens.
        EXPECT_NEAR(drawn.share[i] * double{luminance(drawn.weight[i])}, double{set.rays[i].flux}, 1e-3) << i;
    }
}

TEST(RayLight, LampOutsideTheGamut_HasItsColourOfLuminanceOne) {
    RaySet set = five_rays();
    V3d sum(0, 0, 0);
    const double nm[] = {520, 525, 530, 535, 540};
    for (std::size_t i = 0; i < 5; ++i) {
        set.tristimulus.push_back(V3f(cie_xyz(nm[i]) / cie_xyz(nm[i]).y));
        sum += double{set.rays[i].flux} * V3d(set.tristimulus.back());
    }
    set.xyz = sum / sum.y;
    const Drawn drawn(set);
    EXPECT_NEAR((drawn.light->flux() - 8.0F * set.colour()).length(), 0, 1e-5F);
    V3d mean(0, 0, 0);
    for (std::size_t i = 0; i < 5; ++i) mean += drawn.share[i] * V3d(drawn.weight[i]);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], 8 * double{set.colour()[c]}, 1e-3) << c;
}

TEST(RayLight, Placement_MovesTurnsAndScalesTheRays) {
    M44d m;
    m.scale(V3d(2));
    m.rotate(V3d(0, M_PI / 2, 0));  // z onto x
    m.translate(V3d(0));
    m[3][0] = 10;
    const auto light = make_ray_light(five_rays(), RayLightSettings{"five", m, 3, 0});
    const auto e = light->sample_Le({{0, 0}, {0, 0}, 0});  // the first ray
    ASSERT_TRUE(e);
    V3d p, d;
    m.multVecMatrix(V3d(0, 0.002, -0.003), p);
    m.multDirMatrix(V3d(0.6, 0, 0.8), d);
    EXPECT_NEAR((V3d(e->from.p) - p).length(), 0, 1e-6);
    EXPECT_NEAR((V3d(e->d) - d / 2).length(), 0, 1e-6);
    EXPECT_NEAR(light->power(), 24, 1e-4);  // of 8 lm, times 3, whatever the size
    EXPECT_EQ(light->unit(), FluxUnit::lumen);
    EXPECT_NEAR(make_ray_light(five_rays(), RayLightSettings{"five", M44d(), 1, 5})->power(), 5, 1e-5);
    EXPECT_NEAR(make_ray_light(five_rays(), RayLightSettings{"five", M44d(), 2, 5})->power(), 10, 1e-5);
}

TEST(RayLight, OnlyParticles_MeetIt) {
    const auto light = make_ray_light(five_rays(), RayLightSettings{"five", M44d(), 1, 0});
    EXPECT_TRUE(light->only_particles());
    EXPECT_FALSE(light->has_impostor());
    EXPECT_FALSE(light->sample_Li({0, 0, 1}, {0.5F, 0.5F}));
}

TEST(RayLight, EveryNumber_FindsARayWithFlux) {
    RaySet set = five_rays();
    set.rays.front().flux = 0, set.rays.back().flux = 0;
    const auto light = make_ray_light(set, RayLightSettings{"five", M44d(), 1, 0});
    for (const float x : {0.0F, 0.1F, 0.888888F, 0.99999994F}) {
        for (const float y : {0.0F, 0.99999994F}) {
            const auto e = light->sample_Le({{x, y}, {0, 0}, 0});
            ASSERT_TRUE(e);
            const auto i = static_cast<std::size_t>(std::lround(e->from.p.x * 1000));
            EXPECT_GT(set.rays[i].flux, 0) << x << " " << y;
        }
    }
}

TEST(RayLight, NothingToEmit_IsRefused) {
    RaySet dark = five_rays();
    for (LampRay& ray : dark.rays) ray.flux = 0;
    EXPECT_THAT(testing::error_of([&] {
                    make_ray_light(dark, RayLightSettings{"five", M44d(), 1, 0});
                }),
                HasSubstr("five: no ray carries flux"));
    EXPECT_THROW(make_ray_light(five_rays(), RayLightSettings{"five", M44d(), NAN, 0}), InputError);
}

// --- files ---

TEST(WriteRays, EveryFormat_ReadsBackWhatWasWritten) {
    const testing::TemporaryFolder folder;
    for (const FluxUnit unit : {FluxUnit::lumen, FluxUnit::watt}) {
        for (const char* name : {"rays.tm25ray", "rays.DAT", "rays.ray"}) {
            RaySet set = five_rays();
            set.unit = unit;
            set.provenance = "five rays, é";
            write_rays(folder / name, set);
            testing::ListeningMonitor monitor;
            const RaySet read = read_rays(folder / name, monitor);
            EXPECT_TRUE(monitor.warnings.empty()) << name << monitor.warnings[0];
            ASSERT_EQ(read.rays.size(), 5U);
            for (std::size_t i = 0; i < 5; ++i) {
                EXPECT_NEAR((read.rays[i].o - set.rays[i].o).length(), 0, 1e-9F);
                EXPECT_NEAR((read.rays[i].d - set.rays[i].d).length(), 0, 1e-6F);
                EXPECT_NEAR(read.rays[i].flux, set.rays[i].flux, 1e-6F);
            }
            EXPECT_EQ(read.unit, unit);
            EXPECT_NEAR(read.flux, 8, 1e-6);
            const bool coloured = unit == FluxUnit::lumen && std::string_view(name) == "rays.tm25ray";
            RayFileInfo info;
            info.unit = unit;
            info.xyz = set.xyz;
            EXPECT_EQ(keeps_colour(folder / name, info), coloured);
            EXPECT_NEAR((read.xyz - (coloured ? set.xyz : kWhiteXyz)).length(), 0, 1e-6) << name;
            EXPECT_FALSE(read.coloured()) << name;
            // Writing the same rays again gives the same bytes.
            const auto first = read_bytes(folder / name);
            write_rays(folder / name, set);
            EXPECT_EQ(read_bytes(folder / name), first) << name;
        }
    }
}

TEST(WriteRays, ColoursOfRays_AreTheSameAgainFromTm25) {
    const testing::TemporaryFolder folder;
    testing::ListeningMonitor monitor;
    RaySet lumens = coloured_rays();
    lumens.unit = FluxUnit::lumen;
    lumens.lumens_per_watt = 0;
    lumens.rays[3].flux = 0;
    lumens.flux = 7.5;
    V3d sum(0, 0, 0);
    for (std::size_t i = 0; i < 5; ++i) {
        V3f& xyz = lumens.tristimulus[i];
        xyz = i == 3 ? V3f(1) : xyz / xyz.y;
        sum += double{lumens.rays[i].flux} * V3d(xyz);
    }
    lumens.xyz = sum / sum.y;
    for (const RaySet& set : {lumens, coloured_rays()}) {
        write_rays(folder / "rays.tm25ray", set);
        const RaySet read = read_rays(folder / "rays.tm25ray", monitor);
        EXPECT_TRUE(monitor.warnings.empty());
        EXPECT_EQ(read.unit, set.unit);
        EXPECT_NEAR(read.flux, set.flux, 1e-6);
        EXPECT_NEAR((read.xyz - set.xyz).length(), 0, 1e-6 * set.xyz.length());
        EXPECT_NEAR(read.lumens_per_watt, set.lumens_per_watt, 1e-4);
        ASSERT_EQ(read.tristimulus.size(), 5U);
        for (std::size_t i = 0; i < 5; ++i) {
            EXPECT_EQ(read.rays[i].flux, set.rays[i].flux);
            if (!(set.rays[i].flux > 0)) continue;
            EXPECT_NEAR((read.tristimulus[i] - set.tristimulus[i]).length(), 0,
                        2e-6F * std::max(1.0F, set.tristimulus[i].length()))
                << i;
        }
        // The other formats keep the rays and report that they drop the colours.
        RayFileInfo info;
        info.unit = set.unit;
        info.colour_per_ray = true;
        info.lumens_per_watt = set.lumens_per_watt;
        EXPECT_TRUE(keeps_colour("a.tm25ray", info));
        EXPECT_FALSE(keeps_colour("a.dat", info));
        EXPECT_FALSE(keeps_colour("a.ray", info));
        write_rays(folder / "rays.dat", set);
        EXPECT_FALSE(read_rays(folder / "rays.dat", monitor).coloured());
    }
    // Without a luminous efficacy no luminous flux can be written.
    RaySet unknown = coloured_rays();
    unknown.lumens_per_watt = 0;
    RayFileInfo info;
    info.unit = FluxUnit::watt;
    info.colour_per_ray = true;
    EXPECT_FALSE(keeps_colour("a.tm25ray", info));
    write_rays(folder / "rays.tm25ray", unknown);
    EXPECT_FALSE(read_rays(folder / "rays.tm25ray", monitor).coloured());
}

TEST(WriteRays, WrongNames_AreRefused) {
    const testing::TemporaryFolder folder;
    EXPECT_THAT(testing::error_of([&] { write_rays(folder / "rays.txt", five_rays()); }),
                HasSubstr(".tm25ray"));
    EXPECT_THROW(write_rays(folder / "none" / "rays.ray", five_rays()), InputError);
    RayFileInfo many;
    many.rays = std::uint64_t{1} << 31;
    EXPECT_THAT(
        testing::error_of([&] { write_rays(folder / "rays.dat", many, [](std::vector<LampRay>&) {}); }),
        HasSubstr("2147483647"));
    EXPECT_FALSE(std::filesystem::exists(folder / "rays.dat"));
}

// --- a field, its rays, and the field again ---

LightField smooth_field(const Rig& rig) {
    LightFieldInfo info;
    info.unit = FluxUnit::lumen;
    info.colour = five_rays().colour();
    return testing::random_field(rig, 0.5e6F, 1.5e6F, 22, info);
}

// Returns Σ (difference / its standard deviation)² of the coefficients projected from `rays` against the
// truth. The projection of rays has the variance Σ (contribution)²; enough rays fall on each coefficient for
// it to be normal.
testing::ChiSquare against(const LightField& truth, const RaySet& rays, double scale) {
    Monitor silent;
    const Rig& rig = truth.rig();
    const LightField got = project_rays(rays, rig, {}, silent).field;
    // The rays are equal, so batches of them give each coefficient's variance.
    constexpr std::size_t kBatches = 40;
    std::vector<RunningStats> stats(rig.coefficients());
    for (std::size_t batch = 0; batch < kBatches; ++batch) {
        RaySet part = rays;
        part.rays.clear();
        for (std::size_t i = batch; i < rays.rays.size(); i += kBatches) {
            part.rays.push_back(rays.rays[i]);
            part.rays.back().flux *= static_cast<float>(kBatches);
        }
        const LightField field = project_rays(part, rig, {}, silent).field;
        for (std::size_t i = 0; i < stats.size(); ++i) stats[i].add(double{field.coefficients()[i]});
    }
    testing::ChiSquare result;
    for (std::size_t i = 0; i < stats.size(); ++i) {
        const double difference = double{got.coefficients()[i]} - scale * double{truth.coefficients()[i]};
        // The t² of forty batches has the mean 39/37.
        result.statistic += sqr(difference / stats[i].standard_error()) * 37 / 39;
        ++result.degrees;
    }
    // A sum of many t², each of variance slightly over 2, is tested by its normal limit, one-sided against
    // excess.
    const double sigmas = (result.statistic - result.degrees) / std::sqrt(2.4 * result.degrees);
    result.p_value = 0.5 * std::erfc(sigmas / std::sqrt(2.0));
    return result;
}

TEST(LampEmission, RaysOfAField_AreTheFieldAgain) {
    const testing::TemporaryFolder folder;
    Rig rig = testing::rig_b();
    rig.pixels = {5, 5};
    const LightField field = smooth_field(rig);
    for (const EmissionMode mode : {EmissionMode::exact}) {
        for (const char* name : {"out.tm25ray", "out.dat"}) {
            testing::ListeningMonitor monitor;
            const LampEmission lamp(field, "field.exr", mode, 23, {}, monitor);
            const RayFileInfo info = lamp.write(folder / name, 100'000, monitor);
            EXPECT_EQ(info.unit, FluxUnit::lumen);
            EXPECT_NEAR(info.flux / field.flux(), 1, 1e-6);
            EXPECT_EQ(monitor.warnings.size(),
                      std::string_view(name) == "out.tm25ray" ? 0U : 1U);  // for the dropped colours
            Monitor silent;
            const RaySet rays = read_rays(folder / name, silent);
            EXPECT_EQ(rays.rays.size(), 100'000U);
            EXPECT_EQ(rays.unit, FluxUnit::lumen);
            EXPECT_NEAR(rays.flux / field.flux(), 1, 1e-5);
            const auto fit = against(field, rays, 1);
            EXPECT_TRUE(fit.accepted()) << name << ": " << fit.statistic << " of " << fit.degrees;
            const auto wrong = against(field, rays, 1.06);
            EXPECT_FALSE(wrong.accepted()) << name << ": " << wrong.statistic << " of " << wrong.degrees;
        }
    }
}

TEST(LampEmission, ThreadsAndSeeds_SameRaysOrOthers) {
    const testing::TemporaryFolder folder;
    const LightField field = smooth_field(testing::rig_b());
    Monitor silent;
    const auto bytes = [&](EmissionMode mode, std::uint64_t seed, int threads) {
        LampEmission(field, "field.exr", mode, seed, {threads}, silent)
            .write(folder / "rays.tm25ray", 50'000, silent);
        return read_bytes(folder / "rays.tm25ray");
    };
    for (const EmissionMode mode : {EmissionMode::exact, EmissionMode::constant}) {
        const auto one = bytes(mode, 1, 1);
        EXPECT_EQ(one, bytes(mode, 1, 3));
        EXPECT_NE(one, bytes(mode, 2, 1));
    }
}

TEST(LampEmission, EqualEnergyModes_GiveEqualRays) {
    const testing::TemporaryFolder folder;
    Monitor silent;
    // Some coefficients are negative; clamping them is compensated by rescaling.
    const LightField field = testing::random_field(testing::rig_b(), -0.3e6F, 1e6F, 24);
    for (const EmissionMode mode : {EmissionMode::exact, EmissionMode::constant}) {
        LampEmission(field, "field.exr", mode, 0, {}, silent).write(folder / "rays.tm25ray", 1000, silent);
        const RaySet rays = read_rays(folder / "rays.tm25ray", silent);
        double sum = 0;
        bool equal = true;
        for (const LampRay& ray : rays.rays) {
            sum += double{ray.flux};
            equal = equal && ray.flux == rays.rays[0].flux;
        }
        EXPECT_NEAR(sum / field.flux(), 1, 1e-4);
        EXPECT_TRUE(equal);
    }
    const LightField dark = testing::random_field(testing::rig_b(), 0, 0, 1);
    EXPECT_THROW(LampEmission(dark, "dark", EmissionMode::exact, 0, {}, silent), InputError);
}

}  // namespace ray_light_test
}  // namespace lucerna
