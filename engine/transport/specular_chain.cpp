#include "engine/transport/specular_chain.h"

#include <cmath>
#include <utility>

namespace lucerna {
namespace {

// Makes the differentials of a ray follow it from surface to surface [Igehy 1999].
struct Differentials {
    V3d p, d;  // changes of the origin and of the direction

    // Moves the origin to the surface of normal n at distance t along the ray of direction w. w·n is not 0,
    // since the ray meets the surface; near grazing incidence the changes are large, as they are in truth.
    void transfer(const V3d& w, double t, const V3d& n) {
        const V3d moved = p + t * d;
        p = moved - (moved.dot(n) / w.dot(n)) * w;
    }
    // Turns the direction w at a surface whose shading normal n, on the side of the ray, changes by n_change.
    void reflect(const V3d& w, const V3d& n, const V3d& n_change) {
        const double c = w.dot(n);
        const double c_change = d.dot(n) + w.dot(n_change);
        d -= 2.0 * (c_change * n + c * n_change);
    }
    // `eta` is the index on the ray's side over that on the other one.
    void refract(const V3d& w, const V3d& n, const V3d& n_change, double eta) {
        const double c = -w.dot(n);
        const double c_change = -(d.dot(n) + w.dot(n_change));
        const double c_t = std::sqrt(std::max(1 - eta * eta * (1 - c * c), 1e-12));
        const double bend = eta * c - c_t;
        const double bend_change = eta * c_change - eta * eta * c * c_change / c_t;
        d = eta * d + bend_change * n + bend * n_change;
    }
};

SpecularEvent event_of(const BsdfSample& sample) {
    if (sample.straight) return SpecularEvent::straight;
    return sample.transmission ? SpecularEvent::refraction : SpecularEvent::reflection;
}

// Holds what a surface does to a chain.
struct Turn {
    BsdfSample sample;
    float chance;  // of the event
};
std::optional<Turn> turn_at(const Bsdf& bsdf, const V3f& wo, SpecularEvent event) {
    if (!bsdf.is_single_delta()) return std::nullopt;
    float lobe = 0.5F, chance = 1;
    if (const auto reflect = bsdf.reflect_chance(wo)) {
        const bool reflects = event == SpecularEvent::reflection;
        chance = reflects ? *reflect : 1 - *reflect;
        if (!(chance > 0)) return std::nullopt;
        lobe = reflects ? 0.0F : 0.5F * (1 + *reflect);
    }
    const auto sample = bsdf.sample(wo, {lobe, V2f(0.5F)}, Transport::radiance);
    if (!sample || !sample->delta) return std::nullopt;
    if (event_of(*sample) != event) return std::nullopt;
    return Turn{*sample, chance};
}

}  // namespace

double Chain::solid_angle_per_area(double t) const {
    const V3d u = p_u + t * d_u, v = p_v + t * d_v;
    return 1 / std::fabs(V3d(d).dot(u.cross(v)));
}

bool Chain::begins_as(const V3f& other, double t) const {
    constexpr double kNearby = 1e-2, kSame = 3e-4, kSameEnd = 2e-5;  // rad, rad, share of the distance
    const Frame frame(first);
    const V3d change(other - first);
    const double length = change.length();
    if (!(length < kNearby)) return length < kSame;
    const double u = change.dot(V3d(frame.s)), v = change.dot(V3d(frame.t));
    return length < kSame || (u * (p_u + t * d_u) + v * (p_v + t * d_v)).length() < kSameEnd * t;
}

std::optional<Chain> follow_chain(const Scene& scene, const SurfacePoint& x, const V3f& first,
                                  const ChainEvents& events) {
    Chain chain;
    chain.first = chain.d = first;
    chain.from = x;
    const Frame frame(first);
    Differentials u{V3d(0.0), V3d(frame.s)}, v{V3d(0.0), V3d(frame.t)};
    for (int i = 0; i < events.size(); ++i) {
        const Ray ray = chain.ray();
        const auto closest = scene.closest_hit(ray);
        if (!closest) return std::nullopt;
        const Hit hit = scene.intersect(ray, *closest);
        const Bsdf bsdf = scene.bsdf(hit);
        const auto turn = turn_at(bsdf, -ray.d, events[i]);
        if (!turn) return std::nullopt;

        const V3d w(ray.d), ng(hit.at.n);
        const auto t = static_cast<double>(hit.t);
        u.transfer(w, t, ng);
        v.transfer(w, t, ng);
        if (events[i] != SpecularEvent::straight) {
            const auto normals = scene.normal_field(ray, *closest);
            if (!normals) return std::nullopt;
            V3d n(bsdf.shading_normal());
            // Relief changes the normal in ways of which no derivative is known.
            if (std::fabs(n.dot(V3d(hit.ns))) < 1 - 1e-5) return std::nullopt;
            if (n.dot(w) > 0) n = -n;
            const double side = n.dot(normals->value) < 0 ? -1.0 : 1.0;
            const V3d n_u = side * normals->unit_change(u.p), n_v = side * normals->unit_change(v.p);
            if (events[i] == SpecularEvent::reflection) {
                u.reflect(w, n, n_u);
                v.reflect(w, n, n_v);
            } else {
                const double eta = std::sqrt(static_cast<double>(turn->sample.eta_scale));
                u.refract(w, n, n_u, eta);
                v.refract(w, n, n_v, eta);
            }
        }
        chain.passed *= turn->sample.weight * turn->chance;
        chain.chance *= turn->chance;
        chain.from = hit.at;
        chain.d = turn->sample.wi;
    }
    chain.p_u = u.p;
    chain.p_v = v.p;
    chain.d_u = u.d;
    chain.d_v = v.d;
    return chain;
}

namespace {

// How far the last ray of a chain passes beside y.
struct Miss {
    double distance;  // along the ray to the place nearest to y
    V3d by;           // from y to that place, perpendicular to the ray
    double share() const { return by.length() / distance; }
};
std::optional<Miss> miss_of(const Chain& chain, const V3f& y) {
    const V3d to = V3d(y) - V3d(chain.from.p), d(chain.d);
    const double distance = to.dot(d);
    if (!(distance > 0)) return std::nullopt;
    return Miss{distance, distance * d - to};
}

// Returns the next first direction by Newton's method.
std::optional<V3f> newton_step(const Chain& chain, const Miss& miss) {
    const Frame across(chain.d), frame(chain.first);
    const V3d s(across.s), t(across.t);
    const V3d u = chain.p_u + miss.distance * chain.d_u, v = chain.p_v + miss.distance * chain.d_v;
    const double us = u.dot(s), ut = u.dot(t), vs = v.dot(s), vt = v.dot(t);
    const double determinant = us * vt - ut * vs;
    if (determinant == 0) return std::nullopt;
    const double ms = miss.by.dot(s), mt = miss.by.dot(t);
    const double du = -(ms * vt - mt * vs) / determinant, dv = -(us * mt - ut * ms) / determinant;
    const double length = std::sqrt(du * du + dv * dv);
    constexpr double kLongest = 0.3;  // rad; beyond, the derivatives say little
    if (!std::isfinite(length)) return std::nullopt;
    const double share = length > kLongest ? kLongest / length : 1;
    return (chain.first + static_cast<float>(share * du) * frame.s + static_cast<float>(share * dv) * frame.t)
        .normalized();
}

}  // namespace

std::optional<Chain> find_chain(const Scene& scene, const SurfacePoint& x, const V3f& guess,
                                const ChainEvents& events, const V3f& y) {
    constexpr int kSteps = 12;
    constexpr double kNear = 1e-6, kNearEnough = 1e-5;  // miss over distance
    std::optional<Chain> chain = follow_chain(scene, x, guess, events);
    std::optional<Miss> miss = chain ? miss_of(*chain, y) : std::nullopt;
    for (int step = 0; step < kSteps && miss && !(miss->share() < kNear); ++step) {
        const auto next = newton_step(*chain, *miss);
        auto tried = next ? follow_chain(scene, x, *next, events) : std::nullopt;
        const auto missed = tried ? miss_of(*tried, y) : std::nullopt;
        // A search that comes no nearer fails almost always, so shorter steps are not worth their rays.
        if (!missed || !(missed->share() < miss->share())) break;
        chain = std::move(tried);
        miss = missed;
    }
    if (!miss || !(miss->share() < kNearEnough)) return std::nullopt;
    return chain;
}

Rgb transmittance(const Scene& scene, const SurfacePoint& x, std::int32_t medium, const V3f& first,
                  const ChainEvents& events, float distance, Sampler& sampler) {
    Rgb passed(1);
    Ray ray{x.towards(first), first};
    for (int i = 0;; ++i) {
        const auto hit = i < events.size() ? scene.intersect(ray) : std::nullopt;
        const Ray way{ray.o, ray.d, hit ? hit->t : distance};
        medium = for_each_piece(scene, way, medium, [&](MediumPiece piece) {
            passed *= transmittance(std::move(piece.along), sampler);
            return true;
        });
        if (!hit) return passed;
        const auto turn = turn_at(scene.bsdf(*hit), -ray.d, events[i]);
        if (!turn) return passed;  // possible only by rounding
        medium = medium_towards(hit->media, hit->at.n, turn->sample.wi, medium);
        ray = {hit->at.towards(turn->sample.wi), turn->sample.wi};
    }
}

void ChanceChain::turn(const Bsdf& bsdf, const BsdfSample& sample) {
    if (!by) return;
    const bool is_known = sample.delta && bsdf.is_single_delta() && events.append(event_of(sample));
    if (!is_known) by = nullptr;
}

}  // namespace lucerna
