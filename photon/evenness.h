// Whether the light on a disc has structure: edges, gradients, spots; by the photons found there [Lin 2020].
//
// The disc is cut into cells of equal area. If the light is even, each cell receives the same flux but for
// noise: of photons with powers w_i each cell's sum S_b has the mean S/B and, as which photons there are is
// random as well as where they lie, the variance Q/B with Q = Σ w_i² (a compound Poisson process; for equal
// powers these are counts). Then
//
//   X = (B/Q) Σ (S_b - S/B)²
//
// follows chi-squared with B - 1 degrees of freedom where cells hold several photons each. Unevenness of a
// relative standard deviation c between cells adds c² S²/Q to its mean, S²/Q being the number of photons for
// equal powers: what the test finds is what stands out of the noise of as many photons.
//
// Each colour channel is tested for itself, so that a border between two colours is found; together they find
// structure in even light as often as stated, and less often where photons are of a net: these lie more
// evenly than independent ones.
#pragma once

#include <array>
#include <cstddef>

#include "engine/base/vec.h"

namespace lucerna {

class EvennessTest {
  public:
    // Tests a disc with unit normal n.
    explicit EvennessTest(const V3f& n) : frame_(n) { sums_.fill(V3d(0.0)); }

    // A photon that crosses the disc at `offset` from its centre, at the share rho2 in [0,1] of the squared
    // radius.
    void add(const V3f& offset, float rho2, const Rgb& power);

    // Whether the light is not even. Even light is called structured with a probability of kFalse.
    bool finds_structure() const;

    static constexpr double kFalse = 0.01;

  private:
    static constexpr std::size_t kRings = 3, kSectors = 4, kCells = kRings * kSectors;
    // Chi-squared with kCells - 1 degrees of freedom is larger with a probability of kFalse/3.
    static constexpr double kCritical = 27.917;

    Frame frame_;
    std::array<V3d, kCells> sums_;
    V3d squares_{0.0};
};

}  // namespace lucerna
