// Runs the importance pre-pass of instant global illumination: learns which lights, and which of their light
// paths, contribute to the image [Wald 2003].
//
// [Wald 2003] traces a few paths per pixel and counts which lights lit them; light paths then start from
// those lights alone. Here the light paths themselves are tried: pre-pass paths, emitted plainly, make VPLs
// as those of the sets are made, and these light a few places that the camera sees, shadow rays included. A
// lamp in another room whose light comes in through the door counts by that light; one whose VPLs all lie
// behind walls does not. The importance of a path is its second moment,
//
//   m = mean over places of (X / (L + ε))²,
//
// where X is the radiance that all VPLs of the path together add to the pixel, L is the pixel's radiance
// (direct light by a few samples, indirect light by the pre-pass's own paths) and ε is a share of the mean L,
// so that black pixels do not matter most. EmissionTrial takes these moments
// (engine/guiding/importance_pre_pass.h): of all densities of path starts, the learned one gives the image
// the least relative error. A density that errs is less efficient, but the image is still unbiased
// (photon/learned_emission.h).
//
// The first hits of the pre-pass's paths also tell which lights reach a place. Direct light samples those
// lights (engine/guiding/guide.h), because samples of lights behind walls are wasted, too.
//
// No pass has these paths and places, so the learned density does not depend on the VPLs that it weighs.
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

// The following types describe a few places that the camera sees, and what VPLs bring there. The pre-pass
// weighs light paths and VPLs by it.

// Describes a place that VPLs shade in the image.
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
    std::vector<float> shown;  // luminance of each camera ray
};

// Traces rays evenly over the film to the places where VPLs shade them. `shown` is emission and direct light.
// Requires a view and media that do not scatter. The result is the same for any number of threads.
ShadingPoints find_shading_points(const IgiSettings& settings, const RenderContext& context,
                                  std::int64_t rays);

// Computes the luminance that a VPL of a set of one path brings to the camera ray of a place.
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
    ImportancePrePass importance;    // `useful`: share of paths that lit a place
    std::optional<GuideMap> guides;  // none if there is nothing to choose
    ShadingPoints seen;              // `shown` includes all indirect light, and ε: > 0
};

// Runs the pre-pass. `settings` are as with_distance() returns them. Returns none if there is nothing to
// learn (no light, nothing seen), or if the monitor stopped it. Requires a view and media that do not
// scatter. The result is the same for any number of threads.
std::optional<IgiPrePass> run_igi_pre_pass(const IgiSettings& settings, const RenderContext& context);

// Thinning traces more light paths than the sets hold, and keeps those of their VPLs that the image needs.
//
// Learned emission (photon/learned_emission.h) ends where a path leaves its light, but what its VPLs do for
// the image is decided later, behind the door or before it. Therefore several times as many paths are traced,
// which costs little beside shading, and their VPLs are thinned: each is tried at places that the camera
// sees, shadow rays included, and kept with a probability that depends on its importance there,
//
//   I = root of the mean over places of (X / L)²,    p = min(1, c (β · mean I + (1 - β) · I)),
//
// where c is such that as many are kept as one set's own paths would have made. A kept VPL is divided by p.
// Every mean is preserved, because p > 0 and the places are independent of the image's samples. No VPL weighs
// more than 1/β (the defensive weight) times what it would among as many kept uniformly. Within a set the
// choice is systematic (one random number for all), so that the sum of a set's importance hardly varies.
//
// [Georgiev and Slusallek 2010] accept VPLs by their contribution to the image as a whole; here each is
// weighed relative to what the pixels show, as the paths are.

// Each set gets kThinning times as many light paths, as long as those of all sets together are at most
// kMostPathsToThin, whose VPLs take some 700 MB while they are tried.
inline constexpr std::uint32_t kThinning = 16, kMostPathsToThin = 1U << 22;

// Returns the thinning factor that this limit allows for such sets, a power of 2; 1 means no thinning.
inline std::uint32_t thinning(const VplParameters& parameters) {
    const std::uint64_t paths = std::uint64_t{parameters.sets} * parameters.paths;  // powers of 2, at least 1
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(kMostPathsToThin / paths, 1, kThinning));
}

// Keeps about 1/factor of the VPLs, factor at least 1. The result is the same for any number of threads.
VplSets thin_vpls(const VplSets& sets, std::uint32_t factor, const ShadingPoints& seen,
                  const IgiSettings& settings, const RenderContext& context);

}  // namespace lucerna
