// Tests that the order of many points computed by several ranks is that of one process.
#include <gtest/gtest.h>

#include <random>

#include "kdtree/box_tree.h"
#include "tests/support/thread_communicator.h"

namespace lucerna {
namespace order_by_ranks_test {

TEST(BoxOrder, ByRanks_IsThatOfOneProcess) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> place(-1, 1);
    std::vector<V3f> points(200'000);
    for (V3f& p : points) p = {place(random), place(random), std::round(8 * place(random)) / 8};
    const std::vector<std::uint32_t> expected = box_order(points, {2});
    for (const int size : {2, 3}) {
        testing::on_ranks(size, {1, 2}, [&](Ranks& ranks) {
            EXPECT_EQ(box_order(points, {ranks.threads(ranks.rank()), &ranks}), expected);
            EXPECT_EQ(ranks.traffic().count("order of points"), 1U);  // the work was shared
        });
    }
}

}  // namespace order_by_ranks_test
}  // namespace lucerna
