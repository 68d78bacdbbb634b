#include "engine/render/render.h"

#include <bit>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/render/image_in_progress.h"
#include "engine/render/job.h"
#include "engine/render/outputs.h"
#include "engine/render/progress.h"
#include "engine/render/render_checks.h"
#include "engine/system/memory.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

// Samples per pixel come in rounds that grow, so that a render that is stopped early has a whole image. With
// a limit of time a tile takes no longer than the user can wait for. `seconds`: for one sample of a tile's
// pixels.
int next_round(int done, double seconds, bool ends_in_time) {
    constexpr double kLongestTile = 0.05;  // seconds
    const int most =
        ends_in_time && seconds > 0 ? static_cast<int>(std::clamp(kLongestTile / seconds, 1.0, 16.0)) : 16;
    return std::max(1, std::min(done, most));
}

// Names the scene in the files of photon maps.
MapFiles map_files(const Job& job, const RenderOptions& options) {
    MapFiles files = options.maps;
    if (!files.any()) return files;
    files.scene = job.files.empty() ? "" : job.files.front().string();
    files.scene_facts = scene_facts(job);
    return files;
}

std::string unit_of(const Job& job) {
    const std::string text = unit_text(quantity_of(job.integrator), scene_unit(job.scene));
    return job.film.scale != 1 ? text + fmt::format(", times {:g}", job.film.scale) : text;
}

// Runs one render, from scratch or from a checkpoint, to the image. All ranks of a parallel job run it alike:
// decisions that depend on a clock, on the user or on the whole image are rank 0's and go to all ranks
// (agreed).
class Run {
  public:
    Run(const Job& job, const RenderOptions& options, Monitor& monitor)
        : job_(job),
          options_(options),
          monitor_(monitor),
          clock_(options.resume ? options.resume->seconds : 0),
          integrator_(make_integrator(job.integrator, map_files(job, options))),
          in_passes_(integrator_->samples_per_pass() > 0),
          image_(job, options.seed, options.workers, *integrator_),
          outputs_(job, options, clock_, image_, report_, in_passes_) {
        report_.unit = unit_of(job);
        report_.flux_unit = flux_unit_text(scene_unit(job.scene));
        if (options.resume) resume(*options.resume);
    }

    // Returns the result at rank 0.
    RenderResult render() {
        {
            const TimedPhase timed(preparing_);
            image_.look_at_features(monitor_);
        }
        if (in_passes_) {
            render_passes();
        } else {
            render_rounds();
        }
        if (options_.resume) report_.seconds.add("earlier", clock_.earlier());
        report_.seconds.add("prepare", preparing_.seconds);
        report_.seconds.add("image", imaging_.seconds);
        outputs_.keep();
        image_.gather();
        report_ranks();
        if (options_.workers.ranks && !options_.workers.ranks->leads()) return {};
        warn_of_losses(image_, report_, monitor_);
        const Stopwatch denoising;
        RenderResult last = develop(job_, image_, report_, true, options_.workers);
        if (last.denoised) last.report.seconds.add("denoise", denoising.seconds());
        if (options_.watch) options_.watch(last);
        return last;
    }

  private:
    enum class Swept : std::uint8_t { whole, out_of_time, stopped };

    // The measured times that decisions go by, those of rank 0 on all ranks.
    struct Times {
        double elapsed = 0;      // seconds, of all renders of the image
        double tile = 0;         // seconds of one sample of a tile's pixels, by one thread
        double preparation = 0;  // seconds, of the last pass
        double pass = 0;         // seconds of the last pass, its preparation included
    };

    // Continues from a checkpoint whose facts are this render's.
    void resume(const Checkpoint& from) {
        image_.restore(from);
        report_.samples_done = from.samples_done;
        report_.passes_done = from.passes_done;
        monitor_.info(fmt::format("resumed: {} samples per pixel, rendered in {}", from.samples_done,
                                  duration_text(from.seconds)));
    }
    void resume_report() {
        if (options_.resume) report_.restore(options_.resume->numbers, options_.resume->notes);
    }

    // --- Preparation

    // Makes what all passes share, within that share of the time that is left. Null if it was stopped.
    std::unique_ptr<const Session> begin(double share) {
        const double seconds = share * (options_.limits.seconds - elapsed());
        const TimedPhase timed(preparing_);
        std::optional<View> view;
        if (job_.receivers.empty()) view = view_of(job_);  // no camera sees receivers
        auto session = integrator_->begin({job_.scene, options_.seed, options_.workers, monitor_, view,
                                           Deadline::after(seconds), job_.film.two_halves},
                                          report_.once);
        return monitor_.stopped() ? nullptr : std::move(session);
    }

    // Null if it was stopped.
    std::unique_ptr<const Estimator> prepare(const Session& session, int pass, Monitor& monitor,
                                             PassStatistics& statistics) {
        const TimedPhase timed(preparing_);
        auto estimator = session.pass(static_cast<std::uint32_t>(pass), monitor, statistics);
        times_.preparation = timed.seconds();
        return estimator;
    }

    // --- Rounds: one pass serves all samples.

    void render_rounds() {
        constexpr double kPreparation = 0.25;  // the share of the time, at most
        StopRule rule(options_.limits, job_.spp);
        int& done = report_.samples_done;
        if (is_enough(rule, done)) return end(rule.reason());
        const auto session = begin(kPreparation);
        const auto estimator = session ? prepare(*session, 0, monitor_, report_.passes) : nullptr;
        image_.sum_counts();
        report_.rays_prepare = image_.rays() - (options_.resume ? options_.resume->rays : 0);
        if (!estimator) return end("user");
        Progress progress(monitor_, "image", span(), options_.limits);
        for (;;) {
            const double now = elapsed();
            const int round = rule.next(done, wanted_round(), now);
            if (round == 0) break;
            const Swept swept = render_round(*estimator, round, progress);
            if (swept == Swept::stopped) return end("user");
            if (swept == Swept::out_of_time) return end(rule.time_is_up(), progress);
            if (has_error(rule, done)) break;
            outputs_.pause(true);
        }
        // If the time is up, as many tiles as it allows get one more sample.
        if (rule.out_of_time() && render_tiles(*estimator, done + 1, progress) == Swept::stopped)
            return end("user");
        end(rule.reason(), progress);
    }

    int wanted_round() const {
        const int done = report_.samples_done, round = next_round(done, times_.tile, ends_in_time());
        return image_.is_adaptive() ? std::min(round, SampleAllocation::next_decision(done) - done) : round;
    }

    Swept render_round(const Estimator& estimator, int round, Progress& progress) {
        const double before = imaging_.seconds;
        const Swept swept = render_tiles(estimator, report_.samples_done + round, progress);
        if (swept != Swept::whole) return swept;
        report_.samples_done += round;
        image_.prepare_next(report_.samples_done, report_.samples_done);
        times_.tile = (imaging_.seconds - before) * options_.workers.threads /
                      (static_cast<double>(round) * image_.tiles());
        progress.round(clock_.elapsed());
        return swept;
    }

    // --- Passes: each is prepared, serves its samples and is dropped.

    void render_passes() {
        constexpr double kPreparation = 0.1;  // the share of the time, at most: there should be many passes
        const int samples = integrator_->samples_per_pass();
        StopRule rule(options_.limits, static_cast<int>((std::int64_t{job_.spp} + samples - 1) / samples));
        int& done = report_.passes_done;
        if (is_enough(rule, done)) {
            resume_report();
            return end(rule.reason());
        }
        const auto session = begin(kPreparation);
        if (!session) return end("user");
        resume_report();
        Progress progress(monitor_, "passes", span(), options_.limits);
        while (rule.next(done, 1, elapsed()) > 0) {
            const Swept swept = render_pass(*session, progress);
            if (swept == Swept::stopped) return end("user");
            if (swept == Swept::out_of_time) return end(rule.time_is_up(), progress);
            progress.round(clock_.elapsed());
            if (has_error(rule, done)) break;
            outputs_.pause(true);
        }
        // If the time is up, a last pass serves as many tiles as it allows, unless it takes all of it to
        // prepare.
        if (rule.out_of_time() && elapsed() + times_.preparation < options_.limits.seconds &&
            render_pass(*session, progress) == Swept::stopped)
            return end("user");
        end(rule.reason(), progress);
    }

    Swept render_pass(const Session& session, Progress& progress) {
        const int end = std::min(report_.samples_done + integrator_->samples_per_pass(), job_.spp);
        // The samples of a pass belong together. A last pass that is cut short, by the number of samples or
        // by the time, cannot be continued: the checkpoint is of the image before it.
        if (end - report_.samples_done < integrator_->samples_per_pass() ||
            elapsed() + times_.pass >= options_.limits.seconds)
            outputs_.keep_the_last();
        const Stopwatch clock;
        PassStatistics statistics;
        PassMonitor quiet(monitor_);
        const auto estimator = prepare(session, report_.passes_done, quiet, statistics);
        if (!estimator) return Swept::stopped;
        const Swept swept = render_tiles(*estimator, end, progress);
        if (swept != Swept::whole) return swept;
        report_.passes.add(statistics);
        report_.samples_done = end;
        ++report_.passes_done;
        image_.prepare_next(end, report_.passes_done);
        times_.pass = clock.seconds();
        return swept;
    }

    // --- Tiles

    // Renders all pixels' samples below `end`, without those that are there. Unless it returns `whole`, some
    // pixels have them and some have not.
    Swept render_tiles(const Estimator& estimator, int end, Progress& progress) {
        if (report_.samples_done > 0) return sweep(estimator, {end}, progress);
        for (int step = 0; step < TileRenderer::kFirstSteps; ++step) {
            // However little time there is, the first step is done, so that there is something to see
            // everywhere.
            const Swept swept = sweep(estimator, {end, step, step > 0}, progress);
            if (swept != Swept::whole) return swept;
        }
        return Swept::whole;
    }

    Swept sweep(const Estimator& estimator, const Sweep& sweep, Progress& progress) {
        Ranks* const ranks = options_.workers.ranks;
        const auto ends = [&] {
            return (ranks ? ranks->asked_to_stop() : monitor_.stopped()) || is_out_of_time(clock_.elapsed());
        };
        const auto pauses = [this] { return outputs_.is_pause_due(); };
        for (double now = clock_.elapsed();;) {
            bool is_whole = false;
            {
                const TimedPhase timed(imaging_);
                is_whole =
                    image_.sweep(estimator, sweep,
                                 {options_.limits.seconds - now, ends, pauses, ends_in_time()}, progress);
            }
            if (is_whole) return Swept::whole;
            if (ranks) ranks->agree_to_stop();
            if (monitor_.stopped()) return Swept::stopped;
            if (is_out_of_time(now = elapsed())) return Swept::out_of_time;
            outputs_.pause(false);
        }
    }

    // --- Ends

    // Returns rank 0's time on all ranks, and agrees on the other times. Collective.
    double elapsed() {
        times_.elapsed = clock_.elapsed();
        times_ = agreed(options_.workers, times_);
        return times_.elapsed;
    }
    bool ends_in_time() const { return std::isfinite(options_.limits.seconds); }
    bool is_out_of_time(double elapsed) const { return ends_in_time() && elapsed >= options_.limits.seconds; }

    // Returns whether a resumed render has all that is asked for, so that nothing need be prepared. It is
    // asked only at the end of a round or pass, where the earlier render asked it, too.
    bool is_enough(StopRule& rule, int done) {
        if (done == 0 || !image_.is_even(report_.samples_done)) return false;
        return has_error(rule, done) || rule.next(done, 1, elapsed()) == 0;
    }

    // Returns whether so many samples, or passes, reach the error that is asked for: that of the denoised
    // picture, if there is one. Since denoising takes longer than a round, it is not tried after each.
    // Collective.
    bool has_error(StopRule& rule, int done) {
        if (!rule.wants_error() || !is_time_for_error(done)) return false;
        image_.gather();
        const bool leads = !options_.workers.ranks || options_.workers.ranks->leads();
        return rule.satisfied(done, agreed(options_.workers, leads ? error() : 0));
    }
    bool is_time_for_error(int done) const {
        if (!image_.film().has_two_halves()) return true;
        constexpr unsigned kLooks = 4;  // from one power of two to the next
        const auto number = static_cast<unsigned>(done);
        return done >= StopRule::kLeastForError &&
               number % std::max(1U, std::bit_floor(number) / kLooks) == 0;
    }
    double error() const {
        if (!image_.film().has_two_halves()) return image_.film().relative_error();
        // More samples do not reduce the blur of one set of photon maps: noise may make up half of the
        // squared error at least, so that the render ends.
        const double blur = image_.film().error().blur, most = options_.limits.error / std::sqrt(2.0);
        return hypot(denoise(image_.denoiser_input(), options_.workers).relative_error,
                     in_passes_ ? blur : std::min(blur, most));
    }

    void end(std::string_view reason, Progress& progress) {
        progress.finish();
        end(reason);
    }
    void end(std::string_view reason) {
        report_.complete = reason != "user";
        report_.ended_by = reason;
    }

    // --- Reports

    Progress::Span span() const {
        Progress::Span span;
        if (job_.spp != kNoEndOfSamples)
            span.asked = static_cast<std::uint64_t>(image_.tiles()) * static_cast<std::uint64_t>(job_.spp);
        span.there = image_.samples();
        span.seconds = clock_.earlier();
        return span;
    }

    // Collects what each rank did; collective.
    void report_ranks() {
        if (!options_.workers.ranks) return;
        Ranks& ranks = *options_.workers.ranks;
        Packer own;
        own(RankReport{ranks.host(ranks.rank()), options_.workers.threads, image_.rendered(),
                       job_.scene.rays(), preparing_.seconds, imaging_.seconds, preparing_.processor,
                       imaging_.processor, peak_memory()});
        for (const std::span<const std::byte> bytes : ranks.gather("reports", own.take())) {
            Unpacker unpacker(bytes);
            unpacker(report_.ranks.emplace_back());
        }
        report_.traffic = ranks.traffic();
    }

    const Job& job_;
    const RenderOptions& options_;
    Monitor& monitor_;
    RenderClock clock_;
    std::unique_ptr<Integrator> integrator_;
    bool in_passes_;
    ImageInProgress image_;
    RenderReport report_;
    Outputs outputs_;
    PhaseTime preparing_, imaging_;  // of this render
    Times times_;
};

// Gives all ranks what rank 0's user asks for: the limits, the checkpoint to resume, and whether checkpoints
// are kept.
RenderOptions shared_options(const RenderOptions& own, Ranks& ranks, std::optional<Checkpoint>& resumed) {
    RenderOptions options = own;
    options.limits = ranks.agree(own.limits);
    const bool keeps = ranks.agree(bool(own.keep)), resumes = ranks.agree(own.resume != nullptr);
    if (!ranks.leads() && keeps) options.keep = [](const Checkpoint&) {};
    if (!resumes) return options;
    Packer packer;
    if (ranks.leads()) {
        const Checkpoint& from = *own.resume;
        packer(from.seconds, from.samples_done, from.passes_done, from.tiles, from.film, from.allocation);
    }
    const std::vector<std::byte> bytes = ranks.broadcast("checkpoint", packer.take());
    if (ranks.leads()) return options;
    // Its counts stay at rank 0: counts of all ranks are added up.
    Checkpoint& from = resumed.emplace();
    Unpacker unpacker(bytes);
    unpacker(from.seconds, from.samples_done, from.passes_done, from.tiles, from.film, from.allocation);
    options.resume = &from;
    return options;
}

}  // namespace

RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor) {
    require_fitting_method(job, options);
    require_image_memory(job, options);
    warn_of_unseen_lights(job.scene, job.integrator, monitor);
    warn_of_glowing_media(job.scene, job.integrator, monitor);
    Ranks* const ranks = options.workers.ranks;
    if (!ranks) return Run(job, options, monitor).render();
    RanksMonitor of_all(*ranks, monitor);
    ranks->listen_to([&monitor] { return monitor.stopped(); });
    std::optional<Checkpoint> resumed;
    const RenderOptions of_all_ranks = shared_options(options, *ranks, resumed);
    return Run(job, of_all_ranks, of_all).render();
}

}  // namespace lucerna
