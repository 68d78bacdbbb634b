// Whether and how the emission of photon maps is steered towards what the camera sees (photon/pilot.h).
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "engine/render/integrator.h"
#include "photon/pilot.h"

namespace lucerna {

// Learns by which paths maps with these settings are best built, and writes into the context's report what it
// learned: `pilot.*`, or a note that says why emission stays plain. None: it stays plain (or the monitor
// stopped it). `estimate`: as the image gathers from `paths` light paths; k = 0: all within the radius.
std::optional<Pilot> learn_emission(const PhotonMapSettings& settings, const GatherSettings& estimate,
                                    const PassContext& context);

// How a plan of a render names the pilot.
inline std::string pilot_line(std::int64_t paths) {
    return fmt::format("a pilot of {} light paths, by which all others are emitted", paths);
}

}  // namespace lucerna
