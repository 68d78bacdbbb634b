// Which photon maps are built, and why: only what the scene and the chosen methods need [Jensen 2001, 9;
// Goesele 2003, 5.2].
#pragma once

#include <string>

#include "engine/integrators/settings.h"
#include "engine/scene/scene.h"
#include "photon/deposit.h"

namespace lucerna {

struct MapNeed {
    bool build;
    std::string why;

    std::string text() const { return (build ? "built: " : "not built: ") + why; }
};

MapNeed map_need(MapKind kind, const PhotonMapSettings& settings, const Scene& scene);

// Whether direct light is sampled by photons of its own. Where there is nothing to choose `guided` needs
// none.
bool goes_by_guides(const PhotonMapSettings& settings, const Scene& scene);

}  // namespace lucerna
