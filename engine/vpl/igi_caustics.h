// Light that comes from a lamp over mirrors, glass or gloss to a surface, beside VPLs: photons bring it, as
// with the `photonmap` method, wherever a surface is diffuse.
//
// Every path of light is counted once. At a place, what arrives is split by what it met last:
//   nothing: a lamp itself                     direct light, lights asked and rays that find them
//   mirrors, glass, gloss and nothing else     the Caustic map for the diffuse part of the surface; rays for
//                                              the rest of it, and for what a medium scatters; without
//                                              compensation the map for the gloss of such a surface, too
//   the same, and before that the diffuse      the same; without compensation nothing. (Rays would bring few
//   part of a surface that was lit so          samples of small bright spots.)
//   a surface's diffuse part, a medium         VPLs, and near by the compensating rays
//   gloss and the like, and a diffuse surface  compensating rays; without them gloss (no mirrors) that is lit
//   before that                                by scattered light is taken for a Lambertian VPL
#pragma once

#include <optional>

#include "engine/scene/render_context.h"
#include "engine/transport/direct_light.h"
#include "engine/vpl/igi_settings.h"
#include "engine/vpl/vpl.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"

namespace lucerna {

// What VPLs take for Lambertian with these settings.
VplGloss vpl_gloss(const IgiSettings& settings);

// Whether light may come to a surface over specular ones, or over gloss.
bool throws_caustics(const Scene& scene);

class IgiCaustics {
  public:
    // Without a map.
    explicit IgiCaustics(const IgiSettings& settings);
    // Photons of settings.caustic_paths light paths, emitted by `learned` if it is not null, if the settings
    // want a map and the scene has anything to throw: one map for all samples, or, where these are of two
    // halves (context), one of half the paths for each. Stopped early (monitor), it must not be used.
    IgiCaustics(const IgiSettings& settings, const RenderContext& context, std::uint32_t pass,
                const LearnedEmission* learned);

    // How the maps were made, all together; none if they were not.
    struct Made {
        std::uint64_t paths;
        DepositCount photons;
        double seconds;
    };
    const std::optional<Made>& made() const { return made_; }

    // Lobes of a smaller GGX alpha turn light as mirrors do, as far as caustics and compensating rays go.
    float specular_below() const { return specular_below_; }
    // Books on a path what the map of that half of the samples, 0 or 1, brings to a surface, radiance towards
    // wo: light that came over L(S+D)*S+, S specular. `left` > 0: the bounces that paths may have from there,
    // the one at the surface included.
    void add_radiance(const Vertex& vertex, std::size_t half, int left, const PathAccount& path) const;
    // Of light that arrives along w over L(S+D)*S+ and leaves towards wo, the share that rays must still
    // find.
    Rgb left_to_rays(const Vertex& vertex, const V3f& w) const;

  private:
    float specular_below_;
    int max_depth_;
    bool rays_find_rest_;  // of what arrives over specular surfaces; else the map brings it to gloss, too
    DensityEstimateSettings density_;
    std::vector<PhotonMap> maps_;  // none; one; or one for each half
    std::optional<Made> made_;
};

}  // namespace lucerna
