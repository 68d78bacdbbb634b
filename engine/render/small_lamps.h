// Lamps that the eye sees smaller than a pixel: sampled for every camera sample, and not met by chance.
//
// A camera ray meets a lamp that covers a hundredth of a pixel once in a hundred samples, and that sample is
// a hundred times too bright. So the eye does with such lamps what a surface does: it asks them for light
// (next event estimation at the lens [Veach 1997, 8 and 10]). A place of the lens is drawn, and a direction
// from there to the lamp; it is seen where the camera's projection puts it on the film, and counts by the
// pixel's filter there. In exchange a camera ray that meets one of these lamps first counts none of its
// emission (EmissionRule::but); what mirrors and glass show of it is left to paths, as before.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/sampler.h"
#include "engine/render/film.h"
#include "engine/render/job.h"
#include "engine/transport/lamp_set.h"

namespace lucerna {

class SmallLamps {
  public:
    // The bounds on the film of lamps that are small, both ways and with the blur of a lens: larger ones are
    // met often enough, and a sample drawn on them would seldom lie in the pixel that asks. Pixels. Measured
    // in scenes/many-lights, by 16 samples: an error of 26 % with 0.5 and with 1, of 93 % with 2.
    static constexpr float kLargest = 1;
    // Lamps that one sample asks at the most; of more in reach, so many are drawn by what they may send.
    static constexpr int kMostAsked = 2;

    // Finds the small lamps that the job's image shows: lights, and parts of lights, on surfaces without
    // cut-outs that shine towards the lens and lie before it at some distance (Camera::bounds_on_film()).
    // There are none if the image does not show radiance or the camera is not a perspective one. A crop has
    // the same lamps in each pixel as the whole image. The job outlives this.
    explicit SmallLamps(const Job& job);

    // The lamps in reach of a pixel's filter; none: all is as without this. `pixel`: of the whole picture.
    struct InReach {
        std::uint32_t begin = 0, end = 0;
        const Cdf* by_power = nullptr;  // null: few enough to ask each
        explicit operator bool() const { return begin < end; }
    };
    InReach in_reach(const V2i& pixel) const;

    // Books the lamps on a path of a sample of that pixel that has not begun: the mean over samplers is the
    // pixel's share of what the eye sees of the lamps, weighed by the filter.
    void add(const InReach& lamps, const V2i& pixel, Sampler& sampler, const PathAccount& path) const;

    // The lamps that a camera ray then does not count.
    const LampSet& lamps() const { return set_; }
    std::size_t size() const { return lamps_.size(); }

  private:
    struct Lamp {
        std::uint32_t light;
        std::optional<CellId> part;  // of part_bounds(); none: the whole light
        Box2f on_film;               // pixels
        float importance;            // > 0
    };
    // Pixel and lamp, for each pixel whose filter the lamp may touch.
    struct Touch {
        V2i pixel;
        std::uint32_t lamp;
        float importance;
    };
    struct Pixel {
        int x;
        std::uint32_t begin;    // in touched_
        std::int32_t cdf = -1;  // in cdfs_; -1: none
    };

    void take(std::uint32_t light);
    bool take(std::uint32_t light, std::optional<CellId> part, const LightBounds& bounds);
    std::vector<Touch> touches() const;
    void sort_by_pixel(const std::vector<Touch>& touches);
    Rgb draw(const Lamp& lamp, float probability, const V2i& pixel, Sampler& sampler,
             std::uint32_t branch) const;

    const Job& job_;
    FilterSampler filter_;
    LampSet set_;
    std::vector<Lamp> lamps_;
    std::vector<std::uint32_t> touched_;  // lamps, pixel by pixel
    std::vector<Pixel> pixels_;           // that have any, row by row
    std::vector<std::uint32_t> rows_;     // where each row of what is rendered begins in pixels_; and the end
    std::vector<Cdf> cdfs_;
};

}  // namespace lucerna
