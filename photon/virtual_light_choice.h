// Which lights of a set get a shadow ray, where all are looked at [igi 3].
//
// One number decides about all of them: chances are added up along the lights, and a light is taken wherever
// the sum, begun at that number, passes a whole one (systematic sampling). Each is taken with just its
// chance; but how many are taken can differ from the sum of chances by no more than one, and as neighbours in
// the order are neighbours in space, those taken lie spread over the scene.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "photon/virtual_light_worth.h"

namespace lucerna {

class StretchedRoulette {
  public:
    // u in [0,1).
    explicit StretchedRoulette(double u) : at_(u) {}
    // chance in [0,1]; sure of a chance of 1.
    bool survives(double chance) {
        at_ += chance;
        if (at_ < 1) return false;
        at_ -= 1;
        return true;
    }
    // Goes past many whose chances add up to `chances` if none of them survives.
    bool passes(double chances) {
        if (!(at_ + chances < 1)) return false;
        at_ += chances;
        return true;
    }

  private:
    double at_;
};

// Calls take(place, worth) for every light of the range whose worth is positive.
template <typename Take>
void for_each_worth(const VirtualLightStore& store, const VirtualLightRange& range, std::uint32_t begin,
                    std::uint32_t end, const LightReceiver& at, Take&& take) {
    for (std::uint32_t b = begin; b < end; ++b) {
        const Worths worth = worths(store.blocks()[b], b >= range.media, at);
        for (std::uint32_t i = 0; i < kBlock; ++i) {
            if (worth[i] > 0) take(static_cast<std::uint32_t>(b * kBlock + i), worth[i]);
        }
    }
}

// Takes about `rays` lights of the range, each with chance min(1, worth · rays / sum of worths): calls
// take(place, chance, worth). Where one of them brings more than its share of 1/rays, all rays but its own
// are for the others. rays > 0; u in [0,1).
template <typename Take>
void take_by_worth(const VirtualLightStore& store, const VirtualLightRange& range, const LightReceiver& at,
                   double rays, double u, Take&& take) {
    // Sums of parts are kept, so that a second look goes only where a light is taken.
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
            const Worths worth = worths(store.blocks()[b], b >= range.media, at);
            sums[parts] += sum_of(worth);
            for (const float w : worth) most[parts] = std::max(most[parts], w);
        }
        total += sums[parts];
    }
    if (!(total > 0)) return;

    const double sure = total / rays;  // of a light of this worth
    StretchedRoulette roulette(u);
    for (std::uint32_t part = 0; part < parts; ++part) {
        if (static_cast<double>(most[part]) <= sure && roulette.passes(sums[part] / sure)) continue;
        const std::uint32_t begin = range.surfaces + part * stride;
        for_each_worth(store, range, begin, std::min(begin + stride, range.end), at,
                       [&](std::uint32_t place, float worth) {
                           const double chance = std::min(1.0, static_cast<double>(worth) / sure);
                           if (roulette.survives(chance)) take(place, static_cast<float>(chance), worth);
                       });
    }
}

}  // namespace lucerna
