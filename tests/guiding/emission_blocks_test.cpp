// Tests what is learned from trials of known second moments.
#include "engine/guiding/importance_pre_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

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

// Draws twenty times as many trials in one slice of the numbers as elsewhere, with their weights.
std::vector<EmissionTrial> uneven_trials(std::uint32_t count, std::uint64_t seed, bool weighted,
                                         const std::function<double(const LeSampleU&)>& score) {
    constexpr float kShare = 20.0F / 27;  // of the trials in an eighth of the numbers
    std::vector<EmissionTrial> made;
    for (std::uint32_t i = 0; i < count; ++i) {
        LeSampleU u = emit_numbers(seed, i);
        const bool often = u.position.x < kShare;
        u.position.x =
            often ? u.position.x / kShare / 8 : 0.125F + (u.position.x - kShare) / (1 - kShare) * 0.875F;
        const float weight = often ? 0.125F / kShare : 0.875F / (1 - kShare);
        made.push_back({u, static_cast<float>(score(u)), weighted ? weight : 1.0F});
    }
    return made;
}

TEST(EmissionBlocks, TrialsOfAnotherDensity_TeachTheSameByTheirWeights) {
    const auto corner = [](const LeSampleU& u) {
        return u.direction.x >= 0.5F && u.position.x < 0.25F ? 9.0 : 1.0;
    };
    const auto blocks = learn({uneven_trials(16000, 1, true, corner)}, {1});
    for (const float x : {0.05F, 0.2F})
        EXPECT_NEAR(importance_at(blocks[0], {{x, 0.1F}, {0.8F, 0.5F}}), 3, 0.1) << x;
    EXPECT_NEAR(importance_at(blocks[0], {{0.9F, 0.9F}, {0.8F, 0.5F}}), 1, 0.05);
    EXPECT_NEAR(importance_at(blocks[0], {{0.1F, 0.1F}, {0.2F, 0.5F}}), 1, 0.05);
    // The light's mean second moment is 2, which trials without weights overstate.
    const auto importance = [&](bool weighted) {
        return learn({uneven_trials(4000, 2, weighted, corner), {}}, {1, 1})[1].nodes[0].importance;
    };
    EXPECT_NEAR(importance(true), std::sqrt(2.0), 0.1);
    EXPECT_GT(importance(false), 1.8);
    // Scores that do not depend on the numbers cut nothing.
    std::size_t cut = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        std::uint32_t i = 0;
        const auto noise = [&](const LeSampleU&) { return Sampler(3, Purpose::test, 4, i++).next() < 0.05F; };
        cut += learn({uneven_trials(4000, seed, true, noise)}, {1})[0].nodes.size() > 1 ? 1 : 0;
    }
    EXPECT_LE(cut, 2U);
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
