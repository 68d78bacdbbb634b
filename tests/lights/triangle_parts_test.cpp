#include "lights/triangle_parts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace triangle_parts_test {

// Returns panels of 0.6 x 0.3 in rows 2 apart, rotated by 30 degrees and emitting downwards; each has two
// triangles.
TriangleEmitter panels(int rows) {
    TriangleEmitter shape;
    const float c = std::cos(0.5236F), s = std::sin(0.5236F);
    for (int i = 0; i < rows * rows; ++i) {
        const auto x = static_cast<float>(2 * (i % rows)), z = static_cast<float>(2 * (i / rows));
        const auto first = static_cast<int>(shape.p.size());
        for (const auto& [a, b] : {std::pair(0.0F, 0.0F), {0.6F, 0.0F}, {0.6F, 0.3F}, {0.0F, 0.3F}})
            shape.p.emplace_back(x + c * a - s * b, 3.0F, z + s * a + c * b);
        shape.triangles.emplace_back(first, first + 1, first + 2);
        shape.triangles.emplace_back(first, first + 2, first + 3);
    }
    return shape;
}

// Returns a tessellated sphere with its faces outwards.
TriangleEmitter ball(int steps) {
    TriangleEmitter shape;
    for (int i = 0; i <= steps; ++i) {
        for (int j = 0; j <= 2 * steps; ++j) {
            const float theta = kPi * static_cast<float>(i) / static_cast<float>(steps);
            const float phi = kPi * static_cast<float>(j) / static_cast<float>(steps);
            shape.p.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                 std::cos(theta));
        }
    }
    const int row = 2 * steps + 1;
    for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < 2 * steps; ++j) {
            const int a = i * row + j;
            if (i > 0) shape.triangles.emplace_back(a, a + row, a + 1);
            if (i + 1 < steps) shape.triangles.emplace_back(a + 1, a + row, a + row + 1);
        }
    }
    return shape;
}

std::uint32_t count_of(const std::vector<std::uint32_t>& parts) {
    return *std::max_element(parts.begin(), parts.end()) + 1;
}

TEST(TriangleParts, APanelOrADisc_IsOnePart) {
    const TriangleEmitter one = panels(1);
    EXPECT_EQ(count_of(parts_of_triangles(one.p, one.triangles)), 1U);
    TriangleEmitter disc;
    disc.p.emplace_back(0.0F, 0.0F, 0.0F);
    for (int i = 0; i < 24; ++i) {
        const float phi = 2 * kPi * static_cast<float>(i) / 24;
        disc.p.emplace_back(std::cos(phi), std::sin(phi), 0.0F);
        disc.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % 24);
    }
    EXPECT_EQ(count_of(parts_of_triangles(disc.p, disc.triangles)), 1U);
}

TEST(TriangleParts, PanelsOfACeiling_AreAPartEach) {
    const TriangleEmitter ceiling = panels(8);
    const auto parts = parts_of_triangles(ceiling.p, ceiling.triangles);
    EXPECT_EQ(count_of(parts), 64U);
    for (std::size_t i = 0; i < parts.size(); i += 2) EXPECT_EQ(parts[i], parts[i + 1]);
}

TEST(TriangleParts, ABall_IsCutIntoItsTriangles_AsFarAsPartsGo) {
    const TriangleEmitter lamp = ball(8);
    const auto all = parts_of_triangles(lamp.p, lamp.triangles);
    EXPECT_GT(count_of(all), lamp.triangles.size() / 2);
    for (const std::size_t most : {std::size_t{1}, std::size_t{7}, std::size_t{64}}) {
        const auto few = parts_of_triangles(lamp.p, lamp.triangles, most);
        EXPECT_EQ(count_of(few), most);
        std::vector<int> used(most);
        for (const std::uint32_t part : few) ++used[part];
        for (const int n : used) EXPECT_GT(n, 0);
    }
}

TEST(TriangleParts, WithoutArea_HaveParts) {
    const std::vector<V3f> p(3, V3f(1, 2, 3));
    const std::vector<V3i> flat(5, V3i(0, 1, 2));
    EXPECT_EQ(parts_of_triangles(p, flat).size(), 5U);
}

// Samples each part separately: together they emit what the whole mesh emits, and a ray that meets the mesh
// gets the densities of both ways of sampling.
TEST(MeshLight, PartsTogether_SendWhatTheWholeDoes_WithTheDensitiesStated) {
    const auto light = make_area_light(panels(4), Rgb(2), false);
    const auto parts = light->part_bounds();
    ASSERT_EQ(parts.size(), 16U);
    const V3f x(2.2F, 0, 3.1F), n(0, 1, 0);
    const auto share = [&](const std::optional<LightSample>& in) {
        return in ? double{in->weight.x} * std::max(0.0, double{in->w.dot(n)}) : 0.0;
    };
    RunningStats whole;
    double sum = 0, variance = 0, power = 0;
    for (CellId part = 0; part < parts.size(); ++part) {
        power += double{parts[part].power};
        RunningStats own;
        for (std::uint64_t i = 0; i < 2000; ++i) {
            Sampler sampler(1, Purpose::test, part, i);
            const auto in = light->sample_Li(x, sampler.next2(), part);
            own.add(share(in));
            if (!in) continue;
            ASSERT_TRUE(in->part);
            EXPECT_EQ(in->part->part, part);
            EXPECT_FLOAT_EQ(in->part->part_pdf_w, in->pdf_w);
            EXPECT_NEAR(in->part->whole_pdf_w, in->pdf_w * parts[part].power, 1e-5F * in->pdf_w);
            // The two triangles of a panel have consecutive numbers and belong to the same part.
            for (std::uint32_t triangle = 0; triangle < 32; ++triangle) {
                const auto seen = light->Le_on_surface({x, in->w}, in->distance, V3f(0, -1, 0), triangle);
                ASSERT_TRUE(seen.part);
                if (seen.part->part != part) continue;
                EXPECT_NEAR(seen.part->part_pdf_w / in->pdf_w, 1, 1e-3F);
                EXPECT_NEAR(seen.part->whole_pdf_w / in->part->whole_pdf_w, 1, 1e-3F);
            }
        }
        sum += own.mean();
        variance += sqr(own.standard_error());
    }
    for (std::uint64_t i = 0; i < 200'000; ++i) {
        Sampler sampler(2, Purpose::test, 0, i);
        const auto in = light->sample_Li(x, sampler.next2());
        whole.add(share(in));
        if (i < 100 && in) {
            EXPECT_FLOAT_EQ(in->part->whole_pdf_w, in->pdf_w);
        }
    }
    const double sigma = std::sqrt(variance + sqr(whole.standard_error()));
    EXPECT_LT(std::fabs(sum - whole.mean()), 4 * sigma);
    EXPECT_GT(std::fabs(1.05 * sum - whole.mean()), 4 * sigma) << "a part too many would be noticed";
    EXPECT_NEAR(power, 1, 1e-5);
}

TEST(MeshLight, Particles_AreOfThePartTheyLeave) {
    const auto light = make_area_light(panels(4), Rgb(2), false);
    const auto parts = light->part_bounds();
    for (std::uint64_t i = 0; i < 500; ++i) {
        Sampler sampler(3, Purpose::test, 0, i);
        const auto e = light->sample_Le({sampler.next2(), sampler.next2(), 0});
        ASSERT_TRUE(e);
        ASSERT_LT(e->cell, parts.size());
        EXPECT_EQ(light->part_of(e->cell), e->cell);
        Box3f box = parts[e->cell].box;
        box.min -= V3f(1e-5F);
        box.max += V3f(1e-5F);
        EXPECT_TRUE(box.intersects(e->from.p));
    }
}

}  // namespace triangle_parts_test
}  // namespace lucerna
