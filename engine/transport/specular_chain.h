// Following a ray through mirrors, smooth glass and media to the first surface that scatters.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "engine/base/path_limits.h"
#include "engine/base/sampler.h"
#include "engine/scene/quantity.h"
#include "engine/scene/scene.h"
#include "engine/transport/direct_light.h"

namespace lucerna {

// At so many smooth boundaries that the eye sees, one behind the other, light is followed both ways.
inline constexpr int kGlassSplits = 3;

// Smooth glass sends little one way, which a lamp's mirror image may make bright: followed by chance F, that
// image would be grain. The fainter way, of share s, is followed beside the brighter one by chance sqrt(s),
// which is how many samples pay where its variance goes by s [Rath 2022], and counts s / sqrt(s) times.
struct GlassSplit {
    BsdfU brighter;                     // for Bsdf::sample: the brighter way
    float share;                        // of it; to be multiplied with that sample's weight
    std::optional<BsdfSample> fainter;  // if it is followed: its weight says for how much it stands
};
// None where there are not two ways. `own`: random numbers for nothing else.
inline std::optional<GlassSplit> split_at_glass(const Bsdf& bsdf, const V3f& wo, Sampler& own) {
    const std::optional<float> reflect = bsdf.reflect_chance(wo);
    if (!reflect || !(*reflect > 0) || !(*reflect < 1)) return std::nullopt;
    const BsdfU reflects{0.0F, V2f(0.5F)}, transmits{0.5F * (1 + *reflect), V2f(0.5F)};
    const bool is_clear = *reflect < 0.5F;
    const float faint = is_clear ? *reflect : 1 - *reflect;
    GlassSplit split{is_clear ? transmits : reflects, 1 - faint, {}};
    const float chance = std::sqrt(faint);  // > 0
    if (own.next() < chance) {
        split.fainter = bsdf.sample(wo, is_clear ? reflects : transmits, Transport::radiance);
        if (split.fainter) split.fainter->weight *= faint / chance;
    }
    return split;
}
inline constexpr std::uint32_t kGlassBranch = 0x61a;

// What a sample of a BSDF makes of a path. One that goes straight on is no bounce: the path is what it was.
inline PartsSink past(const PartsSink& parts, const BsdfSample& sample) {
    return sample.straight ? parts : parts.past(sample.delta);
}
inline int bounces_left(int left, const BsdfSample& sample) {
    return sample.straight ? left : left - 1;
}

// What media do to a ray between two surfaces, for methods that know the radiance at any place: they add what
// they scatter into it, and take their share of what comes from behind.
//
// The end is always looked at, and one place on the way beside it, whatever the chances: a thin fog makes no
// noise on what is seen through it, and a thick one none on itself. (A path tracer, for which both are a path
// to be followed, chooses one.) Emission by media is not looked for here; scenes that have it are for `path`.

// Below this share what lies behind media is looked at only sometimes.
inline constexpr float kFaintTransmittance = 0.1F;

struct MediaSegment {
    Rgb passed{1.0F};                 // the share of what comes from the end
    Rgb added{0.0F};                  // radiance, W/(m² sr)
    std::int32_t medium = kNoMedium;  // of the borders, at the end

    // Roulette for a faint end. False: it need not be looked at.
    bool survives(Sampler& sampler) {
        const float left = max_component(passed);
        if (!(left < kFaintTransmittance)) return true;
        if (!(sampler.next() < left / kFaintTransmittance)) return false;
        passed *= kFaintTransmittance / left;  // left > 0, or it were lost
        return true;
    }
};

// Of a ray that meets `hit`, or nothing; it begins in `medium`, with `throughput` (not black).
// `source(MediumVertex, sigma_s, share)` is what is scattered into it there: radiance per unit of length, of
// which that share is added. It is not asked unless `scatters`.
template <typename Source>
MediaSegment media_segment_along(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                                 std::int32_t medium, const Rgb& throughput, bool scatters, Sampler& sampler,
                                 Source&& source) {
    constexpr std::uint32_t kPassBranch = 0x9a;
    MediaSegment segment;
    segment.medium = medium;
    if (scene.media().empty()) return segment;
    const Ray way{ray.o, ray.d, hit ? hit->t : ray.t_max};
    segment.medium = for_each_piece(scene, way, medium, [&](const MediumPiece& piece) {
        const Rgb arriving = throughput * segment.passed;
        if (is_black(arriving)) return false;
        if (const auto place = scatters ? scatter_within(piece.along, arriving, sampler) : std::nullopt) {
            const MediumVertex vertex{scattering_point(piece, place->t, hit), HenyeyGreenstein(place->g),
                                      -ray.d, piece.medium};
            const Rgb share = segment.passed * place->flow;
            segment.added += share * source(vertex, place->sigma_s, share);
        }
        Sampler more = sampler.split(kPassBranch);
        segment.passed *= transmittance(piece.along, more);
        return true;
    });
    return segment;
}

struct SpecularChain {
    std::optional<Hit>
        hit;          // the first surface that is not purely specular; none if the ray escaped or ended
    V3f wo{0, 0, 0};  // from there back along the ray
    Rgb throughput{1.0F};
    Rgb emitted{0.0F};                // met on the way and at the end, throughput included
    float length = 0;                 // to the first surface that the ray does not pass straight, scene units
    std::int32_t medium = kNoMedium;  // of the borders, at its end
    int left = 0;  // bounces that a path may still have, the one at `hit` included; > 0 if there is one
    PartsSink parts = {};  // of what is found there
    Ray ray;               // the last one, which met `hit`, and its rule
    EmissionRule rule;

    Vertex vertex(const Bsdf& bsdf) const { return {*hit, bsdf, wo, medium}; }  // requires hit
};

// What follow_specular() does not follow itself: the fainter way at glass that the eye sees.
struct SpecularBranch {
    Ray ray;
    std::int32_t medium;
    int left;    // bounces that its path may still have
    int splits;  // more of such ways that it may have
    EmissionRule rule;
};
struct NoBranches {
    Rgb operator()(const SpecularBranch&, const Rgb& /*throughput*/, Sampler&, const PartsSink&) const {
        return Rgb(0);
    }
};

// Glass is followed one way, chosen by its reflectance; at the first `splits` boundaries the brighter one,
// and the other one by `branch(SpecularBranch, throughput, sampler, parts)`, which gives the radiance along
// that ray; it counts with that throughput. The ray begins in `medium`, and the path that it is the end of
// may have `left` more bounces: without any it meets what emits, and no more. `source(MediumVertex, sigma_s,
// left, parts)` is radiance scattered per unit of length, as media_segment_along() has it, where so many
// bounces are left, the one in the medium included. All tell their `parts` what they find.
template <typename Source, typename Branch = NoBranches>
SpecularChain follow_specular(const Scene& scene, Ray ray, std::int32_t medium, EmissionRule rule, int left,
                              Sampler& sampler, Source&& source, int splits = 0, Branch&& branch = {},
                              const PartsSink& parts = {}) {
    SpecularChain chain;
    chain.left = left;
    chain.parts = parts;
    float eta_scale = 1;
    int depth = 0;
    for (;;) {
        auto hit = scene.intersect(ray);
        chain.ray = ray;
        chain.rule = rule;
        if (depth == 0) chain.length = hit ? chain.length + hit->t : INFINITY;
        if (chain.left == 0) {
            chain.emitted +=
                chain.throughput * emission_ahead(scene, ray, hit, rule, medium, sampler, chain.parts);
            return chain;
        }
        chain.emitted += chain.throughput * emission(scene, ray, hit, rule, medium, sampler, chain.parts);
        MediaSegment segment =
            media_segment_along(scene, ray, hit, medium, chain.throughput, true, sampler,
                                [&](const MediumVertex& vertex, const Rgb& sigma_s, const Rgb& share) {
                                    return source(vertex, sigma_s, chain.left, chain.parts.times(share));
                                });
        chain.emitted += chain.throughput * segment.added;
        if (!hit || !segment.survives(sampler)) return chain;
        chain.throughput *= segment.passed;
        chain.parts = chain.parts.times(segment.passed);
        chain.medium = segment.medium;
        const Bsdf bsdf = scene.bsdf(*hit);
        if (!bsdf.is_delta()) {
            chain.wo = -ray.d;
            chain.hit = hit;
            return chain;
        }
        BsdfU u{sampler.next(), sampler.next2()};
        if (splits > 0) {
            Sampler own = sampler.split_alike(kGlassBranch);
            if (const auto split = split_at_glass(bsdf, -ray.d, own)) {
                --splits;
                if (const auto& way = split->fainter) {
                    const Rgb throughput = chain.throughput * way->weight;
                    const SpecularBranch other{{hit->at.towards(way->wi), way->wi},
                                               medium_towards(hit->media, hit->at.n, way->wi, segment.medium),
                                               bounces_left(chain.left, *way),
                                               splits,
                                               rule.after(*way, ray, hit->t)};
                    chain.emitted += throughput * branch(other, throughput, own,
                                                         past(chain.parts.times(way->weight), *way));
                }
                u = split->brighter;
                chain.throughput *= split->share;
                chain.parts = chain.parts.times(split->share);
            }
        }
        const auto sample = bsdf.sample(-ray.d, u, Transport::radiance);
        if (!sample) return chain;
        chain.throughput *= sample->weight;
        chain.parts = past(chain.parts.times(sample->weight), *sample);
        chain.left = bounces_left(chain.left, *sample);
        eta_scale *= sample->eta_scale;
        if (!sample->straight && depth++ >= kRouletteFromSpecular) {
            const float survival = survival_of(chain.throughput, eta_scale);
            if (!(sampler.next() < survival)) return chain;  // also where nothing is left
            chain.throughput /= survival;
            chain.parts = chain.parts.times(1 / survival);
        }
        rule = rule.after(*sample, ray, hit->t);
        medium = medium_towards(hit->media, hit->at.n, sample->wi, segment.medium);
        ray = Ray{hit->at.towards(sample->wi), sample->wi};
    }
}

// Radiance along a camera ray by a method that shades surfaces one at a time: `shade(vertex, left, parts)`
// gives a DirectLight (its radiance may hold more than direct light) where paths may have so many more
// bounces, the one at the vertex included; `source` is what media scatter into a ray, as follow_specular()
// has it. Where a surface is shiny as well as rough (varnish), the mirrored part is followed too. The paths
// have `left` bounces at the most.
template <typename Shade, typename Source>
Rgb follow_and_shade(const Scene& scene, SpecularBranch from, Sampler& sampler, Shade&& shade,
                     Source&& source, PartsSink parts) {
    Rgb result(0);
    auto [ray, medium, left, splits, rule] = from;
    Rgb throughput(1);
    const auto branch = [&](const SpecularBranch& way, const Rgb&, Sampler& own, const PartsSink& of_way) {
        return follow_and_shade(scene, way, own, shade, source, of_way);
    };
    for (int depth = 0;; ++depth) {
        const SpecularChain chain =
            follow_specular(scene, ray, medium, rule, left, sampler, source, splits, branch, parts);
        splits = 0;  // a mirror image in varnish is faint as it is
        result += throughput * chain.emitted;
        if (!chain.hit) return result;
        throughput *= chain.throughput;
        const Bsdf bsdf = scene.bsdf(*chain.hit);
        const DirectLight shaded = shade(chain.vertex(bsdf), chain.left, chain.parts);
        result += throughput * shaded.radiance;
        if (!shaded.specular) return result;
        const BsdfSample& sample = *shaded.specular;
        throughput *= sample.weight;
        parts = past(chain.parts.times(sample.weight), sample);
        rule = chain.rule.after(sample, chain.ray, chain.hit->t);
        if (depth >= kRouletteFromSpecular) {
            // What glass made of the throughput in earlier chains is not taken out: a few more paths end.
            const float survival = survival_of(throughput, 1);
            if (!(sampler.next() < survival)) return result;
            throughput /= survival;
            parts = parts.times(1 / survival);
        }
        left = bounces_left(chain.left, sample);
        medium = medium_towards(chain.hit->media, chain.hit->at.n, sample.wi, chain.medium);
        ray = Ray{chain.hit->at.towards(sample.wi), sample.wi};
    }
}

// The beginning of a camera's path.
inline SpecularBranch from_camera(const Scene& scene, const Ray& ray, const EmissionRule& rule, int left) {
    return {ray, scene.media().camera, left, kGlassSplits, rule};
}

// What a meter reads on the first surface along a camera ray, by the same `shade`; `left` > 0.
template <typename Shade>
Rgb meter_and_shade(const Scene& scene, const Ray& ray, int left, Shade&& shade,
                    const PartsSink& parts = {}) {
    const auto hit = scene.intersect(ray);
    if (!hit) return Rgb(0);
    const Bsdf white = white_receiver(*hit);
    std::int32_t medium = scene.media().camera;
    if (!scene.media().empty()) {  // what is between it and the camera matters only for where it lies
        medium =
            for_each_piece(scene, Ray{ray.o, ray.d, hit->t}, medium, [](const MediumPiece&) { return true; });
    }
    const PartsSink read = parts.times(meter_reading(Rgb(1)));
    return meter_reading(shade(Vertex{*hit, white, -ray.d, medium}, left, read).radiance);
}

}  // namespace lucerna
