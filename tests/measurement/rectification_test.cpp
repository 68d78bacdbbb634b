#include "lights/measurement/rectification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/sampler.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace rectification_test {

using testing::error_of;

using ::testing::HasSubstr;

const Corners kOblique{V2d(5.3, 40.1), V2d(50.2, 44.4), V2d(41.7, 9.9), V2d(11.4, 3.2)};

std::vector<float> random_image(std::size_t size, std::uint64_t seed) {
    std::vector<float> image(size);
    Sampler sampler(seed, Purpose::test, 1, 0);
    for (float& x : image) x = sampler.next();
    return image;
}

TEST(Homography, Corners_AreMapped_AndBack) {
    const Homography map = Homography::of_rectangle({8, 6}, kOblique), back = map.inverse();
    const Corners from{V2d(0, 0), V2d(8, 0), V2d(8, 6), V2d(0, 6)};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_TRUE(map(from[i]).equalWithAbsError(kOblique[i], 1e-12));
        EXPECT_TRUE(back(kOblique[i]).equalWithAbsError(from[i], 1e-12));
        EXPECT_TRUE(map.reaches(from[i]) && back.reaches(kOblique[i]));
    }
    // Straight lines stay straight: the diagonals' crossing is the image of the middle.
    const V2d a = kOblique[0], b = kOblique[2] - a, c = kOblique[1], d = kOblique[3] - c;
    const double t = ((c - a).x * d.y - (c - a).y * d.x) / (b.x * d.y - b.y * d.x);
    EXPECT_TRUE(map(V2d(4, 3)).equalWithAbsError(a + t * b, 1e-12));
}

TEST(Homography, CornersOutOfOrderOrOnALine_AreRefused) {
    const auto error = [](const Corners& corners) {
        return error_of([&] { Homography::of_rectangle({1, 1}, corners); });
    };
    EXPECT_THAT(error({V2d(0, 0), V2d(1, 1), V2d(1, 0), V2d(0, 1)}), HasSubstr("convex quadrilateral"));
    EXPECT_THAT(error({V2d(0, 0), V2d(1, 0), V2d(2, 0), V2d(0, 1)}), HasSubstr("convex quadrilateral"));
    EXPECT_THAT(error({V2d(0, 0), V2d(0, 0), V2d(0, 0), V2d(0, 0)}), HasSubstr("convex quadrilateral"));
    EXPECT_THAT(error({V2d(0, 0), V2d(NAN, 0), V2d(1, 1), V2d(0, 1)}), HasSubstr("convex quadrilateral"));
}

TEST(Rectification, ConstantPhotograph_GivesThatConstant) {
    for (const V2i& plane : {V2i(3, 2), V2i(20, 17), V2i(90, 70)}) {
        const AreaMap map = photograph_to_plane({60, 50}, plane, kOblique);
        std::vector<float> out(Grid{plane}.cells());
        map.means(std::vector<float>(3000, 2.5F), out);
        for (const float x : out) EXPECT_NEAR(x, 2.5, 2e-6);
    }
}

// Compares with many points per pixel of M, each looked up in the photograph.
TEST(Rectification, RandomPhotograph_EqualsDenseSampling) {
    const V2i size(60, 50), plane(7, 5);
    const std::vector<float> photograph = random_image(3000, 4);
    const AreaMap map = photograph_to_plane(size, plane, kOblique);
    std::vector<float> out(35);
    map.means(photograph, out);
    const Homography at = Homography::of_rectangle(V2d(plane), kOblique);
    for (int k = 0; k < plane.x; ++k) {
        for (int l = 0; l < plane.y; ++l) {
            constexpr int kSide = 300;
            double sum = 0;
            for (int i = 0; i < kSide * kSide; ++i) {
                const V2d p = at(V2d(k + (i % kSide + 0.5) / kSide, l + (double(i / kSide) + 0.5) / kSide));
                sum += double{photograph[static_cast<std::size_t>(std::floor(p.y)) * 60 +
                                         static_cast<std::size_t>(std::floor(p.x))]};
            }
            EXPECT_NEAR(out[static_cast<std::size_t>(k * plane.y + l)], sum / (kSide * kSide), 1e-3);
        }
    }
}

TEST(Rectification, CropOfWholePixels_IsTheirMean_WithTUpwards) {
    // Each pixel of M covers 2 x 3 pixels of the photograph.
    const AreaMap map = photograph_to_plane({6, 8}, {2, 2}, corners_of_crop({1, 1}, {4, 6}));
    std::vector<float> photograph(48), out(4), variance(4);
    for (std::size_t i = 0; i < 48; ++i) photograph[i] = static_cast<float>(i);
    map.means(photograph, out);
    // The lower left pixel of M covers columns 1 and 2, rows 4 to 6.
    EXPECT_NEAR(out[0], 5 * 6 + 1.5, 1e-5);
    EXPECT_NEAR(out[1], 2 * 6 + 1.5, 1e-5);  // above it
    EXPECT_NEAR(out[2], 5 * 6 + 3.5, 1e-5);  // to the right
    map.variances(std::vector<float>(48, 12), variance);
    for (const float x : variance) EXPECT_NEAR(x, 2, 1e-5);
    EXPECT_FALSE(map.uses(0));
    EXPECT_TRUE(map.uses(7));
}

TEST(Rectification, ThereAndBack_KeepsTheLightOfM) {
    const V2i plane(9, 7), size(60, 50);
    const std::vector<float> light = random_image(63, 5);
    const AreaMap there = plane_to_photograph(plane, size, kOblique);
    std::vector<float> photograph(3000), back(63);
    there.means(light, photograph);
    photograph_to_plane(size, plane, kOblique).means(photograph, back);
    double before = 0, after = 0;
    for (std::size_t i = 0; i < light.size(); ++i) before += double{light[i]}, after += double{back[i]};
    EXPECT_NEAR(after, before, 0.01 * before);
    for (const std::size_t inside : {24U, 25U, 31U, 38U}) EXPECT_NEAR(back[inside], light[inside], 0.2);
}

TEST(Rectification, CornersOutsideThePhotograph_AreRefused) {
    EXPECT_THAT(error_of([] {
                    photograph_to_plane({40, 50}, {4, 4}, kOblique);
                }),
                HasSubstr("(50.2, 44.4) lies outside the photographs of 40 x 50"));
}

}  // namespace rectification_test
}  // namespace lucerna
