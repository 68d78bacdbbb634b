// Scrambled (0,2)-sequence: the first two Sobol dimensions under Owen's nested uniform scrambling.
//
// Sources: Sobol 1967; Owen 1998; Kollig and Keller, "Efficient Multidimensional Sampling", 2002; the hash
// that stands for the scrambling tree is of the form of Laine and Karras, "Stratified Sampling for Stochastic
// Transparency", 2011: every step of it carries bits upwards only, which is what makes it a nested
// permutation when it works on the reversed word.
#pragma once

#include <cstdint>

#include "engine/base/vec.h"

namespace lucerna {

inline std::uint32_t reverse_bits(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
    x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
    return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
}

// Nested uniform scrambling of a word whose most significant bit comes first.
inline std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
    x = reverse_bits(x);
    x ^= x * 0x3d20adeaU;
    x += seed;
    x *= (seed >> 16) | 1U;
    x ^= x * 0x05526c56U;
    x ^= x * 0x53a22864U;
    return reverse_bits(x);
}

// Second Sobol dimension, whose generator matrix is Pascal's triangle modulo 2 (the first is reverse_bits).
inline std::uint32_t sobol_1(std::uint32_t index) {
    std::uint32_t result = 0;
    for (std::uint32_t v = 1U << 31; index != 0; index >>= 1, v ^= v >> 1) {
        if (index & 1U) result ^= v;
    }
    return result;
}

// [0,1) from the upper 24 bits: every value is exact in a float and 1 is never reached.
inline float to_unit(std::uint32_t x) {
    return static_cast<float>(x >> 8) * 0x1p-24F;
}

}  // namespace lucerna
