// The bodies of luminous openings: their projected areas, against integrals over their surfaces, and their
// names in photometric files.
#include "lights/luminous_opening.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "lights/photometric_files.h"
#include "tests/lights/field_fixtures.h"

namespace lucerna {
namespace luminous_opening_test {

using Shape = LuminousOpening::Shape;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ListeningMonitor;

// A surface as a list of small flat pieces, each given by its outward normal times its area.
using Surface = std::vector<V3d>;

constexpr int kSteps = 240;

// Adds the pieces between points of a parametrised surface; point() increases in both parameters
// counter-clockwise.
template <typename Point>
void add_surface(Surface& surface, Point&& point, int across) {
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < across; ++j) {
            const double u0 = double(i) / kSteps, u1 = double(i + 1) / kSteps;
            const double v0 = double(j) / across, v1 = double(j + 1) / across;
            const V3d a = point(u0, v0), b = point(u1, v0), c = point(u1, v1), d = point(u0, v1);
            surface.push_back(0.5 * (c - a).cross(d - b));
        }
    }
}

// Returns the closed surface of an elliptic cylinder along z with these diameters and this height.
Surface upright_cylinder(double x, double y, double z) {
    Surface surface;
    add_surface(
        surface,
        [&](double u, double v) {
            return V3d(0.5 * x * std::cos(2 * kPiD * u), 0.5 * y * std::sin(2 * kPiD * u), v * z);
        },
        1);
    for (const double side : {1.0, -1.0}) {
        add_surface(
            surface,
            [&](double u, double v) {
                return V3d(0.5 * v * x * std::cos(2 * kPiD * u), -side * 0.5 * v * y * std::sin(2 * kPiD * u),
                           0);
            },
            1);
    }
    return surface;
}

Surface ellipsoid(double x, double y, double z) {
    Surface surface;
    add_surface(
        surface,
        [&](double u, double v) {
            const double phi = 2 * kPiD * u, theta = kPiD * (1 - v);
            return V3d(0.5 * x * std::sin(theta) * std::cos(phi), 0.5 * y * std::sin(theta) * std::sin(phi),
                       0.5 * z * std::cos(theta));
        },
        kSteps);
    return surface;
}

// Returns the surface with its axes x, y and z mapped to those of `order`.
Surface turned(const Surface& surface, const std::array<int, 3>& order) {
    Surface other;
    for (const V3d& piece : surface) {
        V3d& turned = other.emplace_back();
        for (int i = 0; i < 3; ++i) turned[order[static_cast<std::size_t>(i)]] = piece[i];
    }
    return other;
}

// Returns the area of a convex body seen from a distant point in direction w: the pieces that face it.
double seen(const Surface& surface, const V3d& w) {
    double area = 0;
    for (const V3d& piece : surface) area += std::max(0.0, piece.dot(w));
    return area;
}

const std::vector<V3d>& directions() {
    static const std::vector<V3d> all = [] {
        std::vector<V3d> some{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
        for (int i = 0; i < 60; ++i) {
            const double z = (i + 0.5) / 30 - 1, phi = 2.399963 * i, r = std::sqrt(1 - z * z);
            some.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
        }
        return some;
    }();
    return all;
}

void expect_same(const LuminousOpening& opening, const Surface& surface) {
    for (const V3d& w : directions()) {
        const double area = seen(surface, w);
        EXPECT_NEAR(opening.projected_area(w), area, 3e-4 * opening.faces().second)
            << opening.name() << " seen along " << w;
    }
}

TEST(LuminousOpening, ProjectedArea_IsWhatIsSeenOfItsSurface) {
    // A cylinder's axis becomes x by a turn of all axes, and y by an exchange.
    const std::array<int, 3> along_x{1, 2, 0}, along_y{0, 2, 1};
    for (const V3d& s : {V3d(0.3, 0.7, 0.2), V3d(0.4, 0.4, 0.4), V3d(1.2, 0.1, 0.05)}) {
        expect_same({Shape::cylinder_upright, s}, upright_cylinder(s.x, s.y, s.z));
        expect_same({Shape::cylinder_along_c0, s}, turned(upright_cylinder(s.y, s.z, s.x), along_x));
        expect_same({Shape::cylinder_along_c90, s}, turned(upright_cylinder(s.x, s.z, s.y), along_y));
        expect_same({Shape::ellipsoid, s}, ellipsoid(s.x, s.y, s.z));
        Surface box;
        for (const double side : {1.0, -1.0}) {
            box.emplace_back(side * s.y * s.z, 0, 0);
            box.emplace_back(0, side * s.x * s.z, 0);
            box.emplace_back(0, 0, side * s.x * s.y);
        }
        expect_same({Shape::box, s}, box);
    }
    expect_same({Shape::cylinder_upright, V3d(0.3, 0.7, 0)}, upright_cylinder(0.3, 0.7, 0));
    expect_same({Shape::cylinder_along_c0, V3d(0, 0.3, 0.7)}, turned(upright_cylinder(0.3, 0.7, 0), along_x));
}

TEST(LuminousOpening, WrongShape_IsDetected) {
    const V3d s(0.3, 0.7, 0.2);
    const LuminousOpening box(Shape::box, s);
    double worst = 0;
    for (const V3d& w : directions())
        worst = std::max(worst, std::fabs(box.projected_area(w) - seen(ellipsoid(s.x, s.y, s.z), w)));
    EXPECT_GT(worst, 0.1 * box.faces().second);
}

// EULUMDAT gives four heights, one for each side: that of the side facing the viewer counts.
TEST(LuminousOpening, SidesOfDifferentHeights_AreSeenFromTheirSide) {
    const LuminousOpening box(Shape::box, 0.3, 0.6, {0.1, 0.02, 0.03, 0.04});
    const double r = std::sqrt(0.5);
    EXPECT_NEAR(box.projected_area({1, 0, 0}), 0.6 * 0.1, 1e-12) << "C0";
    EXPECT_NEAR(box.projected_area({0, -1, 0}), 0.3 * 0.02, 1e-12) << "C90";
    EXPECT_NEAR(box.projected_area({-1, 0, 0}), 0.6 * 0.03, 1e-12) << "C180";
    EXPECT_NEAR(box.projected_area({0, 1, 0}), 0.3 * 0.04, 1e-12) << "C270";
    EXPECT_NEAR(box.projected_area({r, -r, 0}), r * (0.6 * 0.1 + 0.3 * 0.02), 1e-12) << "C45";
    EXPECT_NEAR(box.projected_area({r, 0, r}), r * (0.6 * 0.1 + 0.3 * 0.6), 1e-12);
    const LuminousOpening round(Shape::cylinder_upright, 0.3, 0.3, {0.1, 0.02, 0.03, 0.04});
    EXPECT_NEAR(round.projected_area({1, 0, 0}), 0.3 * 0.1, 1e-12);
    EXPECT_NEAR(round.projected_area({0, 1, 0}), 0.3 * 0.04, 1e-12);
    EXPECT_NEAR(round.projected_area({r, -r, 0}), 0.3 * 0.06, 1e-12) << "C45: between C0 and C90";
    EXPECT_NEAR(round.projected_area({0, -r, r}), r * (0.3 * 0.02 + kPiD / 4 * 0.09), 1e-12);
}

std::string ies(const std::string& edition, const std::string& opening) {
    return edition + "\nTILT=NONE\n1 -1 1 2 1 1 2 " + opening + "\n1 1 9\n0 180\n0\n100 100\n";
}

LuminousOpening opening_of(const std::string& edition, const std::string& opening) {
    Monitor silent;
    return parse_ies(ies(edition, opening), "lamp.ies", silent).info().opening;
}

struct Case {
    const char* opening;  // width, length, height
    const char* name;
    V3d size;  // along C0 (the length), along C90, height
};

void expect_cases(const std::string& edition, const std::vector<Case>& cases) {
    for (const Case& c : cases) {
        const LuminousOpening opening = opening_of(edition, c.opening);
        EXPECT_EQ(opening.name(), c.name) << edition << ": " << c.opening;
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(opening.size[i], c.size[i], 1e-12) << edition << ": " << c.opening;
    }
}

TEST(LuminousOpening, SignsOf1995_NameItsShapes) {
    expect_cases("IESNA:LM-63-1995", {{".2 .4 0", "rectangle", {0.4, 0.2, 0}},
                                      {".2 .4 .1", "box", {0.4, 0.2, 0.1}},
                                      {"0 .4 .1", "rectangle", {0.4, 0, 0.1}},
                                      {"-.3 0 0", "disc", {0.3, 0.3, 0}},
                                      {"-.3 0 -.3", "sphere", {0.3, 0.3, 0.3}},
                                      {"-.3 0 .1", "upright cylinder", {0.3, 0.3, 0.1}},
                                      {"0 1.2 -.03", "cylinder lying along C0", {1.2, 0.03, 0.03}},
                                      {"1.2 0 -.03", "cylinder lying along C90", {0.03, 1.2, 0.03}},
                                      {"-.2 .4 .1", "upright elliptic cylinder", {0.4, 0.2, 0.1}},
                                      {".4 -.2 .1", "upright elliptic cylinder", {0.2, 0.4, 0.1}},
                                      {"-.2 .4 0", "ellipse", {0.4, 0.2, 0}},
                                      {"-.2 .4 -.1", "ellipsoid", {0.4, 0.2, 0.1}},
                                      {".4 -.2 -.1", "ellipsoid", {0.2, 0.4, 0.1}},
                                      {"-.3 -.3 0", "disc", {0.3, 0.3, 0}}});
}

TEST(LuminousOpening, SignsOf2002_NameItsShapes) {
    for (const char* edition : {"IESNA:LM-63-2002", "IES:LM-63-2019"}) {
        expect_cases(edition, {{".2 .4 0", "rectangle", {0.4, 0.2, 0}},
                               {".2 .4 .1", "box", {0.4, 0.2, 0.1}},
                               {"-.3 -.3 0", "disc", {0.3, 0.3, 0}},
                               {"-.2 -.4 0", "ellipse", {0.4, 0.2, 0}},
                               {"-.3 -.3 .1", "upright cylinder", {0.3, 0.3, 0.1}},
                               {"-.2 -.4 .1", "upright elliptic cylinder", {0.4, 0.2, 0.1}},
                               {"-.3 -.3 -.3", "sphere", {0.3, 0.3, 0.3}},
                               {"-.2 -.4 -.1", "ellipsoid", {0.4, 0.2, 0.1}},
                               {"-.03 1.2 -.03", "cylinder lying along C0", {1.2, 0.03, 0.03}},
                               {"-.03 1.2 -.1", "elliptic cylinder lying along C0", {1.2, 0.03, 0.1}},
                               {"1.2 -.03 -.03", "cylinder lying along C90", {0.03, 1.2, 0.03}},
                               {"1.2 -.03 -.1", "elliptic cylinder lying along C90", {0.03, 1.2, 0.1}},
                               {"-.3 0 -.3", "vertical disc", {0, 0.3, 0.3}},
                               {"-.3 0 -.1", "vertical ellipse", {0, 0.3, 0.1}},
                               {"-.3 0 0", "disc", {0.3, 0.3, 0}}});
    }
}

TEST(LuminousOpening, SignsOf1986And1991_NameTheirShapes) {
    for (const char* edition : {"a label", "IESNA91"}) {
        expect_cases(edition, {{".2 .4 .1", "box", {0.4, 0.2, 0.1}},
                               {"-.3 0 0", "disc", {0.3, 0.3, 0}},
                               {"-.3 0 .1", "upright cylinder", {0.3, 0.3, 0.1}},
                               {"-.2 .4 0", "ellipse", {0.4, 0.2, 0}},
                               {"-.2 .4 .1", "ellipsoid", {0.4, 0.2, 0.1}},
                               {"-.3 0 -.3", "sphere", {0.3, 0.3, 0.3}}});
    }
}

TEST(LuminousOpening, Feet_AreReadAsMetres) {
    Monitor silent;
    const PhotometricWeb web = parse_ies(
        "IESNA:LM-63-1995\nTILT=NONE\n1 -1 1 2 1 1 1 -2 0 0\n1 1 9\n0 180\n0\n100 100\n", "lamp.ies", silent);
    EXPECT_NEAR(web.info().opening.size.x, 0.6096, 1e-12);
}

TEST(LuminousOpening, SignsOfNoShape_AreWarnedOf) {
    for (const char* opening : {".2 .4 -.1", "0 0 -.1"}) {
        ListeningMonitor monitor;
        const PhotometricWeb web = parse_ies(ies("IESNA:LM-63-2002", opening), "lamp.ies", monitor);
        EXPECT_THAT(monitor.warnings, ElementsAre(HasSubstr("lamp.ies:3:")));
        EXPECT_EQ(web.info().opening.faces().second, 0);
    }
}

TEST(LuminousOpening, OfAnIesFile_IsReadBackTheSame) {
    Monitor silent;
    for (const char* opening :
         {".2 .4 0", ".2 .4 .1", "-.3 -.3 0", "-.2 -.4 0", "-.3 -.3 .1", "-.2 -.4 .1", "-.3 -.3 -.3",
          "-.2 -.4 -.1", "-.03 1.2 -.03", "1.2 -.03 -.1", "-.3 0 -.3", "0 0 0"}) {
        const PhotometricWeb web = parse_ies(ies("IESNA:LM-63-2002", opening), "lamp.ies", silent);
        const PhotometricWeb again = parse_ies(ies_text(web, "lamp"), "again.ies", silent);
        EXPECT_EQ(again.info().opening.shape, web.info().opening.shape) << opening;
        EXPECT_EQ(again.info().opening.size, web.info().opening.size) << opening;
    }
}

}  // namespace luminous_opening_test
}  // namespace lucerna
