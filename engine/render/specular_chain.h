// Following a ray through mirrors and smooth glass to the first surface that scatters.
#pragma once

#include <optional>

#include "engine/base/stream.h"
#include "engine/render/direct_light.h"
#include "engine/render/quantity.h"
#include "engine/world/scene.h"

namespace lucerna {

struct SpecularChain {
    std::optional<Hit>
        hit;          // the first surface that is not purely specular; none if the ray escaped or ended
    V3f wo{0, 0, 0};  // from there back along the ray
    Rgb throughput{1.0F};
    Rgb emitted{0.0F};  // met on the way and at the end, throughput included
    float length = 0;   // of the first segment, scene units
};

// Glass is followed one way, chosen by its reflectance; a chain longer than max_depth ends black.
inline SpecularChain follow_specular(const Scene& scene, Ray ray, EmissionRule rule, int max_depth,
                                     Stream& stream) {
    SpecularChain chain;
    for (int depth = 0;; ++depth) {
        auto hit = scene.hit(ray);
        chain.emitted += chain.throughput * emission(scene, ray, hit, rule);
        if (depth == 0) chain.length = hit ? hit->t : INFINITY;
        if (!hit) return chain;
        const Bsdf bsdf = scene.bsdf(*hit);
        if (!bsdf.is_delta()) {
            chain.wo = -ray.d;
            chain.hit = hit;
            return chain;
        }
        const BsdfU u{stream.next(), stream.next2()};
        const auto sample = bsdf.sample(-ray.d, u, Transport::radiance);
        if (!sample || depth >= max_depth) return chain;
        chain.throughput *= sample->weight;
        rule = rule.through_specular();
        ray = Ray{hit->at.towards(sample->wi), sample->wi};
    }
}

// Radiance along a camera ray by a method that shades surfaces one at a time: `shade(vertex)` gives a
// DirectLight (its radiance may hold more than direct light). Where a surface is shiny as well as rough
// (varnish), the mirrored part is followed too.
template <typename Shade>
Rgb follow_and_shade(const Scene& scene, Ray ray, int max_depth, Stream& stream, Shade&& shade) {
    Rgb result(0);
    Rgb throughput(1);
    for (int depth = 0;; ++depth) {
        const SpecularChain chain = follow_specular(scene, ray, EmissionRule::all(), max_depth, stream);
        result += throughput * chain.emitted;
        if (!chain.hit) return result;
        throughput *= chain.throughput;
        const Bsdf bsdf = scene.bsdf(*chain.hit);
        const DirectLight shaded = shade(Vertex{*chain.hit, bsdf, chain.wo});
        result += throughput * shaded.radiance;
        if (!shaded.specular || depth >= max_depth) return result;
        throughput *= shaded.specular->weight;
        ray = Ray{chain.hit->at.towards(shaded.specular->wi), shaded.specular->wi};
    }
}

// What a meter reads on the first surface along a camera ray, by the same `shade`.
template <typename Shade>
Rgb meter_and_shade(const Scene& scene, const Ray& ray, Shade&& shade) {
    const auto hit = scene.hit(ray);
    if (!hit) return Rgb(0);
    const Bsdf white = white_receiver(*hit);
    return meter_reading(shade(Vertex{*hit, white, -ray.d}).radiance);
}

}  // namespace lucerna
