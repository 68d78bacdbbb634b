// Tests whether the light on a disc has structure (edges, gradients, spots) by the photons found there [Lin
// 2020].
//
// The disc is divided into B cells of equal area. If the light is even, every cell receives the same flux up
// to noise. The sum S_b of the powers w_i in a cell then has the mean S/B and, since both the number of
// photons and their positions are random, the variance Q/B with Q = Σ w_i² (a compound Poisson process; for
// equal powers the sums are counts). Then
//
//   X = (B/Q) Σ (S_b - S/B)²
//
// follows a chi-squared distribution with B - 1 degrees of freedom if each cell holds several photons.
// Unevenness of relative standard deviation c between cells adds c² S²/Q to its mean, where S²/Q is the
// number of photons if powers are equal: the test detects what stands out of the noise of that many photons.
//
// Each colour channel is tested by itself, so that an edge between two colours is found. Together the
// channels report structure in even light at most as often as stated, and less often if the photons come from
// a low-discrepancy net, which places them more evenly than independent samples.
#pragma once

#include <array>
#include <cstddef>

#include "engine/base/vec.h"

namespace lucerna {

class EvennessTest {
  public:
    // Tests a disc with unit normal n.
    explicit EvennessTest(const V3f& n) : frame_(n) { sums_.fill(V3d(0.0)); }

    // Adds a photon that crosses the disc at `offset` from its centre; rho2 in [0,1] is its squared distance
    // as a fraction of the squared radius.
    void add(const V3f& offset, float rho2, const Rgb& power);

    // Returns whether the light is uneven. The false positive rate for even light is kFalse.
    bool finds_structure() const;

    static constexpr double kFalse = 0.01;

  private:
    static constexpr std::size_t kRings = 3, kSectors = 4, kCells = kRings * kSectors;
    // A chi-squared variable with kCells - 1 degrees of freedom exceeds this with probability kFalse/3, for
    // three channels.
    static constexpr double kCritical = 27.917;

    Frame frame_;
    std::array<V3d, kCells> sums_;
    V3d squares_{0.0};
};

}  // namespace lucerna
