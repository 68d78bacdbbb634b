// Defines the settings of instant global illumination [Keller 1997; Pharr 2004]: how virtual point lights are
// made, chosen and clamped. The table of all settings (engine/integrators/settings.h) names them.
#pragma once

#include <cstdint>

#include "engine/scene/quantity.h"
#include "photon/photon_map.h"

namespace lucerna {

struct IgiSettings {
    int nlights = 64;  // light paths per set, rounded up to a power of 2
    int nsets = 16;    // independent sets, rounded up to a power of 2
    // VPLs fade out below this distance [Pharr 2004], scene units. 0 means 2 % of the scene's diagonal, or no
    // fading where glimit limits the VPLs instead.
    float mindist = 0;
    float glimit = 0;  // largest cos cos / d² of a VPL, 1/(scene unit)²; 0: no limit
    // Each camera sample takes this many compensation rays. They add the light that mindist and glimit
    // remove, and indirect light via mirrors, glass and gloss, so that the image is complete, and noisier
    // near lamps. With 0 there is no compensation, as in [Pharr 2004].
    int gather_samples = 0;
    // The Caustic map, which brings light from lamps via mirrors, glass and gloss to diffuse surfaces, has
    // this many light paths. With 0 there is no map; compensation rays find this light, if there are any.
    std::int64_t caustic_paths = 1'000'000;
    IndexKind index = IndexKind::tree;  // acceleration structure of the Caustic map and of the guides
    // Shadow rays for less luminance than this are subject to Russian roulette, with the probability
    // rr_continue of being traced, as in [Pharr 2004]. With 0 there are about shadow_rays rays per shading
    // point, distributed in proportion to estimated contributions.
    float rr_threshold = 0;
    float rr_continue = 0.1F;
    int shadow_rays = 4;  // 0: one for every VPL
    float indirect_scale = 1;
    // The importance pre-pass has this many light paths; 0 means no pre-pass. It also learns which VPLs are
    // kept and which lights are sampled.
    std::int64_t pre_pass = 0;
    int max_depth = 0;  // see max_depth_of() (engine/integrators/settings.h)

    bool compensates() const { return gather_samples > 0; }
    Quantity quantity = Quantity::radiance;
};

}  // namespace lucerna
