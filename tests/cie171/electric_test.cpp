// CIE 171:2006, 5.2 to 5.8: electric light and diffuse reflection.
#include "tests/cie171/case.h"

namespace lucerna::cie171 {
namespace electric_test {

const V3d kUp(0, 0, 1), kNorth(0, 1, 0), kDown(0, 0, -1);

// Returns the points of a surface that has a single row of them.
std::vector<Point> row(const SurfaceIlluminance& found, const std::string& names,
                       const std::function<double(const V3d&)>& derived, const std::vector<double>& published,
                       const std::function<Reading95(const PointIlluminance&)>& computed) {
    std::vector<Point> points;
    for (int i = 0; i < found.surface.points.x; ++i) {
        const auto n = static_cast<std::size_t>(i);
        points.push_back({names.substr(n, 1), derived(found.surface.position(i, 0)), published.at(n),
                          computed(found.at(i, 0))});
    }
    return points;
}
std::vector<Point> joined(std::vector<Point> a, const std::vector<Point>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}
Reading95 all(const PointIlluminance& parts) {
    return parts.all;
}

TEST(Cie171, Case52_PointSource) {
    const IlluminanceReport report = measure(scene("5.2-point-source.pbrt"), 4);
    const SurfaceIlluminance& plane = surface(report, "plane");
    // The published values are those of table 11.
    const struct {
        const char* name;
        int x, y;
        double lx;
    } table[] = {{"A", 0, 0, 111.11}, {"B", 1, 0, 105.21}, {"C", 2, 0, 90.02}, {"D", 3, 0, 71.11},
                 {"E", 1, 1, 99.73},  {"F", 2, 1, 85.64},  {"G", 3, 1, 68.06}, {"H", 2, 2, 74.36},
                 {"I", 3, 2, 59.98},  {"J", 3, 3, 49.39}};
    std::vector<Point> points;
    for (const auto& at : table) {
        const V3d p = plane.surface.position(at.x, at.y);
        const double d2 = p.x * p.x + p.y * p.y + 9;
        points.push_back({at.name, 1000 * 9 / (d2 * d2), at.lx, plane.at(at.x, at.y).all});
    }
    expect_as_published("5.2", 0.005, 0.0005, points);
    expect_as_stated("5.2", "lx", 1e-3, points);
}

TEST(Cie171, Case53_AreaSource) {
    const IlluminanceReport report = measure(scene("5.3-area-source.pbrt"), 24);
    const std::vector<V3d> source{{1.5, 1.5, 3}, {2.5, 1.5, 3}, {2.5, 2.5, 3}, {1.5, 2.5, 3}};
    const auto lx = [&](const V3d& normal) {
        return [&, normal](const V3d& p) { return 1000 * kPiD * factor(p, normal, source); };
    };
    // The published values are those of table 12.
    const std::vector<Point> points = joined(
        row(surface(report, "wall"), "ABCDEF", lx(kNorth), {32.68, 75.09, 81.38, 69.12, 53.41, 39.90}, all),
        row(surface(report, "floor"), "GHIJKLMN", lx(kUp),
            {61.27, 79.18, 95.52, 105.89, 105.89, 95.52, 79.18, 61.27}, all));
    expect_as_published("5.3", 0.005, 0.003, points);
    expect_as_stated("5.3", "lx", 0.01, points);
}

TEST(Cie171, Case56_DiffuseReflection) {
    const IlluminanceReport report = measure(scene("5.6-diffuse-reflection.pbrt"), 48);
    const std::vector<V3d> floor{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}};
    const auto percent = [&](const V3d& normal) {
        return [&, normal](const V3d& p) { return 100 * factor(p, normal, floor); };
    };
    const auto indirect = [](const PointIlluminance& parts) {
        return scaled(parts.indirect, 100 / (10000 * 0.3));
    };
    // The published values are those of table 17.
    const std::vector<Point> points =
        joined(row(surface(report, "wall"), "BCDEF", percent(kNorth),
                   {35.901, 27.992, 21.639, 16.716, 12.967}, indirect),
               row(surface(report, "ceiling"), "GHIJKLMN", percent(kDown),
                   {26.80, 30.94, 33.98, 35.57, 35.57, 33.98, 30.94, 26.80}, indirect));
    expect_as_published("5.6", 0.01, 0, points);
    expect_as_stated("5.6", "% of E_hz rho", 0.01, points);
}

TEST(Cie171, Case57_DiffuseReflectionWithObstruction) {
    const IlluminanceReport report = measure(scene("5.7-obstruction.pbrt"), 224);
    // Computes the height from which the wall y = 4 is visible above the box, over the edge that hides more
    // of it.
    const auto percent = [](const V3d& normal) {
        return [normal](const V3d& p) {
            double lowest = 0;
            for (const double edge : {2.5, 2.7})
                lowest = std::max(lowest, p.z + (1 - p.z) * (4 - p.y) / (edge - p.y));
            if (lowest >= 3) return 0.0;
            return 100 * factor(p, normal, {{0, 4, lowest}, {4, 4, lowest}, {4, 4, 3}, {0, 4, 3}});
        };
    };
    const auto indirect = [](const PointIlluminance& parts) {
        return scaled(parts.indirect, 100 / (10000 * 0.6));
    };
    // The published values are those of [Dau 2016, Table 14], which replaces Table 19, because that is in
    // error.
    const std::vector<Point> points =
        joined(row(surface(report, "wall"), "ABCDEF", percent(kNorth),
                   {16.07, 16.33, 15.40, 13.32, 10.32, 7.08}, indirect),
               row(surface(report, "floor"), "GHIJK", percent(kUp), {3.38, 3.63, 3.01, 0, 0}, indirect));
    expect_as_published("5.7", 0.006, 0, points);
    expect_as_stated("5.7", "% of E_v rho", 0.015, points);
}

TEST(Cie171, Case58_ReflectedComponent) {
    // The published values are those of table 20.
    const std::pair<double, double> table[] = {{0.05, 5.48}, {0.1, 11.6}, {0.2, 26.0}, {0.3, 44.6},
                                               {0.4, 69.4},  {0.5, 104},  {0.6, 156},  {0.7, 243},
                                               {0.8, 417},   {0.9, 937},  {0.95, 1979}};
    std::vector<Point> points;
    for (const auto& [rho, published] : table) {
        const IlluminanceReport report = measure(
            scene("5.8-reflected-component.pbrt", {{"[ 0.5 0.5 0.5 ]", fmt::format("[ {0} {0} {0} ]", rho)}}),
            2);
        const SurfaceIlluminance& floor = report.surfaces[0];
        points.push_back({fmt::format("rho = {}", rho),
                          rho * 1e4 / (96 * (1 - rho)),
                          published,
                          {floor.mean.value - floor.direct, floor.mean.half_width}});
    }
    expect_as_published("5.8", 0.6, 0, points);
    expect_as_stated("5.8", "lx", 0.01, points);
}

}  // namespace electric_test
}  // namespace lucerna::cie171
