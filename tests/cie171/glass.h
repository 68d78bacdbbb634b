// The plate of clear glass of the cases' scenes: 6 mm, index 1.52, absorption 7.07 per metre.
#pragma once

#include <cmath>

namespace lucerna::cie171 {

// Returns the transmittance of a plate for one polarisation, or for an average treated as one: reflectance
// `r` of either side and internal transmittance `t`, with all reflections between the sides.
inline double plate(double r, double t) {
    return (1 - r) * (1 - r) * t / (1 - r * r * t * t);
}

struct Transmittance {
    double unpolarised;  // by the mean reflectance of both polarisations at each side, as rendered
    double exact;        // the mean transmittance of both polarisations
};
inline Transmittance glass(double cosine) {
    const double inside = std::sqrt(1 - (1 - cosine * cosine) / (1.52 * 1.52));
    const double s = std::pow((cosine - 1.52 * inside) / (cosine + 1.52 * inside), 2);
    const double p = std::pow((1.52 * cosine - inside) / (1.52 * cosine + inside), 2);
    const double t = std::exp(-7.07 * 0.006 / inside);
    return {plate((s + p) / 2, t), (plate(s, t) + plate(p, t)) / 2};
}

}  // namespace lucerna::cie171
