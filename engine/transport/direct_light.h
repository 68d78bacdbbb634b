// Computes direct light by Monte Carlo, with both strategies of multiple importance sampling [Veach 1997, 9].
//
// A surface either samples a direction towards a light (next_event), or draws a direction from the BSDF,
// which may happen to meet a light (emission, whose MIS weight is given by EmissionRule). Combined by the
// power heuristic, the two are unbiased, and neither small nor large lights are noisy. A place where a medium
// scatters is lit in the same two ways, with its phase function in place of the BSDF.
//
// The caller chooses which light is sampled, and which part of it (light_choice.h). There is no default
// choice, so that no caller can overlook the settings.
//
// Media attenuate every ray, here as everywhere between vertices. The MIS weights use only the densities of
// directions: media attenuate both strategies alike, so that the attenuation need not enter the weights.
#pragma once

#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/scene.h"
#include "engine/transport/eye_path.h"
#include "engine/transport/light_choice.h"

namespace lucerna {

// Samples one light, drawn by `choice`, and all suns of the choice. Books the radiance that they send towards
// wo on the path that ends at the vertex.
void next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
                const PathAccount& path);
void next_event(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                const PathAccount& path);

// Describes how directions are drawn at a vertex, where they are not drawn by the BSDF alone.
class DirectionDensity {
  public:
    // Returns the density per solid angle, without deltas.
    virtual float pdf_w(const V3f& wi) const = 0;

  protected:
    ~DirectionDensity() = default;
};
// Samples a light at a surface whose other strategy draws directions by `drawn_by` instead of the BSDF.
void next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
                const DirectionDensity& drawn_by, const PathAccount& path);

// Returns the unoccluded radiance that a drawn light sends towards wo, MIS weight included.
Rgb unshadowed(const Vertex& vertex, const LightChoice::Draw& drawn);
// Returns the share of that radiance that arrives: 0 behind something opaque, else the transmittance.
Rgb transmitted_share(const Scene& scene, const Vertex& vertex, const LightSample& light_sample,
                      Sampler& sampler);

// Holds the radiance that a sun of LightChoice::suns() sends towards wo. There is none if it is black even
// unoccluded.
struct Sunlight {
    Rgb radiance;
    V3f w;  // unit, towards the sun
};
std::optional<Sunlight> sunlight(const Scene& scene, const Vertex& vertex, std::uint32_t sun,
                                 Sampler& sampler);

// Samples direct light by both strategies, one light sample and one BSDF sample, and books it on the path
// that ends at the vertex. On diffuse surfaces that see the light as small, the BSDF sample is subject to
// Russian roulette. A specular BSDF sample (mirror, smooth glass) is returned instead: the light from its
// direction is still to be found.
std::optional<BsdfSample> direct_light(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                                       const LightChoice& choice, const PathAccount& path);
// Does the same in a medium. The booked radiance times the scattering coefficient is the gain of the ray
// towards wo per unit of length.
void direct_light(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                  const PathAccount& path);

// Books the emission along a direction that was drawn from the BSDF at a vertex, with its MIS weight. `found`
// is the path's account at the vertex.
void add_emission_towards(const Scene& scene, const Vertex& vertex, const BsdfSample& sample,
                          const LightChoice& choice, Sampler& sampler, const PathAccount& found);

}  // namespace lucerna
