// Offers photon mapping to other methods: the maps of one pass and the estimator that reads them.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/guiding/importance_pre_pass.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/photon_pass.h"
#include "engine/integrators/settings.h"
#include "engine/scene/scene.h"
#include "photon/deposit.h"

namespace lucerna {

// Learns how to emit the light paths of maps with these settings, and reports what it learned, or why
// emission stays plain. Returns none if it stays plain or the monitor stopped it. `estimate` holds the
// image's settings; k = 0 uses all photons within the radius.
std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const RenderContext& context, OnceStatistics& statistics);

// Runs the first pass, which builds the maps, and returns the estimator of the second. Returns null if the
// monitor stopped it.
std::unique_ptr<const Estimator> photon_map_pass(const PhotonMapSettings& settings,
                                                 const PassContext& context, FirstPassResult parts);

// Says whether a photon map is built, and why: only what the scene and the chosen methods need [Jensen 2001,
// 9; Goesele 2003, 5.2].
struct MapNeed {
    bool build;
    std::string why;

    std::string text() const { return (build ? "built: " : "not built: ") + why; }
};

MapNeed map_need(MapKind kind, const PhotonMapSettings& settings, const Scene& scene);

// Tells whether photons of their own guide the sampling of direct light. `guided` needs none where there is
// only one light to choose.
bool uses_light_guides(const PhotonMapSettings& settings, const Scene& scene);
// Returns how many light paths make the photons that guide direct light.
std::int64_t guide_paths(const PhotonMapSettings& settings);

}  // namespace lucerna
