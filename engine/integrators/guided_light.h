// Direct light with the help of photons that came straight from the lights [Goesele 2003, 5.2, 5.3].
//
//   gated   as `mc`, but only where a photon lies near. Where none landed there is no light: too dark by what
//           arrives there. With M paths of power Φ/M and a gate of radius r on a flat surface lit by E, the
//           chance that none landed is exp(-π r² E M/Φ), so the mean over maps lacks E times that; no
//           irradiance lacks more than Φ/(e π r² M).
//   guided  as `mc`, but lights and their parts are chosen by the photons near, mixed with the plain choice:
//           unbiased.
//
// `guided` asks several places of lights for what would arrive, traces one shadow ray to one of them chosen
// in proportion to that, and lets it stand for all (resampled importance sampling [Talbot 2005]). Where the
// BSDF's strategy of MIS is expected to find next to nothing, its ray is traced only sometimes and weighs
// more. In a scene with nothing_to_choose() renderers take `mc` in its place: it does the same with less
// work.
#pragma once

#include "engine/base/sampler.h"
#include "engine/guiding/guide.h"
#include "engine/integrators/direct_light.h"
#include "engine/scene/scene.h"

namespace lucerna {

struct GuidedLightSettings {
    float defensive_weight =
        0.25F;  // defensive mixture weight: the least share of the plain choice, in (0, 1]
    static constexpr int kMostCandidates = 1024;
    int candidates = 16;  // places of lights weighed before one is asked for, in [1, kMostCandidates]
};

// As many candidates as pay. Those of a measured lamp's places cost little beside a shadow ray, and what
// arrives differs much between them; those of whole lights differ less than their shadows do.
int candidates_that_pay(const Scene& scene);

// Both as direct_light(); `plain` is the choice without photons.
DirectLight gated_light(const Scene& scene, const GuideMap& guides, const Vertex& vertex, Sampler& sampler,
                        const LightChoice& plain);

class GuidedLight {
  public:
    // Keeps references to the scene and the guides.
    GuidedLight(const Scene& scene, const GuideMap& guides, const GuidedLightSettings& settings)
        : scene_(scene), guides_(guides), settings_(settings) {}
    DirectLight operator()(const Vertex& vertex, Sampler& sampler, const LightChoice& plain) const;

  private:
    const Scene& scene_;
    const GuideMap& guides_;
    GuidedLightSettings settings_;
};

}  // namespace lucerna
