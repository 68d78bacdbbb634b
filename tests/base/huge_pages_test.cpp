// Memory in large pages keeps the guarantees that vectors rely on.
#include "engine/base/huge_pages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>

namespace lucerna {
namespace huge_pages_test {

TEST(HugePages, Vectors_OfAnySize_KeepTheirNumbersAndTheirAlignment) {
    for (const std::size_t n :
         {std::size_t{1}, std::size_t{1000}, std::size_t{1} << 19, (std::size_t{1} << 21) + 3}) {
        HugeVector<std::uint32_t> numbers(n);
        std::iota(numbers.begin(), numbers.end(), 0U);
        numbers.push_back(7);  // reallocates
        HugeVector<std::uint32_t> copy = numbers;
        numbers.clear();
        numbers.shrink_to_fit();
        EXPECT_EQ(copy[n - 1], n - 1);
        EXPECT_EQ(copy.back(), 7U);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(copy.data()) % 64, 0U);
    }
    EXPECT_TRUE(HugeVector<float>().empty());
}

// Memory that was used before is zeroed again.
TEST(HugePages, ZeroedVectors_OfAnySize_AreZero) {
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{1000}, std::size_t{1} << 19,
                                (std::size_t{1} << 21) + 3}) {
        for (int time = 0; time < 3; ++time) {
            ZeroedVector<std::uint32_t> numbers(n);
            EXPECT_EQ(std::count(numbers.begin(), numbers.end(), 0U), static_cast<std::ptrdiff_t>(n));
            std::iota(numbers.begin(), numbers.end(), 1U);
            const ZeroedVector<std::uint32_t> copy = numbers;
            numbers.resize(2 * n);
            EXPECT_TRUE(std::equal(copy.begin(), copy.end(), numbers.begin()));
            EXPECT_EQ(std::count(numbers.begin(), numbers.end(), 0U), static_cast<std::ptrdiff_t>(n));
        }
    }
}

}  // namespace huge_pages_test
}  // namespace lucerna
