#include "engine/photometry/room.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/pbrt/read_scene.h"

namespace lucerna {
namespace room_test {

Job scene_of(const std::string& world) {
    Monitor silent;
    return read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + world, "scene.pbrt", {},
                           Workers{2}, silent);
}

// Returns an upright rectangle between two points of the plan, z upwards.
std::string upright(const V2d& a, const V2d& b, double low = 0, double high = 3) {
    return fmt::format(
        "Shape \"bilinearmesh\" \"point3 P\" [{0} {1} {4} {2} {3} {4} {0} {1} {5} {2} {3} {5}]\n", a.x, a.y,
        b.x, b.y, low, high);
}
std::string level(const V2d& a, const V2d& b, double z) {
    return fmt::format(
        "Shape \"bilinearmesh\" \"point3 P\" [{0} {1} {4} {2} {1} {4} {0} {3} {4} {2} {3} {4}]\n", a.x, a.y,
        b.x, b.y, z);
}
std::string box(const V2d& a, const V2d& b, double low, double high) {
    return upright(a, {b.x, a.y}, low, high) + upright({b.x, a.y}, b, low, high) +
           upright(b, {a.x, b.y}, low, high) + upright({a.x, b.y}, a, low, high) + level(a, b, low) +
           level(a, b, high);
}
std::string shell(const std::vector<V2d>& corners) {
    std::string world = level({-20, -20}, {20, 20}, 0) + level({-20, -20}, {20, 20}, 3);
    for (std::size_t i = 0; i < corners.size(); ++i)
        world += upright(corners[i], corners[(i + 1) % corners.size()]);
    return world;
}

std::vector<double> widths(const Room& room) {
    std::vector<double> found;
    for (const Wall& wall : room.walls()) found.push_back(wall.width());
    std::sort(found.begin(), found.end());
    return found;
}

using ::testing::DoubleNear;
using ::testing::ElementsAre;

TEST(Room, OfFourWalls_HasThem) {
    const Job job = scene_of(shell({{0, 0}, {8, 0}, {8, 5}, {0, 5}}));
    const auto room = Room::around(job.scene, std::vector<V3d>{{4, 2, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_NEAR(room->floor(), 0, 1e-5);
    EXPECT_NEAR(room->ceiling(), 3, 1e-5);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(5, 1e-3), DoubleNear(5, 1e-3), DoubleNear(8, 1e-3),
                                           DoubleNear(8, 1e-3)));
    for (const Wall& wall : room->walls()) {
        EXPECT_GT(wall.inward.dot(V3d(4, 2.5, 0) - wall.from), 0);
        // Up x inward points along the wall.
        EXPECT_NEAR(V3d(0, 0, 1).cross(wall.inward).dot(wall.to - wall.from), wall.width(), 1e-9);
        EXPECT_NEAR(wall.from.z, 0, 1e-5);
    }
    EXPECT_TRUE(room->holds(job.scene, {7.9, 4.9, 0}));
    EXPECT_FALSE(room->holds(job.scene, {8.1, 4.9, 0}));
}

TEST(Room, OfAnL_HasSixWalls_AndHoldsNeitherItsNotchNorTheNextRoom) {
    const Job job = scene_of(shell({{0, 0}, {8, 0}, {8, 3}, {3, 3}, {3, 9}, {0, 9}}));
    const auto room = Room::around(job.scene, std::vector<V3d>{{7, 1, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(3, 1e-3), DoubleNear(3, 1e-3), DoubleNear(5, 1e-3),
                                           DoubleNear(6, 1e-3), DoubleNear(8, 1e-3), DoubleNear(9, 1e-3)));
    EXPECT_TRUE(room->holds(job.scene, {1, 8.5, 0}));
    EXPECT_FALSE(room->holds(job.scene, {6, 6, 0}));
    EXPECT_NEAR(room->area(job.scene), 8 * 3 + 3 * 6, 0.72);
    EXPECT_FALSE(room->is_open_sided());
}

TEST(Room, WithAnOpenSide_EndsWithItsCeiling_NotAtTheHouseOpposite) {
    const Job job =
        scene_of(level({-40, -40}, {40, 40}, 0) + level({0, 0}, {8, 5}, 3) + upright({0, 0}, {0, 5}) +
                 upright({0, 5}, {8, 5}) + upright({8, 5}, {8, 0}) + upright({-20, -15}, {30, -15}, 0, 12));
    const auto room = Room::around(job.scene, std::vector<V3d>{{4, 2, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(5, 1e-3), DoubleNear(5, 1e-3), DoubleNear(8, 1e-3)));
    EXPECT_NEAR(room->bounds().min.y, 0, 0.01);
    EXPECT_NEAR(room->area(job.scene), 40, 0.5);
    EXPECT_TRUE(room->is_open_sided());
}

// A lintel is seen below the ceiling, but it is no wall.
TEST(Room, WithALintelOverAnOpenSide_IsOpenThere) {
    const Job job =
        scene_of(level({-40, -40}, {40, 40}, 0) + level({0, 0}, {8, 5}, 3) + upright({0, 0}, {0, 5}) +
                 upright({0, 5}, {8, 5}) + upright({8, 5}, {8, 0}) + upright({0, 0}, {8, 0}, 2.7, 3));
    const auto room = Room::around(job.scene, std::vector<V3d>{{4, 2, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_EQ(room->walls().size(), 3U);
    EXPECT_TRUE(room->is_open_sided());
}

TEST(Room, WithOneWall_HasTheAreaOfItsCeiling) {
    const Job job =
        scene_of(level({-40, -40}, {40, 40}, 0) + level({0, 0}, {4, 5}, 3) + upright({0, 5}, {4, 5}));
    const auto room = Room::around(job.scene, std::vector<V3d>{{2, 2, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(4, 1e-3)));
    EXPECT_NEAR(room->area(job.scene), 20, 0.3);
}

TEST(Room, WithAHoleInTheCeiling_KeepsItsWalls) {
    std::string world = level({-20, -20}, {20, 20}, 0);
    for (const V2d& corner :
         {V2d(0, 0), V2d(2.5, 0), V2d(5, 0), V2d(0, 2.5), V2d(5, 2.5), V2d(0, 5), V2d(2.5, 5), V2d(5, 5)})
        world += level(corner, corner + V2d(2.5), 3);
    for (int i = 0; i < 4; ++i) {
        const V2d corners[] = {{0, 0}, {7.5, 0}, {7.5, 7.5}, {0, 7.5}};
        world += upright(corners[i], corners[(i + 1) % 4]);
    }
    const Job job = scene_of(world);
    const auto room = Room::around(job.scene, std::vector<V3d>{{1, 1, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(7.5, 1e-3), DoubleNear(7.5, 1e-3),
                                           DoubleNear(7.5, 1e-3), DoubleNear(7.5, 1e-3)));
}

TEST(Room, WithSlantedWalls_HasTheirWidths) {
    const Job job = scene_of(shell({{0, 0}, {6, 0}, {7, 4}, {1, 5}}));
    const auto room = Room::around(job.scene, std::vector<V3d>{{3, 2, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_THAT(widths(*room),
                ElementsAre(DoubleNear(std::sqrt(17.0), 0.02), DoubleNear(std::sqrt(26.0), 0.02),
                            DoubleNear(6, 0.02), DoubleNear(std::sqrt(37.0), 0.02)));
}

TEST(Room, FurnitureLuminairesDoorsAndWindowsChangeNoWall) {
    std::string world = level({-9, -9}, {20, 20}, 0) + level({-9, -9}, {20, 20}, 3);
    // A wall with a door, one with a window whose pane lies 0.2 m outside, and two plain ones.
    world += upright({0, 0}, {2, 0}) + upright({3, 0}, {8, 0}) + upright({2, 0}, {3, 0}, 2.1, 3);
    world +=
        upright({8, 0}, {8, 5}, 0, 1) + upright({8, 0}, {8, 5}, 2.2, 3) + upright({8.2, 0}, {8.2, 5}, 1, 2.2);
    world += upright({8, 5}, {0, 5}) + upright({0, 5}, {0, 0});
    world += box({0, 4.4}, {4, 5}, 0, 2.2) + box({2, 2}, {4, 3}, 0.7, 0.74);  // a cupboard and a table
    world += box({2, 1}, {3.5, 1.3}, 2.8, 3);                                 // a luminaire
    const Job job = scene_of(world);
    const auto room =
        Room::around(job.scene, std::vector<V3d>{{2.7, 1.1, 0.75}, {3, 2.5, 0.75}, {6, 3, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_NEAR(room->floor(), 0, 1e-5);
    EXPECT_NEAR(room->ceiling(), 3, 1e-5);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(5, 1e-3), DoubleNear(5, 1e-3), DoubleNear(8, 1e-3),
                                           DoubleNear(8, 1e-3)));
}

// Two columns whose faces lie in one plane are no wall.
TEST(Room, WithColumns_HasTheSameWalls) {
    const Job job = scene_of(shell({{0, 0}, {8, 0}, {8, 5}, {0, 5}}) + box({2, 2}, {2.4, 2.4}, 0, 3) +
                             box({6, 2}, {6.4, 2.4}, 0, 3));
    const auto room = Room::around(job.scene, std::vector<V3d>{{4, 3, 0.75}}, 2);
    ASSERT_TRUE(room);
    EXPECT_THAT(widths(*room), ElementsAre(DoubleNear(5, 1e-3), DoubleNear(5, 1e-3), DoubleNear(8, 1e-3),
                                           DoubleNear(8, 1e-3)));
}

// Tiles with joints through which the slab above them is seen, as wide as a fifth of the tiles.
TEST(Room, UnderACeilingOfTiles_EndsAtThem) {
    std::string world = shell({{0, 0}, {8, 0}, {8, 5}, {0, 5}});
    for (int i = 0; i < 16; ++i) {
        for (int j = 0; j < 10; ++j)
            world += level({0.5 * i + 0.02, 0.5 * j + 0.02}, {0.5 * i + 0.48, 0.5 * j + 0.48}, 2.8);
    }
    const Job job = scene_of(world);
    std::vector<V3d> points;
    for (int i = 0; i < 40; ++i) points.emplace_back(0.2 * i, 0.125 * i, 0.75);
    const auto room = Room::around(job.scene, points, 2);
    ASSERT_TRUE(room);
    EXPECT_NEAR(room->ceiling(), 2.8, 1e-5);
    EXPECT_EQ(room->walls().size(), 4U);
}

TEST(Room, AroundACounter_HasTheFloorBesideIt) {
    const Job job = scene_of(shell({{0, 0}, {8, 0}, {8, 5}, {0, 5}}) + box({3, 2}, {4, 4}, 0, 1));
    const auto room = Room::around(job.scene, std::vector<V3d>{{3.2, 2.2, 1.02}, {3.8, 3.8, 1.02}}, 2);
    ASSERT_TRUE(room);
    EXPECT_NEAR(room->floor(), 0, 1e-5);
    EXPECT_EQ(room->walls().size(), 4U);
}

TEST(Room, UnderTheSky_IsNone) {
    const Job job = scene_of(level({-9, -9}, {9, 9}, 0) + upright({0, 0}, {8, 0}));
    EXPECT_FALSE(Room::around(job.scene, std::vector<V3d>{{4, 2, 0.75}}, 2));
}

}  // namespace room_test
}  // namespace lucerna
