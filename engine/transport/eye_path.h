// The path from a camera or a sensor: one type for every integrator.
//
// A path owns its ray, what it is worth at the eye (throughput) and the account of its sample, so that
// whoever finds light calls one function, which books it in image, layer and light group at once
// (engine/scene/path_account.h). How it is followed through mirrors, glass and media is follow.h; what
// happens where it meets a surface that is not purely specular is each integrator's own.
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

namespace lucerna {

// At this many smooth boundaries that the eye sees, one behind the other, light is followed both ways.
inline constexpr int kGlassSplits = 3;

struct EyePath : PathAccount {
    EyePath(const PathAccount& account, const Ray& along, std::int32_t in_medium, const EmissionRule& counts)
        : PathAccount(account), ray(along), medium(in_medium), rule(counts) {}

    Ray ray;
    std::int32_t medium;  // of the borders, in which the ray begins
    EmissionRule rule;    // what emission along the ray counts for
    // Bounces that the whole path, from the light to the eye, may still have. With none left the path meets
    // what emits, and nothing else.
    int left = kMaxBounces;
    int bounces = 0;  // that it has had; a pane that is passed straight is none
    int splits = 0;   // boundaries of glass at which both ways may still be followed
    // The factors that the throughput has for reasons which say nothing about how much light the path
    // carries, as radiance compression in glass. Russian roulette goes by the throughput without them.
    float eta_scale = 1;
    // How many times more densely its directions were drawn than by BSDFs alone.
    float density_ratio = 1;

    // Where a medium scatters the path: the share of direct light that is to be found there. The rest has
    // been found beside a lamp (passed_lamp.h).
    float direct_share = 1;

    // How the path begins. With `meters` the first surface is a white one, and what lies before it does not
    // count (Quantity::illuminance); the surface is `receiver` if that is set, on which the ray then ends,
    // and otherwise the first that the ray meets.
    bool meters = false;
    const Hit* receiver = nullptr;
    // The place on the whole film, pixels: a method may take more or fewer samples there than elsewhere.
    V2f film{0, 0};
    // The half of the image's samples, 0 or 1, to which this one belongs, where halves are to be independent:
    // of what a method makes two it uses one for each half. None: the sample may use all.
    std::optional<int> half = {};

    // Begins at a camera or a sensor, in the scene's camera's medium. `max_depth` as max_depth_of() has it.
    static EyePath begin(const Scene& scene, const Ray& ray, Quantity quantity, int max_depth,
                         SampleAccount& account);

    // Turns the path at a surface by a sample of its BSDF, whose weight goes into the throughput. `rough`
    // says what emission along the new ray counts for, unless the sample is specular.
    void turn(const Vertex& at, const BsdfSample& sample, const EmissionRule& rough);
    // Turns the path in a medium. The throughput stays, as the phase function is sampled exactly. Of emission
    // along the new ray the rule counts `direct_share`.
    void turn(const MediumVertex& at, const V3f& wi, const EmissionRule& rule_there);
    // Goes straight on behind a surface that passes light unbent.
    void pass(const Hit& hit);

    // Russian roulette: false ends the path. A chance of 1 or more is certain; it is 0 where nothing is left.
    bool survives(float chance, Sampler& sampler) {
        if (!(sampler.next() < chance)) return false;
        throughput /= std::min(chance, 1.0F);  // > 0
        return true;
    }
    // The chance by what the path still carries.
    float survival() const { return survival_of(throughput, eta_scale); }
};

// Calls found(radiance, distance, light) for each light that is not geometry (the sky, lamps' impostors) and
// lies on the ray before `hit`, with the share of its radiance that counts.
template <typename Found>
void for_each_impostor(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                       const EmissionRule& rule, Found&& found) {
    if (scene.impostors().empty()) return;
    const Ray whole = rule.whole(ray);
    const float nearest = hit ? rule.passed + hit->t : INFINITY;
    for (const std::uint32_t light : scene.impostors()) {
        const auto seen = scene.lights()[light]->Le(whole);
        if (!seen || seen->distance < rule.passed) continue;  // before the last pane: it has been counted
        if (!(seen->distance < nearest || (!hit && std::isinf(seen->distance)))) continue;
        found(seen->radiance * rule.share(scene, light, *seen), seen->distance - rule.passed, light);
    }
}

// Books what is emitted along the path's ray, which met `hit` or nothing, as it arrives through the media on
// the way: by surfaces, and by what is not geometry (the sky, lamps' impostors).
void add_emission(const Scene& scene, const EyePath& path, const std::optional<Hit>& hit, Sampler& sampler);

// Books the same and all that lies straight behind panes, where next_event() finds it, too: as far as the
// first surface that lets nothing pass unbent. For paths that end here.
void add_emission_ahead(const Scene& scene, EyePath path, std::optional<Hit> hit, Sampler& sampler);

}  // namespace lucerna
