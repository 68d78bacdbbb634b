#include "lights/image_lights.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace image_lights_test {

using testing::agrees;
using testing::chi_square;

LeSampleU le_u(Sampler& s) {
    return {s.next2(), s.next2(), s.bits()};
}

// Returns coloured noise with a bright spot and a black row, without any symmetry.
std::shared_ptr<const Image> rough_image(int width, int height) {
    Sampler s(11, Purpose::test, 0, 0);
    auto image = std::make_shared<Image>(Image::rgb(width, height));
    for (float& value : image->data) value = s.next();
    for (int x = 0; x < width; ++x) image->set_rgb(x, height / 2, Rgb(0.0F));
    image->set_rgb(width / 3, height / 4, Rgb(30, 20, 10));
    return image;
}

// Returns rotated and mirrored axes.
LightAxes odd_axes() {
    const V3f z = V3f(0.3F, -0.5F, 0.8F).normalized();
    const V3f x = V3f(0.2F, 0.9F, 0.1F).cross(z).normalized();
    return {x, x.cross(z), z};
}

struct Lamp {
    std::string name;
    std::unique_ptr<Light> light;
};

std::vector<Lamp> all_lamps() {
    const Rgb colour(2, 1, 0.5F);
    const SceneSphere scene{{0.2F, 0, 0.1F}, 2};
    const auto by_latitude =
        std::make_shared<DirectionalImage>(rough_image(16, 8), SphereMap::latitude_longitude);
    const auto equal_area = std::make_shared<DirectionalImage>(rough_image(12, 12), SphereMap::equal_area);
    const LightAxes down{{1, 0, 0}, {0, 1, 0}, V3f(0, 0, -1)};
    const V3f above(0.3F, 0.2F, 1.5F);
    std::vector<Lamp> lamps;
    lamps.push_back({"sky by latitude", make_image_infinite_light(by_latitude, odd_axes(), colour, scene)});
    lamps.push_back({"equal-area sky", make_image_infinite_light(equal_area, odd_axes(), colour, scene)});
    lamps.push_back({"goniometric", make_goniometric_light(by_latitude, above, odd_axes(), colour)});
    lamps.push_back(
        {"goniometric, equal-area", make_goniometric_light(equal_area, above, odd_axes(), colour)});
    for (const bool up : {true, false}) {
        const auto slide = std::make_shared<const Slide>(rough_image(9, 6), 70, up);
        lamps.push_back({up ? "projection" : "projection, upside down",
                         make_projection_light(slide, above, down, colour)});
    }
    return lamps;
}

TEST(ImageLight, Emission_WeighsTheFluxInTheMean) {
    for (const Lamp& lamp : all_lamps()) {
        Sampler s(1, Purpose::test, 0, 0);
        RunningStats channel[3];
        for (int i = 0; i < 50000; ++i) {
            const auto emitted = lamp.light->sample_Le(le_u(s));
            ASSERT_TRUE(emitted) << lamp.name;
            for (int c = 0; c < 3; ++c) channel[c].add(static_cast<double>(emitted->weight[c]));
            ASSERT_NEAR(emitted->d.length(), 1, 1e-5F) << lamp.name;
        }
        for (int c = 0; c < 3; ++c) {
            const auto flux = static_cast<double>(lamp.light->flux()[c]);
            EXPECT_NEAR(channel[c].mean(), flux, 4 * channel[c].standard_error() + 1e-6 * flux) << lamp.name;
            EXPECT_LT(channel[c].standard_error(), 0.01 * flux) << lamp.name << ": the image is not drawn by";
        }
    }
}

// Estimates the flux through a disc of radius 0.4 about the origin that faces +z, by particles and by
// sample_Li().
TEST(ImageLight, ParticlesOnAPatch_CarryWhatSampleLiPromises) {
    constexpr float kRadius = 0.4F;
    for (const Lamp& lamp : all_lamps()) {
        RunningStats by_particles, by_asking;
        Sampler s(2, Purpose::test, 0, 0);
        for (int i = 0; i < 600000; ++i) {
            const auto emitted = lamp.light->sample_Le(le_u(s));
            double power = 0;
            if (emitted && emitted->d.z < 0 && emitted->from.p.z > 0) {
                const V3f at = emitted->from.p - emitted->from.p.z / emitted->d.z * emitted->d;
                if (V2f(at.x, at.y).length() < kRadius) {
                    power = static_cast<double>(luminance(emitted->weight));
                }
            }
            by_particles.add(power);
            const V2f place = kRadius * square_to_disc(s.next2());
            const auto light_sample = lamp.light->sample_Li({place.x, place.y, 0}, s.next2());
            const float cosine = light_sample ? std::max(0.0F, light_sample->w.z) : 0.0F;
            by_asking.add(light_sample ? static_cast<double>(luminance(light_sample->weight) * cosine * kPi) *
                                             sqr(static_cast<double>(kRadius))
                                       : 0.0);
        }
        const double gap = by_particles.mean() - by_asking.mean();
        const double sigma = std::hypot(by_particles.standard_error(), by_asking.standard_error());
        EXPECT_GT(by_asking.mean(), 0) << lamp.name;
        EXPECT_LT(sigma, 0.02 * by_asking.mean()) << lamp.name << ": too noisy to say anything";
        EXPECT_LT(std::fabs(gap), 4 * sigma) << lamp.name;
        // The same test rejects a light whose power is wrong by a tenth.
        EXPECT_GT(std::fabs(gap + 0.1 * by_asking.mean()), 4 * sigma) << lamp.name;
    }
}

// Bins of equal solid angle, in the cosine and the azimuth.
constexpr int kCosines = 10, kAzimuths = 20;
std::size_t bin_of(const V3f& w) {
    const double phi = std::atan2(static_cast<double>(w.y), static_cast<double>(w.x)) / (2 * kPiD) + 0.5;
    const double z = (static_cast<double>(w.z) + 1) / 2;
    return static_cast<std::size_t>(std::clamp(static_cast<int>(z * kCosines), 0, kCosines - 1) * kAzimuths +
                                    std::clamp(static_cast<int>(phi * kAzimuths), 0, kAzimuths - 1));
}

TEST(ImageInfiniteLight, Directions_FollowTheDensityThatSeenStates) {
    for (const Lamp& lamp : all_lamps()) {
        if (!lamp.light->has_impostor()) continue;
        constexpr int kSamples = 200000;
        std::vector<std::uint64_t> counts(kCosines * kAzimuths);
        Sampler s(3, Purpose::test, 0, 0);
        for (int i = 0; i < kSamples; ++i)
            ++counts[bin_of(lamp.light->sample_Li({1, 2, 3}, s.next2()).value().w)];
        // Integrates the stated density over each bin by a fine quadrature.
        std::vector<double> expected(counts.size()), uniform(counts.size(), kSamples / 200.0);
        constexpr int kFine = 60;
        double total = 0;
        for (int i = 0; i < kCosines * kFine; ++i) {
            for (int j = 0; j < kAzimuths * kFine; ++j) {
                const double z = 2 * (i + 0.5) / (kCosines * kFine) - 1;
                const double phi = 2 * kPiD * ((j + 0.5) / (kAzimuths * kFine) - 0.5),
                             r = std::sqrt(1 - z * z);
                const V3f w(V3d(r * std::cos(phi), r * std::sin(phi), z));
                const double mass = static_cast<double>(lamp.light->Le({V3f(0.0F), w}).value().pdf_w) * 4 *
                                    kPiD / (kCosines * kAzimuths * kFine * kFine);
                expected[bin_of(w)] += mass * kSamples;
                total += mass;
            }
        }
        EXPECT_NEAR(total, 1, 2e-3) << lamp.name;
        EXPECT_TRUE(chi_square(counts, expected).accepted()) << lamp.name;
        EXPECT_FALSE(chi_square(counts, uniform).accepted()) << lamp.name;
    }
}

TEST(ImageInfiniteLight, Le_AgreesWithSampleLi) {
    for (const Lamp& lamp : all_lamps()) {
        if (!lamp.light->has_impostor()) continue;
        Sampler s(4, Purpose::test, 0, 0);
        int edge = 0;
        for (int i = 0; i < 20000; ++i) {
            const auto light_sample = lamp.light->sample_Li({0, 0, 0}, s.next2()).value();
            const EmittedRadiance seen = lamp.light->Le({{0, 0, 0}, light_sample.w}).value();
            const Rgb radiance = light_sample.weight * light_sample.pdf_w;
            const bool same = std::fabs(seen.pdf_w / light_sample.pdf_w - 1) < 1e-4F &&
                              max_component(seen.radiance - radiance) < 1e-4F * max_component(radiance);
            edge += same ? 0 : 1;  // a direction may round into the neighbouring texel
        }
        EXPECT_LT(edge, 10) << lamp.name;
        EXPECT_FALSE(lamp.light->Le({{0, 0, 0}, {0, 0, 1}, 5.0F})) << "a ray with an end";
    }
}

TEST(ImagePoints, Emission_GoesWhereTheIntensityIs) {
    for (const Lamp& lamp : all_lamps()) {
        if (lamp.light->has_impostor()) continue;
        // Compares the intensity of particles in each bin with its quadrature by sample_Li() at places around
        // the light.
        constexpr int kSamples = 150000;
        std::vector<RunningStats> emitted(kCosines * kAzimuths), asked(kCosines * kAzimuths);
        Sampler s(5, Purpose::test, 0, 0);
        const V3f position = lamp.light->sample_Le(le_u(s)).value().from.p;
        for (int i = 0; i < kSamples; ++i) {
            const auto particle = lamp.light->sample_Le(le_u(s)).value();
            const V3f w = square_to_sphere(s.next2());
            const auto light_sample = lamp.light->sample_Li(position + w, {});
            for (std::size_t bin = 0; bin < emitted.size(); ++bin) {
                if (i % 8 != static_cast<int>(bin % 8)) continue;  // each bin by an eighth of the samples
                emitted[bin].add(bin_of(particle.d) == bin ? static_cast<double>(luminance(particle.weight))
                                                           : 0);
                asked[bin].add(light_sample && bin_of(w) == bin
                                   ? 4 * kPiD * static_cast<double>(luminance(light_sample->weight))
                                   : 0);
            }
        }
        double most = 0;
        for (const RunningStats& bin : asked) most = std::max(most, bin.mean());
        for (std::size_t bin = 0; bin < emitted.size(); ++bin) {
            const double sigma = std::hypot(emitted[bin].standard_error(), asked[bin].standard_error());
            EXPECT_LT(std::fabs(emitted[bin].mean() - asked[bin].mean()), 4.5 * sigma + 1e-3 * most)
                << lamp.name << " " << bin;
        }
    }
}

TEST(Slide, Integral_OfAConstant_IsTheSolidAngleOfItsFrame) {
    auto white = std::make_shared<Image>(Image::rgb(5, 5));
    std::fill(white->data.begin(), white->data.end(), 1.0F);
    // A slide with a field of view of 90 degrees covers one face of the cube.
    EXPECT_NEAR(Slide(white, 90, true).integral().x, 4 * kPiD / 6, 1e-5);
    EXPECT_EQ(Slide(white, 90, true).at(V3f(0.99F, 0, 1).normalized()), Rgb(1.0F));
    EXPECT_EQ(Slide(white, 90, true).at(V3f(1.01F, 0, 1).normalized()), Rgb(0.0F));
}

TEST(DirectionalImage, Integral_OfAConstant_IsFourPi) {
    for (const SphereMap map : {SphereMap::latitude_longitude, SphereMap::equal_area}) {
        auto white = std::make_shared<Image>(Image::rgb(8, 4));
        std::fill(white->data.begin(), white->data.end(), 1.0F);
        const DirectionalImage image(white, map);
        EXPECT_NEAR(image.integral().x, 4 * kPiD, 1e-5);
        for (const V3f& w : {V3f(0, 0, 1), V3f(0, 0, -1), V3f(1, 0, 0), V3f(-1, -1e-9F, 0)}) {
            EXPECT_NEAR(image.pdf_w(w), kSpherePdfW, 1e-6F);
        }
    }
}

// Tests black images, poles and corners of the unit square.
TEST(ImageLight, EdgeCases_AreFiniteOrNoSample) {
    const auto black =
        std::make_shared<DirectionalImage>(std::make_shared<Image>(Image::rgb(4, 4)), SphereMap::equal_area);
    const auto dark = make_image_infinite_light(black, {}, Rgb(1.0F), {});
    EXPECT_EQ(dark->power(), 0);
    EXPECT_FALSE(dark->sample_Le({{0.5F, 0.5F}, {0.5F, 0.5F}}));
    EXPECT_FALSE(dark->sample_Li({0, 0, 0}, {0.5F, 0.5F}));
    EXPECT_EQ(dark->Le({{0, 0, 0}, {0, 0, 1}})->pdf_w, 0);
    for (const Lamp& lamp : all_lamps()) {
        for (const float u : {0.0F, 0.5F, 0x1.fffffep-1F}) {
            for (const float v : {0.0F, 0.5F, 0x1.fffffep-1F}) {
                const auto emitted = lamp.light->sample_Le({{u, v}, {v, u}});
                if (!emitted) continue;
                EXPECT_TRUE(is_finite(emitted->weight)) << lamp.name;
                EXPECT_NEAR(emitted->d.length(), 1, 1e-5F) << lamp.name;
            }
        }
    }
}

RC_GTEST_PROP(EqualAreaMap, ThereAndBack_IsTheSamePoint, ()) {
    const auto inside = [] { return *rc::gen::inRange(1, 1 << 20) / static_cast<double>(1 << 20); };
    const double x = inside(), y = inside();
    const V3d w = equal_area_direction(x, y);
    RC_ASSERT(std::fabs(w.length() - 1) < 1e-12);
    const Imath::V2d back = equal_area_square(w);
    // Points of the square's edge that are images of each other are one direction.
    const bool on_edge = std::fabs(w.z) > 1 - 1e-9 || std::fabs(w.x) < 1e-9 || std::fabs(w.y) < 1e-9;
    RC_ASSERT(on_edge || (std::fabs(back.x - x) < 1e-7 && std::fabs(back.y - y) < 1e-7));
}

TEST(EqualAreaMap, Areas_BecomeEqualSolidAngles) {
    std::vector<std::uint64_t> counts(kCosines * kAzimuths);
    Sampler s(6, Purpose::test, 0, 0);
    constexpr int kSamples = 200000;
    for (int i = 0; i < kSamples; ++i) {
        const V2f u = s.next2();
        ++counts[bin_of(V3f(equal_area_direction(static_cast<double>(u.x), static_cast<double>(u.y))))];
    }
    EXPECT_TRUE(chi_square(counts, std::vector<double>(counts.size(), kSamples / 200.0)).accepted());
}

}  // namespace image_lights_test
}  // namespace lucerna
