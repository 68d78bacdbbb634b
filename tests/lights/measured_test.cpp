#include "lights/measured.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/colour/spectrum.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace measured_test {

using testing::all_rigs;
using ::testing::HasSubstr;
using testing::random_field;
using testing::rig_a;
using testing::rig_b;
using testing::rig_c;

std::unique_ptr<Light> make(const LightField& field, const MeasuredSettings& settings = {}) {
    Monitor silent;
    return make_measured_light(field, CellTable(field, Workers{1}, silent), settings, silent);
}

LeSampleU emit_numbers(std::uint64_t seed, int i) {
    Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
    LeSampleU u;
    u.position = sampler.next2();
    u.direction = sampler.next2();
    u.salt = sampler.bits();
    return u;
}

// The points at which a particle of a light under identity placement crossed S and M.
struct Passed {
    V2d on_s, on_m;
    Passed(const LeSample& e, const Rig& rig) {
        on_s = V2d(double{e.from.p.x}, double{e.from.p.y}) - V2d(rig.centre.x, rig.centre.y);
        on_m = on_s + V2d(double{e.d.x}, double{e.d.y}) * (rig.distance / double{e.d.z});
    }
};

// The transform places the coordinate frame of the lamp's file, not the plane S, which lies in front of the
// lamp.
TEST(MeasuredLight, SamplingPlaneBeforeTheLamp_EmitsAndIsSeenThere) {
    const LightField field = random_field(rig_b(), 0, 1, 3);
    const V3d centre = field.rig().centre;
    ASSERT_GT(std::fabs(centre.z), 1e-3);
    MeasuredSettings settings;
    settings.world_from_light = M44d(2, 0, 0, 0, 0, 0, 2, 0, 0, -2, 0, 0, 5, 6, 7, 1);
    const auto light = make(field, settings);
    // The file's z axis is mapped to -2 y of the world.
    const double height = 6 - 2 * centre.z;
    int emitted = 0;
    for (int i = 0; i < 1000; ++i) {
        const auto e = light->sample_Le(emit_numbers(4, i));
        if (!e) continue;
        ++emitted;
        EXPECT_NEAR(double{e->from.p.y}, height, 1e-5);
        EXPECT_LT(e->d.y, 0);
    }
    EXPECT_GT(emitted, 100);
    const V3f below(static_cast<float>(5 + 2 * centre.x), static_cast<float>(height - 0.1),
                    static_cast<float>(7 + 2 * centre.y));
    const auto seen = light->Le({below, V3f(0, 1, 0)});
    ASSERT_TRUE(seen);
    EXPECT_NEAR(double{seen->distance}, 0.1, 1e-4);
}

// Test functions of the four coordinates; none of them is even.
double probe(int i, const Rig& rig, const V2d& s, const V2d& m) {
    const double u = s.x / rig.spacing.x;
    const double v = s.y / rig.spacing.y;
    const double p = m.x / rig.pixel.x;
    const double q = m.y / rig.pixel.y;
    switch (i) {
        case 0:
            return 1;
        case 1:
            return u;
        case 2:
            return v * q;
        case 3:
            return std::cos(2 * u + p);
        case 4:
            return u * u * v * v;
        default:
            return std::sin(3 * u * v) + p;
    }
}

void expect_moments(const LightField& field, EmissionMode mode, bool expected_to_hold) {
    MeasuredSettings settings;
    settings.mode = mode;
    const auto light = make(field, settings);
    RunningStats stats[6];
    for (int i = 0; i < 300000; ++i) {
        const auto e = light->sample_Le(emit_numbers(21, i));
        if (!e) {
            for (RunningStats& s : stats) s.add(0);
            continue;
        }
        EXPECT_EQ(e->from.n, V3f(0, 0, 1));
        const Passed at(*e, field.rig());
        for (int k = 0; k < 6; ++k)
            stats[k].add(double{luminance(e->weight)} * probe(k, field.rig(), at.on_s, at.on_m));
    }
    const double gain = field.flux() / field.clamped_flux({});
    bool all = true;
    for (int k = 0; k < 6; ++k) {
        const double truth = gain * testing::integrate(field, 20, 4, [&](const V2d& s, const V2d& m) {
                                 return probe(k, field.rig(), s, m);
                             });
        // The midpoint rule errs by about a thousandth of the flux.
        const bool agrees =
            std::fabs(stats[k].mean() - truth) <= 4 * stats[k].standard_error() + 1e-3 * field.flux();
        all = all && agrees;
        EXPECT_TRUE(agrees || !expected_to_hold) << k << ": " << stats[k].mean() << " for " << truth;
    }
    EXPECT_EQ(all, expected_to_hold);
}

TEST(MeasuredLight, Long_ExactEmission_OfASignedField_MeetsItsMoments) {
    for (const Rig& rig : all_rigs()) expect_moments(random_field(rig, -1, 2, 31), EmissionMode::exact, true);
}

TEST(MeasuredLight, ApproximateReconstruction_EmissionMeetsItsMoments) {
    for (const Rig& rig : {rig_b(), rig_c(), testing::rig_d()}) {
        const LightField field = random_field(rig, 0.2F, 2, 31);
        const testing::ApproximateRadiance approximate(field);
        MeasuredSettings settings;
        settings.reconstruction = Reconstruction::approximate;
        const auto light = make(field, settings);
        RunningStats stats[6];
        for (int i = 0; i < 100000; ++i) {
            const auto e = light->sample_Le(emit_numbers(22, i));
            ASSERT_TRUE(e);
            const Passed at(*e, field.rig());
            for (int k = 0; k < 6; ++k)
                stats[k].add(double{luminance(e->weight)} * probe(k, field.rig(), at.on_s, at.on_m));
        }
        int exact = 0;
        for (const int k : {0, 2, 5}) {
            const double truth = testing::integrate(field, 6, 3, [&](const V2d& s, const V2d& m) {
                return approximate(s, m) * field.rig().geometric_term(s, m) / testing::brute_h(field, s, m) *
                       probe(k, field.rig(), s, m);
            });
            const double of_exact = testing::integrate(
                field, 6, 3, [&](const V2d& s, const V2d& m) { return probe(k, field.rig(), s, m); });
            // The midpoint rule errs by a few thousandths of the flux.
            const double allowed = 4 * stats[k].standard_error() + 3e-3 * field.flux();
            EXPECT_NEAR(stats[k].mean(), truth, allowed) << k;
            exact += std::fabs(stats[k].mean() - of_exact) <= allowed;
        }
        EXPECT_LT(exact, 3) << "the exact reconstruction would pass, too";
    }
}

TEST(MeasuredLight, ApproximateReconstruction_WithConstantEmission_IsRefused) {
    MeasuredSettings settings;
    settings.reconstruction = Reconstruction::approximate;
    settings.mode = EmissionMode::constant;
    EXPECT_THAT(testing::error_of([&] { make(random_field(rig_b(), 0, 1, 3), settings); }),
                ::testing::HasSubstr("\"exact\""));
}

TEST(MeasuredLight, ConstantEmission_IsAnApproximationThatTheSameTestSees) {
    expect_moments(random_field(rig_b(), -1, 2, 31), EmissionMode::constant, false);
}

TEST(MeasuredLight, Particles_MadeManyAtOnce_AreTheSingleOnesBitForBit) {
    for (const EmissionMode mode : {EmissionMode::constant, EmissionMode::exact}) {
        MeasuredSettings settings;
        settings.mode = mode;
        settings.world_from_light.rotate(V3d(0.3, -1.0, 0.5));
        const auto light = make(random_field(rig_a(), -1, 1.2F, 41), settings);
        int emitted = 0;
        for (const int size : {0, 1, 7, 63, 64, 65, 1000}) {
            std::vector<LeSampleU> u;
            for (int i = 0; i < size; ++i) u.push_back(emit_numbers(42, i));
            std::vector<std::optional<LeSample>> many(u.size());
            light->sample_Le_many(u, many);
            for (std::size_t i = 0; i < u.size(); ++i) {
                const auto one = light->sample_Le(u[i]);
                ASSERT_EQ(one.has_value(), many[i].has_value());
                if (!one) continue;
                ++emitted;
                EXPECT_EQ(one->from.p, many[i]->from.p);
                EXPECT_EQ(one->from.n, many[i]->from.n);
                EXPECT_EQ(one->from.error, many[i]->from.error);
                EXPECT_EQ(one->d, many[i]->d);
                EXPECT_EQ(one->weight, many[i]->weight);
                EXPECT_EQ(one->cell, many[i]->cell);
            }
        }
        EXPECT_GT(emitted, 0);
    }
    const auto dark = make({rig_b(), std::vector<float>(rig_b().coefficients())});
    std::vector<std::optional<LeSample>> none(3, LeSample{});
    dark->sample_Le_many(std::vector<LeSampleU>(3), none);
    for (const auto& e : none) EXPECT_FALSE(e);
}

TEST(MeasuredLight, SmallestFields_EmitWhatTheyHold) {
    // Rigs with one view and one pixel (a single coefficient), with one view of many pixels, and with many
    // views of one pixel.
    for (const auto& [views, pixels] : {std::pair(V2i(1, 1), V2i(1, 1)), std::pair(V2i(1, 1), V2i(4, 5)),
                                        std::pair(V2i(3, 2), V2i(1, 1))}) {
        Rig rig = rig_b();
        rig.views = views;
        rig.pixels = pixels;
        for (const EmissionMode mode : {EmissionMode::constant, EmissionMode::exact}) {
            MeasuredSettings settings;
            settings.mode = mode;
            const LightField field = random_field(rig, 0.1F, 1, 43);
            const auto light = make(field, settings);
            RunningStats flux, square;
            for (int i = 0; i < 20000; ++i) {
                const auto e = light->sample_Le(emit_numbers(44, i));
                ASSERT_TRUE(e);
                const Passed at(*e, rig);
                EXPECT_LE(std::fabs(at.on_s.x), 0.5001 * rig.intervals(0) * rig.spacing.x);
                EXPECT_LE(std::fabs(at.on_m.y), 0.5001 * rig.columns(1) * rig.pixel.y);
                flux.add(double{luminance(e->weight)});
                square.add(double{luminance(e->weight)} * sqr(at.on_s.x / rig.spacing.x));
            }
            EXPECT_NEAR(flux.mean(), field.flux(), 4 * flux.standard_error() + 1e-5 * field.flux());
            if (views == V2i(1, 1) && mode != EmissionMode::constant) {
                // The second moment of the bell itself.
                double moment = 0;
                for (int i = 0; i < 1000; ++i)
                    moment += sqr((i + 0.5) / 1000) * testing::phi((i + 0.5) / 1000) / 500;
                EXPECT_NEAR(square.mean(), field.flux() * moment, 4 * square.standard_error());
            }
        }
    }
    std::vector<float> e(rig_b().coefficients(), 1.0F);
    e[7] = NAN;
    EXPECT_THROW(LightField(rig_b(), e), InputError);
}

TEST(MeasuredLight, Particles_FallIntoTheirCellsByClampedFlux) {
    const LightField field = random_field(rig_a(), -1, 1.5F, 32);
    Monitor silent;
    const CellTable table(field, {}, silent);
    const auto light = make(field);
    std::vector<std::uint64_t> observed(table.cells());
    constexpr int kDraws = 300000;
    for (int i = 0; i < kDraws; ++i) ++observed[light->sample_Le(emit_numbers(22, i))->cell];
    std::vector<double> expected;
    for (CellId id = 0; id < table.cells(); ++id) {
        expected.push_back(std::max(1e-9, field.members(*table.cell(id)).clamped_mean() / table.flux() *
                                              field.rig().cell_volume() * kDraws));
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
    for (double& e : expected) e = std::max(1e-9, 2.0 * kDraws / static_cast<double>(table.cells()) - e);
    EXPECT_FALSE(testing::chi_square(observed, expected).accepted());
}

TEST(MeasuredLight, Flux_IsTheMeanOfEmission_WhateverThePlacement) {
    LightFieldInfo info;
    info.colour = colour_of_luminance_one(Rgb(1, 0.5F, 0.25F));
    const LightField field = random_field(rig_b(), -1, 2, 33, info);
    for (const double scale : {0.01, 1.0, 250.0}) {
        for (const EmissionMode mode : {EmissionMode::constant, EmissionMode::exact}) {
            MeasuredSettings settings;
            settings.mode = mode;
            settings.power_scale = 3;
            settings.world_from_light.rotate(V3d(0.3, -1.0, 0.5));
            settings.world_from_light.scale(V3d(scale));
            settings.world_from_light[3][0] = 5;
            const auto light = make(field, settings);
            EXPECT_NEAR(light->power(), 3 * field.flux(), 1e-5 * field.flux());
            EXPECT_NEAR(light->flux().x / light->flux().z, info.colour.x / info.colour.z, 1e-4F);
            RunningStats stats;
            for (int i = 0; i < 40000; ++i) {
                const auto e = light->sample_Le(emit_numbers(23, i));
                stats.add(e ? double{luminance(e->weight)} : 0.0);
            }
            EXPECT_NEAR(stats.mean(), light->power(), 4 * stats.standard_error() + 1e-4 * light->power());
        }
    }
    MeasuredSettings set;
    set.power = 7;
    EXPECT_NEAR(make(field, set)->power(), 7, 1e-5);
    set.power_scale = 2;
    EXPECT_NEAR(make(field, set)->power(), 14, 1e-5);
}

// The irradiance in a small square about `x` on a plane that faces the lamp, by three estimators.
struct Irradiance {
    RunningStats emitted, illuminated, seen;
};

Irradiance irradiance_three_ways(const Light& light, const V3f& x, const V3f& n, float side, int samples) {
    Irradiance result;
    int lost = 0;  // rays not found again
    const Frame frame(n);
    for (int i = 0; i < samples; ++i) {
        Sampler sampler(24, Purpose::test, 1, static_cast<std::uint64_t>(i));
        const auto e = light.sample_Le(emit_numbers(25, i));
        double hit = 0;
        if (e) {
            const float facing = -e->d.dot(n);
            const float t = (x - e->from.p).dot(n) / e->d.dot(n);
            const V3f local = frame.to_local(e->from.p + t * e->d - x);
            if (facing > 0 && t > 0 && std::fabs(local.x) < side / 2 && std::fabs(local.y) < side / 2) {
                hit = double{luminance(e->weight)} / double{side * side};
            }
        }
        result.emitted.add(hit);
        const V2f offset = sampler.next2() - V2f(0.5F, 0.5F);
        const V3f at = x + frame.to_world({offset.x * side, offset.y * side, 0});
        const auto in = light.sample_Li(at, sampler.next2());
        result.illuminated.add(in ? double{luminance(in->weight)} * std::max(0.0, double{in->w.dot(n)})
                                  : 0.0);
        const V3f w = frame.to_world(square_to_cosine_hemisphere(sampler.next2()));
        const auto seen = light.Le(Ray{at, w});
        result.seen.add(seen ? double{luminance(seen->radiance)} * double{kPi} : 0.0);  // L cosθ / (cosθ / π)
        if (in) {
            // The same ray, evaluated by Le(), has the same radiance and density. On the edge of a pixel, or
            // of one of the density's squares, rounding may put the ray on the other side; rays next to it
            // then decide.
            const auto same = [&](const std::optional<EmittedRadiance>& back) {
                return back && std::fabs(back->pdf_w - in->pdf_w) <= 2e-3F * in->pdf_w &&
                       std::fabs(back->distance - in->distance) <= 2e-3F * in->distance;
            };
            if (!same(light.Le(Ray{at, in->w}))) {
                ++lost;
                bool beside = false;
                for (const V2f& by : {V2f(1, 1), V2f(1, -1), V2f(-1, 1), V2f(-1, -1)}) {
                    const V3f near = in->w + 1e-6F * (by.x * Frame(in->w).s + by.y * Frame(in->w).t);
                    beside = beside || same(light.Le(Ray{at, near.normalized()}));
                }
                EXPECT_TRUE(beside);
            }
        }
    }
    EXPECT_LE(lost, 2);
    return result;
}

void expect_same(const RunningStats& a, const RunningStats& b) {
    const double sigma = std::sqrt(sqr(a.standard_error()) + sqr(b.standard_error()));
    EXPECT_GT(a.mean(), 0);
    EXPECT_NEAR(a.mean(), b.mean(), 4 * sigma);
    EXPECT_LT(sigma, 0.05 * a.mean());
}

TEST(MeasuredLight, Long_Irradiance_BySampleLeSampleLiAndLe_IsOne) {
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_field(rig, -1, 2, 34);
        for (const double scale : {1.0, 20.0}) {
            MeasuredSettings settings;
            if (scale != 1) settings.reconstruction = Reconstruction::approximate;
            settings.world_from_light.rotate(V3d(0.4, 0.2, 1));
            settings.world_from_light.scale(V3d(scale));
            settings.world_from_light[3][1] = 2;
            const auto light = make(field, settings);
            // Places between S and M, and beyond M.
            for (const double z : scale == 1 ? std::vector{0.03, 0.2} : std::vector{0.2}) {
                V3d x;
                V3d n;
                settings.world_from_light.multVecMatrix(V3d(0.004, 0.002, z), x);
                settings.world_from_light.multDirMatrix(V3d(0.1, 0.2, -1), n);
                const auto e = irradiance_three_ways(*light, V3f(x), V3f(n.normalized()),
                                                     static_cast<float>(0.2 * z * scale), 200000);
                expect_same(e.illuminated, e.emitted);
                expect_same(e.illuminated, e.seen);
            }
        }
    }
}

TEST(MeasuredLight, SampleLi_RestrictedToOneCell_AddsUpToTheWhole) {
    const LightField field = random_field(rig_b(), 0, 1, 35);
    Monitor silent;
    const CellTable table(field, {}, silent);
    const auto light = make(field);
    const V3f x(0.01F, 0, 0.15F);
    RunningStats whole;
    RunningStats parts;
    for (int i = 0; i < 40000; ++i) {
        Sampler sampler(26, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        const auto all = light->sample_Li(x, u);
        whole.add(all ? double{luminance(all->weight)} : 0.0);
        double sum = 0;
        for (int n = 0; n < 4; ++n) {
            for (int o = 0; o < 3; ++o) {
                const auto part = light->sample_Li(x, u, table.id({n, o, 0, 0}));
                if (!part) continue;
                sum += double{luminance(part->weight)};
                EXPECT_EQ(table.cell(part->cell)->n, n);
                EXPECT_EQ(table.cell(part->cell)->o, o);
            }
        }
        parts.add(sum);
    }
    expect_same(whole, parts);
    EXPECT_FALSE(light->sample_Li(x, {0.5F, 0.5F}, static_cast<CellId>(table.cells())));
}

TEST(MeasuredLight, FromBehindOrBeside_NothingIsSeen) {
    const auto light = make(random_field(rig_b(), 1, 2, 36));
    EXPECT_FALSE(light->sample_Li({0, 0, -1}, {0.5F, 0.5F}));
    EXPECT_FALSE(light->sample_Li({0, 0, 0.003F}, {0.5F, 0.5F}));
    EXPECT_FALSE(light->sample_Li({100, 0, 1}, {0.5F, 0.5F}));  // outside M
    EXPECT_FALSE(light->Le({{0, 0, -1}, {0, 0, 1}}));
    EXPECT_FALSE(light->Le({{0, 0, 1}, {0, 0, 1}}));
    EXPECT_FALSE(light->Le({{1, 0, 1}, {0, 0, -1}}));
    EXPECT_TRUE(light->Le({{0, 0, 1}, {0, 0, -1}}));
    EXPECT_FALSE(light->Le({{0, 0, 1}, {0, 0, -1}, 0.5F}));
    EXPECT_FALSE(light->Le({{0, 0, 1}, {1, 0, 0}}));
    EXPECT_TRUE(light->has_impostor());
    EXPECT_FALSE(light->is_delta());
    EXPECT_EQ(light->kind(), "lightfield");
}

TEST(MeasuredLight, FieldWithoutLight_IsDark) {
    const auto dark = make({rig_b(), std::vector<float>(rig_b().coefficients())});
    EXPECT_EQ(dark->power(), 0);
    EXPECT_FALSE(dark->sample_Le(emit_numbers(1, 1)));
    EXPECT_FALSE(dark->sample_Li({0, 0, 1}, {0.5F, 0.5F}));
    EXPECT_FALSE(dark->Le({{0, 0, 1}, {0, 0, -1}}));
    EXPECT_EQ(make({rig_b(), std::vector<float>(rig_b().coefficients(), -1.0F)})->power(), 0);

    // Some coefficients are positive, but the total flux is negative: noise, not a lamp.
    std::vector<float> e(rig_b().coefficients(), -1.0F);
    e[0] = 1;
    const LightField noise(rig_b(), e);
    testing::ListeningMonitor monitor;
    const auto light = make_measured_light(noise, CellTable(noise, {}, monitor), {}, monitor);
    EXPECT_EQ(light->power(), 0);
    EXPECT_EQ(monitor.warnings.size(), 1U);
}

TEST(MeasuredLight, Settings_OutOfRange_AreRefused) {
    const LightField field = random_field(rig_b(), 0, 1, 37);
    const auto refused = [&](const std::function<void(MeasuredSettings&)>& spoil, const char* word) {
        MeasuredSettings settings;
        settings.file = "lamp.exr";
        spoil(settings);
        try {
            make(field, settings);
            ADD_FAILURE() << word;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("lamp.exr"));
            EXPECT_THAT(error.what(), HasSubstr(word));
        }
    };
    refused([](MeasuredSettings& s) { s.world_from_light.scale(V3d(1, 1, 1.01)); }, "non-uniform scale");
    refused([](MeasuredSettings& s) { s.world_from_light.scale(V3d(0, 0, 0)); }, "singular");
    refused([](MeasuredSettings& s) { s.world_from_light.shear(V3d(0.1, 0, 0)); }, "has shear");
    refused([](MeasuredSettings& s) { s.world_from_light[0][0] = NAN; }, "finite");
    refused([](MeasuredSettings& s) { s.world_from_light[0][3] = 1; }, "projective");
    refused([](MeasuredSettings& s) { s.power_scale = -1; }, "power scale");
    refused([](MeasuredSettings& s) { s.power = NAN; }, "power");
    MeasuredSettings mirrored;
    mirrored.world_from_light.scale(V3d(-1, 1, 1));
    EXPECT_GT(make(field, mirrored)->power(), 0);
}

TEST(MeasuredLight, FromAFile_KeepsItsTableBesideIt) {
    const testing::TemporaryFolder folder;
    write_light_field(folder / "lamp.exr", random_field(rig_a(), -1, 2, 38));
    MeasuredSettings settings;
    settings.file = folder / "lamp.exr";
    Monitor silent;
    const auto light = make_measured_light(settings, {}, silent);
    EXPECT_NEAR(light->power(), read_light_field(settings.file).flux(), 1e-6 * light->power());
    EXPECT_TRUE(std::filesystem::exists(folder / "lamp.cells"));
    settings.file = folder / "none.exr";
    EXPECT_THROW(make_measured_light(settings, {}, silent), InputError);
}

}  // namespace measured_test
}  // namespace lucerna
