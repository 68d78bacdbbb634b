// Chooses which lights of a set get a shadow ray, after an estimate of every light [Pharr 2004].
//
// One random number decides about all lights (systematic sampling): the chances are added up along the
// lights, beginning at that number, and a light is selected wherever the sum passes an integer. Each has
// exactly its chance, but the number of selected lights differs from the sum of the chances by no more than
// one. As neighbours in the order are neighbours in space, the selected lights are spread over the scene.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "engine/vpl/vpl_contribution.h"

namespace lucerna {

// Samples a sequence systematically: each element is selected with its own chance, by one number for all.
class SystematicSampling {
  public:
    // Requires u in [0,1).
    explicit SystematicSampling(double u) : at_(u) {}
    // Tells whether the next element is selected, whose chance is in [0,1]. A chance of 1 is certain.
    bool selects(double chance) {
        at_ += chance;
        if (at_ < 1) return false;
        at_ -= 1;
        return true;
    }
    // Skips elements whose chances add up to `chances` and returns true, if none of them is selected.
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

// Selects about `rays` lights of the range, each with chance min(1, estimate · rays / sum of estimates), and
// calls visit(place, chance, estimate). A light that brings more than 1/rays of the sum is certain to be
// selected, once. rays > 0; u in [0,1).
template <typename Visit>
void sample_by_contribution(const VplStore& store, const VplRange& range, const LightReceiver& at,
                            double rays, double u, Visit&& visit) {
    // The sums of parts are kept, so that the second pass visits only parts in which a light is selected.
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

    const double sure = total / rays;  // lights of at least this estimate are certain to be selected
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
