#include "engine/transport/direct_light.h"

#include <algorithm>
#include <utility>

namespace lucerna {
namespace {

// Branches of a path's sampler: numbers that only media take.
constexpr std::uint32_t kShadowBranch = 0x5d;
constexpr std::uint32_t kLampBranch = 0x1a;
constexpr std::uint32_t kAheadBranch = 0xa000;  // and one more for each pane

// The share of a light's sample that arrives.
template <typename Place>
Rgb arriving_share(const Scene& scene, const Place& place, const LightSample& light_sample,
                   Sampler& sampler) {
    const Ray way = way_from(place.from(), light_sample.w, light_sample.distance);
    const std::int32_t medium = place.medium_towards(light_sample.w);
    if (scene.media().empty()) return passing(scene, way, medium, sampler);  // draws nothing
    Sampler more = sampler.split(kShadowBranch);
    return passing(scene, way, medium, more);
}

template <typename Place>
Rgb unshadowed_at(const Place& place, const LightChoice::Draw& drawn) {
    const LightSample& light_sample = drawn.light_sample;
    Rgb result = place.value(light_sample.w);
    if (is_black(result)) return Rgb(0);
    result *= light_sample.weight * drawn.gain;
    if (!(drawn.pdf_w > 0)) return result;  // a delta light: nothing else finds it
    return result * power_heuristic(drawn.pdf_w, place.pdf_w(light_sample.w));
}

template <typename Place>
std::optional<Sunlight> sunlight_at(const Scene& scene, const Place& place, std::uint32_t sun,
                                    Sampler& sampler) {
    const auto arriving = scene.lights()[sun]->sample_Li(place.from().p, V2f(0.5F));  // of one direction
    if (!arriving) return std::nullopt;
    const Rgb value = place.value(arriving->w) * arriving->weight;
    if (is_black(value)) return std::nullopt;
    return Sunlight{value * arriving_share(scene, place, *arriving, sampler), arriving->w};
}

// One light, asked by a surface or by a place in a medium; and the suns.
struct AskedLight {
    Rgb radiance{0.0F};                     // towards wo, with that from suns
    std::optional<LightChoice::Draw> draw;  // none: nothing arrives from the light
};
template <typename Place>
AskedLight ask_light(const Scene& scene, const Place& place, Sampler& sampler, const LightChoice& choice,
                     const PartsSink& parts) {
    // Draw always, so that the later draws of a path do not depend on what is found here.
    const float u_light = sampler.next();
    const V2f u_place = sampler.next2();
    AskedLight asked{Rgb(0), choice.draw(scene, place.from().p, u_light, u_place)};
    if (asked.draw) {
        asked.radiance = unshadowed_at(place, *asked.draw);
        if (!is_black(asked.radiance)) {
            asked.radiance *= arriving_share(scene, place, asked.draw->light_sample, sampler);
            parts.direct(asked.radiance, asked.draw->light);
        }
    }
    for (const std::uint32_t sun : choice.suns()) {
        if (const auto from_sun = sunlight_at(scene, place, sun, sampler)) {
            asked.radiance += from_sun->radiance;
            parts.direct(from_sun->radiance, sun);
        }
    }
    return asked;
}

// The chance of a BSDF sample at a diffuse surface beside a light that was drawn there. Where lights are
// drawn far more densely than directions of the BSDF, the power heuristic leaves the latter next to nothing,
// at the price of a ray: it is taken sometimes [Russian roulette; Veach 1997, 10.4.1], so that its variance,
// which falls by the square of the densities' ratio, still is the smaller one. Never under a sky: what is
// drawn densely there (the sun) says nothing about the rest of it, which only BSDF samples find well; nor
// beside several lights, or parts of one, where that of one says nothing about the others.
float bsdf_sample_chance(const Scene& scene, const Bsdf& bsdf,
                         const std::optional<LightChoice::Draw>& drawn) {
    constexpr float kLeast = 0.125F;
    // A diffuse surface's largest density; how many times more densely lights are drawn for the chance to
    // fall.
    constexpr float kDensity = kInvPi, kMargin = 4;
    const bool one_light = scene.lights().size() == 1 && scene.lights()[0]->part_bounds().empty();
    if (!one_light || !bsdf.is_diffuse() || scene.has_sky() || !drawn || !(drawn->pdf_w > 0)) return 1;
    return std::clamp(kMargin * kDensity / drawn->pdf_w, kLeast, 1.0F);
}

}  // namespace

Rgb next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
               const PartsSink& parts) {
    return ask_light(scene, vertex, sampler, choice, parts).radiance;
}
Rgb next_event(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
               const PartsSink& parts) {
    return ask_light(scene, vertex, sampler, choice, parts.in_medium()).radiance;
}

namespace {

struct GuidedVertex : Vertex {
    const DirectionDensity& drawn_by;
    float pdf_w(const V3f& w) const { return drawn_by.pdf_w(w); }
};

}  // namespace

Rgb next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
               const DirectionDensity& drawn_by, const PartsSink& parts) {
    return ask_light(scene, GuidedVertex{vertex, drawn_by}, sampler, choice, parts).radiance;
}

Rgb unshadowed(const Vertex& vertex, const LightChoice::Draw& drawn) {
    return unshadowed_at(vertex, drawn);
}
Rgb transmitted_share(const Scene& scene, const Vertex& vertex, const LightSample& light_sample,
                      Sampler& sampler) {
    return arriving_share(scene, vertex, light_sample, sampler);
}

std::optional<Sunlight> sunlight(const Scene& scene, const Vertex& vertex, std::uint32_t sun,
                                 Sampler& sampler) {
    return sunlight_at(scene, vertex, sun, sampler);
}

Rgb surface_emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                     const EmissionRule& rule, const PartsSink& parts) {
    if (rule.kind == EmissionRule::Kind::none || !hit || hit->light == kNoLight) return Rgb(0);
    const auto light = static_cast<std::uint32_t>(hit->light);
    const EmittedRadiance seen = scene.lights()[light]->Le_on_surface(rule.whole(ray), rule.passed + hit->t,
                                                                      hit->at.n, hit->primitive);
    const Rgb radiance = seen.radiance * rule.share(scene, light, seen);
    parts.met(radiance, light, rule.kind == EmissionRule::Kind::all);
    return radiance;
}

Rgb emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, const EmissionRule& rule,
             const PartsSink& parts) {
    if (rule.kind == EmissionRule::Kind::none) return Rgb(0);
    Rgb result = surface_emission(scene, ray, hit, rule, parts);
    for_each_impostor(scene, ray, hit, rule, [&](const Rgb& radiance, float, std::uint32_t light) {
        result += radiance;
        parts.met(radiance, light, rule.kind == EmissionRule::Kind::all);
    });
    return result;
}

Rgb emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, const EmissionRule& rule,
             std::int32_t medium, Sampler& sampler, const PartsSink& parts) {
    if (scene.media().empty()) return emission(scene, ray, hit, rule, parts);
    if (rule.kind == EmissionRule::Kind::none) return Rgb(0);
    Sampler more = sampler.split(kLampBranch);
    Rgb result(0);
    const auto add = [&](const Rgb& radiance, float distance, std::uint32_t light) {
        if (!is_black(radiance)) {
            const Rgb arriving = radiance * transmittance(scene, Ray{ray.o, ray.d, distance}, medium, more);
            result += arriving;
            parts.met(arriving, light, rule.kind == EmissionRule::Kind::all);
        }
    };
    if (hit) add(surface_emission(scene, ray, hit, rule), hit->t, static_cast<std::uint32_t>(hit->light));
    for_each_impostor(scene, ray, hit, rule, add);
    return result;
}

Rgb emission_ahead(const Scene& scene, Ray ray, std::optional<Hit> hit, EmissionRule rule,
                   std::int32_t medium, Sampler& sampler, PartsSink parts) {
    Rgb result(0), passed(1);
    for (int panes = 0; panes < kMaxBorders; ++panes) {
        result += passed * emission(scene, ray, hit, rule, medium, sampler, parts);
        if (!hit || !scene.has_panes() || rule.kind == EmissionRule::Kind::none) break;
        Rgb share = scene.bsdf(*hit).straight_share(-ray.d);
        if (is_black(share)) break;
        if (!scene.media().empty()) {
            Sampler more = sampler.split(kAheadBranch + static_cast<std::uint32_t>(panes));
            medium = for_each_piece(scene, Ray{ray.o, ray.d, hit->t}, medium, [&](MediumPiece piece) {
                share *= transmittance(std::move(piece.along), more);
                return !is_black(share);
            });
        }
        passed *= share;
        if (is_black(passed)) break;
        parts = parts.times(share);
        medium = medium_towards(hit->media, hit->at.n, ray.d, medium);
        rule = rule.behind(ray, hit->t);
        ray = Ray{hit->at.towards(ray.d), ray.d};
        hit = scene.intersect(ray);
    }
    return result;
}

DirectLight direct_light(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                         const LightChoice& choice, const PartsSink& parts) {
    const auto [asked, drawn] = ask_light(scene, vertex, sampler, choice, parts);
    const BsdfU u{sampler.next(), sampler.next2()};
    const float chance = bsdf_sample_chance(scene, vertex.bsdf, drawn);
    if (!(sampler.next() < chance)) return {asked, {}};
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    if (!sample) return {asked, {}};
    if (sample->delta) return {asked, sample};
    const Ray ray{vertex.hit.at.towards(sample->wi), sample->wi};
    const Rgb found = emission_ahead(
        scene, ray, scene.intersect(ray), EmissionRule::mis(sample->pdf_w, choice),
        vertex.medium_towards(sample->wi), sampler, parts.times(sample->weight / chance).past_surface());
    return {asked + sample->weight * found / chance, {}};  // chance >= kLeast
}

Rgb direct_light(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                 const PartsSink& parts) {
    const Rgb asked = next_event(scene, vertex, sampler, choice, parts);
    const V3f wi = vertex.phase.sample(vertex.wo, sampler.next2());
    const Ray ray{vertex.p, wi};
    const EmissionRule rule = EmissionRule::mis(vertex.pdf_w(wi), choice);
    return asked + emission_ahead(scene, ray, scene.intersect(ray), rule, vertex.medium, sampler,
                                  parts.in_medium());  // phase / pdf is 1
}

}  // namespace lucerna
