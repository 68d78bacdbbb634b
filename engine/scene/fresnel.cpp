#include "engine/scene/fresnel.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/scene/lobes.h"
#include "engine/scene/microfacet.h"

namespace lucerna {
namespace {

constexpr int kAlphas = 32;
constexpr float kLargestAlpha = 2;

float reflected_share(float eta, const V2f& alphas, float mu, float phi) {
    const float z =
        std::max(mu, 1e-6F);  // at grazing, the limit is that every visible facet reflects unshadowed
    const float r = std::sqrt(1 - z * z);
    const V3f wo(r * cos(phi), r * sin(phi), z);
    const Ggx facets(std::max(alphas.x, kLeastAlpha), std::max(alphas.y, kLeastAlpha));
    return mean_over_visible<1024>(facets, wo,
                                   [&](const V3f& m) {
                                       const float cos_o = wo.dot(m);
                                       const V3f wi = 2 * cos_o * m - wo;
                                       if (!(wi.z > 0)) return Rgb(0.0F);
                                       return Rgb(fresnel_dielectric(cos_o, eta).reflectance *
                                                  facets.shadowing_if_visible(wo, wi));
                                   })
        .x;
}

// Returns the maximum over azimuths of a quarter turn, which suffices by symmetry.
float largest_share(float eta, const V2f& alphas, float mu) {
    if (std::max(alphas.x, alphas.y) < kSmoothAlpha) return fresnel_dielectric(mu, eta).reflectance;
    if (alphas.x == alphas.y) return reflected_share(eta, alphas, mu, 0);
    constexpr int kTurns = 8;
    float largest = 0;
    for (int i = 0; i <= kTurns; ++i) {
        const float phi = kPi / 2 * static_cast<float>(i) / kTurns;
        largest = std::max(largest, reflected_share(eta, alphas, mu, phi));
    }
    return largest;
}

// Returns 2 ∫ F μ dμ by the midpoint rule in sqrt(μ), accurate to 1e-5 even with the kink of total
// reflection.
float mean_fresnel(float eta) {
    constexpr int kSteps = 16384;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps;
        sum += 4 * t * t * t *
               static_cast<double>(fresnel_dielectric(static_cast<float>(t * t), eta).reflectance);
    }
    return static_cast<float>(sum / kSteps);
}

}  // namespace

CoatTable::Row CoatTable::make_row(float eta, const V2f& alphas) {
    Row row{};
    const auto cosine = [](int i) { return sqr(static_cast<float>(i) / (kCosines - 1)); };
    for (int i = 0; i < kCosines; ++i) row.e[i] = largest_share(eta, alphas, cosine(i));
    double sum = 0;  // 2 ∫ E μ dμ, in closed form over each linear piece
    for (int i = 0; i + 1 < kCosines; ++i) {
        const double a = static_cast<double>(cosine(i)), b = static_cast<double>(cosine(i + 1));
        const double ea = static_cast<double>(row.e[i]), eb = static_cast<double>(row.e[i + 1]);
        sum += (b - a) * (ea * (2 * a + b) + eb * (a + 2 * b)) / 3;
    }
    row.mean = static_cast<float>(sum);
    return row;
}

CoatTable::CoatTable(float eta, std::optional<V2f> alphas)
    : eta_(eta), outside_mean_(mean_fresnel(eta)), inside_mean_(mean_fresnel(1 / eta)) {
    if (alphas) {
        if (std::max(alphas->x, alphas->y) >= kSmoothAlpha) rows_.push_back(make_row(eta, *alphas));
        return;
    }
    for (int i = 0; i < kAlphas; ++i) {
        const float x = static_cast<float>(i) / (kAlphas - 1);
        const float alpha = kLargestAlpha * x * x * x;
        rows_.push_back(make_row(eta, V2f(alpha, alpha)));
    }
}

CoatTable::Between CoatTable::rows_about(float alpha) const {
    if (rows_.size() == 1) return {&rows_[0], &rows_[0], 0};
    const float x = cbrt(std::clamp(alpha / kLargestAlpha, 0.0F, 1.0F)) * (kAlphas - 1);
    const int low = std::min(static_cast<int>(x), kAlphas - 2);
    return {&rows_[low], &rows_[low + 1], x - static_cast<float>(low)};
}

float CoatTable::rough(float mu, float alpha) const {
    if (rows_.empty() || (any_alpha() && alpha < kSmoothAlpha)) return smooth(mu, true);
    const Between rows = rows_about(alpha);
    const float x = std::clamp(mu, 0.0F, 1.0F);
    const int low = std::min(static_cast<int>(std::sqrt(x) * (kCosines - 1)), kCosines - 2);
    constexpr float kUnit = 1.0F / (kCosines - 1);
    const float a = sqr(static_cast<float>(low) * kUnit), b = sqr(static_cast<float>(low + 1) * kUnit);
    const float part = (x - a) / (b - a);
    const auto along = [&](const Row& row) { return row.e[low] + part * (row.e[low + 1] - row.e[low]); };
    const float first = along(*rows.low);
    return rows.part > 0 ? first + rows.part * (along(*rows.high) - first) : first;
}

float CoatTable::rough_mean(float alpha) const {
    if (rows_.empty() || (any_alpha() && alpha < kSmoothAlpha)) return outside_mean_;
    const Between rows = rows_about(alpha);
    return rows.low->mean + rows.part * (rows.high->mean - rows.low->mean);
}

float CoatTable::smooth(float mu, bool entering) const {
    return fresnel_dielectric(mu, entering ? eta_ : 1 / eta_).reflectance;
}

}  // namespace lucerna
