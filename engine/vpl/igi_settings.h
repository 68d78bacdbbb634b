// Settings of instant global illumination [Keller 1997; Pharr 2004]: how virtual point lights are made,
// chosen and clamped. The table of all settings (engine/integrators/settings.h) names them.
#pragma once

#include <cstdint>

#include "engine/guiding/importance_pre_pass.h"
#include "engine/scene/quantity.h"
#include "lights/light_tree.h"

namespace lucerna {

// Which VPLs a place asks: it looks at all of a set, or draws some from a tree over all sets.
enum class VplChoice : std::uint8_t { loop, tree };

// How light comes that mirrors, glass and gloss turned on its way from a lamp to a surface: from photons, by
// compensating rays, or not at all.
enum class CausticMethod : std::uint8_t { map, rays, none };

struct IgiSettings {
    int nlights = 64;    // light paths per set, rounded up to a power of 2
    int nsets = 16;      // independent sets, rounded up to a power of 2
    float mindist = -1;  // scene units; negative: 2 % of the scene's diagonal
    float glimit = 0;    // largest cos cos / d² of a VPL, 1/(scene unit)²; 0: no limit
    // Rays put back what these two cut off, and what mirrors, glass and gloss turn: the whole picture, and
    // noisier near lamps. [Pharr 2004] has none.
    bool compensate = false;
    int gather_samples = 1;  // such rays per camera sample
    CausticMethod caustics = CausticMethod::map;
    std::int64_t caustic_paths = 1'000'000;  // light paths of the map
    VplChoice choice = VplChoice::loop;
    int tree_samples = 16;  // lights that a place draws from the tree
    // Luminance below which shadow rays play roulette, with the chance rr_continue of going on, as in [Pharr
    // 2004]; negative: rays go where they count, about shadow_rays of them for a place.
    float rr_threshold = -1;
    float rr_continue = 0.1F;
    int shadow_rays = 4;  // 0: one for every light
    float indirect_scale = 1;
    LightSelection lights = LightSelection::tree;  // that are asked for direct light
    EmissionGuiding pre_pass;  // it also learns which VPLs stay and which lights surfaces ask
    int max_depth = 0;         // as all methods have it (engine/integrators/settings.h)
    Quantity quantity = Quantity::radiance;
};

}  // namespace lucerna
