// Tests the density of learned emission and its weights, and that it equals plain emission bit for bit where
// nothing is important.
#include "photon/learned_emission.h"

#include <gtest/gtest.h>

#include "engine/base/defensive.h"
#include "lights/measured.h"
#include "photon/build_maps.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/emission_blocks.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace emission_plan_test {

using testing::boxes_of;
using testing::emit_numbers;
using testing::NumberBox;
using testing::random_blocks;
using testing::SceneMaker;

// Returns a room with a measured lamp, a point light, a dark one and a spotlight.
Scene four_lights() {
    SceneMaker make;
    Monitor silent;
    make.room({2, 2, 2}, make.diffuse(Rgb(0.5F)));
    const LightField field = testing::random_field(testing::rig_a(), -0.2F, 1, 61);
    MeasuredSettings settings;
    settings.power = 30;
    settings.world_from_light.setTranslation(V3d(1, 1, 0.2));
    make.light(make_point_light(V3f(1.0F), Rgb(10 / (4 * kPi))));
    make.light(make_measured_light(field, CellTable(field, {1}, silent), settings, silent));
    make.light(make_point_light(V3f(0.5F), Rgb(0.0F)));
    make.light(make_spot_light(V3f(1.0F), {0, 0, 1}, Rgb(1), {40, 40}));
    return make.build();
}

std::vector<EmissionBlocks> four_blocks() {
    return {random_blocks(40, 1), random_blocks(300, 2), random_blocks(5, 3), EmissionBlocks{}};
}

std::vector<EmissionBlocks> unimportant_blocks() {
    std::vector<EmissionBlocks> unimportant = four_blocks();
    for (EmissionBlocks& blocks : unimportant) {
        for (EmissionBlocks::Node& node : blocks.nodes) node.importance = 0;
    }
    return unimportant;
}

TEST(LearnedEmission, NothingImportant_ChangesNoBit) {
    const Scene scene = four_lights();
    const LearnedEmission learned_emission(scene, unimportant_blocks());
    Emission plain(scene, 5, Purpose::emission, 2),
        steered(scene, 5, Purpose::emission, 2, &learned_emission);
    std::vector<std::optional<LightPathStart>> a(20000), b(20000);
    plain.start(0, a);
    steered.start(0, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_TRUE(a[i] && b[i]);
        EXPECT_EQ(a[i]->light, b[i]->light);
        EXPECT_EQ(a[i]->cell, b[i]->cell);
        EXPECT_EQ(a[i]->from.p, b[i]->from.p);
        EXPECT_EQ(a[i]->d, b[i]->d);
        EXPECT_EQ(a[i]->power, b[i]->power);
    }
}

TEST(LearnedEmission, NothingImportant_IsPlain) {
    const Scene scene = four_lights();
    const LearnedEmission learned_emission(scene, unimportant_blocks());
    for (std::uint32_t light = 0; light < 4; ++light) {
        EXPECT_NEAR(learned_emission.probability(light), double{scene.picker().probability(light)}, 1e-7);
        EXPECT_EQ(learned_emission.density(light, emit_numbers(1, light)), 1);
    }
}

// Computes the density of the header, q = β p + (1 - β) learned, from the blocks independently.
TEST(LearnedEmission, Density_IsTheMixture_AndNeverBelowTheDefensivePart) {
    const Scene scene = four_lights();
    const std::vector<EmissionBlocks> blocks = four_blocks();
    const LearnedEmission learned_emission(scene, blocks);
    double learned = 0;
    for (std::uint32_t light = 0; light < 4; ++light) {
        for (const NumberBox& box : boxes_of(blocks[light])) {
            learned += double{scene.picker().probability(light)} * box.volume() * box.importance;
        }
    }
    for (std::uint32_t light = 0; light < 4; ++light) {
        const double plain = double{scene.picker().probability(light)};
        for (std::uint32_t i = 0; i < 200; ++i) {
            const LeSampleU u = emit_numbers(7, i);
            for (const NumberBox& box : boxes_of(blocks[light])) {
                if (!box.holds(u)) continue;
                const double expected = plain * (double{kDefensiveWeight} +
                                                 (1 - double{kDefensiveWeight}) * box.importance / learned);
                const double density =
                    learned_emission.probability(light) * double{learned_emission.density(light, u)};
                EXPECT_NEAR(density, expected, 2e-5 * expected);
                EXPECT_GE(density, double{kDefensiveWeight} * plain * (1 - 2e-5));
            }
        }
    }
}

TEST(LearnedEmission, WarpedNumbers_FollowTheDensity_AndTheTestSeesWhenTheyDoNot) {
    const Scene scene = four_lights();
    const std::vector<EmissionBlocks> blocks = four_blocks();
    const LearnedEmission learned_emission(scene, blocks);
    constexpr std::uint32_t kLight = 1, kDraws = 200'000;
    const std::vector<NumberBox> boxes = boxes_of(blocks[kLight]);
    std::vector<std::uint64_t> observed(boxes.size());
    std::vector<double> expected;
    for (const NumberBox& box : boxes) {
        const auto middle = [&](std::size_t a) {
            return static_cast<float>(0.5 * (box.low[a] + box.high[a]));
        };
        const LeSampleU u{{middle(0), middle(1)}, {middle(2), middle(3)}};
        expected.push_back(kDraws * box.volume() * double{learned_emission.density(kLight, u)});
    }
    for (std::uint32_t i = 0; i < kDraws; ++i) {
        LeSampleU u = emit_numbers(11, i);
        const std::uint32_t salt = u.salt;
        const float factor = learned_emission.warp(kLight, u);
        EXPECT_EQ(u.salt, salt);
        EXPECT_NEAR(factor * learned_emission.density(kLight, u), 1,
                    1e-6);  // so u lies in the block it was drawn for
        for (std::size_t b = 0; b < boxes.size(); ++b) {
            if (boxes[b].holds(u)) ++observed[b];
        }
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
    std::rotate(expected.begin(), expected.begin() + 1, expected.end());
    EXPECT_FALSE(testing::chi_square(observed, expected).accepted());
}

// Warped numbers remain stratified: of 2^k consecutive ones every block gets its share, except for the points
// at its boundaries.
TEST(LearnedEmission, WarpedNet_FillsBlocksMoreEvenlyThanChance) {
    const Scene scene = four_lights();
    std::vector<EmissionBlocks> blocks(4);
    blocks[1].nodes = {{0, 1, 0}, {1, 3, 0}, {-1, 0, 0.1}, {-1, 0, 1.0}, {-1, 0, 0.3}};
    const LearnedEmission learned_emission(scene, blocks);
    const std::vector<NumberBox> boxes = boxes_of(blocks[1]);
    const EmissionNet net(3, Purpose::test, 0);
    constexpr std::uint32_t kPoints = 4096;
    std::vector<double> count(boxes.size());
    for (std::uint32_t i = 0; i < kPoints; ++i) {
        LeSampleU u = net.at(i).u;
        learned_emission.warp(1, u);
        for (std::size_t b = 0; b < boxes.size(); ++b) count[b] += boxes[b].holds(u) ? 1 : 0;
    }
    for (std::size_t b = 0; b < boxes.size(); ++b) {
        const auto middle = [&](std::size_t a) {
            return static_cast<float>(0.5 * (boxes[b].low[a] + boxes[b].high[a]));
        };
        const LeSampleU u{{middle(0), middle(1)}, {middle(2), middle(3)}};
        // Independent numbers would miss by about 30.
        EXPECT_NEAR(count[b], kPoints * boxes[b].volume() * double{learned_emission.density(1, u)}, 6) << b;
    }
}

// Computes the cells of a measured lamp as boxes in the space of its emission numbers, from its table.
struct CellBoxes {
    std::vector<NumberBox> boxes;  // by CellId

    explicit CellBoxes(const CellTable& table, const Rig& rig) : boxes(table.cells()) {
        const int size[4] = {rig.intervals(0), rig.intervals(1), rig.columns(0), rig.columns(1)};
        double un = 0;
        for (int n = 0; n < size[0]; ++n) {
            double wide = 0;
            for (int o = 0; o < size[1]; ++o) wide += double{table.interval_probability(n, o)};
            double vo = 0;
            for (int o = 0; o < size[1]; ++o) {
                const double interval = double{table.interval_probability(n, o)};
                double sp = 0;
                for (int p = 0; p < size[2]; ++p) {
                    double column = 0;
                    for (int q = 0; q < size[3]; ++q) column += table.probability({n, o, p, q});
                    double tq = 0;
                    for (int q = 0; q < size[3]; ++q) {
                        const double cell = table.probability({n, o, p, q});
                        if (!(cell > 0)) continue;
                        NumberBox& box = boxes[table.id({n, o, p, q})];
                        box.low = {un, vo, sp, tq};
                        box.high = {un + wide, vo + interval / wide, sp + column / interval,
                                    tq + cell / column};
                        tq = box.high[3];
                    }
                    sp += interval > 0 ? column / interval : 0;
                }
                vo += wide > 0 ? interval / wide : 0;
            }
            un += wide;
        }
    }
};

TEST(LearnedEmission, CellsOfAMeasuredLamp_AreDrawnByTheDensity_AndTheTestSeesAShift) {
    Monitor silent;
    const LightField field = testing::random_field(testing::rig_b(), -0.2F, 1, 61);
    const CellTable table(field, {1}, silent);
    MeasuredSettings settings;
    SceneMaker make;
    make.light(make_measured_light(field, table, settings, silent));
    const Scene scene = make.build();
    const std::vector<EmissionBlocks> blocks{random_blocks(100, 9)};
    const LearnedEmission learned_emission(scene, blocks);

    constexpr std::uint32_t kPaths = 1 << 17;
    std::vector<std::uint64_t> observed(table.cells());
    double flux = 0;
    Emission emission(scene, 8, Purpose::emission, 0, &learned_emission);
    emission.for_each(0, kPaths, [&](std::uint32_t, const std::optional<LightPathStart>& start) {
        ASSERT_TRUE(start);
        ++observed[start->cell];
        flux += double{luminance(start->power)} / kPaths;
    });
    const CellBoxes cells(table, field.rig());
    std::vector<double> expected(table.cells());
    for (std::size_t c = 0; c < expected.size(); ++c) {
        for (const NumberBox& block : boxes_of(blocks[0])) {
            const auto middle = [&](std::size_t a) {
                return static_cast<float>(0.5 * (block.low[a] + block.high[a]));
            };
            const LeSampleU u{{middle(0), middle(1)}, {middle(2), middle(3)}};
            expected[c] += kPaths * block.overlap(cells.boxes[c]) * double{learned_emission.density(0, u)};
        }
        if (!(table.probability(*table.cell(static_cast<CellId>(c))) > 0)) expected[c] = 0;
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
    EXPECT_NEAR(flux, scene.lights()[0]->power(), 0.01 * flux);  // weights restore the flux

    std::vector<double> plain(table.cells());
    for (std::size_t c = 0; c < plain.size(); ++c) {
        plain[c] = kPaths * table.probability(*table.cell(static_cast<CellId>(c)));
    }
    EXPECT_FALSE(testing::chi_square(observed, plain).accepted());
    std::rotate(expected.begin(), expected.begin() + 1, expected.end());
    EXPECT_FALSE(testing::chi_square(observed, expected).accepted());
}

}  // namespace emission_plan_test
}  // namespace lucerna
