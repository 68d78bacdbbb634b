#include "engine/render/guided_light.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Of the BSDF's ray: the least chance that it is traced, and the chance where no candidate said anything.
constexpr float kLeastChance = 1.0F / 32;
constexpr float kBlindChance = 0.25F;

V3f side_seen(const Vertex& vertex) {
    const V3f& n = vertex.hit.at.n;
    return n.dot(vertex.wo) < 0 ? -n : n;
}

// u moved on by i steps of the sequence that fills the square most evenly of all such (Roberts 2018): every
// one is uniform if u is, and together they keep out of each other's way.
V2f step(const V2f& u, int i) {
    constexpr double kAlpha[2] = {0.75487766624669276, 0.56984029099805327};
    V2f result;
    for (int a = 0; a < 2; ++a) {
        const double x = double{u[a]} + i * kAlpha[a];
        result[a] = std::min(static_cast<float>(x - std::floor(x)), 0x1.fffffep-1F);
    }
    return result;
}

// Several candidates of the lights' strategy, one kept.
struct Candidates {
    float sum = 0;        // of the luminances of what each would bring, MIS share included
    float missing = 0;    // of what MIS leaves to the BSDF's strategy in the same directions
    Rgb kept{0.0F};       // what the kept one would bring
    Incident incident{};  // how it would

    // Radiance for a free way: on average over which one is kept it is the mean of all `count` of them.
    Rgb radiance(int count) const { return kept * (sum / (luminance(kept) * static_cast<float>(count))); }
    // The share of the light that the BSDF's strategy is expected to find. NaN if that is beyond numbers.
    float left_to_bsdf() const { return missing / (sum + missing); }
};

// Keeps one in proportion to its luminance, by one uniform number that is used again and again (Chao 1982).
void offer(Candidates& all, const Rgb& value, const Incident& incident, float& u_keep) {
    const float y = luminance(value);
    if (!(y > 0) || !std::isfinite(y)) return;
    all.sum += y;
    const float chance = y / all.sum;  // 1 for the first
    if (u_keep < chance) {
        all.kept = value;
        all.incident = incident;
        u_keep /= chance;
    } else {
        u_keep = (u_keep - chance) / (1 - chance);
    }
    u_keep = std::min(u_keep, 0x1.fffffep-1F);
}

Candidates draw_candidates(const Scene& scene, const Vertex& vertex, const LightChoice& choice, int count,
                           Stream& stream) {
    const float u_light = stream.next();
    const V2f u_place = stream.next2();
    float u_keep = stream.next();
    Candidates all;
    for (int i = 0; i < count; ++i) {
        // One in each of `count` equal parts of the choice.
        const float u = (static_cast<float>(i) + u_light) / static_cast<float>(count);
        const auto drawn = choice.draw(scene, vertex.hit.at.p, std::min(u, 0x1.fffffep-1F), step(u_place, i));
        if (!drawn) continue;
        const Rgb value = unshadowed(vertex, *drawn);
        if (drawn->pdf_w > 0) {
            const float ratio = vertex.bsdf.pdf_w(vertex.wo, drawn->incident.w) / drawn->pdf_w;
            all.missing += luminance(value) * ratio * ratio;  // power heuristic: the shares are 1 : ratio²
        }
        offer(all, value, drawn->incident, u_keep);
    }
    return all;
}

// The chance with which the BSDF's ray is traced. Where lights look small (the ratio t of the densities is
// small) that strategy brings a share t² with a variance of t³: a chance of t adds no more than t². Only for
// surfaces without peaks: elsewhere it may find what no candidate can.
float bsdf_chance(const Vertex& vertex, const Candidates& all) {
    if (!vertex.bsdf.is_diffuse()) return 1;
    if (!(all.sum > 0)) return kBlindChance;
    const float left = all.left_to_bsdf();
    return left < 1 ? std::max(std::sqrt(left), kLeastChance) : 1.0F;  // 1 for NaN, too
}

}  // namespace

DirectLight gated_light(const Scene& scene, const GuideMap& guides, const Vertex& vertex, Stream& stream,
                        const LightChoice& plain) {
    if (guides.any_near(vertex.hit.at.p, side_seen(vertex))) {
        return direct_light(scene, vertex, stream, plain);
    }
    if (vertex.bsdf.is_diffuse()) return {Rgb(0), {}};
    const BsdfU u{stream.next(), stream.next2()};
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    return {Rgb(0), sample && sample->delta ? sample : std::nullopt};
}

DirectLight GuidedLight::operator()(const Vertex& vertex, Stream& stream, const LightChoice& plain) const {
    const SurfacePoint& x = vertex.hit.at;
    const bool guided = settings_.floor < 1;
    const Guide guide = guided ? guides_.at(x.p, side_seen(vertex)) : Guide();
    const LightChoice choice = plain.guided(guide, std::max(settings_.floor, guide.plain_share()));

    // Ask the lights.
    DirectLight result{Rgb(0), {}};
    const Candidates all = draw_candidates(scene_, vertex, choice, settings_.candidates, stream);
    if (all.sum > 0) {
        result.radiance =
            all.radiance(settings_.candidates) * passing_share(scene_, vertex, all.incident, stream);
    }

    // Ask the BSDF.
    const BsdfU u{stream.next(), stream.next2()};
    const float u_trace = stream.next();
    const auto sample = vertex.bsdf.sample(vertex.wo, u, Transport::radiance);
    if (!sample) return result;
    if (sample->delta) {
        result.specular = sample;
        return result;
    }
    const float chance = bsdf_chance(vertex, all);
    if (!(u_trace < chance)) return result;
    const Ray ray{x.towards(sample->wi), sample->wi};
    const Rgb found = emission(scene_, ray, scene_.hit(ray), EmissionRule::mis(sample->pdf_w, choice),
                               vertex.medium_towards(sample->wi), stream);
    result.radiance += sample->weight * found / chance;
    return result;
}

}  // namespace lucerna
