// A cell of the sampling plane: the square between four neighbouring filters and the flux density over it.
//
// With x, y in [0, 1] across the cell, h(x, y) = Σ e_ij φ_i(x) φ_j(y), where φ_0 = Φ falls from the left
// neighbour and φ_1 = 1 - Φ rises to the right one, for bells and hats alike. Coefficients may be negative;
// the emitted density is max(0, h).
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/base/net.h"
#include "engine/base/vec.h"
#include "lights/bell.h"

namespace lucerna {

struct BellCell {
    // e[i][j] has i along u and j along v, 0 for the lower neighbour, 1 for the upper one; W/m⁴ in a light
    // field.
    float e[2][2] = {{0, 0}, {0, 0}};
    FilterBasis basis = FilterBasis::bell;

    float value(float x, float y) const {
        return basis == FilterBasis::hat ? value_of<HatBasis>(x, y) : value_of<BellBasis>(x, y);
    }
    // Evaluates h without a branch, for callers that know the basis.
    template <typename Basis>
    float value_of(float x, float y) const {
        const float a = Basis::value(x);
        const float b = Basis::value(y);
        return a * (e[0][0] * b + e[0][1] * (1 - b)) + (1 - a) * (e[1][0] * b + e[1][1] * (1 - b));
    }
    bool has_negative() const { return (e[0][0] < 0) | (e[0][1] < 0) | (e[1][0] < 0) | (e[1][1] < 0); }

    // Returns ∫∫ h over the unit square; each product of half bells integrates to 1/4.
    double signed_mean() const {
        return 0.25 * (double{e[0][0]} + double{e[0][1]} + double{e[1][0]} + double{e[1][1]});
    }
    // Returns ∫∫ max(0, h) over the unit square. It is exact without negative coefficients; otherwise it is
    // exact in x and uses Gauss quadrature in y, to about 1e-5 of the largest coefficient.
    double clamped_mean() const;

    // Draws a point of the cell with density max(0, h) / clamped_mean(). `u` is in [0,1)². Cells with
    // negative coefficients use rejection from their positive part, with numbers seeded by `salt`. After
    // kTries a numerical inversion takes over, which has the same density, so that the limit costs time but
    // no accuracy. Requires clamped_mean() > 0.
    V2f draw(const V2f& u, std::uint32_t salt) const;

    // The stages of draw(), for bulk draws: draw_positive() draws from the mixture of the positive
    // coefficients, stays() accepts or rejects the point, and draw_again() replaces a rejected one.
    template <typename Basis>
    V2f draw_positive(V2f u) const;
    template <typename Basis>
    bool stays(const V2f& at, std::uint32_t salt) const;
    V2f draw_again(std::uint32_t salt) const;

    static constexpr int kTries = 24;

    // Inverts the marginal in y, then the conditional in x. This slow fallback works for every cell.
    V2f draw_by_inversion(const V2f& u) const;
};

// Chooses the first of two with the given weights and makes u uniform again. Requires first + second > 0. It
// and the functions below are branch-free, so that loops over many cells become vector instructions.
inline bool choose_first(float& u, float first, float second) {
    const float p = first / (first + second);
    // With p = 1, by rounding or a second weight of 0, the first is always chosen.
    const bool chosen = (u < p) | (p >= 1);
    const float from = chosen ? 0.0F : p;
    const float width = chosen ? p : 1 - p;  // width of the chosen one, > 0
    u = std::min((u - from) / width, kBelowOne);
    return chosen;
}

// Draws from a product of half bells, each with density 2 Φ on its side. This and stays() must be inlined: a
// call prevents vector instructions, and GCC would emit one in a large file.
template <typename Basis>
[[gnu::always_inline]] inline V2f BellCell::draw_positive(V2f u) const {
    const float e00 = std::max(0.0F, e[0][0]), e01 = std::max(0.0F, e[0][1]);
    const float e10 = std::max(0.0F, e[1][0]), e11 = std::max(0.0F, e[1][1]);
    const bool left = choose_first(u.x, e00 + e01, e10 + e11);
    const bool low = choose_first(u.y, left ? e00 : e10, left ? e01 : e11);
    const float x = Basis::inverse_integral(0.5F * u.x);
    const float y = Basis::inverse_integral(0.5F * u.y);
    return {left ? x : 1 - x, low ? y : 1 - y};
}

template <typename Basis>
[[gnu::always_inline]] inline bool BellCell::stays(const V2f& at, std::uint32_t salt) const {
    const float a = Basis::value(at.x), b = Basis::value(at.y);
    const float bound = a * (std::max(0.0F, e[0][0]) * b + std::max(0.0F, e[0][1]) * (1 - b)) +
                        (1 - a) * (std::max(0.0F, e[1][0]) * b + std::max(0.0F, e[1][1]) * (1 - b));
    // The finisher of MurmurHash3 lets every bit of the salt affect every bit of the number.
    salt ^= salt >> 16;
    salt *= 0x85ebca6bU;
    salt ^= salt >> 13;
    salt *= 0xc2b2ae35U;
    salt ^= salt >> 16;
    // Without negative coefficients the bound equals the value, which exceeds a number below 1 times it.
    return to_unit(salt) * bound < value_of<Basis>(at.x, at.y);
}

}  // namespace lucerna
