#include "lights/measurement/acquire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "lights/measurement/plane_irradiance.h"
#include "tests/support/error_of.h"
#include "tests/support/projectors.h"

namespace lucerna {
namespace projector_test {

using testing::error_of;
using ::testing::HasSubstr;
using testing::small_projector;

Image picture(int width, int height, const std::function<double(double, double)>& value) {
    Image image = Image::rgb(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.set_rgb(x, y, Rgb(static_cast<float>(value((x + 0.5) / width, 1 - (y + 0.5) / height))));
    return image;
}

Image clear_slide() {
    return picture(6, 4, [](double, double) { return 1; });
}

double radiance_at(const EmitterModel& emitter, const V2d& p, const V2d& q, double b) {
    return emitter.radiance(p, V3d(q.x - p.x, q.y - p.y, b).normalized());
}

TEST(Projector, RaysThroughOnePointOfTheSharpPlane_ComeFromOneOfTheSlide) {
    const Projector p = small_projector();
    EXPECT_NEAR(1 / p.slide_distance() + 1 / p.focus, 1 / p.focal_length, 1e-12);
    const EmitterModel emitter =
        projector_emitter(p, picture(36, 24, [](double x, double y) { return x * (0.2 + 0.8 * y); }));
    const V2d half = p.slide_size * (0.5 * p.magnification());
    double last = 0;
    for (const double x : {-0.8, -0.1, 0.6}) {  // brighter to the right and to the top
        const V2d q(x * half.x, 0.3 * half.y);
        const double middle = radiance_at(emitter, {0, 0}, q, p.focus);
        EXPECT_GT(middle, last);
        last = middle;
        for (const V2d& on_lens : {V2d(0.02, 0), V2d(-0.01, 0.015), V2d(0, -0.024)})
            EXPECT_NEAR(radiance_at(emitter, on_lens, q, p.focus), middle, 1e-9 * middle);
    }
    EXPECT_GT(radiance_at(emitter, {0, 0}, {0, 0.8 * half.y}, p.focus),
              radiance_at(emitter, {0, 0}, {0, -0.8 * half.y}, p.focus));
    EXPECT_EQ(radiance_at(emitter, {0, 0}, {1.1 * half.x, 0}, p.focus), 0);
}

TEST(Projector, Inverted_IsTheRestOfTheSlide) {
    Projector p = small_projector();
    const Image image = picture(36, 24, [](double x, double) { return x < 0.5 ? 0.25 : 1.0; });
    p.inverted = true;
    const EmitterModel emitter = projector_emitter(p, image);
    EXPECT_EQ(radiance_at(emitter, {0, 0}, {0.1, 0}, p.focus), 0);
    EXPECT_GT(radiance_at(emitter, {0, 0}, {-0.1, 0}, p.focus), 0);
}

// The flux is ∫ L cosθ over lens and directions, here summed over the sharp plane and rings of the lens.
TEST(Projector, Flux_IsWhatWasAskedFor) {
    const Projector p = small_projector();
    for (const Image& image : {picture(60, 40, [](double, double) { return 1; }),
                               picture(60, 40, [](double x, double y) { return x * y; })}) {
        const EmitterModel emitter = projector_emitter(p, image);
        const V2d half = p.slide_size * (0.5 * p.magnification()) * 1.2;  // includes the dark margin
        constexpr int kQ = 160, kRings = 8, kAngles = 8;
        double sum = 0;
        for (int i = 0; i < kQ * kQ; ++i) {
            const V2d q(half.x * (2 * (i % kQ + 0.5) / kQ - 1), half.y * (2 * (i / kQ + 0.5) / kQ - 1));
            for (int r = 0; r < kRings; ++r) {
                for (int a = 0; a < kAngles; ++a) {
                    const double radius = p.aperture * std::sqrt((r + 0.5) / kRings);
                    const double angle = 2 * std::acos(-1.0) * (a + 0.5 * (r % 2)) / kAngles;
                    const V2d on_lens(radius * std::cos(angle), radius * std::sin(angle));
                    const double r2 = (q - on_lens).length2() + p.focus * p.focus;
                    sum += radiance_at(emitter, on_lens, q, p.focus) * p.focus * p.focus / (r2 * r2);
                }
            }
        }
        const double area =
            4 * half.x * half.y / kQ / kQ * std::acos(-1.0) * p.aperture * p.aperture / kRings / kAngles;
        EXPECT_NEAR(sum * area, 1000, 3);
    }
}

TEST(Projector, Impossible_IsRefused) {
    Projector p = small_projector();
    p.focus = 0.05;
    EXPECT_THAT(error_of([&] { projector_emitter(p, clear_slide()); }), HasSubstr("focal length"));
    p = small_projector();
    EXPECT_THAT(error_of([&] { projector_emitter(p, picture(3, 2, [](double, double) { return 0; })); }),
                HasSubstr("no light"));
    EXPECT_THAT(error_of([&] { projector_emitter(p, picture(3, 2, [](double, double) { return 7; })); }),
                HasSubstr("column 0, row 0"));
    p.flux = NAN;
    EXPECT_THAT(error_of([&] { projector_emitter(p, clear_slide()); }), HasSubstr("finite"));
}

// Uses the paper's rig, coarser, with a lens that its views cover and a sensor that every view's filter
// fills, so all of the lamp's light is in the field and the picture is where it should be.
TEST(Projector, Measured_KeepsItsFluxAndItsPicture) {
    Projector p = small_projector();
    p.aperture = 0.015;
    const EmitterModel emitter = projector_emitter(
        p, picture(72, 48, [](double x, double y) { return x > 0.5 && y > 0.5 ? 1 : 0.1; }));
    Rig rig;
    rig.views = {19, 19};
    rig.spacing = V2d(3 * 0.905e-3);
    rig.pixels = {44, 36};
    rig.pixel = V2d(0.905e-3);
    rig.shift = {3, 3};
    rig.distance = 0.039;
    Monitor silent;
    AcquireOptions options;
    options.s_nodes = options.m_nodes = 2;
    const LightField field = acquire(emitter, rig, {}, silent, options);
    EXPECT_NEAR(field.flux(), 1000, 5);
    // Distances count from S, which stands in front of the lens.
    const double sharp = p.focus - p.setback;
    const V2d half = p.slide_size * (0.5 * p.magnification());
    const double lit = irradiance(field, {0.5 * half.x, 0.5 * half.y, sharp});
    const double r2 = half.length2() * 0.25 + p.focus * p.focus;
    // For a small lens E = L π r² b² / R⁴, with the radiance of the clear part.
    const double clear = radiance_at(emitter, {0, 0}, half * 0.5, p.focus);
    const double expected = clear * std::acos(-1.0) * p.aperture * p.aperture * p.focus * p.focus / (r2 * r2);
    EXPECT_NEAR(lit / expected, 1, 0.03);
    for (const V2d& dim : {V2d(-1, 1), V2d(1, -1), V2d(-1, -1)})
        EXPECT_NEAR(irradiance(field, {0.5 * dim.x * half.x, 0.5 * dim.y * half.y, sharp}) / expected, 0.1,
                    0.03);
}

}  // namespace projector_test
}  // namespace lucerna
