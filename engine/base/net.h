// Implements the scrambled (0,2)-sequence: the first two Sobol dimensions under Owen's nested uniform
// scrambling.
//
// Sources: [Sobol 1967; Owen 1998; Kollig and Keller 2002]. The hash that replaces the scrambling tree has
// the form of [Laine and Karras 2011]: each of its steps carries bits only upwards, which makes it a nested
// permutation when applied to the reversed word. Further dimensions use numbers of [Joe and Kuo 2008].
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "engine/base/vec.h"

namespace lucerna {

// Reverses the bits of each byte of one or several words; the bytes keep their places.
template <typename Word>
constexpr Word reverse_bits_of_bytes(Word x) {
    x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
    x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
    return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
}

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
    return reverse_bits_of_bytes(__builtin_bswap32(x));
}

// These types put words into one vector register, because compilers do not vectorise this code by themselves.
using Words4 [[gnu::vector_size(16)]] = std::uint32_t;
using Words8 [[gnu::vector_size(32)]] = std::uint32_t;
using Floats4 [[gnu::vector_size(16)]] = float;
using Floats8 [[gnu::vector_size(32)]] = float;

// Reverses the bits of each word.
template <typename Words>
Words reverse_bits_each(Words x) {
    x = (x << 16) | (x >> 16);
    return reverse_bits_of_bytes(((x & 0x00ff00ffU) << 8) | ((x >> 8) & 0x00ff00ffU));
}

// Applies nested uniform scrambling to one or several words whose least significant bit comes first.
template <typename Word>
Word owen_scramble_reversed(Word x, Word seed) {
    x ^= x * 0x3d20adeaU;
    x += seed;
    x *= (seed >> 16) | 1U;
    x ^= x * 0x05526c56U;
    x ^= x * 0x53a22864U;
    return x;
}

// Applies nested uniform scrambling to a word whose most significant bit comes first.
inline std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
    return reverse_bits(owen_scramble_reversed(reverse_bits(x), seed));
}

// Returns the second Sobol dimension of an index, least significant bit first. Its generator matrix is
// Pascal's triangle modulo 2, whose entry (i, j) is 1 where all bits of i are bits of j. The product is
// therefore a sum over supersets, computed one bit of i and j at a time.
constexpr std::uint32_t sobol_1_reversed(std::uint32_t x) {
    x ^= (x >> 1) & 0x55555555U;
    x ^= (x >> 2) & 0x33333333U;
    x ^= (x >> 4) & 0x0f0f0f0fU;
    x ^= (x >> 8) & 0x00ff00ffU;
    return x ^ (x >> 16);
}
// Returns this dimension most significant bit first; the first dimension is reverse_bits.
constexpr std::uint32_t sobol_1(std::uint32_t index) {
    return reverse_bits(sobol_1_reversed(index));
}

// Returns the upper 31 bits, of which only the 24 from the first 1 on may be set, which a float holds. A
// number thus stays in the elementary interval of its word.
template <typename Words>
constexpr Words significant_bits(Words x) {
    Words lost = x >> 24;
    lost |= lost >> 1;
    lost |= lost >> 2;
    lost |= lost >> 4;
    return (x & ~lost) >> 1;
}
// Converts to [0,1). Small numbers are finer than 2^-24: a lamp's directions near its axis are mapped from
// them.
inline float to_unit(std::uint32_t x) {
    // The value is converted as a signed integer, which every processor can do in one instruction.
    return static_cast<float>(static_cast<std::int32_t>(significant_bits(x))) * 0x1p-31F;
}
inline Floats4 to_unit_each(Words4 x) {
    using Ints [[gnu::vector_size(16)]] = std::int32_t;
    return __builtin_convertvector((Ints)significant_bits(x), Floats4) * 0x1p-31F;
}
inline Floats8 to_unit_each(Words8 x) {
    using Ints [[gnu::vector_size(32)]] = std::int32_t;
    return __builtin_convertvector((Ints)significant_bits(x), Floats8) * 0x1p-31F;
}

inline constexpr std::size_t kSobolDimensions = 5;

namespace sobol {

// Holds one column of the generator matrices per bit of the index, with all dimensions side by side (eight
// words in one vector register). Each word is reversed, as the scrambling needs it.
using Words = std::array<std::uint32_t, 8>;
using Columns = std::array<Words, 32>;

// Defines a primitive polynomial modulo 2 by its degree, inner coefficients and first numbers of its
// recurrence.
struct Start {
    unsigned degree, inner;
    std::array<std::uint32_t, 3> m;
};
inline constexpr std::array<Start, kSobolDimensions - 1> kStarts{
    {{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}, {3, 2, {1, 1, 1}}}};

constexpr Columns make_columns() {
    Columns columns{};
    for (unsigned k = 0; k < 32; ++k) columns[k][0] = 1U << k;  // van der Corput: the index itself
    for (std::size_t d = 1; d < kSobolDimensions; ++d) {
        const Start& start = kStarts[d - 1];
        std::array<std::uint32_t, 32> v{};
        for (unsigned k = 0; k < 32; ++k) {
            if (k < start.degree) {
                v[k] = start.m[k] << (31 - k);
                continue;
            }
            v[k] = v[k - start.degree] ^ (v[k - start.degree] >> start.degree);
            for (unsigned i = 1; i < start.degree; ++i) {
                if ((start.inner >> (start.degree - 1 - i)) & 1U) v[k] ^= v[k - i];
            }
        }
        for (unsigned k = 0; k < 32; ++k) columns[k][d] = reverse_bits(v[k]);
    }
    return columns;
}
inline constexpr Columns kColumns = make_columns();

// Points of consecutive indices differ by these sums of the first 1, 2 … 32 columns.
inline constexpr Columns kSteps = [] {
    Columns steps = kColumns;
    for (std::size_t k = 1; k < 32; ++k) {
        for (std::size_t d = 0; d < 8; ++d) steps[k][d] ^= steps[k - 1][d];
    }
    return steps;
}();

// Returns the words of a point before scrambling, laid out as kColumns.
inline Words words_of(std::uint32_t index) {
    Words x{};
    for (; index != 0; index &= index - 1) {
        const Words& column = kColumns[static_cast<std::size_t>(std::countr_zero(index))];
        for (std::size_t d = 0; d < 8; ++d) x[d] ^= column[d];
    }
    return x;
}
// Advances the words from the previous point to point `index`.
inline void step_to(std::uint32_t index, Words& x) {
    const Words& step = kSteps[std::min<std::size_t>(std::countr_zero(index), 31)];
    for (std::size_t d = 0; d < 8; ++d) x[d] ^= step[d];
}
inline Floats8 scrambled(const Words& x, const Words& seeds) {
    const auto vector = [](const Words& w) { return Words8{w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]}; };
    return to_unit_each(reverse_bits_each(owen_scramble_reversed(vector(x), vector(seeds))));
}

}  // namespace sobol

// Returns point `index` of Sobol's sequence in five dimensions, each scrambled by a seed of its own. Any 2^k
// consecutive points that start at a multiple of 2^k are a net in every pair of dimensions and in all
// together.
inline std::array<float, kSobolDimensions> scrambled_sobol(
    std::uint32_t index, const std::array<std::uint32_t, kSobolDimensions>& seeds) {
    const sobol::Words x = sobol::words_of(index);
    std::array<float, kSobolDimensions> u{};
    for (std::size_t d = 0; d < kSobolDimensions; ++d) {
        u[d] = to_unit(reverse_bits(owen_scramble_reversed(x[d], seeds[d])));
    }
    return u;
}

}  // namespace lucerna
