// Follows a path from the eye, in one loop for every integrator.
//
// 1. Intersect the ray with the scene and book what is emitted there.
// 2. Cross the media on the way, which scatter light into the ray.
// 3. At a mirror or smooth glass, turn the path. Glass that the eye sees directly sends it both ways.
// 4. At any other surface, let the integrator's visitor book light, and turn the path or end it.
//
// A visitor derives from EyeVisitor and hides the members that it changes. It is copied where a path is
// followed both ways, so that its state belongs to one path.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/scene.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/eye_path.h"
#include "engine/transport/passed_lamp.h"

namespace lucerna {

struct EyeVisitor {
    // Says whether a ray through media is split: then its end is always shaded, and also one place on the
    // way, whatever the probabilities. A thin fog thus adds no noise to what is seen through it, and a thick
    // fog none to itself. Splitting suits methods that know the radiance at any place; they ignore emission
    // of media. Otherwise one of the two is chosen at random, as in a path tracer.
    static constexpr bool kSplitsMedia = true;
    // Says whether direct light in media is also sampled beside lamps (passed_lamp.h), where a ray is not
    // split. Such a visitor has lights(), which returns a LightChooser, and finds the share
    // `path.direct_share` of direct light in at_medium().
    static constexpr bool kFindsPassedLamps = false;
    // Says whether mirrors and smooth glass are given to at_surface(), too.
    static constexpr bool kTakesMirrors = false;

    // Learns which surface the path has met, before its BSDF is evaluated. False ends the path.
    static bool arrives(const EyePath& /*path*/, const Hit& /*hit*/) { return true; }
    // Returns the survival probability after a mirror or smooth glass. The first bounces always survive,
    // because a specular chain has nothing to shade on the way, and a lamp seen through it is bright.
    static float survival(const EyePath& path) {
        return path.bounces > kRouletteFromSpecular ? path.survival() : 1;
    }
    // Continues the path if the sample of direct_light() is specular, for visitors that shade single
    // surfaces.
    static bool go_on(EyePath& path, const Vertex& at, const std::optional<BsdfSample>& specular,
                      Sampler& sampler) {
        if (!specular) return false;
        path.turn(at, *specular, EmissionRule::none());
        return specular->straight || path.survives(survival(path), sampler);
    }
    // A visitor must have the following two functions, which book the light found there on the path. They
    // return whether the path, which they have turned, goes on. In a medium, light is multiplied by sigma_s,
    // per scene unit, and the path of a split ray ends there.
    //   bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler);
    //   bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler);
};

namespace follow_detail {

inline constexpr std::uint32_t kGlassBranch = 0x61a, kPassBranch = 0x9a;
inline constexpr std::uint32_t kPassedLampBranch = 0xb000;  // plus the number of the piece

// After this many bounces lamps beside the path are no longer sampled: the path then carries little, and each
// sample costs two rays. In the Cornell box with fog, sampling them takes 1.4 times as long per sample, and
// the squared error times the time falls to 0.82. In a room with a small lamp in fog, the variance of the
// illuminance falls to a tenth.
inline constexpr int kBouncesBesideLamps = 6;

// Below this transmittance, the surface behind media is shaded only with Russian roulette.
inline constexpr float kFaintTransmittance = 0.1F;

// Smooth glass sends little light one way, but a lamp's mirror image may make that way bright. If it were
// followed with probability F, the mirror image would be noisy. The fainter way, of share s, is followed
// beside the brighter one with probability sqrt(s), because the optimal number of samples follows the square
// root of the variance [Rath 2022]. Its weight is s / sqrt(s).
struct GlassSplit {
    BsdfU brighter;                     // the sample for Bsdf::sample() that takes the brighter way
    float share;                        // of the brighter way; multiplies the weight of its sample
    std::optional<BsdfSample> fainter;  // set if the fainter way is followed; its weight includes s / sqrt(s)
};
// Returns none where there are not two ways. `own` supplies random numbers for nothing else.
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

// Begins a metering path at its white surface. Returns false if there is none, or if the path ends there.
template <typename Visitor>
bool begin_at_meter(const Scene& scene, EyePath& path, Sampler& sampler, Visitor& visit) {
    const Hit* const receiver = path.receiver;
    path.meters = false;
    path.receiver = nullptr;
    path.splits = 0;
    std::optional<Hit> met;
    if (!receiver) {
        met = scene.intersect(path.ray);
        if (!met) return false;
        // The way from the camera to the surface matters only for the medium at the surface.
        if (!scene.media().empty()) {
            const Ray way{path.ray.o, path.ray.d, met->t};
            path.medium = for_each_piece(scene, way, path.medium, [](const MediumPiece&) { return true; });
        }
    }
    const Hit& hit = receiver ? *receiver : *met;
    const Bsdf white = white_receiver(hit);
    return visit.at_surface(path, Vertex{hit, white, -path.ray.d, path.medium}, sampler);
}

// Crosses the media before `hit` as a split ray. Returns false if the path ends there.
template <typename Visitor>
bool cross_media_split(const Scene& scene, EyePath& path, const std::optional<Hit>& hit, Sampler& sampler,
                       Visitor& visit) {
    Rgb passed(1);
    const Ray way{path.ray.o, path.ray.d, hit ? hit->t : path.ray.t_max};
    const std::int32_t end = for_each_piece(scene, way, path.medium, [&](const MediumPiece& piece) {
        const Rgb arriving = path.throughput * passed;
        if (is_black(arriving)) return false;
        if (const auto place = scatter_within(piece.along, arriving, sampler)) {
            const MediumVertex vertex{scattering_point(piece, place->t, hit), HenyeyGreenstein(place->g),
                                      -path.ray.d, piece.medium};
            EyePath there = path;
            there.throughput *= passed * place->flow;
            there.scatter_in_medium();
            visit.at_medium(there, vertex, place->sigma_s, sampler);
        }
        Sampler more = sampler.split(kPassBranch);
        passed *= transmittance(piece.along, more);
        return true;
    });
    if (!hit) return false;
    path.medium = end;
    path.throughput *= passed;
    const float left = max_component(passed);
    if (!(left < kFaintTransmittance)) return true;
    if (!(sampler.next() < left / kFaintTransmittance)) return false;
    path.throughput *= kFaintTransmittance / left;  // left > 0, else the path would have ended above
    return true;
}

enum class Arrival : std::uint8_t { at_surface, scattered, ended };

// Crosses the media before `hit` to one place, chosen at random: a scattering event or the surface.
template <typename Visitor>
Arrival cross_media_by_choice(const Scene& scene, EyePath& path, const std::optional<Hit>& hit,
                              Sampler& sampler, Visitor& visit) {
    if (is_black(path.throughput)) return Arrival::ended;
    std::optional<MediumVertex> scattered;
    std::uint32_t pieces = 0;
    const Ray way{path.ray.o, path.ray.d, hit ? hit->t : path.ray.t_max};
    path.medium = for_each_piece(scene, way, path.medium, [&](const MediumPiece& piece) {
        std::optional<PassedLamp> lamp;
        if constexpr (Visitor::kFindsPassedLamps) {
            Sampler own = sampler.split_alike(kPassedLampBranch + pieces++);
            if (path.bounces < kBouncesBesideLamps)
                lamp = add_light_beside_lamp(scene, visit.lights(), path, piece, hit, own);
        }
        const Flight flight = fly(piece.along, path.throughput, sampler);
        path.add_medium_emission(flight.emitted);
        path.throughput = flight.throughput;
        if (flight.scattered) {
            scattered.emplace(MediumVertex{scattering_point(piece, flight.t, hit), HenyeyGreenstein(flight.g),
                                           -path.ray.d, piece.medium});
            if (lamp) path.direct_share = lamp->share_left(flight.t, scene, *scattered);
        }
        return !scattered && !is_black(path.throughput);
    });
    if (is_black(path.throughput)) return Arrival::ended;
    if (!scattered) return hit ? Arrival::at_surface : Arrival::ended;
    path.scatter_in_medium();
    return visit.at_medium(path, *scattered, Rgb(1), sampler) ? Arrival::scattered : Arrival::ended;
}

template <typename Visitor>
Arrival cross_media(const Scene& scene, EyePath& path, const std::optional<Hit>& hit, Sampler& sampler,
                    Visitor& visit) {
    if (scene.media().empty()) return hit ? Arrival::at_surface : Arrival::ended;
    if constexpr (Visitor::kSplitsMedia) {
        return cross_media_split(scene, path, hit, sampler, visit) ? Arrival::at_surface : Arrival::ended;
    } else {
        return cross_media_by_choice(scene, path, hit, sampler, visit);
    }
}

}  // namespace follow_detail

// Follows the path and books on its account everything that the path and the visitor find.
template <typename Visitor>
void follow(const Scene& scene, EyePath path, Sampler& sampler, Visitor visit);

namespace follow_detail {

// Turns the path at a mirror or smooth glass. One way is chosen by reflectance; at the first boundaries from
// the eye the path takes the brighter way, and the fainter one is followed beside it.
template <typename Visitor>
bool turn_at_specular(const Scene& scene, EyePath& path, const Vertex& at, Sampler& sampler, Visitor& visit) {
    BsdfU u{sampler.next(), sampler.next2()};
    if (path.splits > 0) {
        Sampler own = sampler.split_alike(kGlassBranch);
        if (const auto split = split_at_glass(at.bsdf, at.wo, own)) {
            --path.splits;
            if (split->fainter) {
                EyePath other = path;
                other.turn(at, *split->fainter, EmissionRule::none());
                follow(scene, other, own, visit);
            }
            u = split->brighter;
            path.throughput *= split->share;
        }
    }
    const auto sample = at.bsdf.sample(at.wo, u, Transport::radiance);
    if (!sample) return false;
    path.turn(at, *sample, EmissionRule::none());
    return sample->straight || path.survives(visit.survival(path), sampler);
}

}  // namespace follow_detail

template <typename Visitor>
void follow(const Scene& scene, EyePath path, Sampler& sampler, Visitor visit) {
    using follow_detail::Arrival;
    if (path.meters && !follow_detail::begin_at_meter(scene, path, sampler, visit)) return;
    for (;;) {
        const auto hit = scene.intersect(path.ray);
        if (path.left == 0) return add_emission_ahead(scene, path, hit, sampler);
        add_emission(scene, path, hit, sampler);
        const Arrival arrival = follow_detail::cross_media(scene, path, hit, sampler, visit);
        if (arrival == Arrival::ended) return;
        if (arrival == Arrival::scattered) {
            path.splits = 0;
            continue;
        }
        if (!visit.arrives(path, *hit)) return;
        const Bsdf bsdf = scene.bsdf(*hit);
        const Vertex at{*hit, bsdf, -path.ray.d, path.medium};
        if (!Visitor::kTakesMirrors && bsdf.is_delta()) {
            if (!follow_detail::turn_at_specular(scene, path, at, sampler, visit)) return;
        } else {
            path.splits = 0;  // a mirror image in varnish is faint anyway
            if (!visit.at_surface(path, at, sampler)) return;
        }
    }
}

}  // namespace lucerna
