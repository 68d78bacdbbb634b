// Runs the second pass of photon mapping [Jensen 2001, 9.4]: follows paths from the eye, estimates radiance
// from the maps at diffuse surfaces, and does the final gather.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/guiding/guide.h"
#include "engine/integrators/photon_pass.h"
#include "engine/integrators/splitting.h"
#include "engine/transport/light_choice.h"
#include "photon/density_estimate.h"

namespace lucerna {

class SecondPass final : public Estimator {
  public:
    // `state` is the result of the first pass. split() or split_by() then sets the numbers of samples.
    SecondPass(const Scene& scene, const PhotonMapSettings& settings, FirstPassResult parts,
               PhotonMappingState state);

    void follow(const EyePath& path, Sampler& sampler) const override;

    // Learns which number of samples of each kind pays in which part of the film, unless the settings fix it.
    void split(const PassContext& context);
    // Takes over what another estimator has learned, whose maps hold as many photons.
    void split_by(const Splitting& learned);
    const Splitting& splitting() const { return splitting_; }

  private:
    // Tells how accurately a surface is shaded.
    enum class Stage : std::uint8_t {
        eye,     // seen by the camera, directly or over specular and glossy surfaces
        gather,  // hit by a gather ray, thus blurred over a hemisphere before it is seen
    };
    // Holds how many samples of each kind a camera sample takes where it looks. A pilot takes two of each.
    struct Splits {
        SplitPlan plan;
        SplitPilot* pilot = nullptr;
        // Multiplies density estimates where the camera looks. 0 leaves them to other samples of the pixel.
        float estimates = 1;
    };
    // Follows a path from the eye, or a gather ray, up to the first purely diffuse surface.
    class Visitor;

    // The following functions book light on a path that has arrived at a diffuse surface or is scattered in a
    // medium. The path's `left` > 0 counts the bounces that it may still have, including the one there.
    void shade_eye(const EyePath& path, const Vertex& vertex, const Splits& splits, Sampler& sampler) const;
    template <typename Take>
    void some_of(float number, std::uint32_t branch, SplitMoments* pilot, const EyePath& path,
                 const Sampler& sampler, Take&& take) const;
    float gather_ray(EyePath path, const Vertex& vertex, bool guided, Sampler& sampler) const;
    bool shade_gather(const EyePath& path, const Vertex& vertex, float length, Sampler& sampler) const;
    struct IndirectAtGatherHit {
        float radius;     // of the Global map's estimate
        bool has_direct;  // false: direct() has yet to add direct light
    };
    std::optional<IndirectAtGatherHit> indirect_at_gather_hit(const PathAccount& path, const Vertex& vertex,
                                                              const DensityEstimateSettings& how,
                                                              const Sampler& sampler) const;
    void direct(const PathAccount& path, const Vertex& vertex, const DensityEstimateSettings& how,
                Sampler& sampler) const;
    void sample_direct(const PathAccount& path, const Vertex& vertex, Sampler& sampler) const;
    float estimate(MapKind kind, const PathAccount& path, const Vertex& vertex,
                   const DensityEstimateSettings& how, const Sampler& sampler) const;
    void in_scattered(const EyePath& path, const MediumVertex& vertex, const Rgb& sigma_s, Stage stage,
                      const Splits& splits, Sampler& sampler) const;

    // Restricts an estimate to photons whose paths fit into `left` bounces, one of which is at the estimate.
    DensityEstimateSettings within(int left, DensityEstimateSettings how) const {
        if (settings_.max_depth > 0) how.most_bounces = left - 1;
        return how;
    }

    const Scene& scene_;
    PhotonMapSettings settings_;
    DensityEstimatePair estimates_;
    PhotonMaps maps_;
    const GuideMap* guides_;  // null: none
    std::optional<IrradiancePoints> irradiance_;
    std::optional<DirectionGuideMap> directions_;
    std::unique_ptr<const RadiusRule> radii_;
    std::vector<float> caustic_radii_;
    int samples_;              // see FirstPassResult
    const PixelEdges* edges_;  // see FirstPassResult
    GuidedLightSettings guided_;
    LightChooser lights_;
    Splitting splitting_;
};

}  // namespace lucerna
