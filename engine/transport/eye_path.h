// Represents the path from a camera or a sensor, for every integrator.
//
// A path owns its ray, its throughput at the eye and the account of its sample. Code that finds light calls
// one function, which books the light in image, layer and light group at once (engine/scene/path_account.h).
// follow.h follows a path through mirrors, glass and media; each integrator decides what happens at a surface
// that is not purely specular.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/path_account.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/quantity.h"
#include "engine/scene/scene.h"
#include "engine/transport/emission_rule.h"
#include "engine/transport/specular_chain.h"

namespace lucerna {

// Both reflection and refraction are followed at this many smooth boundaries in a row, from the eye on.
inline constexpr int kGlassSplits = 3;

struct EyePath : PathAccount {
    EyePath(const PathAccount& account, const Ray& along, std::int32_t in_medium, const EmissionRule& counts)
        : PathAccount(account), ray(along), medium(in_medium), rule(counts) {}

    Ray ray;
    std::int32_t medium;  // of the medium interfaces, in which the ray begins
    EmissionRule rule;    // determines the weight of emission along the ray
    // Counts the bounces that the path may still have, from light to eye. With none left, only emission is
    // found.
    int left = kMaxBounces;
    int bounces = 0;  // bounces so far; passing straight through a pane is none
    int splits = 0;   // boundaries of glass at which both ways may still be followed
    // Collects factors of the throughput that don't change how much light the path carries, as radiance
    // compression. Russian roulette uses the throughput without them.
    float eta_scale = 1;
    // Holds the ratio of the density by which the path's directions were drawn to that of the BSDFs alone.
    float density_ratio = 1;

    // Holds the share of direct light to be found where a medium scatters the path. The rest has been found
    // by sampling beside a lamp (passed_lamp.h).
    float direct_share = 1;

    // With `meters` the path begins at a white surface, and whatever lies before it does not count
    // (Quantity::illuminance). The surface is `receiver` if that is set, on which the ray then ends, and
    // otherwise the first surface that the ray meets.
    bool meters = false;
    const Hit* receiver = nullptr;
    // Holds the position on the whole film, pixels, for methods whose numbers of samples vary over the film.
    V2f film{0, 0};
    // Describes the chain of mirrors and glass that the path follows, if lamps at its end are also searched
    // for.
    ChanceChain chain;
    // Names the half (0 or 1) of the image's samples to which this one belongs, where halves must be
    // independent: each then has one of the two structures that a method makes. Without a value the sample
    // may use both.
    std::optional<int> half = {};

    // Begins a path at a camera or a sensor, in the medium around the camera. See max_depth_of() for
    // `max_depth`.
    static EyePath begin(const Scene& scene, const Ray& ray, Quantity quantity, int max_depth,
                         SampleAccount& account);

    // Turns the path at a surface by a sample of its BSDF, whose weight goes into the throughput. `rough`
    // weights emission along the new ray, unless the sample is specular.
    void turn(const Vertex& at, const BsdfSample& sample, const EmissionRule& rough);
    // Turns the path in a medium. The throughput stays, because the phase function is sampled exactly.
    // Emission along the new ray is weighted by `direct_share`.
    void turn(const MediumVertex& at, const V3f& wi, const EmissionRule& rule_there);
    // Continues the ray straight behind a surface that passes light unbent.
    void pass(const Hit& hit);

    // Plays Russian roulette; false ends the path. A chance of 1 or more is certain; the chance is 0 where
    // the throughput is black.
    bool survives(float chance, Sampler& sampler) {
        if (!(sampler.next() < chance)) return false;
        throughput /= std::min(chance, 1.0F);  // > 0
        return true;
    }
    // Returns the survival probability that fits what the path still carries.
    float survival() const { return survival_of(throughput, eta_scale); }
};

// Calls found(radiance, distance, light) for each light without geometry (the sky, lamps' impostors) that
// lies on the ray before `hit`. The radiance includes the rule's share().
template <typename Found>
void for_each_impostor(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                       const EmissionRule& rule, Found&& found) {
    if (scene.impostors().empty()) return;
    const Ray whole = rule.whole(ray);
    const float nearest = hit ? rule.passed + hit->t : INFINITY;
    for (const std::uint32_t light : scene.impostors()) {
        const auto seen = scene.lights()[light]->Le(whole);
        if (!seen || seen->distance < rule.passed) continue;  // before the last pane: already counted
        if (!(seen->distance < nearest || (!hit && std::isinf(seen->distance)))) continue;
        found(seen->radiance * rule.share(scene, light, *seen), seen->distance - rule.passed, light);
    }
}

// Books what is emitted along the path's ray, which met `hit` or nothing: by surfaces, and by lights without
// geometry (the sky, lamps' impostors). Media on the way attenuate it.
void add_emission(const Scene& scene, const EyePath& path, const std::optional<Hit>& hit, Sampler& sampler);

// Books the emission along the path's ray and, behind panes, along its straight continuation, where
// next_event() finds light too. It stops at the first surface that passes nothing unbent. Paths that end here
// use it.
void add_emission_ahead(const Scene& scene, EyePath path, std::optional<Hit> hit, Sampler& sampler);

}  // namespace lucerna
