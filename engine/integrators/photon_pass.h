// The first pass of photon mapping: photon maps, and what is made of them before anything is seen
// [Jensen 2001, 7]. Emission, light paths and deposits are photon/build_maps.h; which maps a scene needs is
// photon_mapping.h.
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

// The radius of an estimate where it does not follow from the photons that are estimated from.
class RadiusRule {
  public:
    virtual ~RadiusRule() = default;
    // n: unit, on the side that is seen. What is whole needs no probes.
    virtual LocalRadius::At radius(MapKind map, const V3f& x, const V3f& n) const = 0;
    // In space, for the Volume map.
    virtual float volume_radius() const = 0;
};

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

struct DensityEstimatePair {
    DensityEstimateSettings eye, gather;  // of estimates at what the camera sees, and where gather rays land
    float volume_radius = 1;              // the largest of an estimate in space
};

// What pass 1 makes and pass 2 reads; maps that are absent are not read.
struct PhotonMappingState {
    PhotonMaps maps;
    std::optional<IrradiancePoints> irradiance;   // looked up by gather rays where they land
    std::optional<DirectionGuideMap> directions;  // of gather rays
    std::vector<float> caustic_radii;             // progressive: the radius of each photon of the Caustic map
};

DensityEstimatePair density_settings(const PhotonMapSettings& settings, const Scene& scene);

// Whether the numbers of samples, and where gather rays are guided, are left to a pilot.
bool is_split_by_pilot(const PhotonMapSettings& settings);

// How the maps of a pass are built. Says in the pass's statistics which are, and why.
MapParameters map_parameters(const PhotonMapSettings& settings, const PassContext& context);

// Makes all that the second pass reads. None if the monitor stopped it.
std::optional<PhotonMappingState> first_pass(const PhotonMapSettings& settings, const PassContext& context,
                                             const PhotonMapPass& parts);

}  // namespace lucerna
