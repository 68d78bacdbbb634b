// Light fields of several colours: storage, and the light of every channel in particles and rays.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "engine/colour/spectrum.h"
#include "lights/field_colour.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace coloured_field_test {

using testing::all_rigs;
using testing::rig_a;
using testing::rig_b;
using testing::rig_c;

// Coefficients of X, Y and Z: luminances in [low, high], and colours between two that are both within sRGB.
struct Channels {
    std::vector<float> x, y, z;
};
Channels random_channels(const Rig& rig, float low, float high, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    const V3d blue = rgb_to_xyz(Rgb(0.3F, 0.5F, 2.0F)), yellow = rgb_to_xyz(Rgb(1.5F, 1.0F, 0.1F));
    Channels c;
    for (std::size_t i = 0; i < rig.coefficients(); ++i) {
        const double e = double{low} + double{high - low} * double{sampler.next()};
        const double t = double{sampler.next()};
        const V3d xyz = (1 - t) * blue + t * yellow;
        c.x.push_back(static_cast<float>(e * xyz.x));
        c.y.push_back(static_cast<float>(e * xyz.y));
        c.z.push_back(static_cast<float>(e * xyz.z));
    }
    return c;
}
LightField random_coloured(const Rig& rig, float low, float high, std::uint64_t seed) {
    const Channels c = random_channels(rig, low, high, seed);
    return {rig, c.x, c.y, c.z};
}

std::unique_ptr<Light> make(LightField field, const MeasuredSettings& settings = {}) {
    Monitor silent;
    CellTable table(field, {}, silent);
    return make_measured_light(std::move(field), std::move(table), settings, silent);
}

LeSampleU numbers(std::uint64_t seed, int i) {
    Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
    LeSampleU u;
    u.position = sampler.next2(), u.direction = sampler.next2(), u.salt = sampler.bits();
    return u;
}

TEST(ColouredField, Channels_AreKeptToAHalf) {
    for (const Rig& rig : all_rigs()) {
        const Channels c = random_channels(rig, -0.2F, 1, 3);
        const LightField field(rig, c.x, c.y, c.z);
        ASSERT_TRUE(field.coloured());
        double sum = 0;
        for (int channel = 0; channel < 3; ++channel) {
            const LightField of = field.channel(channel);
            const std::vector<float>& e = channel == 0 ? c.x : channel == 1 ? c.y : c.z;
            for (std::size_t i = 0; i < e.size(); ++i)
                EXPECT_NEAR(of.coefficients()[i], e[i], 0x1p-11F * std::fabs(e[i]) + 1e-6F) << channel;
            if (channel == 1) sum = of.flux();
        }
        EXPECT_NEAR(field.flux(), sum, 1e-3 * sum) << "W has the flux of Y";
    }
}

TEST(ColouredField, File_KeepsEveryChannel) {
    const testing::TemporaryFolder folder;
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_coloured(rig, -0.2F, 1, 4);
        write_light_field(folder / "lamp.exr", field);
        const LightField back = read_light_field(folder / "lamp.exr");
        EXPECT_EQ(content_hash(back), content_hash(field));
        for (int channel = 0; channel < 3; ++channel) {
            const LightField a = field.channel(channel), b = back.channel(channel);
            for (std::size_t i = 0; i < a.coefficients().size(); ++i)
                EXPECT_EQ(a.coefficients()[i], b.coefficients()[i]);
        }
        // A field that differs in one colour has another hash.
        Channels c = random_channels(rig, -0.2F, 1, 4);
        c.z[5] += 1;
        EXPECT_NE(content_hash(LightField(rig, c.x, c.y, c.z)), content_hash(field));
    }
}

TEST(ColouredField, WithoutLuminance_IsRefused) {
    Channels c = random_channels(rig_b(), 0, 1, 5);
    for (float& y : c.y) y = -y;
    EXPECT_THROW(LightField(rig_b(), c.x, c.y, c.z), InputError);
    c.y[3] = NAN;
    EXPECT_THROW(LightField(rig_b(), c.x, c.y, c.z), InputError);
    c = random_channels(rig_b(), 0, 1, 5);
    c.z.pop_back();
    EXPECT_THROW(LightField(rig_b(), c.x, c.y, c.z), InputError);
}

// The points at which a line crosses S and M, for a lamp under identity placement.
struct Line {
    V2d on_s, on_m;
    Line(const LeSample& e, const Rig& rig) {
        on_s = V2d(double{e.from.p.x}, double{e.from.p.y}) - V2d(rig.centre.x, rig.centre.y);
        on_m = on_s + V2d(double{e.d.x}, double{e.d.y}) * (rig.distance / double{e.d.z});
    }
};
double probe(int i, const V2d& s, const V2d& m) {
    switch (i) {
        case 0:
            return 1;
        case 1:
            return 1 + std::sin(200 * s.x + 40 * m.y);
        default:
            return std::cos(90 * s.y) * std::cos(60 * m.x);
    }
}

// Compares, for every channel, the mean of test functions over particles with their integral over the
// channel's own field. With `wrong` colours the comparison must fail.
void expect_channel_moments(const Rig& rig, EmissionMode mode, bool wrong) {
    const LightField field = random_coloured(rig, 0.1F, 1, 6);
    MeasuredSettings settings;
    settings.mode = mode;
    const auto light = make(field, settings);
    RunningStats stats[3][3];
    for (int i = 0; i < 200000; ++i) {
        const auto e = light->sample_Le(numbers(7, i));
        if (!e) {
            for (auto& of : stats) {
                for (RunningStats& s : of) s.add(0);
            }
            continue;
        }
        const Line line(*e, rig);
        const V3d xyz = rgb_to_xyz(wrong ? Rgb(luminance(e->weight) * field.info().colour) : e->weight);
        for (int c = 0; c < 3; ++c) {
            for (int k = 0; k < 3; ++k) stats[c][k].add(xyz[c] * probe(k, line.on_s, line.on_m));
        }
    }
    bool all = true;
    for (int c = 0; c < 3; ++c) {
        const LightField of = field.channel(c);
        for (int k = 0; k < 3; ++k) {
            const double truth =
                testing::integrate(of, 12, 2, [&](const V2d& s, const V2d& m) { return probe(k, s, m); });
            // The midpoint rule errs by a thousandth, half precision by up to two.
            const bool agrees =
                std::fabs(stats[c][k].mean() - truth) <= 4 * stats[c][k].standard_error() + 2e-3 * of.flux();
            all = all && agrees;
            EXPECT_TRUE(agrees || wrong) << c << ", " << k << ": " << stats[c][k].mean() << " for " << truth;
        }
    }
    EXPECT_EQ(all, !wrong);
}

TEST(ColouredField, Emission_MeetsEveryChannelsMoments) {
    for (const Rig& rig : {rig_a(), rig_c()}) {
        for (const EmissionMode mode : {EmissionMode::exact}) expect_channel_moments(rig, mode, false);
    }
}

TEST(ColouredField, EmissionOfOneColour_IsRefusedByTheSameTest) {
    expect_channel_moments(rig_c(), EmissionMode::exact, true);
}

// Negative coefficients remove light in places; each channel still has the measured flux.
TEST(ColouredField, SignedChannels_KeepTheirFlux) {
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_coloured(rig, -0.5F, 1, 8);
        const auto light = make(field);
        RunningStats stats[3];
        for (int i = 0; i < 100000; ++i) {
            const auto e = light->sample_Le(numbers(9, i));
            const V3d xyz = e ? rgb_to_xyz(e->weight) : V3d(0);
            for (int c = 0; c < 3; ++c) stats[c].add(xyz[c]);
        }
        const V3d stated = rgb_to_xyz(light->flux());
        for (int c = 0; c < 3; ++c) {
            const double measured = field.channel(c).flux();
            EXPECT_NEAR(stats[c].mean(), stated[c], 4 * stats[c].standard_error() + 2e-3 * stated[c]) << c;
            // Colours at the edge of sRGB's gamut are mixed with a little grey.
            EXPECT_NEAR(stats[c].mean(), measured, 4 * stats[c].standard_error() + 0.02 * measured) << c;
        }
    }
}

// Compares, by channel, the irradiance at a place by particles with that by sample_Li(), and the radiance
// that rays find with that of sample_Li().
TEST(ColouredField, Irradiance_BySampleLeAndSampleLi_IsOne) {
    for (const Rig& rig : {rig_a(), rig_c()}) {
        const LightField field = random_coloured(rig, -0.2F, 1, 10);
        const auto light = make(field);
        const V3f x(0.004F, 0.002F, 0.15F);
        const float side = 0.03F;
        RunningStats emitted[3], sampled[3];
        for (int i = 0; i < 200000; ++i) {
            Sampler sampler(11, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const auto e = light->sample_Le(numbers(12, i));
            Rgb hit(0.0F);
            if (e) {
                const V3f at = e->from.p + (x.z - e->from.p.z) / e->d.z * e->d - x;
                if (std::fabs(at.x) < side / 2 && std::fabs(at.y) < side / 2) hit = e->weight / (side * side);
            }
            const V2f offset = (sampler.next2() - V2f(0.5F, 0.5F)) * side;
            const V3f at = x + V3f(offset.x, offset.y, 0);
            const auto in = light->sample_Li(at, sampler.next2());
            const Rgb arrived = in ? in->weight * std::max(0.0F, -in->w.z) : Rgb(0.0F);
            if (in && i % 100 == 0) {
                const auto back = light->Le(Ray{at, in->w});
                ASSERT_TRUE(back);
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(back->radiance[c], in->weight[c] * in->pdf_w,
                                5e-3F * (in->weight[c] * in->pdf_w + luminance(in->weight) * in->pdf_w));
            }
            for (int c = 0; c < 3; ++c) {
                emitted[c].add(double{hit[c]});
                sampled[c].add(double{arrived[c]});
            }
        }
        for (int c = 0; c < 3; ++c) {
            const double sigma = std::hypot(emitted[c].standard_error(), sampled[c].standard_error());
            EXPECT_NEAR(emitted[c].mean(), sampled[c].mean(), 4 * sigma) << c;
            EXPECT_LT(sigma, 0.05 * sampled[c].mean());
        }
    }
}

// The lamp emits a yellow within sRGB and the green of an LED chip outside it: in wide colour spaces every
// place of the lamp has its measured colour, in sRGB it cannot.
TEST(ColouredField, InAWideSpace_EveryPlaceHasItsOwnColour) {
    const V3d green = find_colour_space("rec2020")->to_xyz({0, 1.4, 0.01}),
              yellow = rgb_to_xyz(Rgb(1, 1, 0.1F));
    const Rig rig = rig_a();
    std::vector<float> x, y, z;
    Sampler sampler(5, Purpose::test, 0, 0);
    for (std::size_t i = 0; i < rig.coefficients(); ++i) {
        const double t = double{sampler.next()};
        const V3d xyz = (1 - t) * green + t * yellow;
        x.push_back(static_cast<float>(xyz.x)), y.push_back(static_cast<float>(xyz.y));
        z.push_back(static_cast<float>(xyz.z));
    }
    const LightField field(rig, x, y, z);
    const V3d weight = field.colour_channels().weight;
    for (const std::string_view name : WorkingSpace::names()) {
        const WorkingSpace colours = WorkingSpace::named(name).value();
        const FieldColour colour(field, {}, colours);
        EXPECT_NEAR(luminance(colour.mean()), 1, 1e-5) << name;
        double worst = 0;
        for (int i = 0; i <= 4; ++i) {
            const V3d xyz = (1 - i / 4.0) * green + i / 4.0 * yellow;
            const double w = weight.dot(xyz);
            const Rgb light =
                colour.of(static_cast<float>(w), static_cast<float>(xyz.x), static_cast<float>(xyz.z));
            worst = std::max(worst, (w * colours.light_to_xyz(light) - xyz).length() / xyz.length());
        }
        if (name == "srgb")
            EXPECT_GT(worst, 0.1);
        else
            EXPECT_LT(worst, 2e-3) << name;  // channels are kept as halves
    }
}

}  // namespace coloured_field_test
}  // namespace lucerna
