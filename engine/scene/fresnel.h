// Computes Fresnel reflectance of unpolarised light at a smooth boundary (Born and Wolf, Principles of
// Optics, 1.5 and 14.2).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

struct FresnelRefraction {
    float reflectance;  // [0,1]
    float cos_t;        // cosine of the refracted direction, >= 0; 0 under total reflection
};

// Returns the Fresnel reflectance between two dielectrics. `cos_o` in [0,1] is on the known side, `eta` > 0
// is the far side's index over the known side's.
inline FresnelRefraction fresnel_dielectric(float cos_o, float eta) {
    const float c = std::clamp(cos_o, 0.0F, 1.0F);
    const float sin2_t = (1 - c) * (1 + c) / (eta * eta);
    if (c == 0 || sin2_t >= 1) return {1, 0};
    const float cos_t = std::sqrt(1 - sin2_t);
    // Both denominators are positive, because c, eta and cos_t are.
    const float p = (eta * c - cos_t) / (eta * c + cos_t);
    const float s = (c - eta * cos_t) / (c + eta * cos_t);
    return {std::min(1.0F, 0.5F * (p * p + s * s)), cos_t};
}

// Returns one channel's reflectance from a dielectric onto a conductor of index eta + i k relative to it;
// eta, k >= 0. Double precision keeps squares of a large k from overflowing and differences of a small one
// from cancelling.
inline float fresnel_conductor(float cos_o, float eta, float k) {
    const double c = std::clamp(cos_o, 0.0F, 1.0F);
    if (c == 0) return 1;
    const double c2 = c * c;
    const double s2 = 1 - c2;
    const double e2 = sqr(static_cast<double>(eta));
    const double k2 = sqr(static_cast<double>(k));
    const double t0 = e2 - k2 - s2;
    const double a2b2 = std::sqrt(t0 * t0 + 4 * e2 * k2);  // a² + b²
    const double a = std::sqrt(std::max(0.0, 0.5 * (a2b2 + t0)));
    const double t1 = a2b2 + c2;  // > 0, because c is
    const double t2 = 2 * c * a;
    const double s = (t1 - t2) / (t1 + t2);
    const double t3 = c2 * a2b2 + s2 * s2;
    const double t4 = t2 * s2;
    // t3 is 0 only at normal incidence on eta = k = 0, where both polarisations are alike.
    const double p = t3 > 0 ? s * (t3 - t4) / (t3 + t4) : s;
    return static_cast<float>(std::clamp(0.5 * (p + s), 0.0, 1.0));
}

inline Rgb fresnel_conductor(float cos_o, const Rgb& eta, const Rgb& k) {
    return {fresnel_conductor(cos_o, eta.x, k.x), fresnel_conductor(cos_o, eta.y, k.y),
            fresnel_conductor(cos_o, eta.z, k.z)};
}

// The total reflectance of a dielectric's surface determines how much light reaches a coated base. CoatTable
// tabulates it once per material.

// Tabulates E(μ) of a GGX surface seen from outside at the cosine μ: the directional albedo of its
// reflection, with single bounces between facets. E is linear in μ between the table's points, and the means
// are those of the function that rough() returns, so that a coat and its base add up.
class CoatTable {
  public:
    // `eta` > 0 is the index inside over outside. With `alphas`, only those may be queried; for a brushed
    // surface (two different alphas) E is the largest over all azimuths, so that its base gets slightly too
    // little. Without, any isotropic alpha may be queried: E is linear in the cube root of α between 32
    // values up to 2 (errors up to 0.01 near grazing).
    explicit CoatTable(float eta, std::optional<V2f> alphas = std::nullopt);

    // Tells whether any isotropic alpha may be queried.
    bool any_alpha() const { return rows_.size() > 1; }
    float eta() const { return eta_; }
    // Returns E(μ), μ in [0,1]. `alpha` matters only if any_alpha().
    float rough(float mu, float alpha) const;
    float rough_mean(float alpha) const;  // 2 ∫ E μ dμ
    // These return the Fresnel reflectance from outside or from inside, and its mean, 2 ∫ F μ dμ.
    float smooth(float mu, bool entering) const;
    float smooth_mean(bool entering) const { return entering ? outside_mean_ : inside_mean_; }

  private:
    static constexpr int kCosines = 64;  // at μ = (i/63)²: denser towards grazing
    struct Row {
        std::array<float, kCosines> e;
        float mean = 0;
    };
    static Row make_row(float eta, const V2f& alphas);
    // Interpolates α between two rows.
    struct Between {
        const Row *low, *high;
        float part;  // weight of `high`
    };
    Between rows_about(float alpha) const;

    float eta_;
    float outside_mean_ = 0, inside_mean_ = 0;
    std::vector<Row> rows_;
};

}  // namespace lucerna
