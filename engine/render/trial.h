// A trial: one method renders a few samples in blocks of pixels spread over the image, to measure its cost
// and the variance of its samples. choose_method() compares trials.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/stats.h"
#include "engine/integrators/integrator.h"
#include "engine/render/job.h"
#include "engine/render/small_lamps.h"

namespace lucerna {

// Returns the first pixels of blocks of kTrialBlock x kTrialBlock pixels, any first few of which are spread
// evenly over the image. There are fewer blocks in a small image.
inline constexpr int kTrialBlock = 4;
std::vector<V2i> trial_blocks(const FilmSettings& film);

class Trial {
  public:
    // The arguments must outlive it. `lamps` are the job's. `seed` differs from the render's, so that a
    // method is not chosen by chance.
    Trial(const Job& job, const SmallLamps& lamps, const IntegratorSettings& settings, std::uint64_t seed,
          const Workers& workers, Monitor& monitor);

    // Prepares the method if necessary, and samples until `seconds` are over, including preparation, but at
    // least some blocks, or two passes. Returns false if the monitor stopped it.
    bool run(double seconds);

    const IntegratorSettings& settings() const { return settings_; }
    bool in_passes() const { return integrator_->samples_per_pass() > 0; }
    // Returns the seconds, with all workers, of what is prepared once, however much work follows: a pre-pass,
    // guides, first radii, the pilot that finds numbers of samples.
    double once_seconds() const { return once_; }
    // Returns the seconds of all other preparation: of photons or VPLs, which grows with their number, or of
    // one pass.
    double prepare_seconds() const;
    // Returns the seconds of one sample of one pixel.
    double sample_seconds() const;
    // The luminance of the samples of each block's pixels, in the order of trial_blocks(); if the method
    // works in passes, the luminance of each pass.
    struct Block {
        explicit Block(std::size_t count) : pixels(count), blur(count) {}
        std::vector<RunningStats> pixels;
        // The block's mean in each pass, if the method works in passes. The pixels of a block share photons,
        // so the mean varies by more than they suggest.
        RunningStats passes;
        // The sums of Film::Sample::blur over the samples of each half, if the job's film has two, or over
        // every second pass.
        struct HalfBlur {
            double sum = 0;
            int samples = 0;
        };
        std::vector<std::array<HalfBlur, 2>> blur;  // by pixel
        // Returns the mean of the squared blur of its pixels (Film::ErrorEstimate::blur), or 0 if it is
        // unknown.
        double blur2() const;
        std::vector<float> values;  // luminances of all samples or passes, in any order
        double mean() const;
        double variance() const;              // of mean()
        double variance_of_a_sample() const;  // mean over pixels; of a pass, if in passes
    };
    const std::vector<Block>& blocks() const { return blocks_; }

    std::uint32_t passes() const { return passes_; }

  private:
    static constexpr int kSamplesAtOnce = 2;

    // Prepares within `seconds`, with less work than the settings ask for if necessary.
    bool prepare(double seconds);
    // Takes the samples [first, last) of every pixel of the blocks [begin, end).
    void sample_blocks(std::size_t begin, std::size_t end, int first, int last);

    const Job& job_;
    const SmallLamps& lamps_;
    IntegratorSettings settings_;
    std::uint64_t seed_;
    const Workers& workers_;
    Monitor& monitor_;
    std::unique_ptr<Integrator> integrator_;
    std::unique_ptr<const Session> session_;
    std::unique_ptr<const Estimator> estimator_;
    std::vector<V2i> places_;
    std::vector<Block> blocks_;
    std::size_t next_ = 0;  // next block to sample
    int sweep_ = 0;         // sweeps completed over all blocks
    std::uint32_t passes_ = 0;
    double preparing_ = 0, once_ = 0, sampling_ = 0;  // seconds
    std::atomic<std::uint64_t> samples_ = 0;          // summed over pixels
};

}  // namespace lucerna
