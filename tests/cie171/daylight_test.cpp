// CIE 171:2006, 5.4 (flux conservation), 5.5 (glass) and 5.9 to 5.14: daylight through openings. All values
// are daylight factors: percentages of the illuminance of a horizontal plane under the unobstructed sky.
#include <map>

#include "engine/photometry/daylight_factor.h"
#include "tests/cie171/case.h"
#include "tests/cie171/glass.h"

namespace lucerna::cie171 {
namespace daylight_test {

constexpr double kHorizontal = 10000;                        // lx, of every sky
constexpr double kGround = 0.3 / kPiD, kMask = 0.05 / kPiD;  // luminance for a horizontal illuminance of 1

// Returns the relative luminance of CIE S 011:2003, with gradation a, b and indicatrix c, d, e; type 16 is
// CIE's traditional overcast sky. The sun stands 60 degrees high towards +y, which the measured wall of 5.9
// faces.
double relative_luminance(int type, const V3d& w) {
    if (type == 5) return 1;
    if (type == 16) return (1 + 2 * w.z) / 3;
    const double sun = kPiD / 3;
    const auto sky = [&](double a, double b, double c, double d, double e) {
        const double chi = std::acos(std::clamp(w.y * std::cos(sun) + w.z * std::sin(sun), -1.0, 1.0));
        return (1 + a * std::exp(b / std::max(w.z, 1e-6))) *
               (1 + c * (std::exp(d * chi) - std::exp(d * kPiD / 2)) + e * std::pow(std::cos(chi), 2));
    };
    return type == 1 ? sky(4, -0.7, 0, -1, 0) : sky(-1, -0.32, 10, -3, 0.45);  // types 1 and 12
}

// A sky scaled to a horizontal illuminance of 1.
class Sky {
  public:
    explicit Sky(int type) : type_(type) {
        const int n = 400;
        double sum = 0;
        for (int i = 0; i < n; ++i) {
            const double theta = (i + 0.5) / n * kPiD / 2;
            for (int j = 0; j < n; ++j) {
                const double phi = (j + 0.5) / n * 2 * kPiD;
                sum += relative_luminance(type, {std::sin(theta) * std::cos(phi),
                                                 std::sin(theta) * std::sin(phi), std::cos(theta)}) *
                       std::sin(theta) * std::cos(theta);
            }
        }
        scale_ = 1 / (sum * (kPiD / 2 / n) * (2 * kPiD / n));
    }
    double luminance(const V3d& w) const { return scale_ * relative_luminance(type_, w); }
    Changes changes() const { return {{"cie-16", fmt::format("cie-{}", type_)}}; }

  private:
    int type_;
    double scale_;
};

struct Opening {
    V3d corner, u, v;  // a rectangle
    double area_of(double n) const { return u.length() * v.length() / (n * n); }
};
const Opening kRoof1{{1.5, 1.5, 3}, {1, 0, 0}, {0, 1, 0}}, kRoof4{{0, 0, 3}, {4, 0, 0}, {0, 4, 0}},
    kFacade2{{1, 0, 1}, {2, 0, 0}, {0, 0, 1}}, kFacade4{{0, 0, 0}, {4, 0, 0}, {0, 0, 3}};

// Returns the luminance seen from a point outwards through the opening, divided by the horizontal
// illuminance.
using Outside = std::function<double(const V3d& from, const V3d& w)>;

// Returns the illuminance in per cent by the midpoint rule over the opening.
double through(const Opening& opening, const V3d& p, const V3d& normal, const Outside& outside, bool glazed) {
    const int n = 500;
    const V3d across = opening.u.cross(opening.v).normalized();
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            const V3d way = opening.corner + (i + 0.5) / n * opening.u + (j + 0.5) / n * opening.v - p;
            const double d2 = way.length2();
            const V3d w = way / std::sqrt(d2);
            const double at_point = normal.dot(w), at_opening = std::fabs(across.dot(w));
            if (at_point <= 0) continue;
            const double part = at_point * at_opening / d2 * outside(p, w);
            sum += glazed ? part * glass(at_opening).unpolarised : part;
        }
    }
    return 100 * sum * opening.area_of(n);
}

Outside sky_and_ground(const Sky& sky) {
    return [&sky](const V3d&, const V3d& w) { return w.z > 0 ? sky.luminance(w) : kGround; };
}

struct Row {
    const char* surface;
    const char* names;  // each a letter and its apostrophes
    std::vector<double> published;
};

std::vector<Point> points_of(const IlluminanceReport& report, const std::vector<Row>& rows,
                             const Opening& opening, const Outside& outside, bool glazed) {
    std::vector<Point> points;
    for (const Row& row : rows) {
        const SurfaceIlluminance& found = surface(report, row.surface);
        for (int i = 0; i < found.surface.points.x; ++i) {
            const auto n = static_cast<std::size_t>(i);
            const std::string name =
                std::string(1, row.names[i]) + (std::string(row.surface) == "ceiling" ? "'" : "");
            points.push_back(
                {name,
                 through(opening, found.surface.position(i, 0), V3d(found.surface.normal), outside, glazed),
                 row.published.empty() ? kNone : row.published.at(n), found.at(i, 0).all});
        }
    }
    return points;
}

// Measures as `lucerna lux --daylight-factor` does.
IlluminanceReport measure_factors(Job job, int samples) {
    const double sky = sky_illuminance(job.scene);
    EXPECT_NEAR(sky, kHorizontal, 1e-4 * kHorizontal);
    return daylight_factors(measure(std::move(job), samples), sky);
}

// Tests a case with one sky; `precision` is the widest interval relative to the value.
void expect_case(const std::string& number, const std::string& file, int type, const Opening& opening,
                 bool glazed, int samples, double precision, double share, const std::vector<Row>& rows) {
    const Sky sky(type);
    const std::string title = fmt::format("{}, sky {}", number, type);
    const std::vector<Point> points = points_of(measure_factors(scene(file, sky.changes()), samples), rows,
                                                opening, sky_and_ground(sky), glazed);
    expect_as_published(title, 0.011, share, points);
    expect_as_stated(title, "% of E_hz", precision, points);
}

std::vector<Row> roof(std::vector<double> wall, std::vector<double> floor) {
    return {{"wall", "ABCDEF", std::move(wall)}, {"floor", "GHIJKLMN", std::move(floor)}};
}
std::vector<Row> facade(std::vector<double> wall, std::vector<double> floor, std::vector<double> ceiling) {
    return {{"wall", "ABCDEF", std::move(wall)},
            {"floor", "GHIJKLMN", std::move(floor)},
            {"ceiling", "GHIJKLMN", std::move(ceiling)}};
}

TEST(Cie171, Case54_FluxConservation) {
    const IlluminanceReport report = measure(scene("5.4-flux-conservation.pbrt"), 1);
    Reading95 flux;
    double derived = 0;  // by the midpoint rule over the sides, of the exact illuminance
    for (const SurfaceIlluminance& side : report.surfaces) {
        const double area = side.surface.u.length() * side.surface.v.length();
        flux.value += area * side.mean.value;
        flux.half_width += area * side.mean.half_width;
        for (int y = 0; y < side.surface.points.y; ++y) {
            for (int x = 0; x < side.surface.points.x; ++x) {
                const V3d way = V3d(2, 2, 1.5) - side.surface.position(x, y);
                derived += area / static_cast<double>(side.points.size()) * 1e4 / (4 * kPiD) *
                           way.dot(V3d(side.surface.normal)) / std::pow(way.length(), 3);
            }
        }
    }
    EXPECT_NEAR(derived, 1e4, 2);
    const std::vector<Point> points{{"flux", 1, 1, scaled(flux, 1e-4)}};
    expect_as_stated("5.4", "of the source's", 1e-3, points);
}

TEST(Cie171, Case55_Glass) {
    std::vector<Point> points;
    for (const int degrees : {0, 15, 30, 45, 60, 70, 75, 80}) {
        // Computes the mean over the disc, cosine-weighted like the sensor.
        const double theta = degrees * kPiD / 180;
        const int n = 400;
        double sum = 0, weight = 0;
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                const double r = (i + 0.5) / n, phi = (j + 0.5) / n * 2 * kPiD;
                const V3d at(r * std::cos(phi), r * std::sin(phi), 10);
                const V3d w = at.normalized();
                const double part = r * std::pow(w.z, 4);
                weight += part;
                sum += part * glass(std::fabs(w.z * std::cos(theta) - w.x * std::sin(theta))).unpolarised;
            }
        }
        const double open = kPiD * 1000 / 101;  // lx, without the plate: sin² = 1 / (1 + 10²)
        const IlluminanceReport report =
            measure(scene("5.5-glass.pbrt", {{"Rotate 0 ", fmt::format("Rotate {} ", degrees)}}), 48);
        points.push_back({fmt::format("{} degrees", degrees), sum / weight, kNone,
                          scaled(report.surfaces[0].points[0].all, 1 / open)});
    }
    expect_as_stated("5.5", "transmittance", 0.04, points);
    // Computes the error of neglecting polarisation.
    EXPECT_NEAR(glass(1).unpolarised, 0.88, 1e-3);
    EXPECT_NEAR(glass(0.5).unpolarised / glass(0.5).exact, 1, 0.015);
}

TEST(Cie171, Nightly_Case59_RoofOpening) {
    constexpr int kSamples = 256;
    // The published values are those of tables B.1 and B.2.
    expect_case("5.9, 1 x 1", "5.9-roof-1x1.pbrt", 5, kRoof1, false, kSamples, 0.04, 0.005,
                roof({1.04, 2.39, 2.59, 2.20, 1.70, 1.27}, {1.95, 2.52, 3.04, 3.37, 3.37, 3.04, 2.52, 1.95}));
    expect_case("5.9, 1 x 1", "5.9-roof-1x1.pbrt", 16, kRoof1, false, kSamples, 0.04, 0.005,
                roof({0.56, 1.78, 2.32, 2.20, 1.82, 1.43}, {2.29, 3.07, 3.82, 4.29, 4.29, 3.82, 3.07, 2.29}));
    expect_case("5.9, 1 x 1", "5.9-roof-1x1.pbrt", 1, kRoof1, false, kSamples, 0.04, 0.005,
                roof({0.46, 1.64, 2.34, 2.26, 1.88, 1.47}, {2.33, 3.11, 3.84, 4.29, 4.29, 3.84, 3.11, 2.33}));
    expect_case("5.9, 1 x 1", "5.9-roof-1x1.pbrt", 12, kRoof1, false, kSamples, 0.04, 0.005,
                roof({1.74, 3.76, 4.55, 4.61, 4.24, 3.63}, {5.72, 6.01, 5.12, 3.97, 2.90, 2.03, 1.40, 0.96}));
    // The published values are those of tables B.3 and B.4 except for A: 46.74, 39.28, 37.84 and 66.34 there
    // are 3.6 to 5.6 % more than the integral, and B up to 0.6 % more. For the same geometry, 5.6's table
    // agrees with the integral at B.
    expect_case("5.9, 4 x 4", "5.9-roof-4x4.pbrt", 5, kRoof4, false, kSamples / 8, 0.02, 0.006,
                roof({kNone, 36.05, 28.05, 21.67, 16.73, 12.98},
                     {26.80, 30.95, 33.99, 35.58, 35.58, 33.99, 30.95, 26.80}));
    expect_case("5.9, 4 x 4", "5.9-roof-4x4.pbrt", 16, kRoof4, false, kSamples / 8, 0.02, 0.006,
                roof({kNone, 32.32, 26.79, 21.78, 17.53, 14.05},
                     {31.36, 36.76, 40.71, 42.76, 42.76, 40.71, 36.76, 31.36}));
    expect_case("5.9, 4 x 4", "5.9-roof-4x4.pbrt", 1, kRoof4, false, kSamples / 8, 0.02, 0.006,
                roof({kNone, 31.72, 26.85, 22.10, 17.89, 14.38},
                     {31.87, 37.30, 41.27, 43.35, 43.35, 41.27, 37.30, 31.87}));
    expect_case("5.9, 4 x 4", "5.9-roof-4x4.pbrt", 12, kRoof4, false, kSamples / 8, 0.02, 0.006,
                roof({kNone, 54.33, 44.25, 36.10, 29.48, 24.25},
                     {42.33, 43.82, 43.54, 40.85, 35.92, 29.17, 22.62, 16.79}));
}

TEST(Cie171, Nightly_Case510_GlazedRoofOpening) {
    constexpr int kSamples = 384;
    // The published values are those of tables B.5 to B.8, without A of the larger opening, 32.66 and 29.21
    // there, as in 5.9.
    expect_case("5.10, 1 x 1", "5.10-glazed-roof-1x1.pbrt", 5, kRoof1, true, kSamples, 0.06, 0.05,
                roof({0.35, 1.69, 2.12, 1.87, 1.47, 1.11}, {1.71, 2.22, 2.68, 2.96, 2.96, 2.68, 2.22, 1.71}));
    expect_case("5.10, 1 x 1", "5.10-glazed-roof-1x1.pbrt", 16, kRoof1, true, kSamples, 0.06, 0.05,
                roof({0.19, 1.26, 1.90, 1.87, 1.57, 1.24}, {2.00, 2.70, 3.36, 3.78, 3.78, 3.36, 2.70, 2.00}));
    expect_case("5.10, 4 x 4", "5.10-glazed-roof-4x4.pbrt", 5, kRoof4, true, kSamples / 8, 0.03, 0.05,
                roof({kNone, 27.87, 22.92, 18.23, 14.31, 11.20},
                     {23.43, 27.12, 29.83, 31.25, 31.25, 29.83, 27.12, 23.43}));
    expect_case("5.10, 4 x 4", "5.10-glazed-roof-4x4.pbrt", 16, kRoof4, true, kSamples / 8, 0.03, 0.05,
                roof({kNone, 25.63, 22.14, 18.43, 15.03, 12.15},
                     {27.44, 32.23, 35.73, 37.56, 37.56, 35.73, 32.23, 27.44}));
}

TEST(Cie171, Nightly_Case511_FacadeOpening) {
    constexpr int kSamples = 384;
    // The published values are those of tables B.9 to B.11.
    const std::vector<double> ceiling2{0.38, 0.53, 0.75, 1.08, 1.56, 2.14, 2.40, 1.24};
    expect_case("5.11, 2 x 1", "5.11-facade-2x1.pbrt", 5, kFacade2, false, kSamples, 0.06, 0.005,
                facade({0.95, 1.06, 1.79, 3.09, 3.54, 3.17}, {1.27, 1.75, 2.49, 3.59, 5.19, 7.11, 7.99, 4.13},
                       ceiling2));
    expect_case("5.11, 2 x 1", "5.11-facade-2x1.pbrt", 16, kFacade2, false, kSamples, 0.06, 0.005,
                facade({0.95, 1.06, 1.28, 1.71, 2.06, 2.14}, {0.95, 1.38, 2.07, 3.19, 4.97, 7.42, 9.11, 5.04},
                       ceiling2));
    // The published values are those of tables B.12 to B.14; they agree to 0.5 % except for A, C, D, F of the
    // uniform sky and the points next to the facade.
    const std::vector<double> ceiling4{1.74, 2.29, 3.06, 4.14, 5.63, 7.65, 10.27, 13.59};
    expect_case("5.11, 4 x 3", "5.11-facade-4x3.pbrt", 5, kFacade4, false, kSamples / 4, 0.06, 0.04,
                facade({6.43, 8.96, 11.11, 13.47, 14.57, 15.17},
                       {5.79, 7.63, 10.20, 13.78, 18.76, 25.50, 34.24, 45.29}, ceiling4));
    expect_case("5.11, 4 x 3", "5.11-facade-4x3.pbrt", 16, kFacade4, false, kSamples / 4, 0.06, 0.04,
                facade({5.29, 6.46, 7.67, 8.88, 9.73, 10.29},
                       {4.50, 6.15, 8.53, 12.00, 16.97, 23.91, 33.08, 44.43}, ceiling4));
}

TEST(Cie171, Nightly_Case512_GlazedFacadeOpening) {
    constexpr int kSamples = 512;
    // The published values are those of tables B.15 to B.20.
    const std::vector<double> ceiling2{0.33, 0.46, 0.65, 0.94, 1.34, 1.80, 1.85, 0.53};
    expect_case("5.12, 2 x 1", "5.12-glazed-facade-2x1.pbrt", 5, kFacade2, true, kSamples, 0.08, 0.05,
                facade({0.84, 0.94, 1.58, 2.72, 3.12, 2.79}, {1.11, 1.54, 2.18, 3.13, 4.47, 6.00, 6.17, 1.75},
                       ceiling2));
    const std::vector<double> ceiling4{1.52, 2.00, 2.66, 3.57, 4.80, 6.36, 8.09, 9.55};
    expect_case("5.12, 4 x 3", "5.12-glazed-facade-4x3.pbrt", 16, kFacade4, true, kSamples / 4, 0.08, 0.05,
                facade({4.65, 5.69, 6.75, 7.82, 8.56, 9.04},
                       {3.94, 5.36, 7.41, 10.34, 14.42, 19.74, 25.70, 30.40}, ceiling4));
}

TEST(Cie171, Case513_HorizontalMask) {
    const Sky sky(5);
    // The published values are those of tables B.21 to B.23.
    const std::pair<double, std::vector<double>> table[] = {
        {0.5, {1.27, 1.75, 2.49, 3.59, 5.19, 7.11, 7.13, 0.21}},
        {1, {1.27, 1.75, 2.49, 3.59, 4.82, 5.42, 3.63, 0.21}},
        {2, {1.21, 1.50, 1.86, 2.24, 2.44, 1.73, 0.40, 0.21}}};
    // The mask emits what it reflects, so that the scene has a light beside the sky.
    for (const auto& [depth, published] : table) {
        Changes changes = sky.changes();
        changes.emplace_back("-0.5 3", fmt::format("{} 3", -depth));
        const Outside outside = [&, depth = depth](const V3d& from, const V3d& w) {
            const double y = from.y + w.y * (3 - from.z) / w.z;  // where the ray crosses the mask's height
            return y > -depth ? kMask : sky.luminance(w);
        };
        const std::string title = fmt::format("5.13, {} m, sky 5", depth);
        const std::vector<Point> points = points_of(
            daylight_factors(measure(scene("5.13-horizontal-mask.pbrt", changes), 192), kHorizontal),
            {{"floor", "ABCDEFGH", published}}, kFacade2, outside, false);
        expect_as_published(title, 0.011, 0.005, points);
        expect_as_stated(title, "% of E_hz", 0.06, points);
    }
}

TEST(Cie171, Case514_VerticalMask) {
    const Sky sky(5);
    // The published values are those of table B.24 from point C on, from which the mask is not visible. There
    // are none for 6 and 9 m, because tables B.25 and B.26 are in error.
    const std::pair<int, std::vector<double>> table[] = {
        {3, {kNone, kNone, 2.49, 3.59, 5.19, 7.11, 7.99, 4.13}}, {6, {}}, {9, {}}};
    for (const auto& [height, published] : table) {
        Changes changes = sky.changes();
        changes.emplace_back("-6 3", fmt::format("-6 {}", height));
        const Outside outside = [&, height = height](const V3d& from, const V3d& w) {
            const double z = from.z + w.z * (-6 - from.y) / w.y;  // where the ray crosses the mask
            return z < height ? 0 : sky.luminance(w);
        };
        const std::string title = fmt::format("5.14, {} m, sky 5", height);
        const std::vector<Point> points =
            points_of(measure_factors(scene("5.14-vertical-mask.pbrt", changes), 192),
                      {{"floor", "ABCDEFGH", published}}, kFacade2, outside, false);
        expect_as_published(title, 0.011, 0.005, points);
        expect_as_stated(title, "% of E_hz", 0.06, points);
    }
}

}  // namespace daylight_test
}  // namespace lucerna::cie171
