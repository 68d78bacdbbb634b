// Forms nets across pixels: assigns the points of one (0,2)-sequence to the pixels of an image so that the
// error of their estimates is blue noise.
//
// Neighbouring pixels whose samples are well distributed together have opposite errors, and the eye or a
// filter sees the mean of their errors, which is smaller than that of independent ones [Ahmed and Wonka
// 2020]. They take a pixel's samples as a section of one sequence, whose length must be known. Here it need
// not be known, because pixels are a third coordinate of the sequence.
//
// Over the field of two elements, sample number s is a polynomial s(t) with the bits of s as coefficients,
// and the digits of the two Sobol dimensions are its power series at t = 0 and at t = 1. 2^k samples form a
// net because a nonzero polynomial of degree below k cannot vanish at 0 and at 1 in k ways together. Other
// rational functions obey the same law [Niederreiter and Xing 1996]: with a pole of order at most j at q = t²
// + t + 1 in addition to the polynomials, there are 4^j times as many functions, and none but 0 vanishes in k
// + 2j ways. Therefore a pixel with the Morton number P, whose base-4 digits from the lowest are P_0, P_1 …,
// adds
//     sum over j of P_j(t) / q^(j+1),   P_j(t) of degree 0 or 1.
// Then, for all k and j, any aligned 2^k samples of every aligned block of 2^j × 2^j pixels are a net of
// 2^(k+2j) points. The samples of each pixel alone are a net as usual.
//
// Each draw shuffles the pixels as it shuffles the samples: it permutes the four quarters of each block at
// random, nested. Otherwise pairs of pixels that are opposites in one draw would be so in all draws, and
// quantities that depend on two draws at once would be worse than with independent numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/base/net.h"

namespace lucerna {

// Interleaves the bits of x and y < 2^16, x first: an order of pixels whose aligned blocks are squares.
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

// An Offset is added to both dimensions of a point. The first digit is in the lowest bit, the first dimension
// in the lower half.
using Offset = std::uint64_t;
using Table = std::array<std::array<Offset, 256>, 4>;

// Divides by 1 + t + t² = (1 + t³) / (1 + t).
constexpr std::uint32_t over_q(std::uint32_t series) {
    series ^= series << 1;
    for (const unsigned stride : {3U, 6U, 12U, 24U}) series ^= series << stride;
    return series;
}

// Returns offsets by bytes of a Morton number with digits in reverse order, the highest in the lowest bits.
constexpr Table make_table() {
    std::array<Offset, 32> columns{};
    std::uint32_t pole = 1;
    for (std::size_t digit = 0; digit < 16; ++digit) {
        pole = over_q(pole);  // the same at 0 and at 1, where t + 1 replaces t, because q(t + 1) = q(t)
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

// Holds a pixel, prepared for the shuffling of each draw.
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
        std::uint32_t x, y;  // to be added (xor) to the reversed digits of a point
    };
    Offsets offsets(std::uint32_t seed) const {
        const std::uint32_t p = shuffled(seed);
        const pixel_net::Offset offset =
            pixel_net::kTable[0][p & 0xffU] ^ pixel_net::kTable[1][p >> 8 & 0xffU] ^
            pixel_net::kTable[2][p >> 16 & 0xffU] ^ pixel_net::kTable[3][p >> 24];
        return {static_cast<std::uint32_t>(offset), static_cast<std::uint32_t>(offset >> 32)};
    }

  private:
    // Returns the digits in reverse order, two bits each, permuted by the seed and all higher digits.
    std::uint32_t shuffled(std::uint32_t seed) const {
        constexpr std::uint64_t kEach = 0x1111111111111111U;
        // Every step carries bits only upwards, from higher digits to lower ones (as owen_scramble_reversed
        // does). It flips a digit's two bits and makes the two unused bits below them random.
        std::uint64_t z = digits_;
        const std::uint64_t spread = seed * 0x9e3779b97f4a7c15U;
        z += spread;
        z ^= z * 0x6a3f1b96c2d4a7e8U;
        z *= spread >> 32 | 1U;
        z ^= z * 0x2545f4914f6cdd1cU;
        z ^= z * 0xd1342543de82ef94U;
        // Flips do not change which quarters differ in which bit, but exchanging and adding the bits do.
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
