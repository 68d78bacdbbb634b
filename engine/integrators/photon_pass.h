// Runs the first pass of photon mapping: builds the photon maps, and what is derived from them before
// rendering [Jensen 2001, 9.3]. A pass with an index is one of a progressive render and contains both of
// Jensen's. Emission, light paths and deposits are in photon/build_maps.h; photon_mapping.h
// says which maps a scene needs.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/guiding/directional_guide.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/integrator.h"
#include "engine/integrators/pixel_edges.h"
#include "engine/integrators/settings.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"
#include "photon/irradiance.h"
#include "photon/local_radius.h"

namespace lucerna {

// Gives the radius of an estimate where it does not follow from the estimate's own photons.
class RadiusRule {
  public:
    virtual ~RadiusRule() = default;
    // Returns the radius at x. `n` is the unit normal on the visible side. A `whole` disc needs no probes.
    virtual LocalRadius::At radius(MapKind map, const V3f& x, const V3f& n) const = 0;
    // Returns the radius in space, for the Volume map.
    virtual float volume_radius() const = 0;
};

// Holds what a pass is given beside its settings. It owns `radii`; the session owns the pointers' targets.
struct FirstPassResult {
    // If set, all photons within these radii count in place of the k nearest. If null, each estimate finds
    // its radius from its own photons.
    std::unique_ptr<const RadiusRule> radii = nullptr;
    const LearnedEmission* emission = nullptr;  // distribution of emitted light paths; null: by power
    const GuideMap* guides = nullptr;           // for the direct methods `gated` and `guided`
    MapFiles files = {};
    int sets = 1;  // see MapParameters
    // The pass takes this many camera samples of each pixel. One of them estimates density from the maps; in
    // pixels that show an edge (`edges`, if not null) all of them do.
    int samples = 1;
    const PixelEdges* edges = nullptr;
};

struct DensityEstimatePair {
    DensityEstimateSettings eye, gather;  // for what the camera sees, and where gather rays land
    float volume_radius = 1;              // the largest radius of an estimate in space, scene units
};

// Holds what pass 1 makes and pass 2 reads. Missing maps are not read.
struct PhotonMappingState {
    PhotonMaps maps;
    std::optional<IrradiancePoints> irradiance;   // read where gather rays land
    std::optional<DirectionGuideMap> directions;  // guide gather rays
    std::vector<float> caustic_radii;             // progressive: the radius of each photon of the Caustic map
};

DensityEstimatePair density_settings(const PhotonMapSettings& settings, const Scene& scene);

// Tells whether a pilot chooses the numbers of samples, and where gather rays are guided.
bool is_split_by_pilot(const PhotonMapSettings& settings);

// Returns how to build the maps of a pass. Records in its statistics which maps are built, and why.
MapParameters map_parameters(const PhotonMapSettings& settings, const PassContext& context);

// Makes everything that the second pass reads. Returns none if the monitor stopped it.
std::optional<PhotonMappingState> first_pass(const PhotonMapSettings& settings, const PassContext& context,
                                             const FirstPassResult& parts);

}  // namespace lucerna
