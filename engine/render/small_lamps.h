// Samples lamps that the eye sees smaller than a pixel for every camera sample, instead of leaving them to
// chance.
//
// A camera ray meets a lamp that covers a hundredth of a pixel once in a hundred samples, and that sample is
// a hundred times too bright. The eye therefore treats such lamps as a surface does, by next-event estimation
// at the lens [Veach 1997, 8 and 10]. A point on the lens is drawn, and a direction from there to the lamp;
// the sample is projected onto the film and weighted by the filter of the pixel. In exchange, a camera ray
// that meets one of these lamps first ignores its emission (EmissionRule::but); reflections and refractions
// of the lamp are left to paths.
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
    // Largest extent on the film, in pixels, of small lamps, including the blur of the lens. Larger lamps are
    // met often enough, and a sample on them would rarely lie in the filter of the pixel. Measured in
    // scenes/many-lights with 16 samples: an error of 26 % with 0.5 and with 1, of 93 % with 2.
    static constexpr float kLargest = 1;
    // Largest number of lamps per sample; if more are in reach, this many are drawn by their expected
    // contributions.
    static constexpr int kMostAsked = 2;

    // Finds the small lamps that the job's image shows: lights, and parts of lights, on surfaces without
    // cut-outs that shine towards the lens and lie before it at some distance (Camera::bounds_on_film()).
    // There are none if the image does not show radiance or the camera is not a perspective one. A crop has
    // the same lamps in each pixel as the full image. The job must outlive this.
    explicit SmallLamps(const Job& job);

    // The lamps in reach of a pixel's filter. Without any, the pixel is rendered as without this class.
    // `pixel` counts in the full image.
    struct InReach {
        std::uint32_t begin = 0, end = 0;
        const Cdf* by_power = nullptr;  // null: few enough to sample each
        explicit operator bool() const { return begin < end; }
    };
    InReach in_reach(const V2i& pixel) const;

    // Books the lamps on a path from the eye that has not begun, for a sample of that pixel. The expected
    // value is the pixel's share of the light that the eye sees of the lamps, weighted by the filter.
    void add(const InReach& lamps, const V2i& pixel, Sampler& sampler, const PathAccount& path) const;

    // Returns the lamps whose emission a camera ray must then ignore.
    const LampSet& lamps() const { return set_; }
    std::size_t size() const { return lamps_.size(); }

  private:
    struct Lamp {
        std::uint32_t light;
        std::optional<CellId> part;  // index in part_bounds(); none: the entire light
        Box2f on_film;               // pixels
        float importance;            // > 0
    };
    // A pixel and a lamp that its filter may touch.
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
    std::vector<Pixel> pixels_;           // pixels with lamps, row by row
    std::vector<std::uint32_t> rows_;     // first index in pixels_ of each rendered row; then the end
    std::vector<Cdf> cdfs_;
};

}  // namespace lucerna
