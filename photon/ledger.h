// Balances the power of light paths. Every particle's power is booked when it is emitted and again when it
// ends:
//
//   emitted = absorbed + media + escaped + not_followed + cut + roulette
//
// `roulette` is the power removed by Russian roulette minus the power added by it, with mean 0. In media
// whose coefficients depend on the colour, one sampled distance serves all channels, and `media` also holds
// the resulting random deviation, again with mean 0. No other power may be missing.
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/base/vec.h"

namespace lucerna {

struct Ledger {
    V3d emitted{0, 0, 0};       // W, as all below; not yet divided by the number of paths
    V3d absorbed{0, 0, 0};      // by surfaces
    V3d media{0, 0, 0};         // absorbed by participating media
    V3d escaped{0, 0, 0};       // left the scene
    V3d not_followed{0, 0, 0};  // carried by paths that the caller could no longer use
    V3d cut{0, 0, 0};           // carried by paths that reached the length limit
    V3d roulette{0, 0, 0};
    V3d scattered{0, 0, 0};         // at each scattering by media; not part of the balance
    std::uint64_t paths = 0;        // requested
    std::uint64_t not_emitted = 0;  // requested paths for which the light had no sample
    std::uint64_t hits = 0;
    std::uint64_t scatterings = 0;  // in media

    void add(const Ledger& other) {
        emitted += other.emitted;
        absorbed += other.absorbed;
        media += other.media;
        escaped += other.escaped;
        not_followed += other.not_followed;
        cut += other.cut;
        roulette += other.roulette;
        scattered += other.scattered;
        paths += other.paths;
        not_emitted += other.not_emitted;
        hits += other.hits;
        scatterings += other.scatterings;
    }

    // Scales sums over paths to the power of the scene; `factor` is 1 / number of paths.
    void scale(double factor) {
        for (V3d* entry : {&emitted, &absorbed, &media, &escaped, &not_followed, &cut, &roulette, &scattered})
            *entry *= factor;
    }

    // Returns |emitted - all ends| / emitted of the worst channel, or 0 if nothing was emitted.
    double imbalance() const {
        const V3d rest = emitted - absorbed - media - escaped - not_followed - cut - roulette;
        double worst = 0;
        for (int c = 0; c < 3; ++c) {
            if (emitted[c] > 0) worst = std::fmax(worst, std::fabs(rest[c]) / emitted[c]);
        }
        return worst;
    }
};

}  // namespace lucerna
