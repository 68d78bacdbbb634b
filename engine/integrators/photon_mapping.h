// Photon mapping as a part of other methods: the maps of one pass and what the camera sees by them.
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

// Learns by which light paths maps with these settings are best built, and tells what it learned, or why
// emission stays plain. None: it stays plain (or the monitor stopped it). `estimate`: as the image's; k = 0:
// all within the radius.
std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const RenderContext& context, OnceStatistics& statistics);

// Both passes of photon mapping: makes maps, and what camera rays see by them. Null if the monitor stopped
// it.
std::unique_ptr<const Estimator> photon_map_pass(const PhotonMapSettings& settings,
                                                 const PassContext& context, PhotonMapPass parts);

// Which photon maps are built, and why: only what the scene and the chosen methods need [Jensen 2001, 9;
// Goesele 2003, 5.2].
struct MapNeed {
    bool build;
    std::string why;

    std::string text() const { return (build ? "built: " : "not built: ") + why; }
};

MapNeed map_need(MapKind kind, const PhotonMapSettings& settings, const Scene& scene);

// Whether direct light is sampled by photons of its own. Where there is nothing to choose `guided` needs
// none.
bool goes_by_guides(const PhotonMapSettings& settings, const Scene& scene);
// Returns how many light paths make the photons by which direct light is sampled.
std::int64_t guide_paths(const PhotonMapSettings& settings);

}  // namespace lucerna
