// One cell of the sampling plane: the square between four neighbouring filters, and the flux density over it.
//
// With x, y in [0, 1] across the cell, h(x, y) = Σ e_ij φ_i(x) φ_j(y), where φ_0 = Φ falls from the left
// neighbour and φ_1 = 1 - Φ rises to the right one, for bells as for hats. Coefficients may be negative;
// light may not: what is emitted is max(0, h).
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/base/net.h"
#include "engine/base/vec.h"
#include "lights/bell.h"

namespace lucerna {

struct BellCell {
    // e[i][j]: i along u, j along v; 0 the lower neighbour, 1 the upper one. Any unit; W/m⁴ in a light field.
    float e[2][2] = {{0, 0}, {0, 0}};
    FilterBasis basis = FilterBasis::bell;

    float value(float x, float y) const {
        return basis == FilterBasis::hat ? value_of<HatBasis>(x, y) : value_of<BellBasis>(x, y);
    }
    // For whoever knows the basis: without a branch.
    template <typename Basis>
    float value_of(float x, float y) const {
        const float a = Basis::value(x);
        const float b = Basis::value(y);
        return a * (e[0][0] * b + e[0][1] * (1 - b)) + (1 - a) * (e[1][0] * b + e[1][1] * (1 - b));
    }
    bool has_negative() const { return (e[0][0] < 0) | (e[0][1] < 0) | (e[1][0] < 0) | (e[1][1] < 0); }

    // ∫∫ h over the unit square: each product of halves integrates to 1/4.
    double signed_mean() const {
        return 0.25 * (double{e[0][0]} + double{e[0][1]} + double{e[1][0]} + double{e[1][1]});
    }
    // ∫∫ max(0, h) over the unit square: exact without negative members; otherwise exact in x and by Gauss
    // quadrature in y, to about 1e-5 of the largest member.
    double clamped_mean() const;

    // A point of the cell with density max(0, h) / clamped_mean(). `u` in [0,1)². Cells with negative members
    // reject against their positive part with numbers that `salt` starts; after kTries a numerical inversion
    // takes over, which has the same density: the bound costs time, never accuracy. Requires clamped_mean() >
    // 0.
    V2f draw(const V2f& u, std::uint32_t salt) const;

    // Its parts, for whoever draws many at once: the first point, from the mixture of the positive members;
    // whether it stays; and what happens if it does not.
    template <typename Basis>
    V2f draw_positive(V2f u) const;
    template <typename Basis>
    bool stays(const V2f& at, std::uint32_t salt) const;
    V2f draw_again(std::uint32_t salt) const;

    static constexpr int kTries = 24;

    // The fallback on its own, for every kind of cell: inverts the marginal in y, then the conditional in x.
    // Slow.
    V2f draw_by_inversion(const V2f& u) const;
};

// Chooses the first of two with the given weights and leaves u uniform again. first + second > 0. Without a
// branch, as all of the following: loops over many cells become vector instructions.
inline bool choose_first(float& u, float first, float second) {
    const float p = first / (first + second);
    // Rounding may leave p = 1 with a second weight of zero, which is never chosen.
    const bool chosen = (u < p) | (p >= 1);
    const float from = chosen ? 0.0F : p;
    const float width = chosen ? p : 1 - p;            // > 0: of what was chosen
    u = std::min((u - from) / width, 0x1.fffffep-1F);  // the largest below 1
    return chosen;
}

// A pair of halves, each with density 2 Φ on its side. This and stays() must be in their loops: a call there
// leaves no vector instructions, and GCC would call them in a large file.
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
    // The finisher of MurmurHash3: every bit of the salt reaches every bit of the number.
    salt ^= salt >> 16;
    salt *= 0x85ebca6bU;
    salt ^= salt >> 13;
    salt *= 0xc2b2ae35U;
    salt ^= salt >> 16;
    // Without negative members the bound is the very value, and a number below 1 times it is less.
    return to_unit(salt) * bound < value_of<Basis>(at.x, at.y);
}

}  // namespace lucerna
