// The energy ledger of a walk, as the statistics show it.
#pragma once

#include "engine/render/render.h"
#include "photon/ledger.h"

namespace lucerna {

// What is emitted is the lamps' flux where emission is plain and every particle of a lamp carries alike; a
// plan (photon/emission_plan.h) weights particles, and then it is an estimate of it.
//
// Luminance of each account in W (or lm), and what does not add up, as a share.
inline void report_energy(const Ledger& ledger, RenderReport& report) {
    const auto y = [](const V3d& c) { return 0.212671 * c.x + 0.715160 * c.y + 0.072169 * c.z; };
    report.numbers["energy.emitted"] = y(ledger.emitted);
    report.numbers["energy.absorbed"] = y(ledger.absorbed);
    report.numbers["energy.absorbed_by_media"] = y(ledger.media);
    report.numbers["energy.scattered_by_media"] = y(ledger.scattered);
    report.numbers["energy.escaped"] = y(ledger.escaped);
    report.numbers["energy.cut"] = y(ledger.cut);
    report.numbers["energy.roulette"] = y(ledger.roulette);
    report.numbers["energy.imbalance"] = ledger.imbalance();
    report.numbers["paths.emitted"] = static_cast<double>(ledger.paths - ledger.not_emitted);
    report.numbers["paths.not_emitted"] = static_cast<double>(ledger.not_emitted);
    report.numbers["paths.hits"] = static_cast<double>(ledger.hits);
    report.numbers["paths.scatterings"] = static_cast<double>(ledger.scatterings);
}

}  // namespace lucerna
