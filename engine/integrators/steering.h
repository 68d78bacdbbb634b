// Whether and how the emission is steered towards what the camera sees: of photon maps
// (engine/guiding/importance_pre_pass.h), of VPLs (igi_pre_pass.h).
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "engine/guiding/importance_pre_pass.h"
#include "engine/integrators/igi_pre_pass.h"
#include "engine/integrators/integrator.h"

namespace lucerna {

// Learns by which paths maps with these settings are best built, and writes into the context's report what it
// learned: `prepass.*`, or a note that says why emission stays plain. None: it stays plain (or the monitor
// stopped it). `estimate`: as the image's from `paths` light paths; k = 0: all within the radius.
std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const PassContext& context);

// The same for VPLs, whose paths it starts, and the choice of lights for direct light besides. Settings as
// with_distance() (igi_estimator.h) gives them.
std::optional<IgiPrePass> learn_emission(const IgiSettings& settings, const PassContext& context);

// The line of Integrator::describe() that names the pre-pass.
inline std::string describe_pre_pass(std::int64_t paths) {
    return fmt::format("an importance pre-pass of {} light paths, by which all others are emitted", paths);
}

}  // namespace lucerna
