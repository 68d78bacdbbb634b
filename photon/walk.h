// One light path: from the light, from surface to surface, until it is absorbed or leaves.
//
// The walk knows nothing of maps. It shows each hit to a visitor, which may store a photon or make a virtual
// light of it; photon mapping and instant global illumination are the same walk with another end.
#pragma once

#include <algorithm>
#include <utility>

#include "engine/base/stream.h"
#include "engine/world/scene.h"
#include "photon/emission.h"
#include "photon/ledger.h"
#include "photon/shading_normals.h"

namespace lucerna {

// How a path came to where it is, in the notation L(S|D)*: what the maps are told apart by.
struct PathClass {
    std::uint32_t specular = 0;  // delta bounces so far
    std::uint32_t diffuse = 0;   // all other bounces
};

struct WalkHit {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f d;      // direction of travel
    Rgb power;  // W, arriving
    PathClass path;
    const LightPathStart& start;
};

// A path that leaves the scene, for good.
struct WalkExit {
    const SurfacePoint& from;
    V3f d;      // direction of travel
    Rgb power;  // W
    PathClass path;
    const LightPathStart& start;
};

// No path goes on for sure, so that even a closed box of albedo 1 comes to an end.
inline constexpr float kMaxSurvival = 0.999F;
// Against endless loops only; roulette ends paths long before (0.999^100000 is 1e-44).
inline constexpr std::uint32_t kMaxBounces = 100'000;

// Follows the path; calls visit(WalkHit) at every surface and leave(WalkExit) if it leaves the scene. Source
// of the roulette: [igi.md 2], with the luminance of the power in place of that of the scale alone, so that
// every survivor carries the luminance its parent had.
template <typename Visit, typename Leave>
void walk(const Scene& scene, const LightPathStart& start, Stream& stream, Ledger& ledger, Visit&& visit,
          Leave&& leave) {
    ledger.emitted += V3d(start.power);
    Rgb power = start.power;
    PathClass path;
    SurfacePoint from = start.from;
    V3f d = start.d;

    for (std::uint32_t bounce = 0; bounce < kMaxBounces; ++bounce) {
        const auto hit = scene.hit(Ray{from.towards(d), d});
        if (!hit) {
            ledger.escaped += V3d(power);
            leave(WalkExit{from, d, power, path, start});
            return;
        }
        ++ledger.hits;
        const Bsdf bsdf = scene.bsdf(*hit);
        visit(WalkHit{*hit, bsdf, d, power, path, start});

        // Scatter; what the surface keeps is absorbed.
        const BsdfU u{stream.next(), stream.next2()};
        const float u_survive = stream.next();
        const auto sample = bsdf.sample(-d, u, Transport::particles);
        if (!sample || is_black(sample->weight)) {
            ledger.absorbed += V3d(power);
            return;
        }
        const Rgb scattered = power * sample->weight * shading_correction(bsdf, -d, sample->wi);
        ledger.absorbed += V3d(power) - V3d(scattered);

        // Russian roulette by luminance. luminance(power) > 0: power is never black here.
        const float survival = std::min(kMaxSurvival, luminance(scattered) / luminance(power));
        if (!(u_survive < survival)) {
            ledger.roulette += V3d(scattered);
            return;
        }
        const Rgb survivor = scattered / survival;
        ledger.roulette += V3d(scattered) - V3d(survivor);
        power = survivor;
        if (is_black(power)) return;  // underflow: nothing is left to book

        ++(sample->delta ? path.specular : path.diffuse);
        from = hit->at;
        d = sample->wi;
    }
    ledger.cut += V3d(power);
}

template <typename Visit>
void walk(const Scene& scene, const LightPathStart& start, Stream& stream, Ledger& ledger, Visit&& visit) {
    walk(scene, start, stream, ledger, std::forward<Visit>(visit), [](const WalkExit& /*exit*/) {});
}

}  // namespace lucerna
