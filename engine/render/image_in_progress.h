// The image under way: the sums of its samples, tile by tile, in one process or on the ranks of a parallel
// job.
//
// The ranks of a job make the same calls in the same order. Each renders tiles of its own and has their sums;
// all know which samples every tile has.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "engine/denoise/denoise.h"
#include "engine/ranks/shared_work.h"
#include "engine/render/allocation.h"
#include "engine/render/checkpoint.h"
#include "engine/render/features.h"
#include "engine/render/film.h"
#include "engine/render/layer_films.h"
#include "engine/render/progress.h"
#include "engine/render/tiles.h"

namespace lucerna {

// Samples that all tiles get: all up to `end`, or, of the first ones, those of one step
// (TileRenderer::render_first).
struct Sweep {
    int end = 0;
    std::optional<int> first_step = {};
    bool may_end = true;  // before all tiles have theirs
};

// Conditions that end a sweep early. Rank 0, or the only process, asks from any thread.
struct SweepEnds {
    double seconds;                // from the sweep's beginning
    std::function<bool()> ends;    // at once
    std::function<bool()> pauses;  // after one tile at least, so that the image makes progress
    bool spreads = false;          // take the tiles in an order that soon covers the whole image
};

class ImageInProgress {
  public:
    ImageInProgress(const Job& job, std::uint64_t seed, const Workers& workers, const Integrator& integrator);

    // Takes over the sums of a checkpoint of the same render. Throws InputError if they do not fit.
    void restore(const Checkpoint& checkpoint);
    // Adds the sums of the image, which gather() has brought together.
    void save(Checkpoint& checkpoint) const;

    // Whether the denoiser or layers need features.
    bool wants_features() const;
    // Takes features with up to so many samples of each pixel (render_features()), unless there are some of
    // as many. Collective.
    void take_features(int most_samples, Monitor& monitor);
    // Takes about so many more samples at edges where there is one sample of each pixel
    // (lucerna::refine_features()).
    void refine_features(double samples, Monitor& monitor);
    // Takes over those of another image of the same job.
    void take_features_of(ImageInProgress& other);
    void forget_features();

    // Renders the samples that tiles lack. Returns whether all tiles have theirs.
    bool sweep(const Estimator& estimator, const Sweep& sweep, const SweepEnds& ends, Progress& progress);
    // Whether all tiles have the same number of samples.
    bool is_even(int samples) const;
    // The samples of all tiles together, those of a tile counted once for all its pixels.
    std::uint64_t samples() const;
    int tiles() const { return tiles_.tiles(); }

    // After a whole round or pass, at `done` samples per pixel: allocates samples anew where
    // SampleAllocation::decide() does, and at powers of two of `count` (samples per pixel, or passes)
    // balances the tiles among ranks.
    void prepare_next(int done, int count);
    bool is_adaptive() const { return allocation_.has_value(); }
    // Whether prepare_next() at `done` samples per pixel allocates samples, which needs features of
    // kMostFeatureSamples.
    bool decides_at(int done) const { return allocation_ && SampleAllocation::is_decision(done); }

    // Copies all sums to rank 0, and counts. The functions below refer to rank 0's sums.
    void gather();
    // Adds up what all ranks have counted so far; at rank 0, and as of the last call.
    void sum_counts();
    const BadSamples& bad_samples() const { return counts_.bad; }
    std::uint64_t rays() const { return counts_.rays; }
    std::uint64_t invalid_rays() const { return counts_.invalid_rays; }

    const Film& film() const { return film_; }
    const std::optional<LayerFilms>& layer_films() const { return layer_films_; }
    const Features& features() const { return features_; }  // empty if none were taken
    // The input of the denoiser; of a film of two halves.
    DenoiserInput denoiser_input() const;

    // How many tiles this rank has rendered, counted in every sweep.
    std::uint64_t rendered() const { return rendered_; }

  private:
    // A tile's pixels have all samples with a number below `samples`, and of the first ones so many steps.
    struct TileState {
        std::int32_t samples = 0, first_steps = 0;
    };
    struct Counts {
        BadSamples bad;
        std::uint64_t rays = 0, invalid_rays = 0;

        template <typename Archive>
        void fields(Archive& archive) {
            archive(bad, rays, invalid_rays);
        }
    };

    std::optional<LayerFilms> make_layer_films(const Integrator& integrator) const;
    std::vector<std::int64_t> tiles_left(const Sweep& sweep, bool spreads) const;
    int render_tile(const Estimator& estimator, const Sweep& sweep, std::int64_t tile);
    int note(const Sweep& sweep, std::int64_t tile);
    void decide_on_ranks(Ranks& ranks, int done);
    template <typename Archive>
    void fields_of(std::int64_t tile, Archive& archive);
    template <typename Visit>
    void for_each_block(std::int64_t tile, Visit&& visit) const;

    const Job& job_;
    std::uint64_t seed_;
    Workers workers_;
    int samples_per_pass_;
    Film film_;
    Features features_;
    int feature_samples_ = 0;                     // of each pixel at most
    std::optional<SampleAllocation> allocation_;  // none: all pixels get the same number of samples
    std::optional<LayerFilms> layer_films_;
    TileRenderer tiles_;
    std::vector<TileState> states_;  // by tile
    OwnedItems owned_;               // tiles
    bool is_gathered_ = true;
    std::atomic<std::uint64_t> rendered_{0};
    Counts resumed_, counts_;  // those of a checkpoint; of all ranks
};

}  // namespace lucerna
