// Following a path from the eye: one loop for every integrator.
//
//   meet what the ray meets, and book what is emitted there
//   cross the media on the way: a part of the light is scattered into the ray
//   at a mirror or smooth glass, turn the path; glass that the eye sees sends it both ways
//   anywhere else, let the integrator's visitor book light, and turn the path or end it
//
// A visitor derives from EyeVisitor and hides what it changes. It is copied where a path is followed two
// ways, so that what it remembers belongs to one path.
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
    // Whether a ray through media is split: its end is always looked at, and one place on the way beside it,
    // whatever the chances. So a thin fog makes no noise on what is seen through it, and a thick one none on
    // itself. That is for methods that know the radiance at any place; they do not look for what media emit.
    // Otherwise one of the two is chosen, as a path tracer does, for which both are a path to be followed.
    static constexpr bool kSplitsMedia = true;
    // Whether direct light in media is found beside lamps, too (passed_lamp.h), where a ray is not split. A
    // visitor that says so has lights(), a LightChooser, and finds `path.direct_share` of direct light in
    // at_medium().
    static constexpr bool kFindsPassedLamps = false;
    // Whether mirrors and smooth glass are given to at_surface(), too.
    static constexpr bool kTakesMirrors = false;

    // Is told what the path has met, before the surface is worked out. False ends the path.
    static bool arrives(const EyePath& /*path*/, const Hit& /*hit*/) { return true; }
    // The chance with which a path goes on after a mirror or smooth glass. In a row of them there is nothing
    // to shade on the way, and a lamp seen by way of them is bright.
    static float survival(const EyePath& path) {
        return path.bounces > kRouletteFromSpecular ? path.survival() : 1;
    }
    // For visitors that look at surfaces one at a time: goes on if the sample of direct_light() is specular.
    static bool go_on(EyePath& path, const Vertex& at, const std::optional<BsdfSample>& specular,
                      Sampler& sampler) {
        if (!specular) return false;
        path.turn(at, *specular, EmissionRule::none());
        return specular->straight || path.survives(survival(path), sampler);
    }
    // A visitor must have these two, which book the light found there on the path. They return whether the
    // path, which they have turned, goes on. In a medium the light counts times sigma_s, per scene unit; a
    // path of a ray that was split ends there.
    //   bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler);
    //   bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler);
};

namespace follow_detail {

inline constexpr std::uint32_t kGlassBranch = 0x61a, kPassBranch = 0x9a;
inline constexpr std::uint32_t kPassedLampBranch = 0xb000;  // and one more for each piece of a way

// Bounces of a path after which lamps that it passes are not looked at any more: it carries little then, and
// each look costs two rays. In Cornell's box with fog a sample takes 1.4 times as long and the squared error
// times the time falls to 0.82; in a room with a small lamp in fog the variance of the illuminance falls to a
// tenth.
inline constexpr int kBouncesBesideLamps = 6;

// Below this share what lies behind media is looked at only sometimes.
inline constexpr float kFaintTransmittance = 0.1F;

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

// The first surface of a path that meters: a white one. False: there is none, or the path ends there.
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
        // What is between it and the camera matters only for the medium in which it lies.
        if (!scene.media().empty()) {
            const Ray way{path.ray.o, path.ray.d, met->t};
            path.medium = for_each_piece(scene, way, path.medium, [](const MediumPiece&) { return true; });
        }
    }
    const Hit& hit = receiver ? *receiver : *met;
    const Bsdf white = white_receiver(hit);
    return visit.at_surface(path, Vertex{hit, white, -path.ray.d, path.medium}, sampler);
}

// Crosses the media before `hit` as a split ray. False: the path ends there.
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
    path.throughput *= kFaintTransmittance / left;  // left > 0, or the path had ended
    return true;
}

enum class Arrival : std::uint8_t { at_surface, scattered, ended };

// Crosses the media before `hit` to one place, which chance chooses.
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
        path.glow(flight.emitted);
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

// Books on the path's account all that the path and the visitor find.
template <typename Visitor>
void follow(const Scene& scene, EyePath path, Sampler& sampler, Visitor visit);

namespace follow_detail {

// Turns the path at a mirror or smooth glass: one way, chosen by its reflectance; at the first boundaries
// that the eye sees the brighter one, and the fainter one is followed beside it.
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
            path.splits = 0;  // a mirror image in varnish is faint as it is
            if (!visit.at_surface(path, at, sampler)) return;
        }
    }
}

}  // namespace lucerna
