#include "engine/transport/direct_light.h"

#include <algorithm>
#include <utility>

namespace lucerna {
namespace {

// This branch of a path's sampler serves only media, so that their numbers don't shift the path's own.
constexpr std::uint32_t kShadowBranch = 0x5d;

// Returns the share of a light sample that arrives at the place.
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
    if (!(drawn.pdf_w > 0)) return result;  // a delta light, which no other strategy can find
    return result * power_heuristic(drawn.pdf_w, place.pdf_w(light_sample.w));
}

template <typename Place>
std::optional<Sunlight> sunlight_at(const Scene& scene, const Place& place, std::uint32_t sun,
                                    Sampler& sampler) {
    const auto arriving = scene.lights()[sun]->sample_Li(place.from().p, V2f(0.5F));  // one direction only
    if (!arriving) return std::nullopt;
    const Rgb value = place.value(arriving->w) * arriving->weight;
    if (is_black(value)) return std::nullopt;
    return Sunlight{value * arriving_share(scene, place, *arriving, sampler), arriving->w};
}

// Samples one light from a surface or a place in a medium, and then every sun. Returns the light sample, or
// none if the drawn light sends nothing here.
template <typename Place>
std::optional<LightChoice::Draw> ask_light(const Scene& scene, const Place& place, Sampler& sampler,
                                           const LightChoice& choice, const PathAccount& path) {
    // The numbers are always drawn, so that the later draws of a path do not depend on what is found here.
    const float u_light = sampler.next();
    const V2f u_place = sampler.next2();
    const auto drawn = choice.draw(scene, place.from().p, u_light, u_place);
    if (drawn) {
        const Rgb radiance = unshadowed_at(place, *drawn);
        if (!is_black(radiance))
            path.add_direct(radiance * arriving_share(scene, place, drawn->light_sample, sampler),
                            drawn->light);
    }
    for (const std::uint32_t sun : choice.suns()) {
        if (const auto from_sun = sunlight_at(scene, place, sun, sampler))
            path.add_direct(from_sun->radiance, sun);
    }
    return drawn;
}

// Returns the probability of taking a BSDF sample at a diffuse surface, given the light sample drawn there.
// Where lights are drawn far more densely than directions of the BSDF, the power heuristic leaves the BSDF
// sample almost no weight, yet it costs a ray. It is therefore taken only sometimes [Russian roulette; Veach
// 1997, 10.4.1]: its variance falls by the square of the densities' ratio and still remains the smaller one.
// Under a sky the probability is 1, because a dense sample of the sun says nothing about the rest of the sky,
// which only BSDF samples find well. It is also 1 with several lights or several parts of a light, because a
// sample of one says nothing about the others.
float bsdf_sample_chance(const Scene& scene, const Bsdf& bsdf,
                         const std::optional<LightChoice::Draw>& drawn) {
    constexpr float kLeast = 0.125F;
    // kDensity is a diffuse surface's largest density. The probability falls below 1 once lights are drawn
    // kMargin times more densely.
    constexpr float kDensity = kInvPi, kMargin = 4;
    const bool one_light = scene.lights().size() == 1 && scene.lights()[0]->part_bounds().empty();
    if (!one_light || !bsdf.is_diffuse() || scene.has_sky() || !drawn || !(drawn->pdf_w > 0)) return 1;
    return std::clamp(kMargin * kDensity / drawn->pdf_w, kLeast, 1.0F);
}

}  // namespace

void next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
                const PathAccount& path) {
    ask_light(scene, vertex, sampler, choice, path);
}
void next_event(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                const PathAccount& path) {
    PathAccount here = path;
    here.scatter_in_medium();
    ask_light(scene, vertex, sampler, choice, here);
}

namespace {

struct GuidedVertex : Vertex {
    const DirectionDensity& drawn_by;
    float pdf_w(const V3f& w) const { return drawn_by.pdf_w(w); }
};

}  // namespace

void next_event(const Scene& scene, const Vertex& vertex, Sampler& sampler, const LightChoice& choice,
                const DirectionDensity& drawn_by, const PathAccount& path) {
    ask_light(scene, GuidedVertex{vertex, drawn_by}, sampler, choice, path);
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

void add_emission_towards(const Scene& scene, const Vertex& vertex, const BsdfSample& sample,
                          const LightChoice& choice, Sampler& sampler, const PathAccount& found) {
    const Ray ray{vertex.hit.at.towards(sample.wi), sample.wi};
    EyePath path(found, ray, vertex.medium_towards(sample.wi), EmissionRule::mis(sample.pdf_w, choice));
    path.throughput *= sample.weight;
    path.scatter_at_surface(false);
    add_emission_ahead(scene, path, scene.intersect(ray), sampler);
}

std::optional<BsdfSample> direct_light(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                                       const LightChoice& choice, const PathAccount& path) {
    const auto drawn = ask_light(scene, vertex, sampler, choice, path);
    const BsdfU u{sampler.next(), sampler.next2()};
    const float chance = bsdf_sample_chance(scene, vertex.bsdf, drawn);
    if (!(sampler.next() < chance)) return std::nullopt;
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    if (!sample || sample->delta) return sample;
    add_emission_towards(scene, vertex, *sample, choice, sampler,
                         path.times(1 / chance));  // chance >= kLeast
    return std::nullopt;
}

void direct_light(const Scene& scene, const MediumVertex& vertex, Sampler& sampler, const LightChoice& choice,
                  const PathAccount& path) {
    next_event(scene, vertex, sampler, choice, path);
    const V3f wi = vertex.phase.sample(vertex.wo, sampler.next2());
    const Ray ray{vertex.p, wi};
    // The throughput needs no factor, because the phase function divided by its own density is 1.
    EyePath found(path, ray, vertex.medium, EmissionRule::mis(vertex.pdf_w(wi), choice));
    found.scatter_in_medium();
    add_emission_ahead(scene, found, scene.intersect(ray), sampler);
}

}  // namespace lucerna
