#include "lights/measurement/acquire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/warp.h"
#include "lights/bell.h"
#include "lights/measured.h"
#include "lights/measurement/ray_projection.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/shared_data.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace acquire_test {

using ::testing::HasSubstr;
using Outline = EmitterModel::Outline;

// Returns rays of equal flux of a disc or rectangle with a cosine-power lobe, drawn by formulas that share no
// code with the emitters'.
RaySet rays_of(Outline outline, const V2d& half_size, double flux, double exponent, int count,
               std::uint64_t seed) {
    RaySet set;
    set.flux = flux;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f a = sampler.next2();
        const V2f b = sampler.next2();
        const V2f at = outline == Outline::disc ? square_to_disc(a) : 2.0F * a - V2f(1, 1);
        const float z = std::pow(1 - b.x, 1 / (static_cast<float>(exponent) + 1));
        const float r = std::sqrt(std::max(0.0F, 1 - z * z));
        set.rays.push_back(
            {{at.x * static_cast<float>(half_size.x),
              at.y * static_cast<float>(outline == Outline::disc ? half_size.x : half_size.y), 0},
             {r * std::cos(2 * kPi * b.y), r * std::sin(2 * kPi * b.y), z},
             static_cast<float>(flux / count)});
    }
    return set;
}

Rig bench() {
    Rig rig;
    rig.views = {9, 7};
    rig.spacing = {0.004, 0.005};
    rig.pixels = {10, 12};
    rig.pixel = {0.03, 0.02};
    rig.distance = 0.1;
    return rig;
}

// Evaluates ∫∫ Φ̃_m Φ̃_n L g, averaged over the pixel, by many midpoints, without code shared with acquire().
double brute_coefficient(const EmitterModel& emitter, const Rig& rig, int m, int n, int k, int l) {
    constexpr int kSide = 200;
    constexpr int kPixel = 8;
    const V2d sensor(rig.shift.x > 0 ? rig.filter(0, m) : 0, rig.shift.y > 0 ? rig.filter(1, n) : 0);
    const V2d w = emitter.half_size;
    double sum = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
        const V2d x(w.x * (2 * (i % kSide + 0.5) / kSide - 1),
                    w.y * (2 * (static_cast<double>(i / kSide) + 0.5) / kSide - 1));
        if (emitter.outline == Outline::disc && x.length() > w.x) continue;
        for (int p = 0; p < kPixel * kPixel; ++p) {
            const V2d on_m(
                sensor.x + (k - 0.5 * rig.pixels.x + (p % kPixel + 0.5) / kPixel) * rig.pixel.x,
                sensor.y + (l - 0.5 * rig.pixels.y + (static_cast<double>(p / kPixel) + 0.5) / kPixel) *
                               rig.pixel.y);
            // A ray runs from the emitter's point behind S through S to M, so areas on the emitter map to
            // areas on S.
            const double share = emitter.setback / (emitter.setback + rig.distance);
            const V2d on_s = x + (on_m - x) * share;
            const double dual = bell_dual((on_s.x - rig.filter(0, m)) / rig.spacing.x) / rig.spacing.x *
                                bell_dual((on_s.y - rig.filter(1, n)) / rig.spacing.y) / rig.spacing.y;
            if (dual == 0) continue;
            const V3d way(on_m.x - on_s.x, on_m.y - on_s.y, rig.distance);
            sum += dual * emitter.radiance(x, way.normalized()) * rig.geometric_term(on_s, on_m) *
                   sqr(1 - share);
        }
    }
    return sum * 4 * w.x * w.y / kSide / kSide / kPixel / kPixel;
}

TEST(Acquire, Long_Coefficients_DiscAndRectangle_AreTheIntegrals) {
    Rig travelling = bench();
    travelling.pixel = {0.002, 0.0025};
    travelling.shift = {2, 2};
    Monitor silent;
    struct Case {
        EmitterModel emitter;
        Rig rig;
    };
    EmitterModel behind = cosine_emitter(Outline::disc, {0.012, 0}, 2, 1);
    behind.setback = 0.02;
    const auto pattern = [](const V2d& p) { return 1 + 0.5 * p.x - 0.3 * p.y * p.y; };
    for (const Case& c :
         {Case{cosine_emitter(Outline::disc, {0.009, 0}, 2, 1), bench()},
          Case{cosine_emitter(Outline::rectangle, {0.008, 0.006}, 2, 3, pattern), bench()},
          Case{cosine_emitter(Outline::disc, {0.009, 0}, 2, 2), travelling}, Case{behind, bench()}}) {
        const LightField field = acquire(c.emitter, c.rig, {}, silent);
        float largest = 0;
        for (const float e : field.coefficients()) largest = std::max(largest, std::fabs(e));
        for (const V2i& view : {V2i(4, 3), V2i(2, 3), V2i(6, 5)}) {
            for (const V2i& pixel : {V2i(5, 6), V2i(3, 8)}) {
                const double truth = brute_coefficient(c.emitter, c.rig, view.x, view.y, pixel.x, pixel.y);
                const double got = double{field.coefficient(view.x, view.y, pixel.x, pixel.y)};
                // The brute force has a ragged edge, which the tolerance allows for.
                EXPECT_NEAR(got, truth, 1e-3 * double{largest}) << view << pixel;
            }
        }
        EXPECT_NEAR(field.info().captured + field.info().missed, 2, 1e-6);
        EXPECT_NEAR(field.info().captured, field.flux(), 1e-9);
    }
}

TEST(AcquireWithoutFilter, Coefficients_AreTheFluxDensityAtTheFiltersCentres) {
    Rig travelling = bench();
    travelling.pixel = {0.002, 0.0025};
    travelling.shift = {2, 2};
    Monitor silent;
    EmitterModel emitter = cosine_emitter(Outline::rectangle, {0.02, 0.02}, 2, 3,
                                          [](const V2d& p) { return 1 + 0.5 * p.x - 0.3 * p.y * p.y; });
    emitter.setback = 0.01;
    for (const Rig& rig : {bench(), travelling}) {
        const LightField field = acquire_without_filter(emitter, rig, {}, silent);
        EXPECT_EQ(field.rig().filter_basis, FilterBasis::hat);
        EXPECT_EQ(field.rig().basis, rig.shift.x == 0 ? PixelBasis::hat : PixelBasis::box);
        for (const V2i& view : {V2i(4, 3), V2i(2, 3), V2i(6, 5)}) {
            for (const V2i& pixel : {V2i(5, 6), V2i(3, 8)}) {
                // Averages over the pixel by many midpoints.
                constexpr int kSide = 40;
                const V2d at(rig.filter(0, view.x), rig.filter(1, view.y));
                const V2d sensor = rig.shift.x > 0 ? at : V2d(0);
                double truth = 0;
                for (int i = 0; i < kSide * kSide; ++i) {
                    const V2d on_m =
                        sensor +
                        V2d((pixel.x - 0.5 * rig.pixels.x + (i % kSide + 0.5) / kSide) * rig.pixel.x,
                            (pixel.y - 0.5 * rig.pixels.y + (static_cast<double>(i / kSide) + 0.5) / kSide) *
                                rig.pixel.y);
                    const V2d from = at - (on_m - at) * (emitter.setback / rig.distance);
                    if (std::max(std::fabs(from.x), std::fabs(from.y)) > 0.02) continue;
                    truth +=
                        emitter.radiance(from, V3d(on_m.x - at.x, on_m.y - at.y, rig.distance).normalized()) *
                        rig.geometric_term(at, on_m) / (kSide * kSide);
                }
                EXPECT_NEAR(double{field.coefficient(view.x, view.y, pixel.x, pixel.y)}, truth,
                            2e-3 * std::fabs(truth));
            }
        }
    }
}

// The grating has the filters' own period: the pinholes see only its maxima, the filter sees its mean.
TEST(AcquireWithoutFilter, AGratingAsFineAsTheSpacing_IsAliased) {
    Rig rig = bench();
    rig.views = {9, 9};
    rig.spacing = {0.002, 0.002};
    Monitor silent;
    const EmitterModel emitter = cosine_emitter(Outline::rectangle, {0.006, 0.006}, 2, 1, [&](const V2d& p) {
        return 1 + std::cos(2 * M_PI * p.x * 0.006 / rig.spacing.x);
    });
    const LightField filtered = acquire(emitter, rig, {}, silent, {5, 3});
    const LightField canned = acquire_without_filter(emitter, rig, {}, silent);
    const double passing = filtered.flux();
    EXPECT_LT(passing, emitter.flux);
    // Pinholes at the edge of the emitter represent half a spacing beyond it, hence 7/6 along each axis.
    EXPECT_NEAR(canned.flux() / passing, 2 * sqr(7.0 / 6), 0.05);
}

TEST(Acquire, Nodes_Doubled_ChangeNothingAtTheStatedAccuracy) {
    Monitor silent;
    const EmitterModel emitter = cosine_emitter(Outline::disc, {0.009, 0}, 2, 1);
    const LightField coarse = acquire(emitter, bench(), {}, silent);
    const LightField fine = acquire(emitter, bench(), {}, silent, {5, 5});
    float largest = 0;
    float error = 0;
    for (std::size_t i = 0; i < fine.coefficients().size(); ++i) {
        largest = std::max(largest, std::fabs(fine.coefficients()[i]));
        error = std::max(error, std::fabs(fine.coefficients()[i] - coarse.coefficients()[i]));
    }
    EXPECT_LT(error, 1e-4F * largest);
}

TEST(Acquire, WideScreen_CapturesTheFluxThatMeetsIt) {
    // A Lambertian disc of many filters, and a screen that receives all its light except at the far corners.
    Rig rig = bench();
    rig.views = {11, 11};
    rig.spacing = {0.002, 0.002};
    rig.pixels = {30, 30};
    rig.pixel = {0.04, 0.04};
    Monitor silent;
    const LightField field =
        acquire(cosine_emitter(Outline::disc, {0.008, 0}, 5, 1), rig, {}, silent, {3, 2});
    // The share of a small Lambertian source's flux through a square of half side a at distance D, for a/D =
    // 6, is 4/π · a/√(a²+D²) · atan(a/√(a²+D²)): the form factor of a square seen from its axis.
    const double c = 6 / std::sqrt(37.0);
    const double share = 4 / std::acos(-1.0) * c * std::atan(c);
    EXPECT_NEAR(field.flux() / 5, share, 2e-3);
}

TEST(Acquire, Threads_AnyNumber_MakeTheSameField) {
    Monitor silent;
    const EmitterModel emitter = cosine_emitter(Outline::disc, {0.009, 0}, 2, 1);
    EXPECT_EQ(content_hash(acquire(emitter, bench(), {1}, silent)),
              content_hash(acquire(emitter, bench(), {5}, silent)));
    const RaySet rays = rays_of(Outline::disc, {0.009, 0}, 2, 1, 5000, 1);
    EXPECT_EQ(content_hash(project_rays(rays, bench(), {1}, silent).field),
              content_hash(project_rays(rays, bench(), {5}, silent).field));
}

TEST(Acquire, ImpossibleEmitters_AreRefused) {
    EXPECT_THROW(cosine_emitter(Outline::disc, {0, 0}, 1), InputError);
    EXPECT_THROW(cosine_emitter(Outline::rectangle, {1, -1}, 1), InputError);
    EXPECT_THROW(cosine_emitter(Outline::disc, {1, 0}, 0), InputError);
    EXPECT_THROW(cosine_emitter(Outline::disc, {1, 0}, 1, 0.5), InputError);
    EXPECT_THROW(cosine_emitter(Outline::disc, {1, 0}, 1, 1, [](const V2d&) { return 0.0; }), InputError);
    Rig none = bench();
    none.distance = 0;
    Monitor silent;
    EXPECT_THROW(acquire(cosine_emitter(Outline::disc, {1, 0}, 1), none, {}, silent), InputError);
}

TEST(ProjectRays, OfAnEmittersRays_EstimateItsCoefficients) {
    Rig travelling = bench();
    travelling.pixel = {0.004, 0.005};
    travelling.shift = {1, 1};
    Monitor silent;
    for (const Rig& rig : {bench(), travelling}) {
        const LightField truth = acquire(cosine_emitter(Outline::disc, {0.009, 0}, 2, 2), rig, {}, silent);
        // Ten independent ray sets give each coefficient its own mean and standard error.
        std::vector<RunningStats> stats(rig.coefficients());
        for (std::uint64_t run = 0; run < 10; ++run) {
            const Projection p =
                project_rays(rays_of(Outline::disc, {0.009, 0}, 2, 2, 60000, 50 + run), rig, {}, silent);
            for (std::size_t i = 0; i < stats.size(); ++i) stats[i].add(double{p.field.coefficients()[i]});
        }
        // Sums squared deviations over coefficients that many rays reach; the t² of ten samples has mean 9/7.
        float largest = 0;
        for (const float e : truth.coefficients()) largest = std::max(largest, std::fabs(e));
        RunningStats t2;
        double worst = 0;
        for (std::size_t i = 0; i < stats.size(); ++i) {
            if (std::fabs(truth.coefficients()[i]) < 0.3F * largest) continue;
            const double t = (stats[i].mean() - double{truth.coefficients()[i]}) / stats[i].standard_error();
            t2.add(t * t);
            worst = std::max(worst, std::fabs(t));
        }
        EXPECT_GT(t2.count(), 50U);
        EXPECT_LT(t2.mean(), 2.0);
        EXPECT_GT(t2.mean(), 0.6);
        EXPECT_LT(worst, 12);
    }
}

void expect_balance(const FluxAccount& a, const LightField& field) {
    EXPECT_NEAR(field.flux(), a.captured, 1e-9 * a.total);
    EXPECT_NEAR(a.captured + a.missed(), a.total, 1e-9 * a.total);
    EXPECT_NEAR(a.explained(), a.missed(), 1e-5 * a.total);
    EXPECT_EQ(field.info().captured, a.captured);
    EXPECT_EQ(field.info().missed, a.missed());
}

TEST(ProjectRays, Account_EveryKindOfMiss_AddsUpToTheTotal) {
    Rig travelling = bench();
    travelling.pixel = {0.002, 0.0025};
    travelling.shift = {2, 2};
    Monitor silent;
    for (const Rig& rig : {bench(), travelling}) {
        // The source is larger than S, so rays pass the border, the outside, and both sides of M's edges.
        RaySet set = rays_of(Outline::rectangle, {0.03, 0.03}, 100, 1, 20000, 3);
        set.rays.push_back({{0, 0, 0}, {0, 0, -1}, 7});
        set.rays.push_back({{0, 0, 0}, {1, 0, 0}, 3});
        set.skipped_flux = 5;
        set.flux += 15;
        const Projection p = project_rays(set, rig, {}, silent);
        expect_balance(p.account, p.field);
        EXPECT_NEAR(p.account.backward, 10, 1e-6);
        EXPECT_EQ(p.account.skipped, 5);
        EXPECT_GT(p.account.beside_s, 10);
        EXPECT_GT(p.account.beside_m, 5);
        EXPECT_NE(p.account.not_in_basis, 0);
    }
}

TEST(ProjectRays, OneRay_FillsItsFourByFourFilters) {
    Rig rig = bench();
    RaySet set;
    set.flux = 1;
    set.rays.push_back({{0.001F, 0.001F, 0}, {0, 0, 1}, 1});
    Monitor silent;
    const LightField field = project_rays(set, rig, {}, silent).field;
    int used = 0;
    for (const float e : field.coefficients()) used += e != 0;
    EXPECT_EQ(used, 16);
    EXPECT_NEAR(field.coefficient(4, 3, 5, 6),
                bell_dual(0.25) / 0.004 * bell_dual(0.2) / 0.005 / (0.03 * 0.02), 100);
}

TEST(ChoosePlanes, Long_WideAndNarrowLobes_CatchTheShareAskedFor) {
    Monitor silent;
    for (const double exponent : {1.0, 5.0, 200.0}) {
        const RaySet set = rays_of(Outline::rectangle, {0.002, 0.001}, 10, exponent, 50000, 4);
        for (const double capture : {0.9, 0.98}) {
            FitOptions options;
            options.capture = capture;
            const Projection p = fit_light_field(set, options, {}, silent);
            const FluxAccount& a = p.account;
            expect_balance(a, p.field);
            // Coordinates that are finer in the middle of a plane may extend over all of it.
            const double hits = (a.total - a.beside_s - a.beside_m) / a.total;
            EXPECT_GE(hits, capture - 1e-3) << exponent;
            EXPECT_NEAR(a.not_in_basis / a.total, 0, 0.02) << exponent;
            EXPECT_GE(p.field.rig().views.x, 6) << exponent;
        }
    }
}

TEST(ChoosePlanes, Options_AreObeyed) {
    Monitor silent;
    const RaySet set = rays_of(Outline::disc, {0.002, 0}, 10, 2, 1000, 5);
    FitOptions options;
    options.views = {7, 5};
    options.pixels = {11, 13};
    options.distance = 0.3;
    options.z = 0.01;
    const Rig rig = choose_planes(set, options, {}, silent).rig;
    EXPECT_EQ(rig.views, V2i(7, 5));
    EXPECT_EQ(rig.pixels, V2i(11, 13));
    EXPECT_EQ(rig.distance, 0.3);
    EXPECT_EQ(rig.centre.z, 0.01);
    EXPECT_EQ(rig.shift, V2i(0, 0));
    EXPECT_EQ(rig.fault(), "");
    const auto refused = [&](const std::function<void(FitOptions&)>& spoil) {
        FitOptions o;
        spoil(o);
        EXPECT_THROW(choose_planes(set, o, {}, silent), InputError);
    };
    refused([](FitOptions& o) { o.views.x = -1; });
    refused([](FitOptions& o) { o.pixels.y = 100000; });
    refused([](FitOptions& o) { o.distance = NAN; });
    refused([](FitOptions& o) { o.capture = 1; });
    refused([](FitOptions& o) { o.z = INFINITY; });
}

TEST(ChoosePlanes, OddRaySets_GiveAFieldOrAnError) {
    Monitor silent;
    RaySet down;
    down.flux = 1;
    down.rays.push_back({{0, 0, 0}, {0, 0, -1}, 1});
    EXPECT_THROW(choose_planes(down, {}, {}, silent), InputError);
    EXPECT_THROW(choose_planes({}, {}, {}, silent), InputError);
    RaySet one;
    one.flux = 1;
    one.rays.push_back({{0.5F, 0, 0}, {0, 0, 1}, 1});
    const Projection single = fit_light_field(one, {}, {}, silent);
    expect_balance(single.account, single.field);
    EXPECT_NEAR(single.field.rig().centre.x, 0.5, 1e-9);
    const RaySet point = rays_of(Outline::disc, {0, 0}, 3, 1, 1000, 6);
    const Projection p = fit_light_field(point, {}, {}, silent);
    expect_balance(p.account, p.field);
}

TEST(FitLightField, OsramGreen_HoldsTheLampsFlux) {
    LUCERNA_NEED_DATA(path, "osram-ostar-green-100k.tm25ray");
    testing::ListeningMonitor monitor;
    const RaySet set = read_rays(path, monitor);
    const Projection p = fit_light_field(set, {}, {}, monitor);
    expect_balance(p.account, p.field);
    EXPECT_NEAR(p.account.captured + p.account.missed(), 337, 1e-4);
    EXPECT_GT(p.account.captured, 0.95 * 337);
    EXPECT_LT(p.account.captured, 1.01 * 337);
    EXPECT_EQ(p.field.info().unit, FluxUnit::lumen);
}

// The share of the flux per bin, by angle to the axis and by position on a plane 5 mm in front of the lamp.
struct Pattern {
    std::array<double, 9> angle{};   // bins of ten degrees
    std::array<double, 16> place{};  // squares of 5 mm about the axis
    void add(const V3d& o, const V3d& d, double flux) {
        if (!(d.z > 0)) return;
        angle[std::min<std::size_t>(8, static_cast<std::size_t>(std::acos(d.z) * 18 / std::acos(-1.0)))] +=
            flux;
        const double t = (0.005 - o.z) / d.z;
        const double x = (o.x + t * d.x) / 0.005 + 2;
        const double y = (o.y + t * d.y) / 0.005 + 2;
        if (x < 0 || y < 0 || x >= 4 || y >= 4) return;
        place[static_cast<std::size_t>(x) * 4 + static_cast<std::size_t>(y)] += flux;
    }
};

TEST(FitLightField, OsramGreen_EmitsNearAndFarWhatItsRaysEmit) {
    LUCERNA_NEED_DATA(path, "osram-ostar-green-100k.tm25ray");
    Monitor silent;
    const RaySet set = read_rays(path, silent);
    Projection p = fit_light_field(set, {}, {}, silent);
    Pattern truth;
    for (const LampRay& ray : set.rays) truth.add(V3d(ray.o), V3d(ray.d), double{ray.flux} / set.flux);
    CellTable table(p.field, {}, silent);
    const auto light = make_measured_light(std::move(p.field), std::move(table), {}, silent);
    Pattern got;
    constexpr int kParticles = 200000;
    for (int i = 0; i < kParticles; ++i) {
        Sampler sampler(8, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f a = sampler.next2();
        const auto e = light->sample_Le({a, sampler.next2(), sampler.bits()});
        ASSERT_TRUE(e);
        got.add(V3d(e->from.p), V3d(e->d), double{luminance(e->weight)} / kParticles / set.flux);
    }
    // The tolerance is two per cent of the lamp's flux per bin, because pixels are several degrees wide and
    // filters a quarter of a millimetre.
    for (std::size_t i = 0; i < truth.angle.size(); ++i) EXPECT_NEAR(got.angle[i], truth.angle[i], 0.02) << i;
    for (std::size_t i = 0; i < truth.place.size(); ++i) EXPECT_NEAR(got.place[i], truth.place[i], 0.02) << i;
}

}  // namespace acquire_test
}  // namespace lucerna
