// The suggestion for a mistyped name is the nearest one, at a bounded cost for any input.
#include "engine/text/spelling.h"

#include <gtest/gtest.h>

#include <ctime>
#include <string>
#include <vector>

namespace lucerna {
namespace spelling_test {

std::string hint(std::string_view name, const std::vector<std::string_view>& known) {
    return did_you_mean(name, known);
}

TEST(Names, EditDistance_CountsInsertionsDeletionsSubstitutionsAndSwaps) {
    EXPECT_EQ(edit_distance("", ""), 0U);
    EXPECT_EQ(edit_distance("radius", "radius"), 0U);
    EXPECT_EQ(edit_distance("radius", "radus"), 1U);
    EXPECT_EQ(edit_distance("radius", "raduis"), 1U);
    EXPECT_EQ(edit_distance("radius", "Radiuss"), 2U);
    EXPECT_EQ(edit_distance("abc", "xyz"), 3U);
}

TEST(Names, Mistyped_IsAnsweredByTheNearest) {
    EXPECT_EQ(hint("raduis", {"height", "radius", "radii"}), "did you mean \"radius\"? ");
    EXPECT_EQ(hint("colour", {"height", "radius"}), "");
    EXPECT_EQ(hint("x", {}), "");
    EXPECT_EQ(hint("two\nlines", {"two\nline"}), "");
}

TEST(Names, LongWords_AreNoNamesAndGetNoHint) {
    const std::string name(100'000, 'a');
    EXPECT_EQ(hint(name, {name}), "");
    EXPECT_EQ(hint("a", {name}), "");
}

// A hundred thousand words of a hundred thousand letters, and as many of the maximum length of a word.
TEST(Names, ManyAndLongWords_TakeLessThanASecond) {
    const std::string huge(100'000, 'a'), wide(64, 'b');
    const std::vector<std::string_view> known(100'000, huge), near(100'000, wide);
    const std::clock_t begin = std::clock();
    EXPECT_EQ(hint(std::string(100'000, 'b'), known), "");
    EXPECT_EQ(hint(std::string(64, 'c'), near), "");
    EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 1);
}

}  // namespace spelling_test
}  // namespace lucerna
