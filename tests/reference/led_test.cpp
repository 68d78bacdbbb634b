// Tests the irradiance of a measured LED on a near plane, which shows the chip, and a far one, which shows
// the lobe.
#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "lights/cell_table.h"
#include "lights/measured.h"
#include "lights/measurement/ray_projection.h"
#include "tests/support/scenes.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace led_test {

constexpr int kPixels = 16;

// Returns the irradiance in lm/m² on the plane z = height, pixel by pixel over [-half, half]², from the rays
// themselves.
Image bin_rays(const RaySet& rays, double height, double half) {
    Image image = Image::rgb(kPixels, kPixels);
    const double pixel_area = sqr(2 * half / kPixels);
    for (const LampRay& ray : rays.rays) {
        if (!(ray.d.z > 0)) continue;
        const double t = (height - static_cast<double>(ray.o.z)) / static_cast<double>(ray.d.z);
        const double x = static_cast<double>(ray.o.x) + t * static_cast<double>(ray.d.x);
        const double y = static_cast<double>(ray.o.y) + t * static_cast<double>(ray.d.y);
        const double column = (x / half + 1) / 2 * kPixels;
        const double row = (1 - y / half) / 2 * kPixels;
        if (!(column >= 0 && column < kPixels && row >= 0 && row < kPixels)) continue;
        image.value(static_cast<int>(column), static_cast<int>(row), 0) +=
            static_cast<float>(static_cast<double>(ray.flux) / pixel_area);
    }
    return image;
}

// Renders the same: a diffuse plane seen from behind the lamp, which does not hide it.
Image render_plane(const LightField& field, double height, double half) {
    Monitor silent;
    testing::SceneMaker make;
    const auto size = static_cast<float>(half);
    const auto z = static_cast<float>(height);
    make.quad({-2 * size, -2 * size, z}, {0, 4 * size, 0}, {4 * size, 0, 0}, make.diffuse(Rgb(1.0F)));
    make.light(make_measured_light(field, CellTable(field, Workers{}, silent), {}, silent));
    Camera::Settings camera;
    camera.kind = Camera::Settings::Kind::orthographic;
    // Image columns run with x, rows against y; the camera is behind the lamp.
    camera.world_from_camera = M44d(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -10 * half, 1);
    camera.screen[0] = camera.screen[2] = -size;
    camera.screen[1] = camera.screen[3] = size;
    camera.width = camera.height = kPixels;
    const Job job = testing::make_job(make.build(), Camera(camera), DirectSettings{}, 1024);
    return render(job, {1, Workers{}}, silent).image;
}

struct Pattern {
    V2d centroid;  // metres
    double width;  // root mean square distance from it, metres
    double flux;
};

template <typename Value>
Pattern measure(double half, Value&& value) {
    Pattern p{V2d(0, 0), 0, 0};
    const auto place = [&](int x, int y) {
        return V2d((2 * (x + 0.5) / kPixels - 1) * half, (1 - 2 * (y + 0.5) / kPixels) * half);
    };
    const auto each = [&](auto&& f) {
        for (int y = 0; y < kPixels; ++y) {
            for (int x = 0; x < kPixels; ++x) f(place(x, y), value(x, y));
        }
    };
    each([&](const V2d& at, double v) { p.flux += v, p.centroid += at * v; });
    p.centroid /= p.flux;
    each([&](const V2d& at, double v) { p.width += (at - p.centroid).length2() * v; });
    p.width = std::sqrt(p.width / p.flux);
    return p;
}

TEST(MeasuredLed, NearThePlaneShowsTheChip_FarItShowsTheLobe) {
    LUCERNA_NEED_DATA(file, "osram-ostar-green-100k.tm25ray");
    Monitor silent;
    const RaySet rays = read_rays(file, silent);
    ASSERT_EQ(rays.rays.size(), 100'000U);
    const Projection projection = fit_light_field(rays, {}, Workers{}, silent);
    struct Case {
        double height, half, centroid, width;  // metres; the last two are tolerances
    };
    // Near, the tolerances are below a filter's width (0.26 mm); far, 2 % of the image's half width.
    for (const Case& c : {Case{0.0001, 0.003, 1e-4, 2e-4}, Case{1, 1.5, 0.03, 0.03}}) {
        const Image binned = bin_rays(rays, c.height, c.half);
        const Image rendered = render_plane(projection.field, c.height, c.half);
        const Pattern expected =
            measure(c.half, [&](int x, int y) { return static_cast<double>(binned.value(x, y, 0)); });
        const Pattern seen = measure(c.half, [&](int x, int y) {
            return static_cast<double>(kPi * luminance(rendered.rgb_at(x, y)));
        });
        EXPECT_NEAR(seen.centroid.x, expected.centroid.x, c.centroid) << "at " << c.height << " m";
        EXPECT_NEAR(seen.centroid.y, expected.centroid.y, c.centroid) << "at " << c.height << " m";
        EXPECT_NEAR(seen.width, expected.width, c.width) << "at " << c.height << " m";
        EXPECT_NEAR(seen.flux / expected.flux, 1, 0.03) << "at " << c.height << " m";
        std::cout << "at " << c.height << " m: centroid " << 1e3 * seen.centroid.x << " "
                  << 1e3 * seen.centroid.y << " mm (rays " << 1e3 * expected.centroid.x << " "
                  << 1e3 * expected.centroid.y << "), width " << 1e3 * seen.width << " mm (rays "
                  << 1e3 * expected.width << "), flux ratio " << seen.flux / expected.flux << "\n";
    }
}

}  // namespace led_test
}  // namespace lucerna
