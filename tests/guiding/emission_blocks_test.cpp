// Tests what is learned from trials of known second moments.
#include "engine/guiding/importance_pre_pass.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/emission_blocks.h"

namespace lucerna {
namespace emission_blocks_test {

using testing::boxes_of;
using testing::emit_numbers;
using testing::NumberBox;

template <typename Score>
std::vector<EmissionTrial> trials(std::uint32_t count, std::uint64_t seed, Score&& score) {
    std::vector<EmissionTrial> made;
    for (std::uint32_t i = 0; i < count; ++i) {
        const LeSampleU u = emit_numbers(seed, i);
        made.push_back({u, static_cast<float>(score(u, i))});
    }
    return made;
}

std::vector<EmissionBlocks> learn(std::vector<std::vector<EmissionTrial>> of_lights,
                                  const std::vector<double>& powers, const BlockSettings& settings = {}) {
    return learn_blocks(of_lights, powers, settings);
}

double importance_at(const EmissionBlocks& blocks, const LeSampleU& u) {
    for (const NumberBox& box : boxes_of(blocks)) {
        if (box.holds(u)) return box.importance;
    }
    return NAN;
}

TEST(EmissionBlocks, ScoresThatDoNotDependOnTheNumbers_CutNothing) {
    // One path in twenty is useful, at random.
    const auto noise = [](const LeSampleU&, std::uint32_t i) {
        return Sampler(3, Purpose::test, 2, i).next() < 0.05F;
    };
    std::size_t cut = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const auto blocks = learn({trials(4000, seed, noise)}, {1});
        cut += blocks[0].nodes.size() > 1 ? 1 : 0;
    }
    EXPECT_LE(cut, 2U);
}

TEST(EmissionBlocks, ImportanceIsTheRootOfTheSecondMoment_WhereItIs) {
    // The scores are 9 in a corner of the space of numbers, and 1 elsewhere.
    const auto corner = [](const LeSampleU& u, std::uint32_t) {
        return u.direction.x >= 0.5F && u.position.y < 0.25F ? 9.0 : 1.0;
    };
    const auto blocks = learn({trials(8000, 1, corner)}, {1});
    EXPECT_NEAR(importance_at(blocks[0], {{0.5F, 0.1F}, {0.8F, 0.5F}}), 3, 0.05);
    EXPECT_NEAR(importance_at(blocks[0], {{0.5F, 0.9F}, {0.8F, 0.5F}}), 1, 0.05);
    EXPECT_NEAR(importance_at(blocks[0], {{0.5F, 0.1F}, {0.2F, 0.5F}}), 1, 0.05);
}

// Both halves are equally important; only finer slices differ.
TEST(EmissionBlocks, TheMiddleOfALamp_IsFound) {
    const auto middle = [](const LeSampleU& u, std::uint32_t) {
        return std::fabs(u.direction.x - 0.5F) < 0.125F && std::fabs(u.direction.y - 0.5F) < 0.125F;
    };
    const auto blocks = learn({trials(16000, 1, middle)}, {1});
    const double inside = importance_at(blocks[0], {{0.3F, 0.3F}, {0.45F, 0.55F}});
    const double outside = importance_at(blocks[0], {{0.3F, 0.3F}, {0.9F, 0.1F}});
    EXPECT_NEAR(inside, 1, 0.1);
    EXPECT_LT(outside, 0.3);
}

TEST(EmissionBlocks, Lights_AreAsImportantAsTheirPaths_AndAsAllOnTheAverageWithoutAny) {
    const auto always = [](double score) {
        return [score](const LeSampleU&, std::uint32_t) { return score; };
    };
    const auto blocks = learn({trials(1000, 1, always(4)), trials(1000, 2, always(0)), {}}, {1, 1, 1e-9});
    EXPECT_NEAR(blocks[0].nodes[0].importance, 2, 0.01);
    EXPECT_LT(blocks[1].nodes[0].importance, 0.1);
    EXPECT_GT(blocks[1].nodes[0].importance, 0);
    EXPECT_NEAR(blocks[2].nodes[0].importance, std::sqrt(2.0), 0.01);
}

TEST(EmissionBlocks, Bounds_AreKept) {
    const auto point = [](const LeSampleU& u, std::uint32_t) {
        return std::exp(-40.0 *
                        double{(u.position - V2f(0.3F)).length() + (u.direction - V2f(0.7F)).length()});
    };
    const auto few = learn({trials(60000, 1, point)}, {1}, {16, 32});
    EXPECT_EQ(boxes_of(few[0]).size(), 17U);
    for (const NumberBox& box : boxes_of(learn({trials(60000, 1, point)}, {1}, {4096, 8})[0])) {
        EXPECT_GE(box.volume(), std::ldexp(1.0, -EmissionBlocks::kMostCuts));
        EXPECT_TRUE(std::isfinite(box.importance) && box.importance >= 0);
    }
}

TEST(EmissionBlocks, NoTrials_NoPower_AreNoFault) {
    EXPECT_TRUE(learn({}, {}).empty());
    EXPECT_EQ(learn({{}}, {0})[0].nodes[0].importance, 0);
    EXPECT_EQ(
        learn({trials(100, 1, [](const LeSampleU&, std::uint32_t) { return 0.0; })}, {1})[0].nodes.size(),
        1U);
}

}  // namespace emission_blocks_test
}  // namespace lucerna
