// Where the light went. Every particle's power is booked when it leaves and again when it ends:
//
//   emitted = absorbed + media + escaped + not_followed + cut + roulette
//
// `roulette` is what Russian roulette took minus what it gave: its mean is 0. Where a medium treats colours
// differently, one distance serves them all, and `media` holds the chance of that, too, with mean 0. Nothing
// else may be missing.
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
    V3d not_followed{0, 0, 0};  // still carried when a path had become of no use to the caller
    V3d cut{0, 0, 0};           // still carried when a path reached the length limit
    V3d roulette{0, 0, 0};
    V3d scattered{0, 0, 0};         // by media, each time anew: no end, and no part of the balance
    std::uint64_t paths = 0;        // asked for
    std::uint64_t not_emitted = 0;  // of these, paths for which the light had no sample
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

    // Brings sums over paths to the power of the scene: factor 1 / number of paths.
    void scale(double factor) {
        for (V3d* entry : {&emitted, &absorbed, &media, &escaped, &not_followed, &cut, &roulette, &scattered})
            *entry *= factor;
    }

    // |emitted - all ends| / emitted, the worst channel. 0 when nothing was emitted.
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
