// The energy ledger of light paths, as the statistics show it.
#pragma once

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/monitor.h"
#include "engine/integrators/render_report.h"
#include "photon/ledger.h"

namespace lucerna {

// Luminance of an account.
inline double energy_luminance(const V3d& c) {
    return 0.212671 * c.x + 0.715160 * c.y + 0.072169 * c.z;
}

// What is emitted is the lamps' flux where emission is plain and every particle of a lamp carries alike; a
// learned density (photon/learned_emission.h) weights particles, and then it is an estimate of it.
//
// Luminance of each account in W (or lm), and what does not add up, as a share.
inline void report_energy(const Ledger& ledger, RenderReport& report) {
    report.numbers["energy.emitted"] = energy_luminance(ledger.emitted);
    report.numbers["energy.absorbed"] = energy_luminance(ledger.absorbed);
    report.numbers["energy.absorbed_by_media"] = energy_luminance(ledger.media);
    report.numbers["energy.scattered_by_media"] = energy_luminance(ledger.scattered);
    report.numbers["energy.escaped"] = energy_luminance(ledger.escaped);
    report.numbers["energy.not_followed"] = energy_luminance(ledger.not_followed);
    report.numbers["energy.cut"] = energy_luminance(ledger.cut);
    report.numbers["energy.roulette"] = energy_luminance(ledger.roulette);
    report.numbers["energy.imbalance"] = ledger.imbalance();
    report.numbers["paths.emitted"] = static_cast<double>(ledger.paths - ledger.not_emitted);
    report.numbers["paths.not_emitted"] = static_cast<double>(ledger.not_emitted);
    report.numbers["paths.hits"] = static_cast<double>(ledger.hits);
    report.numbers["paths.scatterings"] = static_cast<double>(ledger.scatterings);
}

// Where nothing takes light away, as in a closed room of albedo 1, a light path ends by roulette alone: what
// it still carries then is missing, and what rare long paths bring has no limit. One warning if so.
inline void warn_of_endless_light(const Ledger& ledger, Monitor& monitor) {
    constexpr std::uint64_t kFewPaths = 64;  // of these one does not know: their ends scatter
    constexpr double kUsual = 0.5;           // the least share that ends as light does, many sigmas below 1
    const std::uint64_t paths = ledger.paths - ledger.not_emitted;
    const double emitted = energy_luminance(ledger.emitted);
    if (paths < kFewPaths || !(emitted > 0)) return;
    const double ended =
        energy_luminance(ledger.absorbed + ledger.media + ledger.escaped + ledger.not_followed) / emitted;
    if (ended >= kUsual) return;
    monitor.warn(fmt::format(
        "{:.0f} % of the light's power was cut off after many bounces, {:.0f} on the average of {} "
        "paths: surfaces and media take almost nothing away, and the picture has no limit that it "
        "could come to; in a closed room an albedo below 1 is needed",
        100 * std::clamp(1 - ended, 0.0, 1.0),
        static_cast<double>(ledger.hits + ledger.scatterings) / static_cast<double>(paths), paths));
}

}  // namespace lucerna
