// Photon mapping as a part of other methods: the maps of one pass and what the camera sees by them.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/guiding/guide.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/pixel_edges.h"
#include "engine/integrators/settings.h"
#include "engine/scene/scene.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"
#include "photon/deposit.h"
#include "photon/irradiance.h"
#include "photon/local_radius.h"

namespace lucerna {

// The radius of an estimate where it does not follow from the photons that are estimated from.
class RadiusRule {
  public:
    virtual ~RadiusRule() = default;
    // n: unit, on the side that is seen. What is whole needs no probes.
    virtual LocalRadius::At radius(MapKind map, const V3f& x, const V3f& n) const = 0;
    // In space, for the Volume map.
    virtual float volume_radius() const = 0;
};

// Learns by which light paths maps with these settings are best built, and tells what it learned, or why
// emission stays plain. None: it stays plain (or the monitor stopped it). `estimate`: as the image's; k = 0:
// all within the radius.
std::optional<ImportancePrePass> learn_emission(const PhotonMapSettings& settings,
                                                const DensityEstimateSettings& estimate,
                                                const RenderContext& context, OnceStatistics& statistics);

// What a pass is given, beside its settings: `radii` are its own, the session owns what is pointed to.
struct PhotonMapPass {
    // With them, all photons within the radius count in place of the k nearest. Null: radii by the photons
    // that are estimated from.
    std::unique_ptr<const RadiusRule> radii = nullptr;
    const LearnedEmission* emission = nullptr;  // by which light paths are emitted; null: by power
    const GuideMap* guides = nullptr;           // for the direct methods that go by one
    MapFiles files = {};
    int sets = 1;  // MapParameters'
    // Camera samples of a pixel by this pass; one of them estimates density from the maps, or, in pixels that
    // show an edge (`edges`, if not null), every one.
    int samples = 1;
    const PixelEdges* edges = nullptr;
};

// Both passes of photon mapping: makes maps, and what camera rays see by them. Null if the monitor stopped
// it.
std::unique_ptr<const Estimator> photon_map_pass(const PhotonMapSettings& settings,
                                                 const PassContext& context, PhotonMapPass parts);

// Precomputed irradiance for final gather: a point for one photon in n of the Global map, which must be there
// (settings.precompute > 0; with direct = map the Direct map, too), with the light of all maps; direct light
// by the Direct map, or sampled as `settings.precompute_lights` says.
IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how, const PhotonMapSettings& settings);

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

}  // namespace lucerna
