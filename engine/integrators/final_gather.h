// The second pass of photon mapping [Jensen 2001, 9.4]: paths from the eye, radiance from the maps where they
// meet what is diffuse, and final gather.
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

class FinalGather final : public Estimator {
  public:
    // `state` is what the first pass has made. Numbers of samples are to be learned by split().
    FinalGather(const Scene& scene, const PhotonMapSettings& settings, PhotonMapPass parts,
                PhotonMappingState state);

    void follow(const EyePath& path, Sampler& sampler) const override;

    // Learns how many samples of each kind pay where, if the settings leave that open.
    void split(const PassContext& context);
    // Takes what another one has learned, whose maps are of as many photons.
    void split_by(const Splitting& learned);
    const Splitting& splitting() const { return splitting_; }

  private:
    // Which quality a surface is shaded with.
    enum class Stage : std::uint8_t {
        eye,     // the camera sees it, straight or over shiny surfaces
        gather,  // a gather ray landed there: blurred over a hemisphere before anyone sees it
    };
    // How many samples of each kind are taken at what a camera sample sees; in the pilot, two of each.
    struct Splits {
        SplitPlan plan;
        SplitPilot* pilot = nullptr;
        // The factor of density estimates where the camera looks. 0 leaves them to other samples of the
        // pixel.
        float estimates = 1;
    };
    // Follows a path from the eye, or a gather ray, up to the first surface that is diffuse and nothing else.
    class Visitor;

    // These book light on a path that has arrived at a diffuse surface, or where a medium scatters. The
    // path's `left` > 0 is how many bounces paths may still have, the one at that place included.
    void shade_eye(const EyePath& path, const Vertex& vertex, const Splits& splits, Sampler& sampler) const;
    template <typename Take>
    void some_of(float number, std::uint32_t branch, SplitMoments* pilot, const EyePath& path,
                 const Sampler& sampler, Take&& take) const;
    float gather_ray(EyePath path, const Vertex& vertex, bool guided, Sampler& sampler) const;
    bool shade_gather(const EyePath& path, const Vertex& vertex, float length, Sampler& sampler) const;
    struct IndirectAtGatherHit {
        float radius;     // of the Global map's estimate
        bool has_direct;  // or what the Direct map would say is still missing
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

    // Photons that count where paths may have `left` bounces: the last of them is the one at the estimate.
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
    int samples_;              // PhotonMapPass's
    const PixelEdges* edges_;  // PhotonMapPass's
    GuidedLightSettings guided_;
    LightChooser lights_;
    Splitting splitting_;
};

}  // namespace lucerna
