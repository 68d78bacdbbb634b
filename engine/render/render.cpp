#include "engine/render/render.h"

#include <bit>
#include <cmath>

#include "engine/base/deadline_monitor.h"
#include "engine/base/elementary.h"
#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/render/chance_light.h"
#include "engine/render/finishing.h"
#include "engine/render/image_in_progress.h"
#include "engine/render/job.h"
#include "engine/render/method_choice.h"
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
          outputs_(job, options, clock_, image_, report_, finishing_, in_passes_),
          preparation_(monitor),
          ends_at_(options.limits.seconds) {
        report_.unit = unit_of(job);
        report_.flux_unit = flux_unit_text(scene_unit(job.scene));
        if (options.resume) resume(*options.resume);
    }

    // Returns the result at rank 0.
    RenderResult render() {
        plan();
        return go_on();
    }

    // Renders one sample of each pixel, or as much of that as fits in a share of the time.
    void render_first(double share) {
        plan();
        const double now = elapsed();
        ends_at_ = std::min(ends_at_, now + share * (options_.limits.seconds - now));
        render_rounds(1, "first image");
        set_end();
    }
    bool is_whole() const { return report_.samples_done > 0; }
    double first_seconds() const { return looking_.seconds + preparing_.seconds + imaging_.seconds; }
    // Returns rank 0's time on all ranks, and agrees on the other times. Collective.
    double elapsed() {
        times_.elapsed = clock_.elapsed();
        times_ = agreed(options_.workers, times_);
        return times_.elapsed;
    }
    // Returns the seconds that are left for samples. Collective.
    double left() { return ends_at_ - elapsed(); }

    // Renders the rest.
    RenderResult go_on() {
        render_samples();
        return finish();
    }

    // Renders in the place of `first`, which has an image already: takes its features and its plan. Its own
    // preparation is cut if it overruns its time. Returns whether there is a whole image.
    bool render_instead_of(Run& first) {
        take_features_of(first);
        finishing_ = first.finishing_;
        report_.whole_after = first.report_.whole_after;
        set_end();
        is_dispensable_ = !options_.workers.ranks;
        render_samples();
        return is_whole();
    }
    void take_features_of(Run& other) { image_.take_features_of(other.image_); }
    void report_first(double seconds) { report_.seconds.add("first image", seconds); }
    void report_given_up(double seconds) { report_.seconds.add("given up", seconds); }
    // Ends without more samples than there are.
    void end_early() { end(monitor_.stopped() ? "user" : "time"); }

    RenderResult finish() {
        if (ends_in_time() && !monitor_.stopped()) take_missing_features();
        if (options_.resume) report_.seconds.add("earlier", clock_.earlier());
        report_.seconds.add("features", looking_.seconds);
        report_.seconds.add("prepare", preparing_.seconds);
        report_.seconds.add("image", imaging_.seconds);
        outputs_.keep();
        image_.gather();
        report_ranks();
        if (!leads()) return {};
        warn_of_losses(image_, report_, monitor_);
        if (ends_in_time())
            finishing_.denoise_within(options_.limits.seconds - finishing_.later_seconds -
                                          finishing_.develop_seconds - clock_.elapsed(),
                                      options_.limits.seconds);
        const Stopwatch denoising;
        RenderResult last = develop(job_, image_, report_, &finishing_, options_.workers);
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

    // --- Features, and the time after the samples

    // Takes the features, and plans what follows the samples. With a limit of time, features take no more
    // than a share of it; their time is known before the samples begin, which have the rest.
    void plan() {
        const TimedPhase timed(looking_);
        if (!ends_in_time()) {
            if (image_.wants_features()) image_.take_features(kMostFeatureSamples, monitor_);
            return;
        }
        const double left = options_.limits.seconds - elapsed();
        const Stopwatch clock;
        const ProcessorStopwatch processor;
        const bool has_features = image_.wants_features() && take_first_features(left);
        const double seconds = clock.seconds(), worked = processor.seconds();
        FinishingRates rates;
        const V2i size = job_.film.rendered_size();
        const double pixels = double{1} * size.x * size.y;
        if (leads()) rates = measured_rates(pixels, options_.workers.alone());
        if (image_.wants_features()) rates.features = seconds;
        rates.slowdown = slowdown(seconds, worked);
        rates = agreed(options_.workers, rates);
        finishing_ =
            plan_finishing(pixels, left, rates, job_.film.two_halves && !job_.film.is_part(), options_.later);
        if (has_features) take_more_features();
        if (can_be_sparse()) finishing_.spacing = std::max(kSparse, finishing_.least_spacing);
        set_end();
        constexpr double kTooShort = 0.1;  // share of the time by which it is exceeded
        const double over = elapsed() - ends_at_;
        // Points have no work of note after their samples; their rounds may begin late.
        if (job_.receivers.empty() && over > kTooShort * options_.limits.seconds) {
            monitor_.warn(
                fmt::format("the requested time is too short for an image of this size: the work after the "
                            "samples alone takes about {} longer",
                            duration_text(over)));
        }
    }
    // Returns how much slower work of all threads is here than on a machine with nothing else to do.
    double slowdown(double seconds, double processor) const {
        constexpr double kMost = 3, kLeastSeconds = 0.01;  // below, the clocks are too coarse
        const double all = seconds * std::min(options_.workers.threads, Workers{}.threads);
        return processor > kLeastSeconds ? std::clamp(all / processor, 1.0, kMost) : 1;
    }
    // Takes one sample of each pixel. Returns false if they took more than a share of `seconds`: then there
    // are none.
    bool take_first_features(double seconds) {
        constexpr double kShare = 0.35;
        const bool can_be_cut = !options_.workers.ranks;
        DeadlineMonitor cut(monitor_, can_be_cut ? Deadline::after(kShare * seconds) : Deadline());
        image_.take_features(1, cut);
        if (!cut.stopped()) return true;
        image_.forget_features();
        return false;
    }
    // Takes as many more samples as the plan has.
    void take_more_features() {
        image_.take_features(finishing_.feature_samples, monitor_);
        if (finishing_.edge_samples > 0) image_.refine_features(finishing_.edge_samples, monitor_);
    }
    // Plans for denoising in place of filling when all pixels have a sample.
    void plan_for_whole() {
        if (report_.whole_after == 0 && !options_.resume) report_.whole_after = elapsed();
        finishing_.fill_seconds = 0;
        finishing_.spacing = finishing_.least_spacing;
        if (ends_in_time()) set_end();
    }
    static constexpr int kSparse = 2;  // the spacing of the finest lattice that is not the whole image
    void set_end() { ends_at_ = options_.limits.seconds - finishing_.seconds(); }

    // Takes those that decisions on samples need. Returns false if it was stopped.
    bool take_all_features() {
        const TimedPhase timed(looking_);
        image_.take_features(kMostFeatureSamples, monitor_);
        return !monitor_.stopped();
    }
    void take_missing_features() {
        const TimedPhase timed(looking_);
        if (image_.wants_features()) {
            // Layers show features, however little time there is.
            if (job_.film.parts && job_.receivers.empty()) image_.take_features(1, monitor_);
        } else if (!is_whole() && can_be_sparse()) {
            take_first_features(options_.limits.seconds);
        }
    }

    // --- Preparation

    // Makes what all passes share, within that share of the time that is left. Null if it was stopped.
    std::unique_ptr<const Session> begin(double share) {
        const double seconds = share * left();
        const TimedPhase timed(preparing_);
        if (is_dispensable_) preparation_.end_at(Deadline::after(kOverrun * seconds));
        std::optional<View> view;
        if (job_.receivers.empty()) view = view_of(job_);  // no camera sees receivers
        auto session = integrator_->begin({job_.scene, options_.seed, options_.workers, preparation_, view,
                                           Deadline::after(seconds), job_.film.two_halves},
                                          report_.once);
        return preparation_.stopped() ? nullptr : std::move(session);
    }

    // Null if it was stopped.
    std::unique_ptr<const Estimator> prepare(const Session& session, int pass, Monitor& monitor,
                                             PassStatistics& statistics) {
        const TimedPhase timed(preparing_);
        auto estimator = session.pass(static_cast<std::uint32_t>(pass), monitor, statistics);
        times_.preparation = timed.seconds();
        if (is_dispensable_ && monitor.stopped()) return nullptr;
        preparation_.end_at({});
        return estimator;
    }

    void render_samples() {
        if (in_passes_) {
            render_passes();
        } else {
            render_rounds(job_.spp, "image");
        }
    }

    // --- Rounds: one pass serves all samples.

    // Makes what all samples need, if it is not there. Returns false if it was stopped.
    bool prepare_rounds() {
        constexpr double kPreparation = 0.15;  // the share of the time, at most
        if (estimator_) return true;
        session_ = begin(kPreparation);
        if (session_) estimator_ = prepare(*session_, 0, preparation_, report_.passes);
        image_.sum_counts();
        report_.rays_prepare = image_.rays() - (options_.resume ? options_.resume->rays : 0);
        return bool(estimator_);
    }

    // Renders up to `most` samples per pixel.
    void render_rounds(int most, std::string_view phase) {
        int& done = report_.samples_done;
        const bool goes_on = bool(estimator_);
        StopRule rule({ends_at_, options_.limits.error}, most, goes_on ? done : 0, goes_on ? elapsed() : 0);
        if (!goes_on && is_enough(rule, done)) return end(rule.reason());
        if (!prepare_rounds()) return end_early();
        Progress progress(monitor_, phase, span(), {ends_at_});
        for (;;) {
            const double now = elapsed();
            rule.end_at(ends_at_);
            const int round = rule.next(done, wanted_round(), now);
            if (round == 0) break;
            if (image_.decides_at(done + round) && !take_all_features()) return end("user");
            const Swept swept = render_round(*estimator_, round, progress);
            if (swept == Swept::stopped) return end("user");
            if (swept == Swept::out_of_time) return end(rule.time_is_up(), progress);
            if (has_error(rule, done)) break;
            outputs_.pause(true);
        }
        // If the time is up, as many tiles as it allows get one more sample.
        if (rule.out_of_time() && render_tiles(*estimator_, done + 1, progress) == Swept::stopped)
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
        plan_for_whole();
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
        StopRule rule({ends_at_, options_.limits.error},
                      static_cast<int>((std::int64_t{job_.spp} + samples - 1) / samples));
        int& done = report_.passes_done;
        if (is_enough(rule, done)) {
            resume_report();
            return end(rule.reason());
        }
        const auto session = begin(kPreparation);
        if (!session) return end_early();
        resume_report();
        Progress progress(monitor_, "passes", span(), {ends_at_});
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
        if (rule.out_of_time() && elapsed() + times_.preparation < ends_at_ &&
            render_pass(*session, progress) == Swept::stopped)
            return end("user");
        end(rule.reason(), progress);
    }

    Swept render_pass(const Session& session, Progress& progress) {
        const int end = std::min(report_.samples_done + integrator_->samples_per_pass(), job_.spp);
        // The samples of a pass belong together. A last pass that is cut short, by the number of samples or
        // by the time, cannot be continued: the checkpoint is of the image before it.
        if (end - report_.samples_done < integrator_->samples_per_pass() ||
            elapsed() + times_.pass >= ends_at_)
            outputs_.keep_the_last();
        const Stopwatch clock;
        PassStatistics statistics;
        PassMonitor quiet(preparation_);
        const auto estimator = prepare(session, report_.passes_done, quiet, statistics);
        if (!estimator) return Swept::stopped;
        const Swept swept = render_tiles(*estimator, end, progress);
        if (swept != Swept::whole) return swept;
        report_.passes.add(statistics);
        report_.samples_done = end;
        ++report_.passes_done;
        plan_for_whole();
        image_.prepare_next(end, report_.passes_done);
        times_.pass = clock.seconds();
        return swept;
    }

    // --- Tiles

    // Renders all pixels' samples below `end`, without those that are there. Unless it returns `whole`, some
    // pixels have them and some have not.
    Swept render_tiles(const Estimator& estimator, int end, Progress& progress) {
        if (report_.samples_done > 0) return sweep(estimator, {end}, progress);
        const double begin = is_dispensable_ ? elapsed() : 0;
        for (int step = 0; step < TileRenderer::kFirstSteps; ++step) {
            // However little time there is, the first step is done, so that there is something to see
            // everywhere.
            const Swept swept = sweep(estimator, {end, step, step > 0 && can_be_sparse()}, progress);
            if (swept != Swept::whole) return swept;
            if (is_dispensable_ && !is_whole_in_time(begin, step)) return Swept::out_of_time;
        }
        return Swept::whole;
    }
    // Returns whether the whole image will be there in time at the rate of its first steps. Otherwise the
    // first image goes on: what is given up early costs little.
    bool is_whole_in_time(double begin, int step) {
        const double pixels = std::ldexp(1.0, 2 * (TileRenderer::kFirstSteps - 1 - step));  // per pixel done
        const double now = elapsed();
        return now + (pixels - 1) * (now - begin) <= ends_at_;
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
                    image_.sweep(estimator, sweep, {ends_at_ - now, ends, pauses, ends_in_time()}, progress);
            }
            if (is_whole) return Swept::whole;
            if (ranks) ranks->agree_to_stop();
            if (monitor_.stopped()) return Swept::stopped;
            if (is_out_of_time(now = elapsed())) return Swept::out_of_time;
            outputs_.pause(false);
        }
    }

    // --- Ends

    bool leads() const { return !options_.workers.ranks || options_.workers.ranks->leads(); }
    bool ends_in_time() const { return std::isfinite(options_.limits.seconds); }
    bool is_out_of_time(double elapsed) const { return ends_in_time() && elapsed >= ends_at_; }
    // Receivers have no neighbours whose light they could show.
    bool can_be_sparse() const { return job_.receivers.empty(); }

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
        if (image_.film().has_two_halves() && !take_all_features()) return false;
        image_.gather();
        return rule.satisfied(done, agreed(options_.workers, leads() ? error() : 0));
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
                       job_.scene.rays(), looking_.seconds + preparing_.seconds, imaging_.seconds,
                       looking_.processor + preparing_.processor, imaging_.processor, peak_memory()});
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
    Finishing finishing_;
    Outputs outputs_;
    // Passed to preparations; with a deadline if there is an image without them.
    DeadlineMonitor preparation_;
    bool is_dispensable_ = false;
    static constexpr double kOverrun = 2;  // times as long as a preparation may take it is cut
    double ends_at_;                       // seconds; when the samples end
    std::unique_ptr<const Session> session_;
    std::unique_ptr<const Estimator> estimator_;
    PhaseTime looking_, preparing_, imaging_;  // of this render: features, preparation, samples
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

namespace {

// Calls body(options, monitor) with what all ranks agree on.
template <typename Body>
RenderResult on_all_ranks(const RenderOptions& options, Monitor& monitor, Body&& body) {
    Ranks* const ranks = options.workers.ranks;
    if (!ranks) return body(options, monitor);
    RanksMonitor of_all(*ranks, monitor);
    ranks->listen_to([&monitor] { return monitor.stopped(); });
    std::optional<Checkpoint> resumed;
    const RenderOptions of_all_ranks = shared_options(options, *ranks, resumed);
    return body(of_all_ranks, of_all);
}

void check(const Job& job, const RenderOptions& options, Monitor& monitor) {
    require_fitting_method(job, options);
    require_image_memory(job, options);
    warn_of_unseen_lights(job.scene, job.integrator, monitor);
    warn_of_glowing_media(job.scene, job.integrator, monitor);
}

RenderResult render_better(Job& job, RenderOptions options, Monitor& monitor, const ChooseMethod& choose) {
    constexpr double kFirstShare = 0.25;  // of the time, at most
    const IntegratorSettings asked = job.integrator, simplest = methods_like(asked).front().settings;
    job.integrator = simplest;
    record_chance_light(job);
    require_fitting_method(job, options);
    require_image_memory(job, options);
    auto first = std::make_unique<Run>(job, options, monitor);
    first->render_first(kFirstShare);
    // Trials would not pay off if there is no time for the simplest method.
    if (first->is_whole() && !monitor.stopped()) {
        job.integrator = asked;
        const double error = choose({{first->left(), options.limits.error}, first->first_seconds()});
        options.limits.error = agreed(options.workers, error);
        if (monitor.stopped()) job.integrator = simplest;
    }
    check(job, options, monitor);
    if (job.integrator.index() == simplest.index()) return first->go_on();
    RenderOptions rest = options;
    rest.limits.seconds -= first->elapsed();
    Run second(job, rest, monitor);
    if (second.render_instead_of(*first)) {
        second.report_first(first->first_seconds());
        first.reset();
        return second.finish();
    }
    first->take_features_of(second);
    first->report_given_up(second.elapsed());
    job.integrator = simplest;
    return first->go_on();
}

}  // namespace

RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor) {
    check(job, options, monitor);
    return on_all_ranks(options, monitor, [&job](const RenderOptions& agreed, Monitor& of_all) {
        return Run(job, agreed, of_all).render();
    });
}

RenderResult render_choosing(Job& job, const RenderOptions& options, Monitor& monitor,
                             const ChooseMethod& choose) {
    if (!std::isfinite(options.limits.seconds)) {
        RenderOptions rest = options;
        rest.limits.error = choose({options.limits});
        return render(job, rest, monitor);
    }
    return on_all_ranks(options, monitor, [&](const RenderOptions& agreed, Monitor& of_all) {
        return render_better(job, agreed, of_all, choose);
    });
}

}  // namespace lucerna
