// Adds caustics to the VPLs: light that comes from a lamp over mirrors, glass or gloss. Photons bring it, as
// with the `photonmap` method, wherever a surface is diffuse.
//
// Every path of light is counted once. At a place, arriving light is split by what it met last:
//   nothing: straight from a lamp              light samples, and rays that meet lamps
//   mirrors, glass, gloss and nothing else     the Caustic map for the diffuse part of the surface; rays for
//                                              the rest of it, and for what a medium scatters; without
//                                              compensation the map for the gloss of such a surface, too
//   the same, and before that the diffuse      the same, because rays would bring few samples of such small
//   part of a surface that was lit so          bright spots; without compensation nothing
//   a surface's diffuse part, a medium         VPLs, and near by the compensation rays
//   gloss and the like, and a diffuse surface  compensation rays; without them gloss (no mirrors) that is lit
//   before that                                by scattered light makes a Lambertian VPL
#pragma once

#include <optional>

#include "engine/scene/render_context.h"
#include "engine/transport/direct_light.h"
#include "engine/vpl/igi_settings.h"
#include "engine/vpl/vpl.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"

namespace lucerna {

// Returns which light makes Lambertian VPLs of gloss with these settings.
VplGloss vpl_gloss(const IgiSettings& settings);

// Tells whether light may come to a surface over specular ones, or over gloss.
bool throws_caustics(const Scene& scene);

class IgiCaustics {
  public:
    // Makes no map.
    explicit IgiCaustics(const IgiSettings& settings);
    // Builds Caustic maps of settings.caustic_paths light paths, emitted by `learned` if it is not null, if
    // the settings want them and the scene has caustics: one map for all samples, or, where these form two
    // halves (context), one of half the paths for each. If the monitor stopped it, it must not be used.
    IgiCaustics(const IgiSettings& settings, const RenderContext& context, std::uint32_t pass,
                const LearnedEmission* learned);

    // Reports how the maps were made, all together; none without maps.
    struct Made {
        std::uint64_t paths;
        DepositCount photons;
        double seconds;
    };
    const std::optional<Made>& made() const { return made_; }

    // Lobes of a smaller GGX alpha count as specular for caustics and compensation rays.
    float specular_below() const { return specular_below_; }
    // Books what the map of one half of the samples, 0 or 1, brings to a surface: radiance towards wo, of
    // light that came over L(S+D)*S+, S specular. `left` > 0 counts the bounces that the path may still have,
    // the one at the surface included.
    void add_radiance(const Vertex& vertex, std::size_t half, int left, const PathAccount& path) const;
    // Returns the share that rays must still find of light that arrives along w over L(S+D)*S+ and leaves
    // towards wo.
    Rgb left_to_rays(const Vertex& vertex, const V3f& w) const;

  private:
    float specular_below_;
    int max_depth_;
    bool rays_find_rest_;  // of light over specular surfaces; if false, the map brings it to gloss, too
    DensityEstimateSettings density_;
    std::vector<PhotonMap> maps_;  // none, one for all samples, or one for each half
    std::optional<Made> made_;
};

}  // namespace lucerna
