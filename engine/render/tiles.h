// Renders an image's samples tile by tile: a tile is the unit of work and of progress.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "engine/integrators/integrator.h"
#include "engine/render/allocation.h"
#include "engine/render/film.h"
#include "engine/render/image_part.h"
#include "engine/render/job.h"
#include "engine/render/layer_films.h"
#include "engine/render/render.h"
#include "engine/render/small_lamps.h"

namespace lucerna {

// Makes the camera samples of a job's image, by pixel and number. For a film of two halves the samples
// alternate between these, in runs of `samples_per_pass`, and each half is stratified on its own.
class CameraSampler {
  public:
    // `samples_per_pass` is the integrator's. `lamps` are the job's; null means that none is sampled on its
    // own.
    CameraSampler(const Job& job, std::uint64_t seed, int samples_per_pass, const SmallLamps* lamps)
        : job_(job),
          lamps_(lamps),
          seed_(seed),
          run_(std::max(1, samples_per_pass)),
          halves_{ImageSamplers(seed, Purpose::camera), ImageSamplers(seed, Purpose::camera_of_second_half)},
          filter_(job.film.filter) {}

    struct Sample {
        Ray ray;
        V2f film;                 // EyePath::film
        std::optional<int> half;  // EyePath::half
        float weight;             // FilterSampler's
        Sampler sampler;          // for the rest of the path
        V2i pixel;                // of the whole picture, without a crop
        std::optional<Hit> receiver = {};
        std::optional<std::int32_t> medium = {};  // of the ray's origin; none: that of the scene's camera
    };
    // Returns the sample `number` of a pixel, which counts from the corner of the rendered crop.
    Sample sample(const V2i& at, int number) const {
        const std::optional<int> half = this->half(number);
        return sample(at, half, half ? number / (2 * run_) * run_ + number % run_ : number);
    }
    // Returns the sample `index` of a half.
    Sample sample(const V2i& at, std::optional<int> half, int index) const;
    // Estimates the sample's radiance, and books it on an empty account.
    Film::Sample radiance(const Estimator& estimator, Sample sample, SampleAccount& account) const;

    // Returns the half of a sample, if the film has two.
    std::optional<int> half(int number) const {
        if (!job_.film.two_halves) return std::nullopt;
        return number / run_ & 1;
    }

  private:
    Sample receiver_sample(const V2i& at, int index) const;

    const Job& job_;
    const SmallLamps* lamps_;
    std::uint64_t seed_;
    int run_;
    std::array<ImageSamplers, 2> halves_;
    FilterSampler filter_;
};

// Samples that were left out because they were not finite. The first of them is kept, so that it can be found
// again: by sample number, then by pixel in reading order, whichever thread found it.
struct BadSamples {
    std::uint64_t count = 0;
    std::string first;
    std::array<int, 3> at{};  // sample, y, x; all 0 for one from a checkpoint, before all of this render

    void add(const BadSamples& more) {
        if (more.count > 0 && (count == 0 || more.at < at)) first = more.first, at = more.at;
        count += more.count;
    }
    template <typename Archive>
    void fields(Archive& archive) {
        archive(count, first, at);
    }
};

// Has everything that a tile needs. Any thread may render any tile, one thread at a time for each tile.
class TileRenderer {
  public:
    // `samples_per_pass` is the integrator's. If it is more than one, the samples of one call of render()
    // depend on each other, and the film's kind is by_pass. `layers` get the same samples as the film; null
    // if they are not wanted. `allocation` says which pixels get samples; null means all alike.
    TileRenderer(const Job& job, std::uint64_t seed, Film& film, int samples_per_pass,
                 LayerFilms* layers = nullptr, SampleAllocation* allocation = nullptr)
        : lamps_(job),
          camera_sampler_(job, seed, samples_per_pass, &lamps_),
          groups_(job.scene.light_groups()),
          seed_(seed),
          film_(film),
          layers_(layers),
          by_pass_(samples_per_pass > 1),
          allocation_(allocation) {}

    int tiles() const { return across() * ((film_.height() + kTile - 1) / kTile); }
    V2i place(int tile) const { return {tile % across(), tile / across()}; }  // column and row
    // The tile's pixels, counted from the corner of the rendered crop.
    PixelBox box(int tile) const {
        const V2i begin = kTile * place(tile);
        return {begin, {std::min(begin.x + kTile, film_.width()), std::min(begin.y + kTile, film_.height())}};
    }

    // Renders the samples [first, end) of every pixel of a tile, `first` > 0.
    void render(const Estimator& estimator, int tile, int first, int end);

    // Renders the samples [0, end) in steps, each of more pixels, evenly over the tile, so that there is soon
    // something to see everywhere (Film::develop). It renders those pixels of a step that have no sample yet.
    static constexpr int kFirstSteps = 3;
    void render_first(const Estimator& estimator, int tile, int end, int step);

    const BadSamples& bad_samples() const { return bad_; }
    // Counts the bad samples of the render that this one continues.
    void resume_bad(BadSamples before) { bad_ = std::move(before); }

  private:
    static constexpr int kTile = 16;  // pixels

    int across() const { return (film_.width() + kTile - 1) / kTile; }
    template <typename Visit>
    void for_each_pixel(int tile, Visit&& visit) const;
    void render_pixel(const Estimator& estimator, const V2i& at, int first, int end);
    void render_allocated(const Estimator& estimator, int tile, int first, int end);
    void add_sample(const Estimator& estimator, const V2i& at, int half, int index, SampleAccount& account);
    void report_bad(const V2i& at, int sample, const Rgb& value);

    SmallLamps lamps_;
    CameraSampler camera_sampler_;
    const LightGroups& groups_;
    std::uint64_t seed_;
    Film& film_;
    LayerFilms* layers_;
    bool by_pass_;
    SampleAllocation* allocation_;
    std::mutex mutex_;
    BadSamples bad_;
};

}  // namespace lucerna
