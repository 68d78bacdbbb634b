// The virtual bench in colour measures X, Y and Z each as it would measure one channel alone.
#include "lights/measurement/acquire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/colour/spectrum.h"
#include "lights/measurement/camera_simulation.h"
#include "lights/measurement/photographs.h"
#include "lights/measurement/ray_projection.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/impatient_monitor.h"
#include "tests/support/projectors.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace acquire_colour_test {

using testing::error_of;
using ::testing::HasSubstr;
using testing::ImpatientMonitor;
using testing::TemporaryFolder;
using Outline = EmitterModel::Outline;

// Returns rigs of both setups, with the lamp at the origin.
std::vector<Rig> both_setups() {
    std::vector<Rig> rigs{testing::rig_a(), testing::rig_b()};
    for (Rig& rig : rigs) rig.centre = {0, 0, 0};
    return rigs;
}

// A light field of three channels that lies in the rig's basis, and an emitter that covers all of S and sends
// exactly this field.
struct Known {
    std::vector<std::vector<float>> e;  // coefficients of X, Y and Z
    EmitterModel emitter;
};
Known known_emitter(const Rig& rig, float least, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    Known known;
    auto fields = std::make_shared<std::vector<LightField>>();
    for (int c = 0; c < 3; ++c) {
        std::vector<float> e(rig.coefficients());
        for (float& x : e) x = least + (1 - least) * sampler.next();
        fields->emplace_back(rig, e);
        known.e.push_back(std::move(e));
    }
    known.emitter.outline = Outline::rectangle;
    known.emitter.half_size = {0.5 * rig.intervals(0) * rig.spacing.x,
                               0.5 * rig.intervals(1) * rig.spacing.y};
    known.emitter.xyz = [=](const V2d& p, const V3d& d) {
        const V2d on_m = p + V2d(d.x, d.y) * (rig.distance / d.z);
        V3d h(0, 0, 0);
        for (int c = 0; c < 3; ++c) {
            const LightField& field = (*fields)[static_cast<std::size_t>(c)];
            field.for_each_pixel(p, on_m, [&](const Cell& cell, float x, float y, float weight) {
                h[c] += double{weight} * double{field.members(cell).value(x, y)};
            });
        }
        return h / rig.geometric_term(p, on_m);
    };
    known.emitter.radiance = [xyz = known.emitter.xyz](const V2d& p, const V3d& d) { return xyz(p, d).y; };
    return known;
}

// Returns the largest difference divided by the largest magnitude.
double off(const std::vector<float>& got, const std::vector<float>& truth) {
    double most = 0, worst = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        most = std::max(most, std::fabs(double{truth[i]}));
        worst = std::max(worst, std::fabs(double{got[i]} - double{truth[i]}));
    }
    return worst / most;
}

TEST(AcquireColour, FieldInTheBasis_ComesBackInEveryChannel) {
    Monitor silent;
    for (const Rig& rig : both_setups()) {
        for (const float least : {-0.2F, 0.05F}) {
            const Known known = known_emitter(rig, least, 5);
            const FilterImages images = acquire_filters(known.emitter, rig, {2}, silent);
            ASSERT_TRUE(images.coloured());
            for (int c = 0; c < 3; ++c)
                EXPECT_LT(off(coefficients_of(images, c), known.e[static_cast<std::size_t>(c)]), 1e-5) << c;
            // The comparison must detect swapped channels.
            EXPECT_GT(off(coefficients_of(images, 0), known.e[2]), 0.1);
            if (least < 0) continue;  // a camera cannot record negative light
            CameraModel camera;       // of the sensor or of the screen, in floats
            camera.bits = 32;
            camera.format = "exr";
            camera.darks = 1;
            const FilterImages seen = photographed(images, camera, {2}, silent).images;
            for (int c = 0; c < 3; ++c)
                EXPECT_LT(off(coefficients_of(seen, c), known.e[static_cast<std::size_t>(c)]), 1e-5) << c;
        }
    }
}

TEST(AcquireColour, Photographs_InFilesOfThreeChannels_GiveTheSameField) {
    Monitor silent;
    for (const Rig& rig : both_setups()) {
        const Known known = known_emitter(rig, 0.05F, 6);
        const FilterImages images = acquire_filters(known.emitter, rig, {2}, silent);
        for (const int bits : {32, 16}) {
            const TemporaryFolder folder;
            CameraModel camera;
            camera.bits = bits;
            camera.format = bits == 32 ? "exr" : "tiff";
            camera.darks = 1;
            camera.oversampling = {2, 1};
            camera.margin = {1, 2};
            write_photographs(images, camera, folder / "shots", {2}, silent);
            const Manifest manifest = read_manifest(folder / "shots" / "manifest.toml");
            EXPECT_EQ(manifest.channel, "rgb");
            const Assembly back = assemble(manifest, {2}, silent, {});
            ASSERT_TRUE(back.images.coloured());
            // A step of 16 bits is 2e-5 of the brightest pixel, and films are scaled up by their sum.
            const double tolerance = bits == 32 ? 1e-5 : 2e-4;
            for (int c = 0; c < 3; ++c)
                EXPECT_LT(off(coefficients_of(back.images, c), coefficients_of(images, c)), tolerance)
                    << c << " " << bits;
            EXPECT_GT(off(coefficients_of(back.images, 0), known.e[2]), 0.1);
        }
    }
}

TEST(AcquireColour, PhotographsWithoutAMatrix_AreLinearSrgb) {
    Monitor silent;
    const Rig rig = both_setups()[1];
    const Known known = known_emitter(rig, 0.05F, 7);
    const FilterImages images = acquire_filters(known.emitter, rig, {2}, silent);
    const TemporaryFolder folder;
    CameraModel camera;
    camera.bits = 32;
    camera.format = "exr";
    camera.darks = 0;
    write_photographs(images, camera, folder / "shots", {2}, silent);
    Manifest manifest = read_manifest(folder / "shots" / "manifest.toml");
    manifest.camera.to_xyz.reset();
    const FilterImages back = assemble(manifest, {2}, silent, {}).images;
    for (std::size_t i = 0; i < images.positive.size(); i += 7) {
        // The files' R, G and B hold what the images hold as X, Y and Z.
        const V3d xyz = rgb_to_xyz(Rgb(images.x.positive[i], images.positive[i], images.z.positive[i]));
        EXPECT_NEAR(back.x.positive[i], xyz.x, 1e-4 * std::fabs(xyz.x) + 1e-6);
        EXPECT_NEAR(back.positive[i], xyz.y, 1e-4 * std::fabs(xyz.y) + 1e-6);
        EXPECT_NEAR(back.z.positive[i], xyz.z, 1e-4 * std::fabs(xyz.z) + 1e-6);
    }
}

TEST(AcquireColour, EachChannel_IsThatOfAnEmitterOfItAlone) {
    Monitor silent;
    for (const Rig& rig : both_setups()) {
        EmitterModel emitter = cosine_emitter(Outline::disc, {0.009, 0}, 2, 2);
        set_colours(emitter, {Rgb(1.0F), Rgb(2.0F, 0.8F, 0.03F), Rgb(0.2F, 1.1F, 2.4F)});
        ASSERT_TRUE(bool(emitter.xyz));
        const FilterImages images = acquire_filters(emitter, rig, {2}, silent);
        for (int c = 0; c < 3; ++c) {
            EmitterModel alone = emitter;
            alone.xyz = {};
            alone.radiance = [c, xyz = emitter.xyz](const V2d& p, const V3d& d) { return xyz(p, d)[c]; };
            EXPECT_LT(
                off(coefficients_of(images, c), coefficients_of(acquire_filters(alone, rig, {2}, silent), 1)),
                1e-6)
                << c;
        }
    }
}

// The tolerance is the rounding of a coloured field's channels, which are kept in half precision.
TEST(AcquireColour, WithoutAFilter_EachChannelIsThatOfAnEmitterOfItAlone) {
    Monitor silent;
    for (const Rig& rig : both_setups()) {
        EmitterModel emitter = cosine_emitter(Outline::disc, {0.02, 0}, 2, 2);
        set_colours(emitter, {Rgb(1.0F), Rgb(2.0F, 0.8F, 0.03F), Rgb(0.2F, 1.1F, 2.4F)});
        const LightField canned = acquire_without_filter(emitter, rig, {2}, silent, {});
        ASSERT_TRUE(canned.coloured());
        const auto coefficients = [](const LightField& field) {
            return std::vector<float>(field.coefficients().begin(), field.coefficients().end());
        };
        for (int c = 0; c < 3; ++c) {
            EmitterModel alone = emitter;
            alone.xyz = {};
            alone.radiance = [c, xyz = emitter.xyz](const V2d& p, const V3d& d) { return xyz(p, d)[c]; };
            const LightField truth = acquire_without_filter(alone, rig, {2}, silent, {});
            EXPECT_LT(off(coefficients(canned.channel(c)), coefficients(truth)), 2e-3) << c;
        }
    }
}

TEST(AcquireColour, WithoutAFilter_ALampBetweenThePinholesIsDark) {
    Monitor silent;
    Rig rig = testing::rig_b();
    rig.centre = {0, 0, 0};
    EmitterModel emitter =
        cosine_emitter(Outline::disc, {0.002, 0}, 2, 2);  // the pinholes are 10 and 20 mm apart
    set_colours(emitter, {Rgb(1.0F), Rgb(2.0F, 0.8F, 0.03F), {}});
    const LightField dark = acquire_without_filter(emitter, rig, {2}, silent, {});
    EXPECT_EQ(dark.flux(), 0);
    EXPECT_FALSE(dark.coloured());
}

TEST(AcquireColour, Flux_OfEveryChannelCloses) {
    // The setup is a Lambertian disc and a wide screen, as in Acquire.WideScreen. The mean of ρ² over a disc
    // is 1/2.
    Rig rig;
    rig.views = {11, 11};
    rig.spacing = {0.002, 0.002};
    rig.pixels = {30, 30};
    rig.pixel = {0.04, 0.04};
    rig.distance = 0.1;
    EmitterModel emitter = cosine_emitter(Outline::disc, {0.008, 0}, 5, 1);
    const Rgb middle(1.0F), rim = Rgb(2, 1, 0.1F) / luminance(Rgb(2, 1, 0.1F));
    set_colours(emitter, {middle, rim, std::nullopt});
    Monitor silent;
    const FilterImages images = acquire_filters(emitter, rig, {2}, silent, {3, 2});
    const double c = 6 / std::sqrt(37.0), share = 4 / std::acos(-1.0) * c * std::atan(c);
    const V3d expected = 5 * share * 0.5 * (rgb_to_xyz(middle) + rgb_to_xyz(rim));
    for (int channel = 0; channel < 3; ++channel) {
        double sum = 0;
        for (const float e : coefficients_of(images, channel)) sum += double{e};
        EXPECT_NEAR(sum * rig.cell_volume() / expected[channel], 1, 2e-3) << channel;
    }
    const LightField field = field_of(images);
    EXPECT_NEAR(field.info().captured + field.info().missed, 5, 1e-6);
    for (int channel = 0; channel < 3; ++channel)  // in the stored channels too
        EXPECT_NEAR(field.channel(channel).flux() / expected[channel], 1, 2e-3) << channel;
}

TEST(AcquireColour, OneColour_IsMeasuredAsOne) {
    EmitterModel emitter = cosine_emitter(Outline::disc, {0.009, 0}, 2, 2);
    const EmitterModel plain = emitter;
    set_colours(emitter, {Rgb(1.2F, 1, 0.8F), Rgb(1.2F, 1, 0.8F), std::nullopt});
    EXPECT_FALSE(bool(emitter.xyz));
    Monitor silent;
    const Rig rig = both_setups()[0];
    EXPECT_EQ(acquire_filters(emitter, rig, {2}, silent).positive,
              acquire_filters(plain, rig, {2}, silent).positive);
}

TEST(AcquireColour, StoppedWork_TakenUpAgain_GivesTheSameBits) {
    Monitor silent;
    for (const Rig& rig : both_setups()) {
        const TemporaryFolder folder;
        const Known known = known_emitter(rig, 0.05F, 8);
        const FilterImages whole = acquire_filters(known.emitter, rig, {2}, silent);
        AcquireOptions options;
        {
            AcquirePart part(folder / "lamp.part", 9);
            options.part = &part;
            ImpatientMonitor impatient(3);
            EXPECT_THAT(error_of([&] { acquire_filters(known.emitter, rig, {1}, impatient, options); }),
                        HasSubstr("stopped"));
        }
        AcquirePart part(folder / "lamp.part", 9);
        EXPECT_EQ(part.columns(), 3U);
        options.part = &part;
        const FilterImages resumed = acquire_filters(known.emitter, rig, {2}, silent, options);
        for (int c = 0; c < 3; ++c) {
            for (const FilterSign sign : kFilterSigns) EXPECT_EQ(resumed.of(sign, c), whole.of(sign, c)) << c;
        }
    }
}

TEST(AcquireColour, SlideInColours_IsTheGreySlideOfEachOfThem) {
    Projector p = testing::small_projector();
    Sampler sampler(3, Purpose::test, 0, 0);
    Image slide = Image::rgb(6, 4);
    Image parts[3] = {slide, slide, slide};
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 6; ++x) {
            const Rgb value(sampler.next(), sampler.next(), sampler.next());
            slide.set_rgb(x, y, value);
            for (int c = 0; c < 3; ++c) parts[c].set_rgb(x, y, Rgb(value[c]));
        }
    }
    for (const bool inverted : {false, true}) {
        p.inverted = inverted;
        const EmitterModel coloured = projector_emitter(p, slide);
        ASSERT_TRUE(bool(coloured.xyz));
        // The flux of a grey slide is given, so each grey slide yields its radiance up to a factor.
        double factor[3] = {0, 0, 0};
        for (int i = 0; i < 200; ++i) {
            const V2f a = sampler.next2(), b = sampler.next2();
            const V2d on_lens = 0.02 * V2d(double{a.x} - 0.5, double{a.y} - 0.5);
            const V3d d = V3d((double{b.x} - 0.5) * 0.5, (double{b.y} - 0.5) * 0.35, 1).normalized();
            const V3d xyz = coloured.xyz(on_lens, d);
            const Rgb rgb = xyz_to_rgb(xyz);
            EXPECT_NEAR(xyz.y, coloured.radiance(on_lens, d), 1e-9 * (1 + xyz.y));
            for (int c = 0; c < 3; ++c) {
                const EmitterModel grey = projector_emitter(p, parts[c]);
                EXPECT_FALSE(bool(grey.xyz));
                const double truth = grey.radiance(on_lens, d);
                if (factor[c] == 0 && truth > 0) factor[c] = double{rgb[c]} / truth;
                EXPECT_NEAR(double{rgb[c]}, factor[c] * truth, 1e-4 * (1 + xyz.y)) << c;
            }
        }
    }
}

TEST(AcquireColour, RaysOfSeveralColours_AreTheirProjectionInEveryChannel) {
    for (const Rig& rig : both_setups()) {
        RaySet set;
        RayTints tints, half;
        const V3d blue = rgb_to_xyz(Rgb(0.3F, 0.5F, 2.0F)), yellow = rgb_to_xyz(Rgb(1.5F, 1.0F, 0.1F));
        for (int i = 0; i < 40'000; ++i) {
            Sampler sampler(12, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const V2f at = sampler.next2();
            set.rays.push_back({{0.03F * (at.x - 0.5F), 0.03F * (at.y - 0.5F), 0.001F},
                                square_to_cosine_hemisphere(sampler.next2()),
                                0.5F + sampler.next()});
            set.flux += double{set.rays.back().flux};
            const double t = i < 10'000 ? 0 : double{sampler.next()};  // the first rays are all blue
            const V3d xyz = (1 - t) * blue + t * yellow;
            set.tristimulus.push_back(V3f(xyz / xyz.y));
            (i < 10'000 ? half : tints).add(set.tristimulus.back());
        }
        EXPECT_FALSE(half.several());
        Monitor silent;
        const Projection direct = project_rays(set, rig, {2}, silent);
        FilterSums sums(rig);
        const std::span<const LampRay> rays(set.rays);
        add_rays(sums, rays.first(10'000), {2}, half);
        EXPECT_FALSE(sums.coloured()) << "one colour so far";
        add_rays(sums, rays.subspan(10'000), {2}, tints);
        ASSERT_TRUE(sums.coloured());
        const FilterImages images = images_of(sums, 1, {});
        for (int c = 0; c < 3; ++c) {
            const LightField channel = direct.field.channel(c);  // rounded to half precision
            const std::vector<float> truth(channel.coefficients().begin(), channel.coefficients().end());
            EXPECT_LT(off(coefficients_of(images, c), truth), 1e-3) << c;
            EXPECT_GT(off(coefficients_of(images, (c + 1) % 3), truth), 0.02) << c;
        }
    }
}

}  // namespace acquire_colour_test
}  // namespace lucerna
