// Tests direct light from nearby photons: `guided` is unbiased, `gated` has the predicted bias.
#include "engine/guiding/guide.h"

#include <gtest/gtest.h>

#include "engine/evaluation/compare.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/eye_paths.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace guided_light_test {

using testing::SceneMaker;

// Returns a lamp of 20 by 20 intervals whose light falls off from its middle and leans outwards, so that
// every point is lit from few of its intervals.
LightField beam() {
    Rig rig;
    rig.views = {19, 19};
    rig.spacing = {0.004, 0.004};
    rig.pixels = {24, 24};
    rig.pixel = {0.01, 0.01};
    rig.distance = 0.2;
    std::vector<float> e(rig.coefficients());
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    const double lean = sqr((m - 9) - 0.8 * (k - 12)) + sqr((n - 9) - 0.8 * (l - 12));
                    e[rig.index(m, n, k, l)] = static_cast<float>(std::exp(-lean / 20) - 0.02);
                }
            }
        }
    }
    return {rig, std::move(e)};
}

// Returns the lamp at the height of 1, emitting along -y.
std::unique_ptr<Light> lamp_above() {
    MeasuredSettings settings;
    settings.world_from_light = M44d(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 1);
    Monitor silent;
    LightField field = beam();
    CellTable table(field, Workers{2}, silent);
    return make_measured_light(std::move(field), std::move(table), settings, silent);
}

// Adds a floor with a plate above it, which casts a shadow.
void add_floor(SceneMaker& make) {
    const auto white = make.diffuse(Rgb(0.8F, 0.6F, 0.4F));
    make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, white);
    make.quad({-0.1F, 0.3F, -0.3F}, {0, 0, 0.4F}, {0.2F, 0, 0}, white);
    make.quad({-0.1F, 0.3F, -0.3F}, {0.2F, 0, 0}, {0, 0, 0.4F}, white);  // faces down
}

Scene lamp_over_floor() {
    SceneMaker make;
    add_floor(make);
    make.light(lamp_above());
    return make.build();
}

Scene many_small_lights() {
    SceneMaker make;
    add_floor(make);
    const auto black = make.diffuse(Rgb(0));
    for (int i = 0; i < 60; ++i) {
        const float x = -1 + 0.2F * static_cast<float>(i % 10);
        const float z = -1 + 0.33F * static_cast<float>(i / 10);
        const float power = 1 + static_cast<float>(i * i % 17);
        make.quad_light({x, 0.5F, z}, {0.02F, 0, 0}, {0, 0, 0.02F}, black, Rgb(power, 10, 20 - power));
    }
    make.light(make_point_light({0.6F, 0.4F, 0.6F}, Rgb(0.05F)));
    make.light(make_infinite_light(Rgb(0.001F), {{0, 0, 0}, 2}));
    return make.build();
}

Scene large_light() {
    SceneMaker make;
    add_floor(make);
    make.quad_light({-1, 0.6F, -1}, {2, 0, 0}, {0, 0, 2}, make.diffuse(Rgb(0)), Rgb(1, 2, 3));
    return make.build();
}

// Returns points of the floor, lit and unlit, at the edge of the plate's shadow and inside it.
std::vector<V3f> places() {
    return {{0.3F, 0, 0.2F}, {-0.35F, 0, -0.1F}, {0.13F, 0, -0.2F}, {0.16F, 0, 0.15F},
            {0, 0, 0.16F},   {0.02F, 0, -0.05F}, {0.9F, 0, 0.9F},   {-0.16F, 0, 0}};
}

Hit hit_on_floor(const Scene& scene, const V3f& x) {
    const auto hit = scene.intersect(Ray{x + V3f(0, 0.01F, 0), {0, -1, 0}});
    return hit.value();
}

template <typename Method>
RunningStats measure(const Scene& scene, const V3f& x, int samples, std::uint64_t seed, Method&& method) {
    const Hit hit = hit_on_floor(scene, x);
    const Bsdf bsdf = scene.bsdf(hit);
    const Vertex vertex{hit, bsdf, V3f(0, 1, 0)};
    RunningStats stats;
    for (int i = 0; i < samples; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        stats.add(double{luminance(method(vertex, sampler))});
    }
    return stats;
}

bool same(const RunningStats& a, const RunningStats& b) {
    const double sigma = std::sqrt(sqr(a.standard_error()) + sqr(b.standard_error()));
    return std::fabs(a.mean() - b.mean()) <= 4 * sigma;
}

// Compares guided with plain direct light, from many photons and from so few that most points have none or
// misleading ones (4 sigmas, 32 comparisons per scene).
void expect_unbiased(const Scene& scene, const char* name) {
    Monitor silent;
    for (const std::int64_t photons : {20, 20'000}) {
        GuideSettings how;
        how.radius = 0.2F;
        const GuideMap guides = build_guides(scene, {photons, 6, 0, how}, Workers{2}, silent);
        for (const int candidates : {8, 1}) {
            const GuidedLightSettings settings{candidates};
            for (const V3f& x : places()) {
                const auto plain = measure(scene, x, 30'000, 7, [&](const Vertex& vertex, Sampler& sampler) {
                    return testing::direct_radiance(scene, vertex, sampler);
                });
                const auto guided = measure(scene, x, 15'000, 8, [&](const Vertex& vertex, Sampler& sampler) {
                    SampleAccount account;
                    GuidedLight(scene, guides, settings)(vertex, sampler, {}, PathAccount(account));
                    return account.radiance();
                });
                EXPECT_TRUE(same(plain, guided))
                    << name << ", " << photons << " photons, at " << x << ": " << guided.mean() << " +- "
                    << guided.standard_error() << " for " << plain.mean() << " +- " << plain.standard_error();
            }
        }
    }
}

TEST(GuidedLight, Long_MeasuredLamp_IsUnbiased) {
    expect_unbiased(lamp_over_floor(), "lamp");
}

TEST(GuidedLight, ManySmallLights_IsUnbiased) {
    expect_unbiased(many_small_lights(), "many");
}

TEST(GuidedLight, OneLargeLight_IsUnbiased) {
    expect_unbiased(large_light(), "large");
}

// Estimates direct light by one draw, weighted by the density of another mixture.
double mean_by(const Scene& scene, const V3f& x, const LightChoice& drawn_by, const LightChoice& weighed_by,
               double& sigma) {
    RunningStats stats;
    for (std::uint64_t i = 0; i < 40'000; ++i) {
        Sampler sampler(9, Purpose::test, 0, i);
        const float u = sampler.next();
        const auto draw = drawn_by.draw(scene, x, u, sampler.next2());
        double value = 0;
        if (draw && draw->pdf_w > 0) {
            const LightSample& in = draw->light_sample;
            const EmittedRadiance back{Rgb(0.0F), in.part ? in.part->whole_pdf_w : in.pdf_w, in.distance,
                                       in.part};
            const double pdf = double{weighed_by.pdf_w(scene, draw->light, back)};
            value = double{luminance(in.weight)} * double{draw->gain} * double{draw->pdf_w} / pdf *
                    std::max(0.0, double{in.w.y});
        }
        stats.add(value);
    }
    sigma = stats.standard_error();
    return stats.mean();
}

TEST(LightChoice, ADensityThatIsNotTheMixtures_IsRejected) {
    Monitor silent;
    for (const Scene& scene : {lamp_over_floor(), many_small_lights()}) {
        GuideSettings how;
        how.radius = 0.2F;
        const GuideMap guides = build_guides(scene, {20'000, 6, 0, how}, Workers{2}, silent);
        const V3f x(0.3F, 0, 0.2F);
        const Guide guide = guides.at(x, {0, 1, 0});
        const LightChoice plain, guided = plain.guided(guide, 0.3F), more_guided = plain.guided(guide, 0.1F);
        double sigma = 0, sigma_guided = 0, sigma_wrong = 0;
        const double truth = mean_by(scene, x, plain, plain, sigma);
        const double right = mean_by(scene, x, guided, guided, sigma_guided);
        EXPECT_LT(std::fabs(right - truth), 4 * std::hypot(sigma, sigma_guided));
        const double wrong = mean_by(scene, x, guided, more_guided, sigma_wrong);
        EXPECT_GT(std::fabs(wrong - truth), 4 * std::hypot(sigma, sigma_wrong));
    }
}

// Directions drawn by the mixture are distributed on the lamp as its density states (chi-square).
TEST(LightChoice, DirectionsTowardsALamp_FollowTheDensity_AndTheTestSeesWhenTheyDoNot) {
    const Scene scene = lamp_over_floor();
    Monitor silent;
    GuideSettings how;
    how.radius = 0.2F;
    const GuideMap guides = build_guides(scene, {20'000, 6, 0, how}, Workers{2}, silent);
    const V3f x(0.25F, 0, 0.1F);
    const Guide guide = guides.at(x, {0, 1, 0});
    ASSERT_GT(guide.choices().size(), 3U);
    const LightChoice choice = LightChoice().guided(guide, 0.3F), other = LightChoice().guided(guide, 0.4F);
    const Light& light = *scene.lights()[0];

    constexpr int kBins = 20;  // in each direction across S, 8 cm wide; one per interval
    constexpr int kDraws = 200'000;
    constexpr int kSteps = 16;  // midpoint rule within a bin
    const auto bin_of = [](const V3f& p) {
        const auto index = [](float c) {
            return std::clamp(static_cast<int>((c + 0.04F) / 0.08F * kBins), 0, kBins - 1);
        };
        return static_cast<std::size_t>(index(p.x) * kBins + index(p.z));
    };
    std::vector<std::uint64_t> observed(kBins * kBins + 1);
    for (std::uint64_t i = 0; i < kDraws; ++i) {
        Sampler sampler(10, Purpose::test, 0, i);
        const float u = sampler.next();
        const auto draw = choice.draw(scene, x, u, sampler.next2());
        const V3f p = draw ? x + draw->light_sample.w * (1 / draw->light_sample.w.y) : V3f(0.0F);
        ++observed[draw ? bin_of(p) : kBins * kBins];
    }
    const auto expected_by = [&](const LightChoice& density) {
        std::vector<double> expected(kBins * kBins + 1);
        double sum = 0;
        const double step = 0.08 / (kBins * kSteps);
        for (int i = 0; i < kBins * kSteps; ++i) {
            for (int j = 0; j < kBins * kSteps; ++j) {
                const V3d p((i + 0.5) * step - 0.04, 1, (j + 0.5) * step - 0.04);
                const V3d way = p - V3d(x);
                const auto seen = light.Le(Ray{x, V3f(way.normalized())});
                if (!seen) continue;  // dark, so nothing is drawn there
                const double solid_angle = step * step * way.y / (way.length2() * way.length());
                const double share = double{density.pdf_w(scene, 0, *seen)} * solid_angle;
                expected[bin_of(V3f(p))] += kDraws * share;
                sum += share;
            }
        }
        expected.back() = std::max(0.0, kDraws * (1 - sum));
        return expected;
    };
    const auto right = testing::chi_square(observed, expected_by(choice));
    EXPECT_TRUE(right.accepted()) << right.statistic << " of " << right.degrees;
    EXPECT_FALSE(testing::chi_square(observed, expected_by(other)).accepted());
}

// The gate stays closed where no photon lies in its disc. With `expected` photons on average, that has at
// least the probability 1 - expected, and at most exp(-expected), that of independent photons: those of
// stratified paths are spread more evenly.
TEST(GatedLight, OnAFlatSurface_LacksWhatWasPredicted) {
    SceneMaker make;
    make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, make.diffuse(Rgb(0.5F)));
    make.light(make_point_light({0, 2, 0}, Rgb(1.0F)));
    const Scene scene = make.build();
    Monitor silent;
    constexpr std::int64_t kPaths = 4096;
    constexpr int kMaps = 200;
    for (const double expected : {0.25, 0.5}) {
        // E = 1/4 below the lamp, whose flux is 4π: πr² E M / (4π) photons.
        GuideSettings how;
        how.radius = static_cast<float>(std::sqrt(expected * 16 / static_cast<double>(kPaths)));
        int open = 0;
        double lit = 0;
        for (std::uint32_t map = 0; map < kMaps; ++map) {
            const GuideMap guides = build_guides(scene, {kPaths, 11, map, how}, Workers{1}, silent);
            open += guides.any_near({0, 0, 0}, {0, 1, 0});
            const auto stats = measure(scene, {0, 0, 0}, 1, map, [&](const Vertex& vertex, Sampler& sampler) {
                SampleAccount account;
                gated_light(scene, guides, vertex, sampler, {}, PathAccount(account));
                return account.radiance();
            });
            lit += stats.mean();
        }
        const double most = std::exp(-expected), margin = 4 * std::sqrt(kMaps * most * (1 - most));
        const int closed = kMaps - open;
        EXPECT_GT(closed, kMaps * (1 - expected) - margin);
        EXPECT_LT(closed, kMaps * most + margin);
        // A point light is sampled without variance: exactly the closed maps are missing from the mean.
        EXPECT_NEAR(lit, open * 0.25 * 0.5 * double{kInvPi}, 1e-4 * lit);
        // The prediction for twice the radius is rejected.
        EXPECT_GT(closed, kMaps * std::exp(-4 * expected) + margin);
    }
}

RenderResult render_with(Scene scene, const IntegratorSettings& settings, int spp, std::uint64_t seed,
                         int threads = 2) {
    Monitor silent;
    const Camera camera = testing::camera({0.7F, 0.9F, -1.3F}, {0, 0.1F, 0}, 32, 32, 50);
    return render(testing::make_job(std::move(scene), camera, settings, spp), {seed, Workers{threads}},
                  silent);
}

// The images differ by noise alone: z-tests of all pixels, and the ratios of the channels' means.
TEST(GuidedLight, AsAPicture_AgreesWithDirect) {
    PhotonMapSettings guided;
    guided.direct = DirectMethod::guided;
    guided.indirect = IndirectMethod::none;
    int scene = 0;
    for (Scene (*make)() : {lamp_over_floor, many_small_lights, large_light}) {
        const auto truth = render_with(make(), DirectSettings{}, 256, 12);
        const auto tried = render_with(make(), guided, 64, 13);
        const Comparison compared = compare(tried.image, truth.image);
        ASSERT_TRUE(compared.z_test);
        EXPECT_GT(compared.z_test->tests, 500U);
        EXPECT_GT(compared.z_test->p_value, 1e-4)
            << scene << ", pixel " << compared.z_test->x << ", " << compared.z_test->y;
        for (const ChannelComparison& channel : compared.channels) {
            EXPECT_NEAR(channel.ratio.value_or(0), 1, 0.01) << scene;
        }
        ++scene;
    }
}

// A single light without parts leaves no choice, so no photons are emitted for it.
TEST(GuidedLight, OneLightWithoutParts_IsMcBitForBit) {
    PhotonMapSettings mc, guided;
    mc.indirect = guided.indirect = IndirectMethod::none;
    guided.direct = DirectMethod::guided;
    EXPECT_EQ(render_with(large_light(), mc, 4, 15).image.data,
              render_with(large_light(), guided, 4, 15).image.data);
    EXPECT_NE(render_with(lamp_over_floor(), mc, 4, 15).image.data,
              render_with(lamp_over_floor(), guided, 4, 15).image.data);
}

TEST(LightChoice, NothingToChoose_IsOneLightWithoutParts) {
    EXPECT_TRUE(nothing_to_choose(large_light()));
    EXPECT_FALSE(nothing_to_choose(lamp_over_floor()));
    EXPECT_FALSE(nothing_to_choose(many_small_lights()));
    EXPECT_TRUE(has_parts(lamp_over_floor()));
    EXPECT_FALSE(has_parts(many_small_lights()));
    SceneMaker dark_beside;
    dark_beside.light(make_point_light({0, 2, 0}, Rgb(1.0F)));
    dark_beside.light(make_point_light({1, 2, 0}, Rgb(0.0F)));
    EXPECT_TRUE(nothing_to_choose(dark_beside.build()));
    SceneMaker none;
    EXPECT_TRUE(nothing_to_choose(none.build()));
}

TEST(GuidedLight, AnyNumberOfThreads_SameImageBitForBit) {
    for (const DirectMethod method : {DirectMethod::gated, DirectMethod::guided}) {
        PhotonMapSettings settings;
        settings.direct = method;
        settings.photons = 20'000;
        settings.gather_rays = 2;
        const auto one = render_with(many_small_lights(), settings, 2, 14, 1);
        const auto five = render_with(many_small_lights(), settings, 2, 14, 5);
        EXPECT_EQ(one.image.data, five.image.data);
    }
}

}  // namespace guided_light_test
}  // namespace lucerna
