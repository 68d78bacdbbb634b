#include "engine/transport/eye_path.h"

#include <utility>

namespace lucerna {
namespace {

// These branches of a path's sampler serve only media, so that their numbers don't shift the path's own.
constexpr std::uint32_t kLampBranch = 0x1a;
constexpr std::uint32_t kAheadBranch = 0xa000;  // plus the number of panes passed

// Returns the radiance that the surface at `hit` emits, times the rule's share().
Rgb surface_emission(const Scene& scene, const EyePath& path, const Hit& hit) {
    const auto light = static_cast<std::uint32_t>(hit.light);
    const EmittedRadiance seen = scene.lights()[light]->Le_on_surface(
        path.rule.whole(path.ray), path.rule.passed + hit.t, hit.at.n, hit.primitive);
    return seen.radiance * path.rule.share(scene, light, seen);
}

}  // namespace

EyePath EyePath::begin(const Scene& scene, const Ray& ray, Quantity quantity, int max_depth,
                       SampleAccount& account) {
    const bool meters = quantity == Quantity::illuminance;
    EyePath path(PathAccount(account, meters ? meter_reading(Rgb(1)) : Rgb(1)), ray, scene.media().camera,
                 EmissionRule::all());
    path.meters = meters;
    path.eta_scale = path.throughput.x;
    path.left = most_bounces(max_depth);
    path.splits = kGlassSplits;
    return path;
}

void EyePath::turn(const Vertex& at, const BsdfSample& sample, const EmissionRule& rough) {
    throughput *= sample.weight;
    eta_scale *= sample.eta_scale;
    rule = sample.delta ? rule.after(sample, ray, at.hit.t) : rough;
    chain.turn(at.bsdf, sample);
    medium = at.medium_towards(sample.wi);
    ray = Ray{at.hit.at.towards(sample.wi), sample.wi};
    if (sample.straight) return;
    --left;
    ++bounces;
    scatter_at_surface(sample.delta);
}

void EyePath::turn(const MediumVertex& at, const V3f& wi, const EmissionRule& rule_there) {
    rule = rule_there;
    rule.weight *= direct_share;
    chain.by = nullptr;
    direct_share = 1;
    medium = at.medium;
    ray = Ray{at.p, wi};
    --left;
    ++bounces;
    scatter_in_medium();
}

void EyePath::pass(const Hit& hit) {
    rule = rule.behind(ray, hit.t);
    medium = medium_towards(hit.media, hit.at.n, ray.d, medium);
    ray = Ray{hit.at.towards(ray.d), ray.d};
}

void add_emission(const Scene& scene, const EyePath& path, const std::optional<Hit>& hit, Sampler& sampler) {
    if (path.rule.kind == EmissionRule::Kind::none) return;
    const bool by_chance = path.rule.kind == EmissionRule::Kind::all;
    const bool through_media = !scene.media().empty();
    std::optional<Sampler> more;
    if (through_media) more = sampler.split(kLampBranch);
    const auto add = [&](Rgb radiance, float distance, std::uint32_t light, const Hit* carrier) {
        if (is_black(radiance)) return;
        const bool is_searched = by_chance && path.chain.by;
        const float share =
            is_searched ? path.chain.by->share(path.chain, light, {path.ray, distance, carrier}) : 1.0F;
        radiance *= share;
        if (through_media) {
            const Ray way{path.ray.o, path.ray.d, distance};
            radiance *= transmittance(scene, way, path.medium, *more);
        }
        path.add_emitted(path.rule.weight * radiance, light, by_chance);
    };
    if (hit && hit->light != kNoLight)
        add(surface_emission(scene, path, *hit), hit->t, static_cast<std::uint32_t>(hit->light), &*hit);
    for_each_impostor(scene, path.ray, hit, path.rule,
                      [&](const Rgb& radiance, float distance, std::uint32_t light) {
                          add(radiance, distance, light, nullptr);
                      });
}

void add_emission_ahead(const Scene& scene, EyePath path, std::optional<Hit> hit, Sampler& sampler) {
    for (int panes = 0; panes < kMaxMediumInterfaces; ++panes) {
        add_emission(scene, path, hit, sampler);
        if (!hit || !scene.has_panes() || path.rule.kind == EmissionRule::Kind::none) return;
        path.throughput *= scene.bsdf(*hit).straight_share(-path.ray.d);
        if (is_black(path.throughput)) return;
        if (!scene.media().empty()) {
            Sampler more = sampler.split(kAheadBranch + static_cast<std::uint32_t>(panes));
            const Ray way{path.ray.o, path.ray.d, hit->t};
            path.medium = for_each_piece(scene, way, path.medium, [&](MediumPiece piece) {
                path.throughput *= transmittance(std::move(piece.along), more);
                return !is_black(path.throughput);
            });
            if (is_black(path.throughput)) return;
        }
        path.pass(*hit);
        hit = scene.intersect(path.ray);
    }
}

}  // namespace lucerna
