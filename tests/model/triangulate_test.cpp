// Polygons cut into triangles, against the shoelace formula and the count of windings.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/model/model.h"

namespace lucerna::triangulate_test {

V3d area_of(const std::vector<V3d>& p) {
    V3d sum(0);
    for (std::size_t i = 0; i < p.size(); ++i) sum += p[i].cross(p[(i + 1) % p.size()]) / 2;
    return sum;
}

// Expects triangles that all face the polygon's side and are together as large as it. They then cover it
// once.
void expect_exact(const std::vector<V3d>& polygon) {
    const V3d whole = area_of(polygon);
    double sum = 0;
    for (const V3i& t : triangles_of_polygon(polygon)) {
        const auto at = [&](int i) { return polygon[static_cast<std::size_t>(i)]; };
        const V3d area = area_of({at(t.x), at(t.y), at(t.z)});
        EXPECT_GT(area.dot(whole), 0);
        sum += area.length();
    }
    EXPECT_NEAR(sum, whole.length(), 1e-9 * whole.length());
}

// Expects the same from each corner on, in both directions, far from the origin and in several planes.
void expect_exact_in_every_way(const std::vector<V2d>& polygon) {
    for (const double far : {0.0, -7.0, 1000.0}) {
        std::vector<V3d> corners;
        for (const V2d& p : polygon) corners.emplace_back(p.x + far, p.y - 2 * far, 0.3 * p.x + far);
        for (int turn = 0; turn < 6; ++turn) {
            for (V3d& p : corners) p = V3d(p.y, p.z, p.x);
            if (turn == 3) std::reverse(corners.begin(), corners.end());
            for (std::size_t first = 0; first < corners.size(); ++first) {
                std::rotate(corners.begin(), corners.begin() + 1, corners.end());
                expect_exact(corners);
            }
        }
    }
}

TEST(TrianglesOfPolygon, ConvexAndConcave_AreCoveredOnce) {
    expect_exact_in_every_way({{0, 0}, {4, 0}, {0, 3}});
    expect_exact_in_every_way({{0, 0}, {4, 0}, {4, 3}, {0, 3}});
    expect_exact_in_every_way({{0, 0}, {4, 0}, {1, 1}, {0, 3}});                  // an arrow
    expect_exact_in_every_way({{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 3}, {0, 3}});  // an L
    expect_exact_in_every_way({{0, 0},
                               {5, 0},
                               {5, 5},
                               {4, 5},
                               {4, 1},
                               {3, 1},
                               {3, 5},
                               {2, 5},
                               {2, 1},
                               {1, 1},
                               {1, 5},
                               {0, 5}});  // a comb
}

TEST(TrianglesOfPolygon, CornersOnAnEdge_AreNoHindrance) {
    expect_exact_in_every_way({{0, 0}, {1, 0}, {2, 0}, {4, 0}, {4, 3}, {2, 3}, {0, 3}});
    expect_exact_in_every_way({{0, 0}, {0, 0}, {4, 0}, {4, 3}, {4, 3}, {0, 3}});
}

// A square of 6 with a square hole of 2, and a cut to it that runs there and back.
TEST(TrianglesOfPolygon, HoleReachedByACut_StaysOpen) {
    expect_exact_in_every_way(
        {{0, 0}, {6, 0}, {6, 6}, {0, 6}, {0, 0}, {2, 2}, {2, 4}, {4, 4}, {4, 2}, {2, 2}});
}

TEST(TrianglesOfPolygon, RandomStars_AreCoveredOnce) {
    std::mt19937 dice(3);
    std::uniform_real_distribution<double> radius(0.2, 1);
    for (int i = 0; i < 50; ++i) {
        std::vector<V3d> star;
        const int corners = 4 + i;
        for (int c = 0; c < corners; ++c) {
            const double angle = 2 * M_PI * c / corners, r = radius(dice);
            star.emplace_back(r * std::cos(angle), 2, r * std::sin(angle));
        }
        expect_exact(star);
    }
}

TEST(TrianglesOfPolygon, WithoutArea_HasNone) {
    EXPECT_TRUE(triangles_of_polygon(std::vector<V3d>{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}).empty());
    EXPECT_TRUE(triangles_of_polygon(std::vector<V3d>(5, V3d(1))).empty());
}

// A polygon that crosses itself has no right answer; it ends all the same.
TEST(TrianglesOfPolygon, Crossing_Ends) {
    std::mt19937 dice(5);
    std::uniform_real_distribution<double> coordinate(-1, 1);
    std::vector<V3d> tangle;
    for (int i = 0; i < 300; ++i) tangle.emplace_back(coordinate(dice), coordinate(dice), coordinate(dice));
    EXPECT_EQ(triangles_of_polygon(tangle).size(), 298U);
}

}  // namespace lucerna::triangulate_test
