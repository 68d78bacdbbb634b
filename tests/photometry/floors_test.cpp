#include "engine/photometry/floors.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/pbrt/read_scene.h"

namespace lucerna {
namespace floors_test {

// Returns all faces of a box.
std::string box(const V3d& a, const V3d& b) {
    return fmt::format(
        "Shape \"trianglemesh\" \"point3 P\" [{0} {1} {2} {3} {1} {2} {3} {4} {2} {0} {4} {2} {0} {1} {5} "
        "{3} {1} {5} "
        "{3} {4} {5} {0} {4} {5}] \"integer indices\" [0 2 1 0 3 2 4 5 6 4 6 7 0 1 5 0 5 4 2 3 7 2 7 6 1 2 6 "
        "1 6 5 0 4 "
        "7 0 7 3]\n",
        a.x, a.y, a.z, b.x, b.y, b.z);
}

std::vector<Floor> floors(const std::string& world, int up = 2) {
    Monitor silent;
    const Job job = read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + world, "scene.pbrt",
                                    {}, Workers{2}, silent);
    return floors_of(job.scene, up);
}

TEST(Floors, OfAHouse_AreItsStoreysWithoutFurnitureAndRoof) {
    // The house has slabs of 0.3 m at 0, 3 and 6 m with an upper storey half as large, walls, a large table
    // on each floor, and a cupboard of 2.2 m.
    const std::string house = box({100, 50, -0.3}, {110, 58, 0}) + box({100, 50, 2.7}, {110, 58, 3}) +
                              box({100, 50, 5.7}, {105, 58, 6}) + box({100, 50, 0}, {100.2, 58, 2.7}) +
                              box({102, 52, 0.7}, {108, 57, 0.75}) + box({101, 51, 3.7}, {104, 57, 3.75}) +
                              box({109, 50, 0}, {110, 58, 2.2});
    const std::vector<Floor> found = floors(house);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_NEAR(found[0].height, 0, 1e-4);
    EXPECT_NEAR(found[1].height, 3, 1e-4);
    // The floor continues under the wall and the cupboard.
    EXPECT_NEAR(found[0].least.x, 100, 1e-3);
    EXPECT_NEAR(found[0].most.x, 110, 1e-3);
    EXPECT_NEAR(found[1].least.x, 100, 1e-3);
    EXPECT_NEAR(found[1].most.x, 105, 1e-3);
    EXPECT_NEAR(found[1].most.y, 58, 1e-3);
    EXPECT_EQ(found[1].least.z, found[1].most.z);
}

TEST(Floors, OfOneRoomOfSingleFaces_IsItsFloor) {
    const auto level = [](double z) {
        return fmt::format("Shape \"bilinearmesh\" \"point3 P\" [0 0 {0} 4 0 {0} 0 5 {0} 4 5 {0}]\n", z);
    };
    ASSERT_EQ(floors(level(0) + level(2.8)).size(), 1U);
    EXPECT_NEAR(floors(level(0) + level(2.8))[0].height, 0, 1e-6);
    // The lower level leaves no room to stand, so only the one under the sky is a floor.
    ASSERT_EQ(floors(level(0) + level(1.8)).size(), 1U);
    EXPECT_NEAR(floors(level(0) + level(1.8))[0].height, 1.8, 1e-6);
}

// Far lights make the grid coarse: its lines are 0.8 m apart.
TEST(Floors, OfASmallPartOfTheModel_HaveExactSides) {
    const std::vector<Floor> found =
        floors(box({0.37, 0.21, -0.3}, {40.11, 30.04, 0}) + box({0.37, 0.21, 3}, {40.11, 30.04, 3.3}) +
               box({100, -2, 1}, {100.1, 98, 1.1}));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR(found[0].least.x, 0.37, 1e-3);
    EXPECT_NEAR(found[0].least.y, 0.21, 1e-3);
    EXPECT_NEAR(found[0].most.x, 40.11, 1e-3);
    EXPECT_NEAR(found[0].most.y, 30.04, 1e-3);
}

TEST(Floors, UnderTheSky_AreTheGround) {
    const std::vector<Floor> found = floors("Shape \"disk\" \"float radius\" 10\n");
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR(found[0].area, 100 * kPiD, 5);
}

TEST(Floors, OfASlope_AreNone) {
    EXPECT_TRUE(floors("Rotate 20 1 0 0 Shape \"disk\" \"float radius\" 10\n").empty());
    EXPECT_TRUE(floors("LightSource \"point\"\n").empty());
}

TEST(Floors, WhereYIsUp_AreFoundTheSame) {
    const std::vector<Floor> found = floors("Rotate -90 1 0 0\n" + box({0, 0, -0.3}, {6, 4, 0}) +
                                                box({0, 0, 2.7}, {6, 4, 3}) + box({0, 0, 5.7}, {6, 4, 6}),
                                            1);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_NEAR(found[0].height, 0, 1e-4);
    EXPECT_NEAR(found[1].height, 3, 1e-4);
}

}  // namespace floors_test
}  // namespace lucerna
