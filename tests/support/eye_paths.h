// Computes radiance along single rays with functions of the product that add light to accounts.
#pragma once

#include "engine/integrators/integrator.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/eye_path.h"

namespace lucerna::testing {

// Returns the radiance along a camera ray, by a method without a limit on path length.
inline Rgb seen_along(const Estimator& estimator, const Scene& scene, const Ray& ray, Sampler& sampler) {
    SampleAccount account;
    estimator.follow(EyePath::begin(scene, ray, Quantity::radiance, 0, account), sampler);
    return account.radiance();
}

// Returns the emission on a ray that the rule counts, in a scene without media.
inline Rgb emission_along(const Scene& scene, const Ray& ray,
                          const EmissionRule& rule = EmissionRule::all()) {
    SampleAccount account;
    Sampler unused(1, Purpose::test, 0, 0);
    add_emission(scene, EyePath(PathAccount(account), ray, kNoMedium, rule), scene.intersect(ray), unused);
    return account.radiance();
}

// Returns direct light at a vertex, as radiance towards wo.
inline Rgb direct_radiance(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                           const LightChoice& choice = {}) {
    SampleAccount account;
    direct_light(scene, vertex, sampler, choice, PathAccount(account));
    return account.radiance();
}

}  // namespace lucerna::testing
