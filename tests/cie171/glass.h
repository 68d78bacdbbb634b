// The plate of clear glass of the cases' scenes: 6 mm, index 1.52, absorption 7.07 per metre.
#pragma once

#include <cmath>

namespace lucerna::cie171 {

// Of one polarisation each, or of what is taken as both: reflectance `r` of either side, internal
// transmittance `t`, all reflections between the sides counted.
inline double plate(double r, double t) {
    return (1 - r) * (1 - r) * t / (1 - r * r * t * t);
}

struct Transmittance {
    double unpolarised;  // the mean reflectance of both polarisations at each side: what is rendered
    double exact;        // the mean transmittance of both
};
inline Transmittance glass(double cosine) {
    const double inside = std::sqrt(1 - (1 - cosine * cosine) / (1.52 * 1.52));
    const double s = std::pow((cosine - 1.52 * inside) / (cosine + 1.52 * inside), 2);
    const double p = std::pow((1.52 * cosine - inside) / (1.52 * cosine + inside), 2);
    const double t = std::exp(-7.07 * 0.006 / inside);
    return {plate((s + p) / 2, t), (plate(s, t) + plate(p, t)) / 2};
}

}  // namespace lucerna::cie171
