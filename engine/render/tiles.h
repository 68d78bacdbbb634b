// A picture's samples, tile by tile: the unit of work and of progress.
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

// The camera samples of a job's image, by pixel and number. For a film of two halves they alternate between
// these, in runs of `samples_per_pass`, each half stratified on its own.
class CameraSampler {
  public:
    // `samples_per_pass`: as the integrator has it. `lamps`: of the job; null: none is sampled on its own.
    CameraSampler(const Job& job, std::uint64_t seed, int samples_per_pass, const SmallLamps* lamps)
        : job_(job),
          lamps_(lamps),
          seed_(seed),
          run_(std::max(1, samples_per_pass)),
          halves_{ImageSamplers(seed, Purpose::camera), ImageSamplers(seed, Purpose::camera_of_second_half)},
          filter_(job.film.filter) {}

    struct Sample {
        Ray ray;
        V2f film;  // EyePath's, as the next
        std::optional<int> half;
        float weight;     // FilterSampler's
        Sampler sampler;  // for what follows
        V2i pixel;        // of the whole picture
        std::optional<Hit> receiver = {};
        std::optional<std::int32_t> medium = {};  // in which the ray begins; none: that of the scene's camera
    };
    // `at` counts from the corner of what is rendered.
    Sample sample(const V2i& at, int number) const {
        const std::optional<int> half = this->half(number);
        return sample(at, half, half ? number / (2 * run_) * run_ + number % run_ : number);
    }
    // Of a half, its sample `index`.
    Sample sample(const V2i& at, std::optional<int> half, int index) const;
    // Books what an estimator sees there on an empty account.
    Film::Sample radiance(const Estimator& estimator, Sample sample, SampleAccount& account) const;

    // Of a film of two halves: the sample's; else none.
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

// Samples that were not finite and left out; the first of them, to find it again: of the first such sample
// number the first pixel in reading order, whichever thread found what when.
struct BadSamples {
    std::uint64_t count = 0;
    std::string first;
    std::array<int, 3> at{};  // sample, y, x; all 0: before any of this render's own

    void add(const BadSamples& more) {
        if (more.count > 0 && (count == 0 || more.at < at)) first = more.first, at = more.at;
        count += more.count;
    }
    template <typename Archive>
    void fields(Archive& archive) {
        archive(count, first, at);
    }
};

// One finished set-up: everything a tile needs. Any thread may render any tile, each tile by one at a time.
class TileRenderer {
  public:
    // `samples_per_pass`: as the integrator has it. Where it is more than one, the samples of one call of
    // render() depend on each other (the film was made for that). `layers` are filled with the image; null:
    // they are not wanted. `allocation`: who gets samples; null: all get the same.
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
    // The tile's pixels, from the corner of what is rendered.
    PixelBox box(int tile) const {
        const V2i begin(tile % across() * kTile, tile / across() * kTile);
        return {begin, {std::min(begin.x + kTile, film_.width()), std::min(begin.y + kTile, film_.height())}};
    }

    // The samples [first, end) of every pixel of a tile, `first` > 0.
    void render(const Estimator& estimator, int tile, int first, int end);

    // The samples [0, end) in steps, each of more pixels, evenly over the tile, so that there is soon
    // something to see everywhere (Film::develop). Of a tile's pixels those of a step that have no sample
    // yet.
    static constexpr int kFirstSteps = 3;
    void render_first(const Estimator& estimator, int tile, int end, int step);

    const BadSamples& bad_samples() const { return bad_; }
    // Those of the render that this one goes on with: its samples came before.
    void take_up_bad(BadSamples before) { bad_ = std::move(before); }

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
