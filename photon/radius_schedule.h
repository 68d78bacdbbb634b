// The schedule of radii of progressive photon mapping, which shrink from pass to pass, with the variance and
// bias of the mean of the passes.
//
// Source: [Knaus and Zwicker 2011]. Pass i = 1, 2 … estimates density within r_i. Each pass has its own
// photons, so passes are independent. In a small disc the number of photons grows as r², so that
//
//   Var[pass i] = v / r_i²   (fewer photons)      Bias[pass i] = b r_i²   (second-order Taylor term)
//
// for some v, b at each point. The mean of N passes has variance (v/N²) Σ 1/r_i² and bias (b/N) Σ r_i². Let
// the variance of a pass grow by (i+1)/(i+α) from one to the next:
//
//   r²_{i+1} = r²_i (i + α)/(i + 1),  so  s_i = r²_i/r²_1 = Γ(i+α) / (Γ(1+α) Γ(i+1)) ~ i^{α-1}/Γ(1+α).
//
// Both sums telescope, since Γ(i+1+α)/Γ(i+1) - Γ(i+α)/Γ(i) = α Γ(i+α)/Γ(i+1) and
// Γ(i+2)/Γ(i+α) - Γ(i+1)/Γ(i+α-1) = (2-α) Γ(i+1)/Γ(i+α):
//
//   (1/N)  Σ s_i   = [Γ(N+1+α)/(Γ(1+α) Γ(N+1)) - 1] / (α N)                    ~ N^{α-1} / (α Γ(1+α))
//   (1/N²) Σ 1/s_i = [Γ(1+α) Γ(N+2)/Γ(N+α) - α] / ((2-α) N²)                   ~ N^{-α} Γ(1+α)/(2-α)
//
// Both vanish for 0 < α < 1: the mean is consistent. The mean square error falls as N^{-α} + N^{2α-2},
// fastest for α = 2/3, where both are N^{-2/3} (the error itself N^{-1/3}). α = 1 keeps the radius, and with
// it the bias. Light that is not estimated from photons (sampled lights, the area of the pixel) has a
// variance proportional to 1/N.
#pragma once

#include <cassert>
#include <cmath>
#include <cstdint>

#include "engine/base/elementary.h"

namespace lucerna {

class RadiusSchedule {
  public:
    // 0 < alpha <= 1.
    explicit RadiusSchedule(double alpha) : alpha_(alpha), gamma_(exp(log_gamma(1 + alpha))) {
        assert(alpha > 0 && alpha <= 1);
    }

    // Returns s = r² of pass `pass` (from 0 on) over that of the first. It does not depend on other passes.
    double r2_ratio(std::uint32_t pass) const {
        const double i = static_cast<double>(pass) + 1;
        return ratio(i + alpha_, i + 1) / gamma_;
    }
    // Returns the variance of the mean of `passes` >= 1 passes over that of the first pass.
    double variance_of_mean(std::uint32_t passes) const {
        const double n = passes;
        return (gamma_ * ratio(n + 2, n + alpha_) - alpha_) / ((2 - alpha_) * n * n);
    }
    // Returns the bias of the mean of `passes` >= 1 passes over that of the first pass.
    double bias_of_mean(std::uint32_t passes) const {
        const double n = passes;
        return (ratio(n + 1 + alpha_, n + 1) / gamma_ - 1) / (alpha_ * n);
    }

  private:
    // Returns Γ(a)/Γ(b), for a and b far below the values at which the difference of logarithms loses more
    // than 1e-6.
    static double ratio(double a, double b) {
        return exp(log_gamma(a) - log_gamma(b));
    }

    double alpha_, gamma_;
};

}  // namespace lucerna
