// One light path: from the light, from surface to surface and through media, until it is absorbed or leaves.
//
// Tracing knows nothing of maps. Each hit goes to a callback, and each place where a medium scatters the path
// to another; they may store a photon or make a VPL of it. Photon mapping and instant global illumination
// trace the same light paths [Jensen 2001, 5; Keller 1997].
#pragma once

#include <algorithm>
#include <utility>

#include "engine/base/sampler.h"
#include "engine/scene/passage.h"
#include "engine/scene/phase.h"
#include "engine/scene/scene.h"
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

// Which paths go on after a bounce: those that the caller can use.
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

// A surface on a light path.
struct LightPathHit {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f d;      // direction of travel
    Rgb power;  // W, arriving
    PathClass path;
    const LightPathStart& start;
};

// Where a medium scatters a path.
struct LightPathScatter {
    V3f p;
    float g;         // of the medium that scatters
    V3f d;           // direction of travel before
    Rgb power;       // W, scattered: what the medium absorbs there is taken off
    PathClass path;  // before
    const LightPathStart& start;
};

// A path that leaves the scene, for good.
struct LightPathEscape {
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

// A light path under way: its end, its power and its class.
class LightPath {
  public:
    LightPath(const Scene& scene, const LightPathStart& start, Sampler& sampler, Ledger& ledger,
              float specular_below)
        : scene_(scene),
          sampler_(sampler),
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

    // One segment: the surface at its end, or where a medium scatters it before that; neither: it escapes.
    struct Segment {
        std::optional<Hit> hit;
        std::optional<Crossing::Scattered> scattered;
    };
    // To the next surface, or to where a medium scatters. The power may be black after it.
    Segment propagate() {
        return propagate(ray(), [this](const Ray& ray) { return scene_.intersect(ray); });
    }
    // The same along ray(), where what it hits is found by hit(ray).
    template <typename HitBy>
    Segment propagate(const Ray& ray, HitBy&& hit) {
        Segment segment{hit(ray), {}};
        // Bent normals turn to whoever looks; light does not look, and is absorbed by what it meets from
        // behind.
        if (segment.hit) segment.hit->wo = V3f(0.0F);
        if (scene_.media().empty()) return segment;
        const Crossing crossing = cross_media(scene_, ray, segment.hit, medium_, power_, sampler_);
        ledger_.media += V3d(power_) - V3d(crossing.power);
        arriving_ = power_;
        power_ = crossing.power;
        medium_ = crossing.medium;
        segment.scattered = crossing.scattered;
        return segment;
    }

    // Both sample the direction in which the path goes on; false: it ends, and the ledger says why.
    bool scatter(const Hit& hit, const Bsdf& bsdf) {
        const BsdfU u{sampler_.next(), sampler_.next2()};
        const float u_survive = sampler_.next();
        const auto sample = bsdf.sample(-d_, u, Transport::particles);
        if (!sample || is_black(sample->weight)) {
            ledger_.absorbed += V3d(power_);
            return false;
        }
        const Rgb scattered = power_ * sample->weight * shading_correction(bsdf, -d_, sample->wi);
        ledger_.absorbed += V3d(power_) - V3d(scattered);  // what the surface keeps
        // What the class takes or gives has mean 0, as roulette has, and is booked there.
        const BounceClass bounced = classify(bsdf, -d_, *sample, specular_below_, sampler_);
        const Rgb of_class = scattered * bounced.scale;
        ledger_.roulette += V3d(scattered) - V3d(of_class);
        // The luminance of the power is never 0: no path of power 0 goes on.
        if (!survive(luminance(of_class) / luminance(power_), of_class, u_survive)) return false;
        path_.bounce(bounced.specular);
        medium_ = medium_towards(hit.media, hit.at.n, sample->wi, medium_);
        from_ = hit.at;
        d_ = sample->wi;
        return true;
    }
    bool scatter(const Crossing::Scattered& at) {
        ledger_.scattered += V3d(power_);
        const V2f u = sampler_.next2();
        // By the largest channel: one distance serves all, and may leave a path with one colour alone.
        // Measured by luminance a blue one would be worth little, and the few that survive would be far too
        // bright.
        if (!survive(max_component(power_) / max_component(arriving_), power_, sampler_.next())) return false;
        path_.scatter();
        from_ = SurfacePoint{at.p};
        d_ = HenyeyGreenstein(at.g).sample(-d_, u);
        return true;
    }

  private:
    // Russian roulette after an event that left `share` of what the path was.
    bool survive(float share, Rgb after, float u) {
        const float survival = std::min(kMaxSurvival, share);
        if (!(u < survival)) {
            ledger_.roulette += V3d(after);
            return false;
        }
        power_ = after / survival;
        ledger_.roulette += V3d(after) - V3d(power_);
        return !is_black(power_);  // black by underflow: nothing is left to book
    }

    const Scene& scene_;
    Sampler& sampler_;
    Ledger& ledger_;
    float specular_below_;
    SurfacePoint from_;
    V3f d_;
    Rgb power_;
    Rgb arriving_{0.0F};  // before the last segment
    PathClass path_;
    std::int32_t medium_;
};

// What happens at the end of a segment; false: the path ends there.
template <typename OnHit, typename OnScatter, typename OnEscape>
bool finish_segment(const Scene& scene, LightPath& light_path, const LightPath::Segment& segment,
                    const LightPathStart& start, Ledger& ledger, OnHit&& on_hit, OnScatter&& on_scatter,
                    OnEscape&& on_escape) {
    if (is_black(light_path.power())) return false;  // absorbed on the way, and booked
    if (segment.scattered) {
        ++ledger.scatterings;
        on_scatter(LightPathScatter{segment.scattered->p, segment.scattered->g, light_path.d(),
                                    light_path.power(), light_path.path(), start});
        return light_path.scatter(*segment.scattered);
    }
    if (segment.hit) {
        ++ledger.hits;
        const Bsdf bsdf = scene.bsdf(*segment.hit);
        on_hit(
            LightPathHit{*segment.hit, bsdf, light_path.d(), light_path.power(), light_path.path(), start});
        return light_path.scatter(*segment.hit, bsdf);
    }
    ledger.escaped += V3d(light_path.power());
    on_escape(
        LightPathEscape{light_path.from(), light_path.d(), light_path.power(), light_path.path(), start});
    return false;
}

// Follows the path; calls on_hit(LightPathHit) at every surface, on_scatter(LightPathScatter) where a medium
// turns it, and on_escape(LightPathEscape) if it leaves the scene. Source of the roulette: [Pharr 2004], with
// the luminance of the power in place of that of the scale alone, so that every survivor of a surface carries
// the luminance its parent had. `specular_below` as BounceClass has it.
template <typename OnHit, typename OnScatter, typename OnEscape>
void trace_light_path(const Scene& scene, const LightPathStart& start, Sampler& sampler, Ledger& ledger,
                      OnHit&& on_hit, OnScatter&& on_scatter, OnEscape&& on_escape,
                      float specular_below = 0) {
    LightPath light_path(scene, start, sampler, ledger, specular_below);
    for (std::uint32_t bounce = 0; bounce < kMaxBounces; ++bounce) {
        if (!finish_segment(scene, light_path, light_path.propagate(), start, ledger, on_hit, on_scatter,
                            on_escape))
            return;
    }
    ledger.cut += V3d(light_path.power());
}

template <typename OnHit, typename OnScatter>
void trace_light_path(const Scene& scene, const LightPathStart& start, Sampler& sampler, Ledger& ledger,
                      OnHit&& on_hit, OnScatter&& on_scatter) {
    trace_light_path(scene, start, sampler, ledger, std::forward<OnHit>(on_hit),
                     std::forward<OnScatter>(on_scatter), [](const LightPathEscape& /*exit*/) {});
}

template <typename OnHit>
void trace_light_path(const Scene& scene, const LightPathStart& start, Sampler& sampler, Ledger& ledger,
                      OnHit&& on_hit) {
    trace_light_path(scene, start, sampler, ledger, std::forward<OnHit>(on_hit),
                     [](const LightPathScatter& /*at*/) {});
}

}  // namespace lucerna
