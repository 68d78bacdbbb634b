// The importance pre-pass of instant global illumination: which lights, and which of their particles, bring
// light to the picture [Wald 2003].
//
// [Wald 2003] traces a few paths per pixel and counts by which lights they were lit; light paths then start
// from those lights alone. Here the question is put to what will answer for it: pre-pass light paths, emitted
// plainly, make VPLs as those of the sets will be made, and each path's light a few places that the camera
// sees, shadow rays and all. A lamp in another room whose light comes in through the door matters by that
// light; one whose VPLs all lie behind walls does not. The importance of a path is its second moment,
//
//   m = mean over places of (X / (L + ε))²,
//
// X what all VPLs of the path together add to the pixel's radiance, L that radiance (direct light by a few
// samples, indirect by the pre-pass's own paths) and ε a share of the mean L, so that black pixels do not
// matter most. It is what EmissionTrial wants (engine/guiding/importance_pre_pass.h): of all densities of
// starts, the learned one then makes the picture's relative error least. That is importance and nothing more:
// a density that errs is less good, and still unbiased (photon/learned_emission.h).
//
// Where the pre-pass's paths first land they say by which lights a place is lit: those are asked for direct
// light (engine/guiding/guide.h), for what is wasted on lights behind walls is wasted there, too.
//
// Paths and places are those of no pass, so the learned density does not depend on the VPLs that it weighs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/guiding/guide.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/vpl/vpl.h"
#include "engine/vpl/vpl_shading.h"

namespace lucerna {

// Where a picture is shaded by VPLs: a few places that the camera sees, and what VPLs bring there. What a
// pre-pass weighs light paths by, and VPLs.

// Where the picture is shaded by VPLs.
struct ShadingPoint {
    Hit hit;
    Bsdf bsdf;
    V3f wo;
    std::int32_t medium;
    Rgb throughput;  // to the film
    std::uint32_t ray;

    Vertex vertex() const { return {hit, bsdf, wo, medium}; }
};

struct ShadingPoints {
    std::vector<ShadingPoint> places;
    std::vector<float> shown;  // by camera ray: luminance
};

// Rays evenly over the film; `shown` is emission and direct light. Requires a view and media that do not
// scatter. The same for any number of threads.
ShadingPoints find_shading_points(const IgiSettings& settings, const RenderContext& context,
                                  std::int64_t rays);

// What a VPL brings to the camera ray of a place, luminance, as the image has it of a set of one path.
class ShadingPointContribution {
  public:
    ShadingPointContribution(const Scene& scene, const IgiSettings& settings);

    float radiance(const ShadingPoint& place, const Vpl& light, Sampler& sampler) const {
        const float result =
            luminance(shading_.shade(place.vertex(), light, place.throughput * scale_, sampler));
        return std::isfinite(result) ? result : 0.0F;
    }

  private:
    VplShading shading_;
    float scale_;  // of indirect light
};

struct IgiPrePass {
    ImportancePrePass
        importance;  // useful: share of the pre-pass's paths that lit any place they were tried at
    std::optional<GuideMap> guides;  // none: there is nothing to choose, or the defensive weight is 1
    ShadingPoints seen;              // `shown` with all indirect light, and a little more: > 0
};

// Settings with a mindist that is not left to the scene. None where there is nothing to learn: no light,
// nothing seen; or if the monitor stopped it. Requires a view and media that do not scatter. The same for any
// number of threads.
std::optional<IgiPrePass> run_igi_pre_pass(const IgiSettings& settings, const RenderContext& context);

// More light paths than sets hold, and of their VPLs those that the picture needs.
//
// Learned emission (photon/learned_emission.h) ends where a path leaves its light: what most of a path's VPLs
// do for the picture is decided later, behind the door or before it. So several times as many paths are
// traced, which costs little beside shading, and their VPLs are thinned: each is tried at places that the
// camera sees, shadow rays and all, and kept with a probability that goes by its importance there,
//
//   I = root of the mean over places of (X / L)²,    p = min(1, c (β · mean I + (1 - β) · I)),
//
// c such that as many are kept as one set's own paths would have made. What is kept is divided by p: every
// mean stays what it is, since p > 0 and the places do not know by whom they will be shaded; and no light
// weighs more than 1/β (the defensive weight) times what it would among as many kept blindly. Within a set
// the choice is systematic (one number for all), so that the sum of a set's importance hardly varies.
//
// [Georgiev and Slusallek 2010] accept lights by their contribution to the image as a whole; here each is
// weighed relative to what the pixels show, as the paths are.

// Light paths that are traced for each of a set's own, and how many all sets may trace together: some 700 MB
// of lights at most, while they are tried.
inline constexpr std::uint32_t kThinning = 16, kMostPathsToThin = 1U << 22;

// As many as that leaves for sets of so many paths, a power of 2; 1: none are to spare.
inline std::uint32_t thinning(const VplParameters& parameters) {
    const std::uint64_t paths = std::uint64_t{parameters.sets} * parameters.paths;  // powers of 2, at least 1
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(kMostPathsToThin / paths, 1, kThinning));
}

// Keeps about 1/factor of each set's lights, factor at least 1. The same for any number of threads.
VplSets thin_vpls(const VplSets& sets, std::uint32_t factor, const ShadingPoints& seen,
                  const IgiSettings& settings, const RenderContext& context);

}  // namespace lucerna
