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
#include "engine/transport/lamp_set.h"
#include "engine/transport/light_choice.h"

namespace lucerna {

inline float power_heuristic(float pdf, float other) {
    // As a ratio, so that squares of extreme densities neither overflow nor vanish. pdf > 0.
    const float ratio = other / pdf;
    return 1 / (1 + ratio * ratio);
}

// What emission at the end of a ray counts for.
struct EmissionRule {
    enum class Kind : std::uint8_t {
        all,   // the eye's own ray, or one that only mirrors and glass have turned: nothing else finds it
        mis,   // a ray from a surface that also asked the lights: the share of the BSDF's strategy
        none,  // accounted for elsewhere
    } kind = Kind::all;
    float pdf_w = 0;     // with which the ray's direction was drawn; for `mis`
    LightChoice choice;  // by which the surface asked the lights; for `mis`
    // Lamps that count nothing on this ray, since whoever made it samples them on his own; null: none.
    const LampSet* but = nullptr;
    // The vertex whose direction the density belongs to, where the ray has gone straight on through panes
    // since, and how far it has come from there to where it begins now, scene units.
    V3f vertex{0, 0, 0};
    float passed = 0;

    static EmissionRule all() { return {}; }
    static EmissionRule all_but(const LampSet* lamps) { return {Kind::all, 0, {}, lamps}; }
    static EmissionRule none() { return {Kind::none, 0, {}}; }
    static EmissionRule mis(float pdf_w, const LightChoice& choice) { return {Kind::mis, pdf_w, choice}; }
    // The share of what was seen of a light that counts.
    float share(const Scene& scene, std::uint32_t light, const EmittedRadiance& seen) const {
        if (but && but->holds(light, seen)) return 0;
        return share(kind == Kind::mis ? choice.pdf_w(scene, light, seen) : 0.0F);
    }
    // The share of emission that counts, given the density with which next_event() would have drawn this
    // direction.
    float share(float light_pdf_w) const {
        switch (kind) {
            case Kind::all:
                return 1;
            case Kind::mis:
                return power_heuristic(pdf_w, light_pdf_w);
            case Kind::none:
                return 0;
        }
        return 0;
    }
    // After a mirror or smooth glass: next_event before it could not reach beyond.
    EmissionRule through_specular() const { return kind == Kind::none ? none() : all(); }
    // Of a ray that goes straight on where `ray`, which had this rule, met a pane at distance t: next_event
    // sees through panes, so nothing changes but where the ray begins.
    EmissionRule behind(const Ray& ray, float t) const {
        EmissionRule rule = *this;
        if (!(passed > 0)) rule.vertex = ray.o;
        rule.passed += t;
        return rule;
    }
    EmissionRule after(const BsdfSample& sample, const Ray& ray, float t) const {
        return sample.straight ? behind(ray, t) : through_specular();
    }
    // The ray from the vertex on. Lights' densities go by it.
    Ray whole(const Ray& ray) const { return passed > 0 ? Ray{vertex, ray.d, passed + ray.t_max} : ray; }
};

// Radiance towards wo from one light, chosen and asked for a direction, and from all suns of the choice.
// Here and below `parts` is told what is returned, as the path that ends with the vertex, or with the ray,
// finds it.
Rgb next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
               const PartsSink& parts = {});
Rgb next_event(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
               const PartsSink& parts = {});

// By which density directions are drawn at a vertex, where it is not the BSDF's alone.
class DirectionDensity {
  public:
    // Per solid angle, without deltas.
    virtual float pdf_w(const V3f& wi) const = 0;

  protected:
    ~DirectionDensity() = default;
};
// The first of these, beside directions drawn so.
Rgb next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
               const DirectionDensity& drawn_by, const PartsSink& parts = {});

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

// Calls found(radiance, distance, light) for each light that is not geometry (the sky, lamps' impostors) and
// lies on the ray before `hit`, with the share of its radiance that counts.
template <typename Found>
void for_each_impostor(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                       const EmissionRule& rule, Found&& found) {
    if (scene.impostors().empty()) return;
    const Ray whole = rule.whole(ray);
    const float nearest = hit ? rule.passed + hit->t : INFINITY;
    for (const std::uint32_t light : scene.impostors()) {
        const auto seen = scene.lights()[light]->Le(whole);
        if (!seen || seen->distance < rule.passed) continue;  // before the last pane: it has been counted
        if (!(seen->distance < nearest || (!hit && std::isinf(seen->distance)))) continue;
        found(seen->radiance * rule.share(scene, light, *seen), seen->distance - rule.passed, light);
    }
}

// Emission along a ray that met `hit` (or nothing), including what is not geometry: the sky, lamps'
// impostors.
Rgb emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, const EmissionRule& rule,
             const PartsSink& parts = {});
// The same as it arrives through the media on the way, begun in `medium`.
Rgb emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, const EmissionRule& rule,
             std::int32_t medium, Sampler& sampler, const PartsSink& parts = {});

// The same with all that lies straight behind panes, where next_event() finds it, too: as far as the first
// surface that lets nothing pass unbent. For rays that are followed no further.
Rgb emission_ahead(const Scene& scene, Ray ray, std::optional<Hit> hit, EmissionRule rule,
                   std::int32_t medium, Sampler& sampler, PartsSink parts = {});

// The part of it that surfaces emit.
Rgb surface_emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                     const EmissionRule& rule, const PartsSink& parts = {});

// Both strategies at once: all direct light at a vertex, one light sample and one BSDF sample; the latter
// only by chance on diffuse surfaces from which lights are small.
struct DirectLight {
    Rgb radiance;
    // The BSDF sample, where it is one that only mirrors and smooth glass make: what comes from there is
    // still to be found.
    std::optional<BsdfSample> specular;
};
DirectLight direct_light(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                         const LightChoice& choice, const PartsSink& parts = {});
// In a medium: times the scattering coefficient, what the ray towards wo gains per unit of length.
Rgb direct_light(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                 const PartsSink& parts = {});

}  // namespace lucerna
