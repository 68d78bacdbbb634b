// Traces one light path from a light, from surface to surface and through media, until it is absorbed or
// leaves the scene.
//
// Tracing does not depend on photon maps. A visitor receives each hit and each scattering in a medium, and
// may store a photon or create a VPL there: photon mapping and instant global illumination trace the same
// light paths [Jensen 2001, 5; Keller 1997].
#pragma once

#include <algorithm>
#include <utility>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/medium.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/scene.h"
#include "photon/bounce.h"
#include "photon/emission.h"
#include "photon/ledger.h"

namespace lucerna {

// The class of a path in the notation L(S|D)*, which decides on its map. Straight passage through a pane is
// not recorded: surfaces behind it count as directly lit, as for shadow rays.
struct PathClass {
    std::uint32_t specular = 0;      // delta bounces so far, and bounces that count as specular
    std::uint32_t non_specular = 0;  // all other bounces, and scattering in media
    bool specular_last = false;      // the last bounce was specular
    // False as long as the path is L(S+D)*S*: every non-specular bounce directly follows a specular one, and
    // no medium has scattered the path.
    bool left_caustic_chain = false;
    bool strayed = false;         // some bounce was not off a delta lobe, whatever counts as specular
    bool began_specular = false;  // the first bounce was off a delta lobe: LS...

    std::uint32_t bounces() const { return specular + non_specular; }
    void bounce(bool is_specular, bool is_delta) {
        if (bounces() == 0) began_specular = is_delta;
        ++(is_specular ? specular : non_specular);
        left_caustic_chain = left_caustic_chain || (!is_specular && !specular_last);
        specular_last = is_specular;
        strayed = strayed || !is_delta;
    }
    void scatter() {
        ++non_specular;
        left_caustic_chain = true;
        specular_last = false;
        strayed = true;
    }
};

// Classes of paths that are followed beyond a bounce, because the caller can use them.
enum class PathUse : std::uint8_t {
    all,
    first_hits,      // L
    caustics,        // LS*
    caustic_chains,  // L(S+D)*S*
    began_specular,  // L, and all paths that begin with LS
};
inline bool is_of_use(const PathClass& path, PathUse use) {
    switch (use) {
        case PathUse::all:
            return true;
        case PathUse::first_hits:
            return path.specular == 0 && path.non_specular == 0;
        case PathUse::caustics:
            return path.non_specular == 0;
        case PathUse::caustic_chains:
            return !path.left_caustic_chain;
        case PathUse::began_specular:
            return path.bounces() == 0 || path.began_specular;
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
    float g;         // of the medium that scatters, as of HenyeyGreenstein
    V3f d;           // direction of travel before
    Rgb power;       // W, scattered, without the power that the medium absorbs there
    PathClass path;  // before
    const LightPathStart& start;
};

// A path that leaves the scene.
struct LightPathEscape {
    const SurfacePoint& from;
    V3f d;      // direction of travel
    Rgb power;  // W
    PathClass path;
    const LightPathStart& start;
};

// A light path that is being traced: its end point, its power and its class.
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
    const PathClass& path_class() const { return path_; }

    Ray ray() const { return {from_.towards(d_), d_}; }

    // Follows one segment along ray(), to the surface `hit` or to a place before it where a medium scatters
    // the path; with neither, the path escapes. The power may be black afterwards.
    std::optional<MediaTraversal::Scattered> propagate(const Ray& ray, std::optional<Hit>& hit) {
        // Shading normals are flipped towards wo only for rays from the eye; wo = 0 disables that, and light
        // that hits a surface from behind is absorbed.
        if (hit) hit->wo = V3f(0.0F);
        if (scene_.media().empty()) return std::nullopt;
        const MediaTraversal crossing = traverse_media(scene_, ray, hit, medium_, power_, sampler_);
        ledger_.media += V3d(power_) - V3d(crossing.power);
        arriving_ = power_;
        power_ = crossing.power;
        medium_ = crossing.medium;
        return crossing.scattered;
    }

    // Samples the direction in which the path continues at a surface, and draws the number for its Russian
    // roulette. LightPathGroup samples all of its paths before any of them is scattered.
    std::optional<BsdfSample> sample(const Bsdf& bsdf) {
        const auto [u_lobe, u_direction, u_survive] = sampler_.next_of_bounce();
        u_survive_ = u_survive;
        return bsdf.sample(-d_, BsdfU{u_lobe, u_direction}, Transport::particles);
    }
    // Scatters the path at a surface, by that sample, or in a medium. Returns false if the path ends; the
    // ledger then has the reason.
    bool scatter(const Hit& hit, const Bsdf& bsdf, const std::optional<BsdfSample>& sample) {
        if (!sample || is_black(sample->weight)) {
            ledger_.absorbed += V3d(power_);
            return false;
        }
        const Rgb scattered = power_ * sample->weight * shading_correction(bsdf, -d_, sample->wi);
        ledger_.absorbed += V3d(power_) - V3d(scattered);  // the part absorbed by the surface
        // Classification scales by a factor of mean 1; the difference is booked as roulette, whose mean is 0.
        const BounceClass bounced = classify(bsdf, -d_, *sample, specular_below_, sampler_);
        const Rgb of_class = scattered * bounced.scale;
        if (bounced.scale != Rgb(1.0F)) ledger_.roulette += V3d(scattered) - V3d(of_class);
        // The luminance of the power is never 0, because no path continues with power 0.
        if (!survive(luminance(of_class) / luminance(power_), of_class, u_survive_)) return false;
        if (!sample->straight) path_.bounce(bounced.specular, sample->delta);
        medium_ = medium_towards(hit.media, hit.at.n, sample->wi, medium_);
        from_ = hit.at;
        d_ = sample->wi;
        return true;
    }
    bool scatter(const MediaTraversal::Scattered& at) {
        ledger_.scattered += V3d(power_);
        const V2f u = sampler_.next2();
        // Roulette uses the largest channel: one distance serves all channels and may leave a path with only
        // one. By luminance, a path left with blue alone would rarely survive and then be far too bright.
        if (!survive(max_component(power_) / max_component(arriving_), power_, sampler_.next())) return false;
        path_.scatter();
        from_ = SurfacePoint{at.p};
        d_ = HenyeyGreenstein(at.g).sample(-d_, u);
        return true;
    }

  private:
    // Plays Russian roulette after an event that left the path `share` of its power.
    bool survive(float share, Rgb after, float u) {
        const float survival = std::min(kMaxSurvival, share);
        if (!(u < survival)) {
            ledger_.roulette += V3d(after);
            return false;
        }
        power_ = after / survival;
        ledger_.roulette += V3d(after) - V3d(power_);
        return !is_black(power_);  // black only by underflow, so nothing remains to be booked
    }

    const Scene& scene_;
    Sampler& sampler_;
    Ledger& ledger_;
    float specular_below_;
    SurfacePoint from_;
    V3f d_;
    Rgb power_;
    Rgb arriving_{0.0F};   // power before the last segment; set only where there are media
    float u_survive_ = 0;  // random number of the last bounce's roulette
    PathClass path_;
    std::int32_t medium_;
};

// Limits of light paths: which bounces count as specular, and when the caller has no further use for a path.
struct LightPathLimits {
    float specular_below = 0;  // alpha below which bounces are specular, see classify()
    PathUse use = PathUse::all;
    int longest = kMaxBounces;  // most bounces of a path that is followed further
};

// Base of visitors of light paths, which ignores all events. A visitor hides the members that it changes, and
// is used by one thread. Its fields() (engine/ranks/packing.h) are the state that the other ranks of a
// parallel job need; without them each rank traces all paths.
struct LightPathVisitor {
    Ledger ledger;  // of its paths, in W times the number of paths

    // Called for each path before it is traced, with the random numbers that it starts with; without a start
    // no light emitted it. Returns false if the path must not be traced.
    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& /*start*/,
               const Sampler& /*sampler*/) {
        return true;
    }
    void hit(const LightPathHit& /*at*/) {}
    void scatter(const LightPathScatter& /*at*/) {}
    void escape(const LightPathEscape& /*at*/) {}
};

// Returns whether the segment ends at a surface that it hits. A path that media have absorbed ends before it.
inline bool is_at_surface(const LightPath& path, const std::optional<Hit>& hit,
                          const std::optional<MediaTraversal::Scattered>& scattered) {
    return hit && !scattered && !is_black(path.power());  // black: absorbed by media and booked
}
// These are the steps at the end of a segment: the visitor receives the event, and the path is scattered.
// They return false if the path ends there; the ledger then has the reason.

// `sample` is that of LightPath::sample() at the hit.
template <typename Visitor>
bool interact_at_surface(LightPath& path, const Hit& hit, const Bsdf& bsdf,
                         const std::optional<BsdfSample>& sample, const LightPathStart& start,
                         Visitor& visitor) {
    ++visitor.ledger.hits;
    visitor.hit(LightPathHit{hit, bsdf, path.d(), path.power(), path.path_class(), start});
    return path.scatter(hit, bsdf, sample);
}
template <typename Visitor>
bool interact_elsewhere(LightPath& path, const std::optional<MediaTraversal::Scattered>& scattered,
                        const LightPathStart& start, Visitor& visitor) {
    if (is_black(path.power())) return false;
    if (scattered) {
        ++visitor.ledger.scatterings;
        visitor.scatter(
            LightPathScatter{scattered->p, scattered->g, path.d(), path.power(), path.path_class(), start});
        return path.scatter(*scattered);
    }
    visitor.ledger.escaped += V3d(path.power());
    visitor.escape(LightPathEscape{path.from(), path.d(), path.power(), path.path_class(), start});
    return false;
}
// Returns whether a scattered path is followed further, after `segments` segments; if not, books its power.
inline bool is_followed(const LightPath& path, const LightPathLimits& limits, int segments, Ledger& ledger) {
    if (!is_of_use(path.path_class(), limits.use) || int(path.path_class().bounces()) > limits.longest) {
        ledger.not_followed += V3d(path.power());
        return false;
    }
    if (segments < kMaxBounces) return true;
    ledger.cut += V3d(path.power());
    return false;
}

// Traces one light path from its start to its end [Jensen 2001, 5.2]. Russian roulette follows [Pharr 2004],
// but by the luminance of the power instead of that of the scale alone, so that every survivor of a surface
// carries the luminance of its parent. LightPathGroup traces several paths at a time by the same
// steps; this loop runs where the order of hits matters (virtual point lights, luminaires).
template <typename Visitor>
void trace_light_path(const Scene& scene, const LightPathStart& start, Sampler sampler,
                      const LightPathLimits& limits, Visitor& visitor) {
    LightPath path(scene, start, sampler, visitor.ledger, limits.specular_below);
    int segments = 0;
    do {
        // Find the end of the segment: a surface, a place in a medium, or neither.
        const Ray ray = path.ray();
        std::optional<Hit> hit = scene.intersect(ray);
        const auto scattered = path.propagate(ray, hit);

        // Deposit a photon there, and scatter.
        if (is_at_surface(path, hit, scattered)) {
            const Bsdf bsdf = scene.bsdf(*hit);
            const auto sample = path.sample(bsdf);
            if (!interact_at_surface(path, *hit, bsdf, sample, start, visitor)) return;
        } else if (!interact_elsewhere(path, scattered, start, visitor)) {
            return;
        }
    } while (is_followed(path, limits, ++segments, visitor.ledger));
}

}  // namespace lucerna
