// Nets across pixels: how the points of one (0,2)-sequence are handed out to the pixels of an image, so that
// the error of their estimates is blue noise.
//
// Neighbouring pixels whose samples are well distributed together err in opposite ways, and the eye, or a
// filter, sees the mean of their errors, which is less than that of independent ones [Ahmed and Wonka 2020].
// They take the samples of a pixel for a piece of one sequence, whose length has to be known. Here it need
// not be: pixels are a third coordinate of the sequence.
//
// Over the field of two elements, sample number s is a polynomial s(t) with the bits of s as coefficients,
// and the digits of the two Sobol dimensions are its power series at t = 0 and at t = 1. What makes 2^k
// samples a net is that a polynomial of degree below k cannot vanish at 0 and at 1 in k ways together. Other
// rational functions obey the same law [Niederreiter and Xing 1996]: with a pole of order j at most at
// q = t² + t + 1 beside the polynomials there are 4^j times as many, and none but 0 vanishes in k + 2j ways.
// So a pixel with the Morton number P, digits P_0, P_1 … in base 4 from the lowest, adds
//     sum over j of P_j(t) / q^(j+1),   P_j(t) of degree 0 or 1,
// and of every aligned block of 2^j × 2^j pixels any aligned 2^k samples are a net of 2^(k+2j) points, for
// all k and j; those of each pixel are a net as ever.
//
// As each draw shuffles the samples, it shuffles the pixels: the four quarters of each block by a random
// permutation, nested. Without that, pairs of pixels that are opposites of each other in one draw would be so
// in all, and what depends on two draws at once would be worse than by independent numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/base/net.h"

namespace lucerna {

// The bits of x and y < 2^16 in turn, x first: pixels in an order whose aligned blocks are squares.
constexpr std::uint32_t morton(std::uint32_t x, std::uint32_t y) {
    const auto spread = [](std::uint32_t v) {
        v = (v | v << 8) & 0x00ff00ffU;
        v = (v | v << 4) & 0x0f0f0f0fU;
        v = (v | v << 2) & 0x33333333U;
        return (v | v << 1) & 0x55555555U;
    };
    return spread(x) | spread(y) << 1;
}

namespace pixel_net {

// What is added to both dimensions of a point, first digit in the lowest bit: the first in the lower half.
using Offset = std::uint64_t;
using Table = std::array<std::array<Offset, 256>, 4>;

// Over 1 + t + t² = (1 + t³) / (1 + t).
constexpr std::uint32_t over_q(std::uint32_t series) {
    series ^= series << 1;
    for (const unsigned stride : {3U, 6U, 12U, 24U}) series ^= series << stride;
    return series;
}

// By bytes of a Morton number whose digits stand in reverse order, the highest in the lowest bits.
constexpr Table make_table() {
    std::array<Offset, 32> columns{};
    std::uint32_t pole = 1;
    for (std::size_t digit = 0; digit < 16; ++digit) {
        pole = over_q(pole);  // the same at 0 and at 1, t + 1 in the place of t: q(t + 1) is q(t)
        const std::size_t bit = 2 * (15 - digit);
        columns[bit] = pole | Offset{pole} << 32;
        columns[bit + 1] = (pole << 1) | Offset{pole ^ (pole << 1)} << 32;
    }
    Table table{};
    for (std::size_t byte = 0; byte < 4; ++byte) {
        for (std::size_t value = 0; value < 256; ++value) {
            for (std::size_t bit = 0; bit < 8; ++bit) {
                if ((value >> bit & 1U) != 0) table[byte][value] ^= columns[8 * byte + bit];
            }
        }
    }
    return table;
}
inline constexpr Table kTable = make_table();

}  // namespace pixel_net

// A pixel, ready to be shuffled by each draw.
class NetPixel {
  public:
    constexpr NetPixel() = default;
    explicit constexpr NetPixel(std::uint32_t morton) {
        const std::uint32_t reversed = reverse_bits(morton);
        std::uint64_t z = (reversed >> 1 & 0x55555555U) | (reversed & 0x55555555U) << 1;
        z = (z | z << 16) & 0x0000ffff0000ffffU;
        z = (z | z << 8) & 0x00ff00ff00ff00ffU;
        z = (z | z << 4) & 0x0f0f0f0f0f0f0f0fU;
        digits_ = (z << 2 | z << 4) & 0xccccccccccccccccU;
    }

    struct Offsets {
        std::uint32_t x, y;  // to add (xor) to the reversed digits of a point
    };
    Offsets offsets(std::uint32_t seed) const {
        const std::uint32_t p = shuffled(seed);
        const pixel_net::Offset offset =
            pixel_net::kTable[0][p & 0xffU] ^ pixel_net::kTable[1][p >> 8 & 0xffU] ^
            pixel_net::kTable[2][p >> 16 & 0xffU] ^ pixel_net::kTable[3][p >> 24];
        return {static_cast<std::uint32_t>(offset), static_cast<std::uint32_t>(offset >> 32)};
    }

  private:
    // Digits in reverse order, two bits each, permuted as all higher ones and the seed say.
    std::uint32_t shuffled(std::uint32_t seed) const {
        constexpr std::uint64_t kEach = 0x1111111111111111U;
        // Every step carries bits upwards only, from higher digits to lower ones (as owen_scramble_reversed
        // does): a digit's two bits are flipped, and the two below them, of no digit, are random.
        std::uint64_t z = digits_;
        const std::uint64_t spread = seed * 0x9e3779b97f4a7c15U;
        z += spread;
        z ^= z * 0x6a3f1b96c2d4a7e8U;
        z *= spread >> 32 | 1U;
        z ^= z * 0x2545f4914f6cdd1cU;
        z ^= z * 0xd1342543de82ef94U;
        // Flips leave alone which quarters differ in what bit; exchanging the bits and adding one to the
        // other does not.
        std::uint64_t low = z >> 2 & kEach, high = z >> 3 & kEach;
        const std::uint64_t exchanged = (low ^ high) & z;
        low ^= exchanged;
        high ^= exchanged ^ (low & z >> 1);
        std::uint64_t p = low | high << 1;
        p = (p | p >> 2) & 0x0f0f0f0f0f0f0f0fU;
        p = (p | p >> 4) & 0x00ff00ff00ff00ffU;
        p = (p | p >> 8) & 0x0000ffff0000ffffU;
        return static_cast<std::uint32_t>(p | p >> 16);
    }

    std::uint64_t digits_ = 0;  // four bits each, of which the upper two are the digit
};

}  // namespace lucerna
