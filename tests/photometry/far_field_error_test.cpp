// The error of the far field where it is known: nearly zero far from a small lamp.
#include "engine/photometry/far_field_error.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "lights/light_field.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace far_field_error_test {

// A disc of 3 mm in a field with negative coefficients along its edge, and points around its axis.
class OfASmallLamp : public ::testing::Test {
  protected:
    testing::TemporaryFolder folder;
    LightField field = made();

    static LightField made() {
        Rig rig;
        rig.views = {13, 13};
        rig.spacing = {0.0004, 0.0004};
        rig.pixels = {24, 24};
        rig.pixel = {0.002, 0.002};
        rig.distance = 0.01;
        EmitterModel disc = cosine_emitter(EmitterModel::Outline::disc, V2d(0.0015), 100);
        disc.info.unit = FluxUnit::lumen;
        Monitor silent;
        return acquire(disc, rig, Workers{2}, silent);
    }

    IlluminanceReport measure(double distance, const FarFieldOf& far_field, std::uint64_t seed) {
        const auto file = folder / "lamp.exr";
        write_light_field(file, field);
        SceneOverrides overrides;
        overrides.far_field = far_field;
        Monitor silent;
        Job job = read_scene_text(
            "Option \"string unit\" \"photometric\" Camera \"perspective\" Film \"rgb\" WorldBegin\n"
            "LightSource \"lightfield\" \"string filename\" \"" +
                file.string() + "\"\n",
            "scene.pbrt", overrides, Workers{2}, silent);
        CalculationSurface plane;
        plane.name = "plane";
        plane.corner = {-0.3 * distance, -0.3 * distance, distance};
        plane.u = {0, 0.6 * distance, 0};
        plane.v = {0.6 * distance, 0, 0};
        plane.normal = plane.up = {0, 0, -1};
        plane.points = {3, 3};
        IlluminanceOptions options;
        options.workers = {2};
        options.most_samples = 256;
        options.seed = seed;
        return illuminance_on(std::vector{plane}, std::move(job), options, silent);
    }

    struct Found {
        FarFieldError error;
        double floor;
    };
    Found error_at(double distance, bool as_rendered) {
        FarFieldGrid grid;
        grid.as_rendered = as_rendered;
        Monitor silent;
        PhotometricWeb web = far_field(field, grid, Workers{2}, silent);
        web.set_opening({});
        const auto same = [&](const std::filesystem::path&) { return web; };
        return {far_field_errors(measure(distance, {}, 1), measure(distance, same, 2)).at(0),
                web.info().grid_error};
    }
};

TEST_F(OfASmallLamp, Long_FarAway_IsNoMoreThanTheFloor) {
    const Found far = error_at(2, true);
    EXPECT_GT(far.floor, 0);
    EXPECT_LT(far.floor, 0.01);
    EXPECT_LT(std::fabs(far.error.mean.value), far.floor + 2 * far.error.mean.half_width);
    EXPECT_LT(far.error.mean.half_width, 1e-3);
    // Unclamped measured coefficients describe another radiance than the rendered one.
    const Found measured = error_at(2, false);
    EXPECT_GT(std::fabs(measured.error.mean.value), far.floor + 4 * measured.error.mean.half_width);
}

// On the axis of a disc of radius r, E = Φ/π / (r² + z²), so the error is (r/z)².
TEST_F(OfASmallLamp, Long_NearBy_IsItsClosedForm) {
    const double z = 0.02;
    const Found near = error_at(z, true);
    EXPECT_NEAR(near.error.points[4].value, std::pow(0.0015 / z, 2), near.floor + 2e-3);
}

// On the axis of an evenly bright rectangle E is four times the closed form of a corner's; the lamp's field
// is Lambertian, so its far field on the opening is that of the rectangle which its file states.
TEST_F(OfASmallLamp, Long_FromTheOpening_IsAnEvenRectangle) {
    const double z = 0.006;
    FarFieldGrid grid;
    grid.as_rendered = true;
    Monitor silent;
    PhotometricWeb web = far_field(field, grid, Workers{2}, silent);
    const V3d size = web.info().opening.size;
    const auto on_axis = [&] {
        const auto same = [&](const std::filesystem::path&) { return web; };
        return measure(z, same, 2).surfaces.at(0).points.at(4).all.value;
    };
    const double from_opening = on_axis();
    web.set_opening({});
    const double from_point = on_axis();
    const double x = 0.5 * size.x / z, y = 0.5 * size.y / z;
    const double rx = std::hypot(1, x), ry = std::hypot(1, y);
    const double corner = 0.5 * (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry));
    EXPECT_NEAR(from_opening / from_point, corner / (x * y), 3e-3);
}

TEST(FarFieldText, HasTheDigitsOfSmallErrorsAndTheFloor) {
    FarFieldError error;
    error.surface = "desk";
    error.mean = error.least = error.greatest = {1.2e-6, 3e-7};
    error.rms = 1.2e-6;
    FarFieldErrors errors{{error}, {}, 4e-5};
    EXPECT_EQ(far_field_text(errors).find("luminous opening"), std::string::npos) << "not computed";
    errors.from_opening = {error};
    const std::string text = far_field_text(errors);
    EXPECT_NE(text.find("from a point"), std::string::npos) << text;
    EXPECT_NE(text.find("from the luminous opening"), std::string::npos) << text;
    EXPECT_NE(text.find("mean +0.000120 ± 0.000030 %"), std::string::npos) << text;
    EXPECT_NE(text.find("floor of the method"), std::string::npos) << text;
    EXPECT_NE(text.find("0.004 %"), std::string::npos) << text;
}

}  // namespace far_field_error_test
}  // namespace lucerna
