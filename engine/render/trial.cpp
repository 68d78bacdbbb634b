#include "engine/render/trial.h"

#include <algorithm>
#include <cmath>

#include "engine/base/monitor.h"
#include "engine/render/progress.h"
#include "engine/render/tiles.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostBlocks = 256;
constexpr double kPreparing = 0.6;  // largest share of a trial's time
// Two passes over all blocks do not fit into so short a trial, seconds.
constexpr double kShort = 0.2;
constexpr std::size_t kBlocksOfShort = 64;

constexpr std::size_t kBlocksAtOnce = 32;  // enough for all threads, few enough to stop in time

V2i block_size(const FilmSettings& film) {
    const V2i size = film.rendered_size();
    return {std::min(kTrialBlock, size.x), std::min(kTrialBlock, size.y)};
}

}  // namespace

// Places blocks by multiples of the inverse powers of the plastic number, of which any first few spread over
// the square [Roberts 2018].
std::vector<V2i> trial_blocks(const FilmSettings& film) {
    const V2i size = film.rendered_size(), block = block_size(film);
    const auto room = static_cast<std::size_t>(size.x / block.x) * static_cast<std::size_t>(size.y / block.y);
    std::vector<V2i> blocks(std::min(room, kMostBlocks));
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        const auto at = [i](double step, int places) {
            const double u = 0.5 + step * static_cast<double>(i);
            return static_cast<int>((u - std::floor(u)) * places);
        };
        blocks[i] = {at(0.7548776662466927, size.x - block.x + 1),
                     at(0.5698402909980532, size.y - block.y + 1)};
    }
    return blocks;
}

double Trial::Block::mean() const {
    double sum = 0;
    for (const RunningStats& pixel : pixels) sum += pixel.mean();
    return sum / static_cast<double>(pixels.size());
}

double Trial::Block::variance() const {
    if (passes.count() > 1) return sqr(passes.standard_error());
    double sum = 0;
    for (const RunningStats& pixel : pixels) sum += sqr(pixel.standard_error());
    return sum / sqr(static_cast<double>(pixels.size()));
}

double Trial::Block::blur2() const {
    double sum = 0;
    for (const auto& [first, second] : blur) {
        if (first.samples > 0 && second.samples > 0)
            sum += first.sum / first.samples * (second.sum / second.samples);
    }
    return Film::kBlurOfDifference * sum / static_cast<double>(blur.size());
}

double Trial::Block::variance_of_a_sample() const {
    double sum = 0;
    for (const RunningStats& pixel : pixels) sum += pixel.variance();
    return sum / static_cast<double>(pixels.size());
}

Trial::Trial(const Job& job, const SmallLamps& lamps, const IntegratorSettings& settings, std::uint64_t seed,
             const Workers& workers, Monitor& monitor)
    : job_(job),
      lamps_(lamps),
      settings_(settings),
      seed_(seed),
      workers_(workers),
      monitor_(monitor),
      integrator_(make_integrator(settings)),
      places_(trial_blocks(job.film)) {}

double Trial::prepare_seconds() const {
    const double seconds = std::max(0.0, preparing_ - once_);
    return in_passes() ? seconds / std::max(1U, passes_) : seconds;
}

double Trial::sample_seconds() const {
    return sampling_ / static_cast<double>(std::max<std::uint64_t>(1, samples_));
}

bool Trial::run(double seconds) {
    const Stopwatch clock;
    if (in_passes()) {
        if (passes_ == 0 && seconds < kShort) places_.resize(std::min(places_.size(), kBlocksOfShort));
        const int samples = integrator_->samples_per_pass();
        double last = 0;
        do {
            const double begin = clock.seconds();
            if (!prepare(kPreparing * seconds)) return false;
            const int first = static_cast<int>(passes_++) * samples;
            sample_blocks(0, places_.size(), first, first + samples);
            last = clock.seconds() - begin;
        } while (passes_ < 2 || clock.seconds() + last < seconds);
        return !monitor_.stopped();
    }
    if (!estimator_ && !prepare(kPreparing * seconds)) return false;
    do {
        const std::size_t end = std::min(next_ + kBlocksAtOnce, places_.size());
        sample_blocks(next_, end, sweep_ * kSamplesAtOnce, (sweep_ + 1) * kSamplesAtOnce);
        next_ = end;
        if (next_ == places_.size()) {
            next_ = 0;
            ++sweep_;
        }
    } while (!monitor_.stopped() && clock.seconds() < seconds);
    return !monitor_.stopped();
}

bool Trial::prepare(double seconds) {
    const Stopwatch clock;
    PassMonitor quiet(monitor_);
    if (!session_) {
        OnceStatistics once;
        session_ = integrator_->begin({job_.scene, seed_, workers_, quiet, view_of(job_),
                                       Deadline::after(seconds), job_.film.two_halves},
                                      once);
        if (!session_ || quiet.stopped()) return false;
        once_ = clock.seconds();
    }
    PassStatistics statistics;
    estimator_ = session_->pass(passes_, quiet, statistics);
    preparing_ += clock.seconds();
    for (const auto& [phase, took] : statistics.seconds) {
        if (phase == kPilotPhase) once_ += took;
    }
    // There may have been time for fewer photons than requested.
    if (auto* maps = std::get_if<PhotonMapSettings>(&settings_); maps && statistics.ledger)
        maps->photons = static_cast<std::int64_t>(statistics.ledger->paths_emitted);
    return estimator_ != nullptr;
}

void Trial::sample_blocks(std::size_t begin, std::size_t end, int first, int last) {
    const Stopwatch clock;
    const V2i size = block_size(job_.film);
    const auto pixels = static_cast<std::size_t>(size.x * size.y);
    if (blocks_.size() < end) blocks_.resize(end, Block(pixels));
    const CameraSampler camera_sampler(job_, seed_, integrator_->samples_per_pass(), &lamps_);
    // Passes do not depend on each other, so every second one makes a half even where the film has none.
    const int half_of_pass = in_passes() ? first / (last - first) & 1 : 0;
    const auto add = [this](std::size_t block, std::size_t pixel, double value) {
        blocks_[block].pixels[pixel].add(value);
        blocks_[block].values.push_back(static_cast<float>(value));
    };
    parallel_chunks(workers_, static_cast<std::int64_t>(end - begin), [&](std::int64_t i) {
        if (monitor_.stopped()) return;
        const std::size_t block = begin + static_cast<std::size_t>(i);
        RunningStats of_pass;
        for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
            const auto p = static_cast<int>(pixel);
            const V2i at = places_[block] + V2i(p % size.x, p / size.x);
            RunningStats seen;
            for (int s = first; s < last; ++s) {
                SampleAccount account;
                CameraSampler::Sample from = camera_sampler.sample(at, s);
                if (in_passes()) from.half = half_of_pass;
                const std::optional<int> half = from.half;
                const Film::Sample sample = camera_sampler.radiance(*estimator_, std::move(from), account);
                if (!is_finite(sample.radiance)) continue;
                if (half) {
                    Block::HalfBlur& blur = blocks_[block].blur[pixel][static_cast<std::size_t>(*half)];
                    blur.sum += double{sample.weight} * double{sample.blur};
                    ++blur.samples;
                }
                const double value = double{sample.weight} * double{luminance(sample.radiance)};
                if (in_passes()) {
                    seen.add(value);
                } else {
                    add(block, pixel, value);
                }
            }
            // The samples of a pass count as one, since they use the same photons.
            if (!in_passes() || seen.count() == 0) continue;
            add(block, pixel, seen.mean());
            of_pass.add(seen.mean());
        }
        if (of_pass.count() > 0) blocks_[block].passes.add(of_pass.mean());
        samples_ += pixels * static_cast<std::size_t>(last - first);
    });
    sampling_ += clock.seconds();
}

}  // namespace lucerna
