#include "engine/render/direct_light.h"

namespace lucerna {

Rgb next_event(const Scene& scene, const Vertex& vertex, Stream& stream) {
    // Draw always, so that the later draws of a path do not depend on what is found here.
    const float u_light = stream.next();
    const V2f u_place = stream.next2();
    const auto pick = scene.picker().pick(u_light);
    if (!pick) return Rgb(0);
    const SurfacePoint& x = vertex.hit.at;
    const Light& light = *scene.lights()[pick->light];
    const auto incident = light.illuminate(x.p, u_place);
    if (!incident) return Rgb(0);

    const float cos_x = std::fabs(incident->w.dot(vertex.bsdf.shading_normal()));
    const Rgb f = vertex.bsdf.f(vertex.wo, incident->w, Transport::radiance);
    if (is_black(f) || !(cos_x > 0)) return Rgb(0);
    Rgb result = f * incident->weight * (cos_x / pick->probability);  // a picked light has probability > 0
    if (!light.is_delta()) {
        const float bsdf_pdf = vertex.bsdf.pdf_w(vertex.wo, incident->w);
        result *= power_heuristic(incident->pdf_w * pick->probability, bsdf_pdf);
    }
    if (is_black(result) || !scene.visible(x, incident->w, incident->distance)) return Rgb(0);
    return result;
}

Rgb surface_emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                     const EmissionRule& rule) {
    if (rule.kind == EmissionRule::Kind::none || !hit || hit->light == kNoLight) return Rgb(0);
    const auto light = static_cast<std::uint32_t>(hit->light);
    const Seen seen = scene.lights()[light]->meet(ray, hit->t, hit->at.n);
    return seen.radiance * rule.share(seen.pdf_w * scene.picker().probability(light));
}

Rgb emission(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, const EmissionRule& rule) {
    if (rule.kind == EmissionRule::Kind::none) return Rgb(0);
    Rgb result = surface_emission(scene, ray, hit, rule);
    const float nearest = hit ? hit->t : INFINITY;
    for (const std::uint32_t light : scene.impostors()) {
        const auto seen = scene.lights()[light]->seen(ray);
        if (!seen || !(seen->distance < nearest || (!hit && std::isinf(seen->distance)))) continue;
        result += seen->radiance * rule.share(seen->pdf_w * scene.picker().probability(light));
    }
    return result;
}

bool visible_between(const Scene& scene, const SurfacePoint& x, const SurfacePoint& y) {
    const V3f w = y.p - x.p;
    const V3f begin = x.towards(w);
    const V3f way = y.towards(-w) - begin;
    const float distance = way.length();
    if (!(distance > 0)) return true;  // the two ends have met: there is no room for anything between them
    return scene.visible(SurfacePoint{begin}, way / distance, distance);
}

DirectLight direct_light(const Scene& scene, const Vertex& vertex, Stream& stream) {
    const Rgb asked = next_event(scene, vertex, stream);
    const BsdfU u{stream.next(), stream.next2()};
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    if (!sample) return {asked, {}};
    if (sample->delta) return {asked, sample};
    const Ray ray{vertex.hit.at.towards(sample->wi), sample->wi};
    const Rgb found = emission(scene, ray, scene.hit(ray), EmissionRule::mis(sample->pdf_w));
    return {asked + sample->weight * found, {}};
}

}  // namespace lucerna
