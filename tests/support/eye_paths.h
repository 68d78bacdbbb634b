// What is seen along single rays, as radiance: product functions book it on accounts.
#pragma once

#include "engine/integrators/integrator.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/eye_path.h"

namespace lucerna::testing {

// Radiance along a camera ray, by a method without limit to its paths.
inline Rgb seen_along(const Estimator& estimator, const Scene& scene, const Ray& ray, Sampler& sampler) {
    SampleAccount account;
    estimator.follow(EyePath::begin(scene, ray, Quantity::radiance, 0, account), sampler);
    return account.radiance();
}

// Emission that a ray meets which the rule counts, in a scene without media.
inline Rgb emission_along(const Scene& scene, const Ray& ray,
                          const EmissionRule& rule = EmissionRule::all()) {
    SampleAccount account;
    Sampler unused(1, Purpose::test, 0, 0);
    add_emission(scene, EyePath(PathAccount(account), ray, kNoMedium, rule), scene.intersect(ray), unused);
    return account.radiance();
}

// Direct light at a vertex, as radiance towards wo.
inline Rgb direct_radiance(const Scene& scene, const Vertex& vertex, Sampler& sampler,
                           const LightChoice& choice = {}) {
    SampleAccount account;
    direct_light(scene, vertex, sampler, choice, PathAccount(account));
    return account.radiance();
}

}  // namespace lucerna::testing
