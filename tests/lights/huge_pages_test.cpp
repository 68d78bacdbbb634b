// Memory in large pages keeps the guarantees that vectors rely on.
#include "lights/huge_pages.h"

#include <gtest/gtest.h>

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

}  // namespace huge_pages_test
}  // namespace lucerna
