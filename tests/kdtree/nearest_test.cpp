// Tests that the k nearest are the k smallest, for any order of visits, one by one or in blocks.
#include "kdtree/nearest.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace lucerna {
namespace nearest_test {

// Bytes as keys make many ties.
std::vector<Neighbour> neighbours(const std::vector<std::uint8_t>& keys) {
    std::vector<Neighbour> all;
    for (std::uint32_t i = 0; i < keys.size(); ++i) all.push_back({i, static_cast<float>(keys[i])});
    return all;
}

void expect_equal(std::span<const Neighbour> found, std::span<const Neighbour> expected) {
    RC_ASSERT(found.size() == expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) RC_ASSERT(found[i].rank() == expected[i].rank());
}

RC_GTEST_PROP(Nearest, AnyOrder_SameResult, (std::vector<std::uint8_t> keys)) {
    const std::vector<Neighbour> all = neighbours(keys);
    const std::size_t k = 1 + keys.size() / 5;
    Nearest forward(k, INFINITY);
    Nearest backward(k, INFINITY);
    for (std::size_t i = 0; i < all.size(); ++i) {
        forward.take(all[i].key, all[i].index);
        const Neighbour& other = all[all.size() - 1 - i];
        backward.take(other.key, other.index);
    }
    std::vector<Neighbour> sorted = all;
    std::sort(sorted.begin(), sorted.end());
    sorted.resize(std::min(k, sorted.size()));
    expect_equal(forward.sorted(), sorted);
    expect_equal(backward.sorted(), sorted);
}

RC_GTEST_PROP(Nearest, Blocks_SameAsOneByOne, (std::vector<std::uint8_t> keys, std::uint8_t most)) {
    const auto bound = static_cast<float>(most) + 1;
    std::vector<Neighbour> expected;
    for (const Neighbour& n : neighbours(keys)) {
        if (n.key < bound) expected.push_back(n);
    }
    std::sort(expected.begin(), expected.end());
    const std::size_t k = 1 + keys.size() / 3;
    expected.resize(std::min(k, expected.size()));

    Nearest blocks(k, bound);
    for (std::size_t first = 0; first < keys.size(); first += 16) {
        std::array<float, 16> block;
        block.fill(std::numeric_limits<float>::quiet_NaN());  // unused places
        for (std::size_t i = first; i < std::min(keys.size(), first + 16); ++i) {
            block[i - first] = static_cast<float>(keys[i]);
        }
        blocks.take(block, static_cast<std::uint32_t>(first));
    }
    expect_equal(blocks.sorted(), expected);
}

TEST(Nearest, FarMoreThanFitInline_AllAreKept) {
    constexpr std::uint32_t kMany = 100'000;
    Nearest nearest(kMany, INFINITY);
    for (std::uint32_t i = 0; i < kMany; ++i) nearest.take(static_cast<float>(kMany - i), i);
    const auto found = nearest.sorted();
    ASSERT_EQ(found.size(), kMany);
    for (std::uint32_t i = 0; i < kMany; ++i) ASSERT_EQ(found[i].index, kMany - 1 - i);
}

TEST(Nearest, InfiniteAndNaNKeys_NeverCount) {
    Nearest nearest(3, INFINITY);
    nearest.take(INFINITY, 0);
    nearest.take(std::numeric_limits<float>::quiet_NaN(), 1);
    nearest.take(std::numeric_limits<float>::max(), 2);
    const auto found = nearest.sorted();
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].index, 2U);
}

TEST(Nearest, ManyTies_LowestIndicesStay_AndTheBoundKeepsThem) {
    Nearest nearest(5, 2);
    for (std::uint32_t i = 1000; i-- > 0;) {
        EXPECT_GE(nearest.take(1, i), 1);
    }
    const auto found = nearest.sorted();
    ASSERT_EQ(found.size(), 5U);
    for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(found[i].index, i);
}

}  // namespace nearest_test
}  // namespace lucerna
