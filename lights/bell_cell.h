// One cell of the sampling plane: the square between four neighbouring filters, and the flux density over it.
//
// With x, y in [0, 1] across the cell, h(x, y) = Σ e_ij φ_i(x) φ_j(y), where φ_0 = Φ falls from the left
// neighbour and φ_1 = 1 - Φ rises to the right one. Coefficients may be negative; light may not: what is
// emitted is max(0, h).
#pragma once

#include <cstdint>

#include "engine/base/vec.h"
#include "lights/bell.h"

namespace lucerna {

struct BellCell {
    // e[i][j]: i along u, j along v; 0 the lower neighbour, 1 the upper one. Any unit; W/m⁴ in a light field.
    float e[2][2] = {{0, 0}, {0, 0}};

    float value(float x, float y) const {
        const float a = bell(x);
        const float b = bell(y);
        return a * (e[0][0] * b + e[0][1] * (1 - b)) + (1 - a) * (e[1][0] * b + e[1][1] * (1 - b));
    }
    bool has_negative() const { return e[0][0] < 0 || e[0][1] < 0 || e[1][0] < 0 || e[1][1] < 0; }

    // ∫∫ h over the unit square: each product of half-bells integrates to 1/4.
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

    static constexpr int kTries = 24;

    // The fallback on its own, for every kind of cell: inverts the marginal in y, then the conditional in x.
    // Slow.
    V2f draw_by_inversion(const V2f& u) const;
};

}  // namespace lucerna
