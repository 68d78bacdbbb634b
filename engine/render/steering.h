// Whether and how the emission is steered towards what the camera sees: of photon maps (photon/pilot.h), of
// virtual lights (igi_pilot.h).
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "engine/render/igi_pilot.h"
#include "engine/render/integrator.h"
#include "photon/pilot.h"

namespace lucerna {

// Learns by which paths maps with these settings are best built, and writes into the context's report what it
// learned: `pilot.*`, or a note that says why emission stays plain. None: it stays plain (or the monitor
// stopped it). `estimate`: as the image gathers from `paths` light paths; k = 0: all within the radius.
std::optional<Pilot> learn_emission(const PhotonMapSettings& settings, const GatherSettings& estimate,
                                    const PassContext& context);

// The same for virtual lights, whose paths it starts, and the choice of lights for direct light besides.
// Settings as with_distance() (igi_estimator.h) gives them.
std::optional<IgiPilot> learn_emission(const IgiSettings& settings, const PassContext& context);

// How a plan of a render names the pilot.
inline std::string pilot_line(std::int64_t paths) {
    return fmt::format("a pilot of {} light paths, by which all others are emitted", paths);
}

}  // namespace lucerna
