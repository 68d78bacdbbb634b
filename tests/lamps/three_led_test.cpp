// The lamp with three LEDs: compares the irradiance that its light field casts on a wall with that of its own
// particles, counted there.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "engine/pbrt/read_scene.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_projection.h"
#include "photon/luminaire.h"

namespace lucerna {
namespace three_led_test {

RaySet rays_of_lamp(const Scene& scene, std::uint64_t seed, std::int64_t paths) {
    LuminaireParameters parameters;
    parameters.paths = paths;
    parameters.seed = seed;
    Monitor silent;
    return trace_rays(scene, parameters, FluxUnit::lumen, Workers{}, silent);
}

Scene read_lamp() {
    Monitor silent;
    return read_scene(std::string(LUCERNA_SOURCE_DIR) + "/scenes/lamps/three-led/three-led.pbrt", {},
                      Workers{}, silent)
        .scene;
}

// Returns a bench of setup B, coarse enough for a million rays.
Rig bench() {
    Rig rig;
    rig.views = {11, 11};
    rig.spacing = {0.0025, 0.0025};
    rig.pixels = {60, 60};
    rig.pixel = {0.02, 0.02};
    rig.distance = 0.75;
    return rig;
}

LightField field_of_rays(const RaySet& set) {
    FilterSums sums(bench());
    add_rays(sums, set.rays, Workers{});
    FilterImages images = images_of(sums, 1, {});
    images.flux = set.flux;
    return field_of(images);
}

// Returns the mean of (field - counted)² over the variance of both, over the pixels that receive many rays: 1
// if they agree, and less because stratified rays are less noisy.
double misfit(const PlaneIrradiance& field, const PlaneIrradiance& counted, double ray_flux, double scale = 1,
              int shift = 0) {
    const PlanePatch& patch = counted.patch;
    const double per_ray = ray_flux / patch.pixel_area();
    double sum = 0;
    int pixels = 0;
    for (int y = 0; y < patch.pixels.y; ++y) {
        for (int x = 0; x + shift < patch.pixels.x; ++x) {
            const double rays = counted.at(x, y) / per_ray;
            if (rays < 100) continue;
            const double difference = scale * field.at(x + shift, y) - counted.at(x, y);
            sum += difference * difference / (2 * rays * per_ray * per_ray);
            ++pixels;
        }
    }
    return pixels > 500 ? sum / pixels : INFINITY;
}

// The functions Φ̃⊗Φ̃ of all filters sum to 1 between the outermost, so on the plane M, in its own pixels,
// the field gives the mean irradiance without blur, and only noise remains.
TEST(ThreeLeds, Long_FieldOnItsOwnScreen_IsTheLuminairesLightWithinTheNoise) {
    const Scene lamp = read_lamp();
    constexpr std::int64_t kPaths = 1 << 20;
    const RaySet measured = rays_of_lamp(lamp, 1, kPaths);
    const RaySet other = rays_of_lamp(lamp, 2, kPaths);
    Monitor silent;
    const LightField field = field_of_rays(measured);
    const PlanePatch screen{0.75, {0, 0}, {1.2, 1.2}, {60, 60}};
    const PlaneIrradiance from_field = project(field, screen, Workers{}, silent);
    const PlaneIrradiance counted = project(other, screen);
    double squares = 0;
    double flux = 0;
    for (const LampRay& ray : other.rays) {
        squares += sqr(double{ray.flux});
        flux += double{ray.flux};
    }
    const double ray_flux = squares / flux;  // of nearly equal rays
    EXPECT_LT(misfit(from_field, counted, ray_flux), 1.15);
    EXPECT_GT(misfit(from_field, counted, ray_flux), 0.3);
    EXPECT_GT(misfit(from_field, counted, ray_flux, 1.1), 1.3);   // too bright
    EXPECT_GT(misfit(from_field, counted, ray_flux, 1, 1), 1.3);  // shifted by a pixel
    EXPECT_NEAR(from_field.flux() / counted.flux(), 1, 5e-3);
}

// Near the lamp the filters blur the field, but each LED's light stays in place.
TEST(ThreeLeds, FieldNearTheLamp_ShowsThreeSpotsWhereTheLuminaireHasThem) {
    const Scene lamp = read_lamp();
    Monitor silent;
    constexpr std::int64_t kPaths = 1 << 18;  // thousands of rays in each spot
    const LightField field = field_of_rays(rays_of_lamp(lamp, 1, kPaths));
    const RaySet other = rays_of_lamp(lamp, 2, kPaths);
    const double turn = 2 * 3.14159265358979 / 3;
    for (int led = 0; led < 3; ++led) {
        const double angle = 3.14159265358979 / 2 + led * turn;
        const V2d at(0.0075 * std::cos(angle), 0.0075 * std::sin(angle));
        const PlanePatch spot{0.02, at, {0.005, 0.005}, {1, 1}};
        const PlanePatch between{0.02, at * -0.9, {0.003, 0.003}, {1, 1}};
        const double bright = project(field, spot, Workers{}, silent).at(0, 0);
        EXPECT_NEAR(bright / project(other, spot).at(0, 0), 1, 0.1);
        EXPECT_GT(bright, 2 * project(field, between, Workers{}, silent).at(0, 0));
    }
}

}  // namespace three_led_test
}  // namespace lucerna
