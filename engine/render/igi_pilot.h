// The pilot of instant global illumination: which lights, and which of their particles, bring light to the
// picture [igi 5].
//
// Wald, Benthin and Slusallek, "Interactive global illumination in complex and highly occluded environments",
// 2003, trace a few paths per pixel and count by which lights they were lit; light paths then start from
// those lights alone. Here the question is put to what will answer for it: pilot light paths, emitted
// plainly, make virtual lights as those of the sets will be made, and each path's light a few places that the
// camera sees, shadow rays and all. A lamp in another room whose light comes in through the door matters by
// that light; one whose virtual lights all lie behind walls does not. What a path is worth is its second
// moment,
//
//   m = mean over places of (X / (L + ε))²,
//
// X what all virtual lights of the path together add to the pixel's radiance, L that radiance (direct light
// by a few samples, indirect by the pilot's own paths) and ε a share of the mean L, so that black pixels do
// not matter most. It is what EmitTrial wants (photon/pilot_blocks.h): of all densities of starts, the plan's
// then makes the picture's relative error least. That is importance and nothing more: a plan that errs is
// less good, and still unbiased (photon/emission_plan.h).
//
// Where the pilot's paths first land they say by which lights a place is lit: those are asked for direct
// light (photon/guide.h), for what is wasted on lights behind walls is wasted there, too.
//
// Paths and places are those of no pass, so a plan does not depend on the virtual lights that it weighs.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/render/igi_places.h"
#include "engine/render/integrator.h"
#include "photon/guide.h"
#include "photon/pilot.h"

namespace lucerna {

struct IgiPilot {
    Pilot pilot;  // useful: share of the pilot's paths that lit any place they were tried at
    std::optional<GuideMap> guides;  // none: there is nothing to choose, or the floor is 1
    SeenPlaces seen;                 // `shown` with all indirect light, and a little more: > 0
};

// Settings with a mindist that is not left to the scene. None where there is nothing to learn: no light,
// nothing seen; or if the monitor stopped it. Requires a view and media that do not scatter. The same for any
// number of threads.
std::optional<IgiPilot> fly_igi_pilot(const IgiSettings& settings, const PassContext& context);

}  // namespace lucerna
