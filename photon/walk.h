// One light path: from the light, from surface to surface and through media, until it is absorbed or leaves.
//
// The walk knows nothing of maps. It shows each hit to a visitor, and each place where a medium scatters the
// path to another; they may store a photon or make a virtual light of it. Photon mapping and instant global
// illumination are the same walk with another end.
#pragma once

#include <algorithm>
#include <utility>

#include "engine/base/stream.h"
#include "engine/world/passage.h"
#include "engine/world/phase.h"
#include "engine/world/scene.h"
#include "photon/bounce_class.h"
#include "photon/emission.h"
#include "photon/ledger.h"
#include "photon/shading_normals.h"

namespace lucerna {

// How a path came to where it is, in the notation L(S|D)*: what the maps are told apart by.
struct PathClass {
    std::uint32_t specular = 0;  // delta bounces so far, and those that count as such
    std::uint32_t diffuse = 0;   // all other bounces, and scattering in media
    bool specular_last = false;  // the last bounce was specular
    // Some bounce that was not specular was of light that came to it over nothing specular, straight from a
    // light or from another such bounce; or a medium scattered the path. False: L(S+D)*S*.
    bool off_caustics = false;

    void bounce(bool is_specular) {
        ++(is_specular ? specular : diffuse);
        off_caustics = off_caustics || (!is_specular && !specular_last);
        specular_last = is_specular;
    }
    void scatter() {
        ++diffuse;
        off_caustics = true;
        specular_last = false;
    }
};

// Which paths go on after a bounce: those that who has them walked can make any use of.
enum class PathUse : std::uint8_t {
    all,
    first_hits,      // L
    caustics,        // LS*
    caustic_chains,  // L(S+D)*S*
};
inline bool is_of_use(const PathClass& path, PathUse use) {
    switch (use) {
        case PathUse::all:
            return true;
        case PathUse::first_hits:
            return path.specular == 0 && path.diffuse == 0;
        case PathUse::caustics:
            return path.diffuse == 0;
        case PathUse::caustic_chains:
            return !path.off_caustics;
    }
    return true;
}

struct WalkHit {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f d;      // direction of travel
    Rgb power;  // W, arriving
    PathClass path;
    const LightPathStart& start;
};

// Where a medium turns a path.
struct WalkScatter {
    V3f p;
    float g;         // of the medium that scatters
    V3f d;           // direction of travel before
    Rgb power;       // W, scattered: what the medium absorbs there is taken off
    PathClass path;  // before
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

// A path on its way: what it carries, and what becomes of that.
class Walker {
  public:
    Walker(const Scene& scene, const LightPathStart& start, Stream& stream, Ledger& ledger,
           float specular_below)
        : scene_(scene),
          stream_(stream),
          ledger_(ledger),
          specular_below_(specular_below),
          from_(start.from),
          d_(start.d),
          power_(start.power),
          medium_(start.medium) {
        ledger.emitted += V3d(start.power);
    }

    const SurfacePoint& from() const { return from_; }
    const V3f& d() const { return d_; }
    const Rgb& power() const { return power_; }
    const PathClass& path() const { return path_; }

    Ray ray() const { return {from_.towards(d_), d_}; }

    struct Leg {
        std::optional<Hit> hit;
        std::optional<Crossing::Scattered> scattered;
    };
    // To the next surface, or to where a medium scatters. The power may be black after it.
    Leg travel() {
        return travel(ray(), [this](const Ray& ray) { return scene_.hit(ray); });
    }
    // The same along ray(), where what it hits is found by hit(ray).
    template <typename HitBy>
    Leg travel(const Ray& ray, HitBy&& hit) {
        Leg leg{hit(ray), {}};
        // Bent normals turn to whoever looks; light does not look, and is absorbed by what it meets from
        // behind.
        if (leg.hit) leg.hit->wo = V3f(0.0F);
        if (scene_.media().empty()) return leg;
        const Crossing crossing = cross_media(scene_, ray, leg.hit, medium_, power_, stream_);
        ledger_.media += V3d(power_) - V3d(crossing.power);
        arriving_ = power_;
        power_ = crossing.power;
        medium_ = crossing.medium;
        leg.scattered = crossing.scattered;
        return leg;
    }

    // Both choose where the path goes on; false: it ends, and the ledger knows why.
    bool leave(const Hit& hit, const Bsdf& bsdf) {
        const BsdfU u{stream_.next(), stream_.next2()};
        const float u_survive = stream_.next();
        const auto sample = bsdf.sample(-d_, u, Transport::particles);
        if (!sample || is_black(sample->weight)) {
            ledger_.absorbed += V3d(power_);
            return false;
        }
        const Rgb scattered = power_ * sample->weight * shading_correction(bsdf, -d_, sample->wi);
        ledger_.absorbed += V3d(power_) - V3d(scattered);  // what the surface keeps
        // What the class takes or gives has mean 0, as roulette has, and is booked there.
        const BounceClass bounced = classify(bsdf, -d_, *sample, specular_below_, stream_);
        const Rgb of_class = scattered * bounced.scale;
        ledger_.roulette += V3d(scattered) - V3d(of_class);
        // The luminance of the power is never 0: no path goes on in black.
        if (!survive(luminance(of_class) / luminance(power_), of_class, u_survive)) return false;
        path_.bounce(bounced.specular);
        medium_ = medium_towards(hit.media, hit.at.n, sample->wi, medium_);
        from_ = hit.at;
        d_ = sample->wi;
        return true;
    }
    bool leave(const Crossing::Scattered& at) {
        ledger_.scattered += V3d(power_);
        const V2f u = stream_.next2();
        // By the largest channel: one distance serves all, and may leave a path with one colour alone.
        // Measured by luminance a blue one would be worth little, and the few that survive would be far too
        // bright.
        if (!survive(max_component(power_) / max_component(arriving_), power_, stream_.next())) return false;
        path_.scatter();
        from_ = SurfacePoint{at.p};
        d_ = HenyeyGreenstein(at.g).sample(-d_, u);
        return true;
    }

  private:
    // Russian roulette after an event that left the share `worth` of what the path was.
    bool survive(float worth, Rgb after, float u) {
        const float survival = std::min(kMaxSurvival, worth);
        if (!(u < survival)) {
            ledger_.roulette += V3d(after);
            return false;
        }
        power_ = after / survival;
        ledger_.roulette += V3d(after) - V3d(power_);
        return !is_black(power_);  // black by underflow: nothing is left to book
    }

    const Scene& scene_;
    Stream& stream_;
    Ledger& ledger_;
    float specular_below_;
    SurfacePoint from_;
    V3f d_;
    Rgb power_;
    Rgb arriving_{0.0F};  // before the last flight
    PathClass path_;
    std::int32_t medium_;
};

// What happens at the end of a leg; false: the path ends there.
template <typename Visit, typename Scatter, typename Leave>
bool take_leg(const Scene& scene, Walker& walker, const Walker::Leg& leg, const LightPathStart& start,
              Ledger& ledger, Visit&& visit, Scatter&& scatter, Leave&& leave) {
    if (is_black(walker.power())) return false;  // absorbed on the way, and booked
    if (leg.scattered) {
        ++ledger.scatterings;
        scatter(WalkScatter{leg.scattered->p, leg.scattered->g, walker.d(), walker.power(), walker.path(),
                            start});
        return walker.leave(*leg.scattered);
    }
    if (leg.hit) {
        ++ledger.hits;
        const Bsdf bsdf = scene.bsdf(*leg.hit);
        visit(WalkHit{*leg.hit, bsdf, walker.d(), walker.power(), walker.path(), start});
        return walker.leave(*leg.hit, bsdf);
    }
    ledger.escaped += V3d(walker.power());
    leave(WalkExit{walker.from(), walker.d(), walker.power(), walker.path(), start});
    return false;
}

// Follows the path; calls visit(WalkHit) at every surface, scatter(WalkScatter) where a medium turns it, and
// leave(WalkExit) if it leaves the scene. Source of the roulette: [igi.md 2], with the luminance of the power
// in place of that of the scale alone, so that every survivor of a surface carries the luminance its parent
// had. `specular_below` as BounceClass has it.
template <typename Visit, typename Scatter, typename Leave>
void walk(const Scene& scene, const LightPathStart& start, Stream& stream, Ledger& ledger, Visit&& visit,
          Scatter&& scatter, Leave&& leave, float specular_below = 0) {
    Walker walker(scene, start, stream, ledger, specular_below);
    for (std::uint32_t bounce = 0; bounce < kMaxBounces; ++bounce) {
        if (!take_leg(scene, walker, walker.travel(), start, ledger, visit, scatter, leave)) return;
    }
    ledger.cut += V3d(walker.power());
}

template <typename Visit, typename Scatter>
void walk(const Scene& scene, const LightPathStart& start, Stream& stream, Ledger& ledger, Visit&& visit,
          Scatter&& scatter) {
    walk(scene, start, stream, ledger, std::forward<Visit>(visit), std::forward<Scatter>(scatter),
         [](const WalkExit& /*exit*/) {});
}

template <typename Visit>
void walk(const Scene& scene, const LightPathStart& start, Stream& stream, Ledger& ledger, Visit&& visit) {
    walk(scene, start, stream, ledger, std::forward<Visit>(visit), [](const WalkScatter& /*at*/) {});
}

}  // namespace lucerna
