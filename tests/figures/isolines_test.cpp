// Isolines of functions whose lines are known: planes, circles, saddles, holes.
#include "engine/figures/isolines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lucerna {
namespace isolines_test {

using Imath::V2d;

template <typename Of>
ValueGrid grid_of(int columns, int rows, Of&& of) {
    ValueGrid grid{columns, rows, {}};
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) grid.values.push_back(of(column, row));
    }
    return grid;
}

std::vector<Isoline> lines_at(const ValueGrid& grid, double level) {
    return isolines(grid, std::vector<double>{level});
}

// Returns twice the area, positive where the line runs clockwise as seen with y downwards.
double doubled_area(const Isoline& line) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < line.points.size(); ++i) sum += line.points[i].cross(line.points[i + 1]);
    return sum;
}

TEST(Isolines, OfAPlane_AreOneStraightLineEach) {
    const auto plane = [](double x, double y) { return 3 + 2 * x - 0.7 * y; };
    const ValueGrid grid = grid_of(12, 9, plane);
    for (const double level : {0.123, 4.0, 11.7, 20.0}) {
        const auto lines = lines_at(grid, level);
        ASSERT_EQ(lines.size(), 1U) << level;
        EXPECT_FALSE(lines[0].closed());
        for (const V2d& p : lines[0].points) EXPECT_NEAR(plane(p.x, p.y), level, 1e-12);
        for (const V2d& end : {lines[0].points.front(), lines[0].points.back()})
            EXPECT_TRUE(end.x == 0 || end.x == 11 || end.y == 0 || end.y == 8);
        // Greater values lie to the right on the screen: x grows, so the line runs upwards.
        EXPECT_LT(lines[0].points.back().y, lines[0].points.front().y);
    }
    EXPECT_TRUE(lines_at(grid, 100).empty());
    EXPECT_TRUE(lines_at(grid, -100).empty());
}

TEST(Isolines, OfARadialFunction_AreCirclesOfItsRadius) {
    const V2d centre(24.3, 19.8);
    const ValueGrid grid = grid_of(50, 40, [&](double x, double y) { return (V2d(x, y) - centre).length(); });
    for (const double radius : {2.5, 7.0, 15.2}) {
        const auto lines = lines_at(grid, radius);
        ASSERT_EQ(lines.size(), 1U);
        EXPECT_TRUE(lines[0].closed());
        // At this distance from the centre, linear interpolation of a length errs by 1 / (8 radius).
        for (const V2d& p : lines[0].points) EXPECT_NEAR((p - centre).length(), radius, 0.13 / (radius - 1));
        // The polygon lies inside the circle: its vertices by up to that error, and each chord of length c
        // loses c^3 / (12 radius), with c^2 <= 2.
        const double lost = kPiD * radius * radius - std::fabs(doubled_area(lines[0])) / 2;
        EXPECT_GT(lost, 0);
        EXPECT_LT(lost, 2 * kPiD * (1 / 8.0 + 2 / 12.0));
        EXPECT_LT(doubled_area(lines[0]), 0);  // what is greater is outside, to the right
    }
}

TEST(Isolines, OfAHill_GoRoundTheOtherWay) {
    const ValueGrid grid = grid_of(20, 20, [](double x, double y) { return -std::hypot(x - 9.2, y - 10.1); });
    const auto lines = lines_at(grid, -4);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_GT(doubled_area(lines[0]), 0);
}

// The lines of (x - a)(y - b) through the saddle cross at (a, b); above and below that level they separate
// the corners differently.
TEST(Isolines, AtASaddle_GoAsTheBilinearSurfaceDoes) {
    const ValueGrid grid = grid_of(2, 2, [](double x, double y) { return (x - 0.4) * (y - 0.3); });
    for (const double level : {0.02, -0.02}) {
        const auto lines = lines_at(grid, level);
        ASSERT_EQ(lines.size(), 2U);
        for (const Isoline& line : lines) {
            ASSERT_EQ(line.points.size(), 2U);
            // Both ends lie on one branch of the hyperbola: x - a has one sign.
            EXPECT_GT((line.points[0].x - 0.4) * (line.points[1].x - 0.4), 0) << level;
            for (const V2d& p : line.points) EXPECT_NEAR((p.x - 0.4) * (p.y - 0.3), level, 1e-12);
        }
    }
}

TEST(Isolines, WherePointsAreMissing_EndAndGoOnBehind) {
    ValueGrid grid = grid_of(11, 5, [](double, double y) { return y; });
    grid.values[2 * 11 + 5] = NAN;
    const auto lines = lines_at(grid, 1.5);
    ASSERT_EQ(lines.size(), 2U);
    double length = 0;
    for (const Isoline& line : lines) {
        length += std::fabs(line.points.front().x - line.points.back().x);
        for (const V2d& p : line.points) EXPECT_TRUE(p.x <= 4 || p.x >= 6);
    }
    EXPECT_DOUBLE_EQ(length, 8);  // of 10: two squares have lost a corner
    EXPECT_EQ(lines_at(grid, 0.5).size(), 1U);
}

// In a refined grid the lines of an even slope stay straight, and end at the edges of a cell without a value.
TEST(Isolines, OfARefinedGrid_EndAtTheEdgesOfAMissingCell) {
    constexpr int kParts = 4;
    for (const bool down : {false, true}) {
        ValueGrid grid = grid_of(11, 11, [&](int x, int y) { return down ? y : x; });
        grid.values[4 * 11 + 4] = NAN;
        const auto lines = lines_at(refined(grid, kParts), 4.2);
        ASSERT_EQ(lines.size(), 2U);
        double length = 0;
        for (const Isoline& line : lines) {
            length += (line.points.front() - line.points.back()).length() / kParts;
            for (const V2d& p : line.points) EXPECT_NEAR((down ? p.y : p.x) / kParts - 0.5, 4.2, 1e-12);
        }
        EXPECT_NEAR(length, 10, 1e-12);  // of 11 cells
        // Beside a corner of the missing cell, both neighbours have the slope's value.
        EXPECT_NEAR(grid.between(4.4, 4.6), down ? 4.6 : 4.4, 1e-12);
        EXPECT_TRUE(std::isnan(grid.between(4.4, 4.4)));
    }
}

// Every line is closed or ends at the border, for any values: noise has saddles everywhere, and integers have
// points exactly at the level.
TEST(Isolines, OfNoise_AreClosedOrEndAtTheBorder_AndLieOnTheLevel) {
    std::mt19937 generator(7);
    for (const bool whole : {false, true}) {
        std::uniform_real_distribution<double> number(0, 6);
        const ValueGrid grid = grid_of(40, 30, [&](int, int) {
            const double v = number(generator);
            return whole ? std::floor(v) : v;
        });
        const auto lines = isolines(grid, std::vector<double>{1, 3, 4});
        EXPECT_GT(lines.size(), 50U);
        for (const Isoline& line : lines) {
            for (const V2d& p : line.points) EXPECT_NEAR(grid.between(p.x, p.y), line.level, 1e-12);
            if (line.points.front() == line.points.back()) continue;
            for (const V2d& end : {line.points.front(), line.points.back()})
                EXPECT_TRUE(end.x == 0 || end.x == 39 || end.y == 0 || end.y == 29);
        }
    }
}

// Exchanging rows and columns, or the sign, does not change the position of any line.
TEST(Isolines, OfTheMirroredGrid_AreMirrored) {
    std::mt19937 generator(11);
    std::uniform_real_distribution<double> number(0, 1);
    const ValueGrid grid = grid_of(17, 13, [&](int, int) { return number(generator); });
    const ValueGrid mirrored = grid_of(13, 17, [&](int x, int y) { return grid.at(y, x); });
    const auto length = [](const std::vector<Isoline>& lines) {
        double sum = 0;
        for (const Isoline& line : lines) {
            for (std::size_t i = 0; i + 1 < line.points.size(); ++i)
                sum += (line.points[i + 1] - line.points[i]).length();
        }
        return sum;
    };
    EXPECT_NEAR(length(lines_at(grid, 0.5)), length(lines_at(mirrored, 0.5)), 1e-9);
    ValueGrid negative = grid;
    for (double& v : negative.values) v = -v;
    EXPECT_NEAR(length(lines_at(grid, 0.5)), length(lines_at(negative, -0.5)), 1e-9);
}

TEST(Isolines, OfOneRowOrNone_AreNone) {
    EXPECT_TRUE(lines_at(grid_of(9, 1, [](int x, int) { return x; }), 4.5).empty());
    EXPECT_TRUE(lines_at(ValueGrid{}, 1).empty());
}

TEST(Isolines, Levels_AreRoundAndInside) {
    EXPECT_THAT(isoline_levels({0, 500}, Scaling::linear), ::testing::ElementsAre(100, 200, 300, 400));
    EXPECT_THAT(isoline_levels({1, 100}, Scaling::logarithmic), ::testing::ElementsAre(2, 5, 10, 20, 50));
}

// --- smoothing ---

TEST(Smoothing, OfEvenValues_ChangesNothing) {
    ValueGrid grid = grid_of(20, 10, [](int, int) { return 300.0; });
    grid.values[57] = NAN;
    const std::vector<double> levels{100, 500};
    const ValueGrid smooth = smoothed_for(levels, grid, 2);
    for (std::size_t i = 0; i < grid.values.size(); ++i) {
        if (i == 57)
            EXPECT_TRUE(std::isnan(smooth.values[i]));
        else
            EXPECT_NEAR(smooth.values[i], 300, 1e-9);
    }
}

TEST(Smoothing, TakesNoiseOut_ByWhatAGaussianOfItsWidthMust) {
    std::mt19937 generator(3);
    std::normal_distribution<double> noise(0, 20);
    const ValueGrid grid = grid_of(200, 200, [&](int, int) { return 300 + noise(generator); });
    const ValueGrid smooth = smoothed_for(std::vector<double>{100, 500}, grid, 2);
    double sum = 0, squares = 0;
    for (int row = 10; row < 190; ++row) {
        for (int column = 10; column < 190; ++column) {
            sum += smooth.at(column, row);
            squares += sqr(smooth.at(column, row) - 300);
        }
    }
    EXPECT_NEAR(sum / (180 * 180), 300, 0.5);
    // Independent values keep 1 / (2 √π deviation) of their deviation; the estimate is good to 3 %.
    EXPECT_NEAR(std::sqrt(squares / (180 * 180)), 20 / (2 * std::sqrt(kPiD) * 2), 0.15);
}

TEST(Smoothing, OfALamp_IsHeldAtTwiceTheHighestLevel) {
    ValueGrid grid = grid_of(21, 21, [](int, int) { return 100.0; });
    grid.values[10 * 21 + 10] = 1e9;
    const std::vector<double> levels{200, 500};
    const ValueGrid smooth = smoothed_for(levels, grid, 1);
    EXPECT_LT(*std::max_element(smooth.values.begin(), smooth.values.end()), 300);
    EXPECT_EQ(smoothed_for(levels, grid, 0).values, grid.values);
}

}  // namespace isolines_test
}  // namespace lucerna
