// Describes all media along a piece of a ray, cut into stretches.
//
// On a stretch the set of media is constant, and one bound holds for each medium that varies. Closed forms
// and null-collision tracking [Woodcock 1965] need both.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/medium.h"

namespace lucerna {

// Holds sums over all media at one place, per scene unit.
struct Coefficients {
    V3d sigma_t{0, 0, 0}, sigma_s{0, 0, 0};
    V3d emission{0, 0, 0};  // W/(m² sr) per unit
};

class MediaAlong {
  public:
    // Takes the ray from 0 to `end` (scene units, may be infinite). `inside` is its medium by interfaces.
    MediaAlong(const SceneMedia& media, std::int32_t inside, const Ray& ray, double end);

    bool empty() const { return crossings_.empty(); }
    // These tell whether any of the media on the ray scatters or emits.
    bool scatters() const { return scatters_; }
    bool emits() const { return emits_; }
    // Tells whether no medium varies, so that closed forms hold on the whole ray.
    bool is_uniform() const { return uniform_all_; }
    // Advances to the next stretch; the first call enters the first. Returns false if there is none.
    bool next();
    double begin() const { return begin_; }
    double end() const { return end_; }

    // These return the extinction per channel on the present stretch.
    const V3d& uniform() const { return uniform_; }  // sum over uniform media, exact
    const V3d& bound() const { return bound_; }      // upper bound of the sum over varying media
    // Returns the rate of additional null collisions per unit of length, which find emission between
    // collisions.
    double search() const { return search_; }

    // Returns the sums over the media at t in the present stretch.
    Coefficients at(double t) const;
    V3d varying_at(double t) const;  // extinction of varying media
    // Chooses one of the media there, in proportion to how much of `weight` it scatters; `u` in [0,1). At
    // least one must scatter. `share` is the medium's part of the scattering coefficient per channel, divided
    // by the choice's probability.
    struct Choice {
        const Medium* medium;
        V3d share;
    };
    Choice choose(double t, const V3d& weight, double u) const;

  private:
    bool is_active(const MediumCrossing& c) const { return c.entry <= begin_ && begin_ < c.exit; }
    void sum_up();

    std::vector<MediumCrossing> crossings_;
    double begin_ = 0, end_ = 0, last_;
    V3d uniform_{0, 0, 0}, bound_{0, 0, 0};
    double search_ = 0;
    bool scatters_ = false, emits_ = false, uniform_all_ = true;
};

}  // namespace lucerna
