// How much a dielectric's surface reflects in all, and so how much it lets through: what stands above a
// coated base takes from it. Tabulated once per material.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// E(μ) of a GGX surface seen from outside at the cosine μ: the directional albedo of its reflection, single
// bounces between facets. Between the table's points E is linear in μ, and the means are those of the very
// function that rough() returns, so that a coat and its base add up.
class CoatTable {
  public:
    // `eta` > 0: index inside over outside. With `alphas` only those may be asked about; of a brushed surface
    // (two different ones) E is the largest over all azimuths: its base gets a little less than its due.
    // Without, any isotropic one, linear in the cube root of α between 32 up to 2 (errs by up to 0.01 near
    // grazing).
    explicit CoatTable(float eta, std::optional<V2f> alphas = std::nullopt);

    // Whether any isotropic surface may be asked about.
    bool any_alpha() const { return rows_.size() > 1; }
    float eta() const { return eta_; }
    // E(μ), μ in [0,1]; `alpha` counts only where any may be asked about.
    float rough(float mu, float alpha) const;
    float rough_mean(float alpha) const;  // 2 ∫ E μ dμ
    // Fresnel's reflectance, from outside or from inside, and its mean in the same sense.
    float smooth(float mu, bool entering) const;
    float smooth_mean(bool entering) const { return entering ? outside_mean_ : inside_mean_; }

  private:
    static constexpr int kCosines = 64;  // at μ = (i/63)²: denser towards grazing
    struct Row {
        std::array<float, kCosines> e;
        float mean = 0;
    };
    static Row make_row(float eta, const V2f& alphas);
    // Where α lies between two rows.
    struct Between {
        const Row *low, *high;
        float part;  // of `high`
    };
    Between rows_about(float alpha) const;

    float eta_;
    float outside_mean_ = 0, inside_mean_ = 0;
    std::vector<Row> rows_;
};

}  // namespace lucerna
