// All media along a piece of a ray, cut into stretches.
//
// On a stretch the same media are met from end to end, and each of those that vary stays under one bound:
// what closed forms and tracking by null collisions [Woodcock 1965] need.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/medium.h"

namespace lucerna {

// Sums over the media at one place, per scene unit.
struct Coefficients {
    V3d sigma_t{0, 0, 0}, sigma_s{0, 0, 0};
    V3d emission{0, 0, 0};  // W/(m² sr) per unit
};

class MediaAlong {
  public:
    // The ray from 0 to `end` (scene units, may be infinite); `inside` is the medium that the borders left
    // it in.
    MediaAlong(const SceneMedia& media, std::int32_t inside, const Ray& ray, double end);

    bool empty() const { return crossings_.empty(); }
    // Whether any of the media on the way does.
    bool scatters() const { return scatters_; }
    bool emits() const { return emits_; }
    // Whether closed forms hold all along.
    bool is_uniform() const { return uniform_all_; }
    // Goes to the next stretch, at first to the first. False: there is none.
    bool next();
    double begin() const { return begin_; }
    double end() const { return end_; }

    // Of the present stretch, extinction per channel.
    const V3d& uniform() const { return uniform_; }  // of what does not vary, exact
    const V3d& bound() const { return bound_; }      // of what varies, an upper bound
    // Further null collisions per unit that emission wants, so that it is found where nothing collides.
    double search() const { return search_; }

    // At t in the present stretch.
    Coefficients at(double t) const;
    V3d varying_at(double t) const;  // extinction of what varies
    // One of the media there, in proportion to what it scatters of `weight`: `u` in [0,1). Requires that
    // some do. `share` is what the medium scatters over the sum of all, per channel, over the choice's
    // probability.
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
