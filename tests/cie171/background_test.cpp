// The background luminance of UGR tables: CIE 190:2010 derives it from the mean indirect illuminance E_WID of
// a standard room's walls, by tables of transfer factors. The path tracer must give the same. The tables are
// cited from [eulumdat-ugr 2026], for the room of 4H x 8H.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"

namespace lucerna {
namespace background_test {

// H = 2 m is the distance between the planes of the eyes and of the luminaires; there are 4 x 8 luminaires.
constexpr double kX = 8, kY = 16, kH = 2, kLumens = 1000;
constexpr double kWalls = 2 * kH * (kX + kY);

struct Reflectances {
    double ceiling, walls, floor;
    double from_floor, from_walls;  // F_T,FW and F_T,WW-1 of CIE 190's table 5
};

// Returns Φ_zL over Φ of a luminaire with a cosine intensity: F_GL of table 4, from the flux within 41.4, 60,
// 75.5 and 90 degrees.
double share_of_floor() {
    const auto within = [](double degrees) { return sqr(std::sin(degrees * kPiD / 180)); };
    return 0.280 * within(41.4) + 0.165 * within(60) + 0.499 * within(75.5) + 0.006;
}

std::string room(const Reflectances& of) {
    const auto face = [](double rho, const std::string& points) {
        return fmt::format(
            "Material \"diffuse\" \"rgb reflectance\" [{0} {0} {0}] Shape \"bilinearmesh\" "
            "\"point3 P\" [{1}]\n",
            rho, points);
    };
    std::string text =
        "Option \"string unit\" \"photometric\" Camera \"perspective\" Film \"rgb\" WorldBegin\n" +
        face(of.floor, "0 0 0 8 0 0 0 16 0 8 16 0") + face(of.ceiling, "0 0 2 8 0 2 0 16 2 8 16 2") +
        face(of.walls, "0 0 0 8 0 0 0 0 2 8 0 2") + face(of.walls, "0 16 0 8 16 0 0 16 2 8 16 2") +
        face(of.walls, "0 0 0 0 16 0 0 0 2 0 16 2") + face(of.walls, "8 0 0 8 16 0 8 0 2 8 16 2") +
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 8; ++j) {
            text += fmt::format(
                "AttributeBegin AreaLightSource \"diffuse\" \"float power\" {} Translate {} {} "
                "1.999 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 0.1 AttributeEnd\n",
                kLumens, 1 + 2 * i, 1 + 2 * j);
        }
    }
    return text;
}

// Returns the indirect illuminance averaged over all walls, by path tracing.
double indirect_of_walls(const Reflectances& of) {
    std::vector<CalculationSurface> walls;
    const auto add = [&walls](const V3d& corner, const V3d& u, const V3d& v) {
        CalculationSurface& wall = walls.emplace_back();
        wall.name = "wall";
        wall.corner = corner;
        wall.u = u;
        wall.v = v;
        wall.normal = wall.up = V3f(u.cross(v).normalized());
        wall.points = {static_cast<int>(u.length()), static_cast<int>(2 * v.length())};
    };
    add({0, 0, 0}, {0, 0, kH}, {kX, 0, 0});
    add({0, kY, 0}, {kX, 0, 0}, {0, 0, kH});
    add({0, 0, 0}, {0, kY, 0}, {0, 0, kH});
    add({kX, 0, 0}, {0, 0, kH}, {0, kY, 0});
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = 16;
    const IlluminanceReport report = illuminance_on(
        walls, read_scene_text(room(of), "scene.pbrt", {}, Workers{2}, silent), options, silent);
    double flux = 0;
    for (const SurfaceIlluminance& wall : report.surfaces) {
        const double area = wall.surface.u.cross(wall.surface.v).length();
        for (const PointIlluminance& point : wall.points)
            flux += point.indirect.value * area / static_cast<double>(wall.points.size());
    }
    return flux / kWalls;
}

double by_cie_190(const Reflectances& of) {
    const double floor = share_of_floor();
    return kLumens * 32 / kWalls * (floor * of.from_floor + (1 - floor) * of.from_walls);
}

TEST(Cie190, IndirectIlluminanceOfTheWalls_IsThatOfItsTables) {
    const Reflectances all[] = {{0.7, 0.5, 0.2, 0.115, 0.211},
                                {0.7, 0.3, 0.2, 0.106, 0.117},
                                {0.5, 0.5, 0.2, 0.100, 0.187},
                                {0.5, 0.3, 0.2, 0.093, 0.104},
                                {0.3, 0.3, 0.2, 0.081, 0.092}};
    for (const Reflectances& of : all) {
        const double ours = indirect_of_walls(of), expected = by_cie_190(of);
        std::cout << fmt::format("{}/{}/{}: {:.2f} lx, CIE 190 {:.2f} lx: {:+.1f} %, {:+.2f} of UGR\n",
                                 of.ceiling, of.walls, of.floor, ours, expected, 100 * (ours / expected - 1),
                                 8 * std::log10(expected / ours));
        // The tables have three digits and treat the luminaires as a uniform ceiling.
        EXPECT_NEAR(ours, expected, 0.06 * expected);
    }
    // The test must detect another room's reflectances.
    EXPECT_GT(std::fabs(indirect_of_walls(all[0]) / by_cie_190(all[2]) - 1), 0.06);
}

}  // namespace background_test
}  // namespace lucerna
