// Lists the rendering methods, and computes their radiance along single rays, for tests of media.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "engine/base/stats.h"
#include "engine/integrators/integrator.h"
#include "tests/support/media.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"

namespace lucerna::testing {

using Colour = std::array<RunningStats, 3>;

struct Method {
    const char* name;
    IntegratorSettings settings;
};

inline PhotonMapSettings photons(DirectMethod direct, IndirectMethod indirect) {
    PhotonMapSettings s;
    s.photons = 200'000;
    s.direct = direct;
    s.indirect = indirect;
    s.gather_rays = 4;
    return s;
}

inline IgiSettings vpls() {
    IgiSettings s;
    s.mindist = 1e-6F;  // no fading
    s.nlights = 64;
    s.nsets = 256;
    return s;
}

inline std::vector<Method> methods() {
    return {{"path", PathSettings{}},
            {"igi", vpls()},
            {"photonmap", photons(DirectMethod::mc, IndirectMethod::gather)},
            {"photonmap, maps seen", photons(DirectMethod::mc, IndirectMethod::map)},
            {"photonmap, all maps", photons(DirectMethod::map, IndirectMethod::map)}};
}

template <typename RayOf>
Colour radiance(const Scene& scene, const IntegratorSettings& settings, int samples, RayOf ray_of) {
    Monitor monitor;
    const Workers workers{2};
    const OnePass estimator(settings, {scene, 7, workers, monitor});
    std::vector<Rgb> values(static_cast<std::size_t>(samples));
    parallel_ranges(workers, samples, 256, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (std::int64_t i = begin; i < end; ++i) {
            Sampler sampler = Sampler::stratified(7, Purpose::test, 0, static_cast<std::uint32_t>(i));
            const Ray ray = ray_of(sampler.next2());
            values[static_cast<std::size_t>(i)] = estimator.Li(ray, sampler);
        }
    });
    Colour stats;
    for (const Rgb& value : values) {
        for (int k = 0; k < 3; ++k) stats[static_cast<std::size_t>(k)].add(static_cast<double>(value[k]));
    }
    EXPECT_EQ(scene.invalid_rays(), 0U);
    return stats;
}
inline Colour radiance(const Scene& scene, const IntegratorSettings& settings, const Ray& ray, int samples) {
    return radiance(scene, settings, samples, [&](const V2f&) { return ray; });
}

inline Ray from_to(const V3f& eye, const V3f& target) {
    return {eye, (target - eye).normalized()};
}

// Returns the small Cornell box full of fog, scattering `sigma` per unit in red and less in the other
// channels; absorption is a tenth of the red scattering.
inline Scene foggy_cornell(float sigma, float g) {
    static Medium fog;  // read by the function below, which cannot capture; tests run one after the other
    fog = in_box(homogeneous(Rgb(0.1F * sigma), Rgb(sigma, 0.8F * sigma, 0.6F * sigma), g), {0, 0, 0},
                 {1, 1, 1});
    return small_cornell_with([](SceneMaker& make) { make.region(fog); });
}

}  // namespace lucerna::testing
