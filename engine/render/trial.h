// A trial: one method renders a few samples in blocks of pixels spread over the image, to measure its cost
// and the variance of its samples. choose_method() compares trials.
#pragma once

#include <array>
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

// Blocks of kTrialBlock x kTrialBlock pixels, spread evenly over the image by any first few of them. Fewer
// where the image has no room.
inline constexpr int kTrialBlock = 4;
std::vector<V2i> trial_blocks(const FilmSettings& film);  // their first pixels

class Trial {
  public:
    // The arguments must outlive it. `lamps` are the job's. `seed` differs from the render's, so that a
    // method is not chosen by chance.
    Trial(const Job& job, const SmallLamps& lamps, const IntegratorSettings& settings, std::uint64_t seed,
          const Workers& workers, Monitor& monitor);

    // Prepares if need be, and looks until so many seconds are over, preparation included; at some blocks, or
    // for two passes, in any case. False if the user stopped it.
    bool run(double seconds);

    const IntegratorSettings& settings() const { return settings_; }
    bool in_passes() const { return integrator_->samples_per_pass() > 0; }
    // Seconds, all workers at it: of preparation (of one pass, where it works in passes), and of one sample
    // of one pixel.
    double prepare_seconds() const;
    // Returns the part of the preparation that would take as long with more photons or sets of VPLs; 0 in
    // passes.
    double once_seconds() const { return once_; }
    double sample_seconds() const;
    // The luminance of the samples of each block's pixels, in the order of trial_blocks(); if the method
    // works in passes, the luminance of each pass.
    struct Block {
        explicit Block(std::size_t count) : pixels(count), blur(count) {}
        std::vector<RunningStats> pixels;
        // Where it works in passes: the block's means by each. Its pixels see the same photons, and the mean
        // varies by more than they tell.
        RunningStats passes;
        // The sums of Film::Sample::blur over the samples of each half, if the job's film has two.
        struct HalfBlur {
            double sum = 0;
            int samples = 0;
        };
        std::vector<std::array<HalfBlur, 2>> blur;  // of the pixels
        // The mean of its pixels' squares (Film::ErrorEstimate::blur); 0 where nothing is known of it.
        double blur2() const;
        std::vector<float> values;  // that they are of, in no order that matters
        double mean() const;
        double variance() const;              // of mean()
        double variance_of_a_sample() const;  // the pixels' mean; of a pass, where it works in passes
    };
    const std::vector<Block>& blocks() const { return blocks_; }

    std::uint32_t passes() const { return passes_; }

  private:
    static constexpr int kSamplesAtOnce = 2;

    // Within so many seconds, with less than the settings ask for if need be.
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
    std::size_t next_ = 0;  // block to look at
    int sweep_ = 0;         // over all blocks
    std::uint32_t passes_ = 0;
    double preparing_ = 0, once_ = 0, sampling_ = 0;  // seconds
    std::uint64_t samples_ = 0;                       // of all pixels
};

}  // namespace lucerna
