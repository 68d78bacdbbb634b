// Closed forms of a pane, in double precision and independent of the library's code.
#pragma once

#include <cmath>

namespace lucerna::testing {

// Returns the Fresnel reflectance of unpolarised light at the boundary to a medium of relative index eta.
inline double boundary_reflectance(double cos_o, double eta) {
    const double sin2_t = (1 - cos_o * cos_o) / (eta * eta);
    if (sin2_t >= 1) return 1;
    const double cos_t = std::sqrt(1 - sin2_t);
    const double s = (cos_o - eta * cos_t) / (cos_o + eta * cos_t);
    const double p = (eta * cos_o - cos_t) / (eta * cos_o + cos_t);
    return (s * s + p * p) / 2;
}

// Returns the transmittance of a pane, all reflections between its two faces included: 1 - 2F/(1 + F).
inline double pane_transmittance(double cos_o, double eta = 1.5) {
    const double f = boundary_reflectance(cos_o, eta);
    return 1 - 2 * f / (1 + f);
}

// Returns the transmittance and the reflectance of an absorbing pane, as sums over the reflections between
// its faces. `inside` is the transmittance from face to face at normal incidence.
struct PaneSums {
    double transmitted = 0, reflected = 0;
};
inline PaneSums pane_sums(double cos_o, double eta, double inside) {
    const double f = boundary_reflectance(cos_o, eta);
    const double t = std::pow(inside, 1 / std::sqrt(1 - (1 - cos_o * cos_o) / (eta * eta)));
    PaneSums sums{0, f};
    double power = (1 - f) * t;  // what arrives at a face from inside
    for (int i = 0; power > 1e-12; ++i) {
        (i % 2 == 0 ? sums.transmitted : sums.reflected) += power * (1 - f);
        power *= f * t;
    }
    return sums;
}

}  // namespace lucerna::testing
