// The importance pre-pass of instant global illumination: which lights, and which of their particles, bring
// light to the picture [Wald 2003].
//
// Wald, Benthin and Slusallek, "Interactive global illumination in complex and highly occluded environments",
// 2003, trace a few paths per pixel and count by which lights they were lit; light paths then start from
// those lights alone. Here the question is put to what will answer for it: pre-pass light paths, emitted
// plainly, make VPLs as those of the sets will be made, and each path's light a few places that the camera
// sees, shadow rays and all. A lamp in another room whose light comes in through the door matters by that
// light; one whose VPLs all lie behind walls does not. The importance of a path is its second moment,
//
//   m = mean over places of (X / (L + ε))²,
//
// X what all VPLs of the path together add to the pixel's radiance, L that radiance (direct light by a few
// samples, indirect by the pre-pass's own paths) and ε a share of the mean L, so that black pixels do not
// matter most. It is what EmitTrial wants (engine/guiding/emission_blocks.h): of all densities of starts, the
// learned one then makes the picture's relative error least. That is importance and nothing more: a density
// that errs is less good, and still unbiased (photon/learned_emission.h).
//
// Where the pre-pass's paths first land they say by which lights a place is lit: those are asked for direct
// light (engine/guiding/guide.h), for what is wasted on lights behind walls is wasted there, too.
//
// Paths and places are those of no pass, so the learned density does not depend on the VPLs that it weighs.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/guiding/guide.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/integrators/igi_places.h"
#include "engine/integrators/integrator.h"

namespace lucerna {

struct IgiPrePass {
    ImportancePrePass
        importance;  // useful: share of the pre-pass's paths that lit any place they were tried at
    std::optional<GuideMap> guides;  // none: there is nothing to choose, or the defensive weight is 1
    SeenPlaces seen;                 // `shown` with all indirect light, and a little more: > 0
};

// Settings with a mindist that is not left to the scene. None where there is nothing to learn: no light,
// nothing seen; or if the monitor stopped it. Requires a view and media that do not scatter. The same for any
// number of threads.
std::optional<IgiPrePass> run_igi_pre_pass(const IgiSettings& settings, const PassContext& context);

}  // namespace lucerna
