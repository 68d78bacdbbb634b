// Direct light by Monte Carlo: both strategies of multiple importance sampling [Veach 1997, 9].
//
// A surface samples a direction towards a light (next_event); or a direction drawn from the BSDF happens to
// find a light (emission, with the rule that says which share of it still counts). Used together, with the
// power heuristic, the two are unbiased and neither small nor large lights are noisy. A place where a medium
// scatters is lit in the same two ways, its phase function in the BSDF's place.
//
// Which light is asked, and which part of it, is the caller's to choose (light_choice.h): nothing is chosen
// by default, so that no place forgets what the settings say.
//
// Media take their share of every ray, here as everywhere between vertices. The weights of the two strategies
// go by the densities of directions alone: both are weakened alike, so it need not be in them.
#pragma once

#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/scene.h"
#include "engine/transport/eye_path.h"
#include "engine/transport/light_choice.h"

namespace lucerna {

// Asks one light, which is chosen and asked for a direction, and all suns of the choice: the radiance that
// they send towards wo is booked on the path that ends at the vertex.
void next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
                const PathAccount& path);
void next_event(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                const PathAccount& path);

// By which density directions are drawn at a vertex, where it is not the BSDF's alone.
class DirectionDensity {
  public:
    // Per solid angle, without deltas.
    virtual float pdf_w(const V3f& wi) const = 0;

  protected:
    ~DirectionDensity() = default;
};
// The first of these, beside directions drawn so.
void next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
                const DirectionDensity& drawn_by, const PathAccount& path);

// What a drawn light would send towards wo if nothing stood in between: the share of the lights' strategy.
Rgb unshadowed(const Vertex& vertex, const LightChoice::Draw& drawn);
// What of it arrives: 0 if something stands in between, else what media let pass.
Rgb transmitted_share(const Scene& scene, const Vertex& vertex, const LightSample& light_sample,
                      Sampler& sampler);

// What a sun of LightChoice::suns() sends towards wo. None: nothing, whatever stands in between.
struct Sunlight {
    Rgb radiance;
    V3f w;  // unit, towards the sun
};
std::optional<Sunlight> sunlight(const Scene& scene, const Vertex& vertex, std::uint32_t sun,
                                 Sampler& sampler);

// Samples direct light by both strategies at once, one light sample and one BSDF sample, and books it on the
// path that ends at the vertex; the BSDF is sampled only by chance on diffuse surfaces from which lights are
// small. Returns the BSDF sample where it is one that only mirrors and smooth glass make: what comes from
// there is still to be found.
std::optional<BsdfSample> direct_light(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                                       const LightChoice& choice, const PathAccount& path);
// In a medium: times the scattering coefficient, what the ray towards wo gains per unit of length.
void direct_light(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                  const PathAccount& path);

// Books what is emitted along a direction drawn at a vertex, for which the path's account is `found`: the
// share of the BSDF's strategy.
void add_emission_towards(const Scene& scene, const Vertex& vertex, const BsdfSample& sample,
                          const LightChoice& choice, Sampler& sampler, const PathAccount& found);

}  // namespace lucerna
