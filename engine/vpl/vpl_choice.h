// Which lights of a set get a shadow ray, where all are looked at [Pharr 2004].
//
// One number decides about all of them: chances are added up along the lights, and a light is taken wherever
// the sum, begun at that number, passes a whole one (systematic sampling). Each is taken with just its
// chance; but how many are taken can differ from the sum of chances by no more than one, and as neighbours in
// the order are neighbours in space, those taken lie spread over the scene.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "engine/vpl/vpl_contribution.h"

namespace lucerna {

// Systematic sampling of a sequence: each element is selected with its own chance, by one number for all.
class SystematicSampling {
  public:
    // u in [0,1).
    explicit SystematicSampling(double u) : at_(u) {}
    // chance in [0,1]; sure of a chance of 1.
    bool selects(double chance) {
        at_ += chance;
        if (at_ < 1) return false;
        at_ -= 1;
        return true;
    }
    // Passes many whose chances add up to `chances` if none of them is selected.
    bool passes(double chances) {
        if (!(at_ + chances < 1)) return false;
        at_ += chances;
        return true;
    }

  private:
    double at_;
};

// Calls visit(place, estimate) for every light of the range whose estimate is positive.
template <typename Visit>
void for_each_contribution(const VplStore& store, const VplRange& range, std::uint32_t begin,
                           std::uint32_t end, const LightReceiver& at, Visit&& visit) {
    for (std::uint32_t b = begin; b < end; ++b) {
        const ContributionEstimates estimate =
            estimate_contributions(store.blocks()[b], b >= range.media, at);
        for (std::uint32_t i = 0; i < kBlock; ++i) {
            if (estimate[i] > 0) visit(static_cast<std::uint32_t>(b * kBlock + i), estimate[i]);
        }
    }
}

// Takes about `rays` lights of the range, each with chance min(1, estimate · rays / sum of estimates): calls
// visit(place, chance, estimate). Where one of them brings more than its share of 1/rays, all rays but its
// own are for the others. rays > 0; u in [0,1).
template <typename Visit>
void sample_by_contribution(const VplStore& store, const VplRange& range, const LightReceiver& at,
                            double rays, double u, Visit&& visit) {
    // Sums of parts are kept, so that the second pass visits only parts in which a light is chosen.
    constexpr std::uint32_t kParts = 256;
    std::array<double, kParts> sums;
    std::array<float, kParts> most;
    const std::uint32_t blocks = range.end - range.surfaces;
    const std::uint32_t stride = std::max(1U, (blocks + kParts - 1) / kParts);
    double total = 0;
    std::uint32_t parts = 0;
    for (std::uint32_t begin = range.surfaces; begin < range.end; begin += stride, ++parts) {
        sums[parts] = 0;
        most[parts] = 0;
        for (std::uint32_t b = begin; b < std::min(begin + stride, range.end); ++b) {
            const ContributionEstimates estimate =
                estimate_contributions(store.blocks()[b], b >= range.media, at);
            sums[parts] += sum_of(estimate);
            for (const float w : estimate) most[parts] = std::max(most[parts], w);
        }
        total += sums[parts];
    }
    if (!(total > 0)) return;

    const double sure = total / rays;  // of a light of this estimate
    SystematicSampling selection(u);
    for (std::uint32_t part = 0; part < parts; ++part) {
        if (static_cast<double>(most[part]) <= sure && selection.passes(sums[part] / sure)) continue;
        const std::uint32_t begin = range.surfaces + part * stride;
        for_each_contribution(store, range, begin, std::min(begin + stride, range.end), at,
                              [&](std::uint32_t place, float estimate) {
                                  const double chance = std::min(1.0, static_cast<double>(estimate) / sure);
                                  if (selection.selects(chance))
                                      visit(place, static_cast<float>(chance), estimate);
                              });
    }
}

}  // namespace lucerna
