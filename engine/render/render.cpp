#include "engine/render/render.h"

#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/render/features.h"
#include "engine/render/film.h"
#include "engine/render/job.h"
#include "engine/render/layer_films.h"
#include "engine/render/progress.h"
#include "engine/render/render_checks.h"
#include "engine/render/tile_exchange.h"
#include "engine/render/tiles.h"
#include "engine/system/memory.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

// Samples per pixel are taken in rounds that grow, so that a run that is stopped early has a whole image.
// With an end in time a tile takes no longer than can be waited for: `seconds`, for one sample of a tile's
// pixels.
int next_round(int done, double seconds, bool ends_in_time) {
    constexpr double kLongestTile = 0.05;
    const int most =
        ends_in_time && seconds > 0 ? static_cast<int>(std::clamp(kLongestTile / seconds, 1.0, 16.0)) : 16;
    return std::max(1, std::min(done, most));
}

// Steps of so many items go through all of them, and early on to all parts: near the golden section of their
// number, and without a divisor in common.
std::int64_t spreading_stride(std::int64_t items) {
    auto stride = static_cast<std::int64_t>(0.618 * static_cast<double>(items)) + 1;
    while (std::gcd(stride, items) > 1) ++stride;
    return stride;
}

// Seconds, by the clock and of all threads' processors.
struct PhaseTime {
    double seconds = 0, processor = 0;
};
// A stretch of it.
class TimedPhase {
  public:
    explicit TimedPhase(PhaseTime& phase) : phase_(phase) {}
    ~TimedPhase() {
        phase_.seconds += clock_.seconds();
        phase_.processor += processor_.seconds();
    }
    TimedPhase(const TimedPhase&) = delete;
    TimedPhase& operator=(const TimedPhase&) = delete;
    double seconds() const { return clock_.seconds(); }

  private:
    PhaseTime& phase_;
    Stopwatch clock_;
    ProcessorStopwatch processor_;
};

// Which scene the maps in files are of.
MapFiles map_files(const Job& job, const RenderOptions& options) {
    MapFiles files = options.maps;
    if (!files.any()) return files;
    files.scene = job.files.empty() ? "" : job.files.front().string();
    files.scene_facts = scene_facts(job);
    return files;
}

// One render, from nothing, or from what another one left, to the image. On the ranks of a parallel job rank
// 0 runs it, and has the others do what is done together (Order), by the same code: they follow().
class Run {
  public:
    Run(const Job& job, const RenderOptions& options, Monitor& monitor)
        : job_(job),
          options_(options),
          monitor_(monitor),
          integrator_(make_integrator(job.integrator, map_files(job, options))),
          in_passes_(integrator_->samples_per_pass() > 0),
          film_(job.film.rendered_size().x, job.film.rendered_size().y,
                {FilterSampler(job.film.filter).weight(), integrator_->samples_per_pass() > 1,
                 job.film.two_halves, is_adaptive(), job.film.two_halves}),
          parts_(make_layer_films()),
          tiles_(job, options.seed, film_, integrator_->samples_per_pass(), parts_ ? &*parts_ : nullptr,
                 is_adaptive() ? &allocation_.emplace(film_) : nullptr),
          states_(static_cast<std::size_t>(tiles_.tiles())),
          show_timer_(options.show ? options.show_every : kNever),
          watch_timer_(options.watch ? options.watch_every : kNever, true),
          checkpoint_timer_(options.keep ? options.keep_every : kNever) {
        report_.unit = unit();
        report_.flux_unit = flux_unit_text(scene_unit(job.scene));
        if (options.resume) take_up(*options.resume);
        if (options.workers.ranks) {
            exchange_.emplace(*options.workers.ranks, job.scene, tiles_, film_, parts_ ? &*parts_ : nullptr,
                              allocation_ ? &*allocation_ : nullptr, states_);
        }
    }

    RenderResult render() {
        look_at_features();
        if (exchange_ && allocation_ && options_.resume) {
            order({.kind = Order::allocate});
            exchange_->share_allocation();
        }
        if (in_passes_) {
            render_passes();
        } else {
            render_rounds();
        }
        if (options_.resume) report_.seconds.add("earlier", options_.resume->seconds);
        report_.seconds.add("prepare", preparing_.seconds);
        report_.seconds.add("image", imaging_.seconds);
        bring_together();
        report_ranks();
        warn();
        keep();
        const Stopwatch denoising;
        RenderResult last = result(true);
        if (last.denoised) last.report.seconds.add("denoise", denoising.seconds());
        if (options_.watch) options_.watch(last);
        order({.kind = Order::end});
        return last;
    }

    // On other ranks than 0.
    void follow() {
        std::unique_ptr<const Session> session;
        std::unique_ptr<const Estimator> estimator;
        for (;;) {
            const Order order = options_.workers.ranks->agree(Order());
            switch (order.kind) {
                case Order::features:
                    look_at_features();
                    break;
                case Order::begin:
                    session = make_session(order.seconds);
                    break;
                case Order::pass: {
                    estimator.reset();
                    PassStatistics told_by_rank_0;
                    estimator = make_estimator(*session, order.number, monitor_, told_by_rank_0);
                    break;
                }
                case Order::sweep_tiles: {
                    const TimedPhase timed(imaging_);
                    exchange_->render(options_.workers, {},
                                      [&](std::size_t tile) { render_tile(*estimator, order.sweep, tile); });
                    break;
                }
                case Order::decide:
                    exchange_->decide(order.number);
                    break;
                case Order::allocate:
                    exchange_->share_allocation();
                    break;
                case Order::count:
                    exchange_->count();
                    break;
                case Order::bring_together:
                    exchange_->bring_together();
                    break;
                case Order::report:
                    report_ranks();
                    break;
                case Order::end:
                    return;
            }
        }
    }

  private:
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    // Shares of the time that is left within which preparations are to be done: of what serves all samples,
    // and of what a pass makes, of which there should be many.
    static constexpr double kPreparation = 0.25, kPassPreparation = 0.1;

    // However many samples the image has: it may be gone on with, and they allocate what comes then.

    static constexpr int kMostFeatureSamples = 16;
    bool is_adaptive() const { return job_.film.two_halves && job_.film.adaptive && !in_passes_; }

    std::optional<LayerFilms> make_layer_films() const {
        const LayerFilms::Wanted wanted{job_.film.parts, job_.film.chance};
        if (!wanted.any()) return std::nullopt;
        const std::string why = integrator_->why_no_light_groups();
        if (wanted.parts && !job_.scene.light_groups().empty() && !why.empty())
            throw InputError("the scene has light groups, and " + why);
        const Film::Kind kind{FilterSampler(job_.film.filter).weight(), integrator_->samples_per_pass() > 1,
                              job_.film.two_halves, is_adaptive()};
        return LayerFilms(film_.width(), film_.height(), kind, job_.scene.light_groups(), wanted);
    }

    enum class Swept : std::uint8_t { whole, out_of_time, stopped };

    // Samples of all tiles: all up to `end`, or of the first ones those of a step.
    struct Sweep {
        int end = 0;
        std::optional<int> first_step = {};
        bool may_end = true;  // before all tiles have theirs
    };

    // What rank 0 tells the others to do with it.
    struct Order {
        enum : std::uint8_t {
            features,
            begin,
            pass,
            sweep_tiles,
            decide,
            allocate,
            count,
            bring_together,
            report,
            end
        } kind = end;
        int number = 0;      // the pass's; samples per pixel at which is decided
        double seconds = 0;  // in which to prepare
        Sweep sweep = {};
    };
    void order(const Order& order) const {
        if (exchange_ && leads()) options_.workers.ranks->agree(order);
    }

    // Goes on from a checkpoint whose facts are this render's.
    void take_up(const Checkpoint& from) {
        const int per_pass = integrator_->samples_per_pass();
        const std::size_t of_image = film_.bytes_of_sums();
        const std::size_t of_parts = parts_ ? parts_->bytes_of_sums() : 0;
        if (from.tiles.size() != states_.size() || from.film.size() != of_image + of_parts ||
            (in_passes_ && std::int64_t{from.passes_done} * per_pass != from.samples_done) ||
            (allocation_ ? !allocation_->restore(from.allocation) : !from.allocation.empty())) {
            throw InputError("the checkpoint is of an image of another kind or size");
        }
        const int most = *std::max_element(from.tiles.begin(), from.tiles.end());
        if (most > job_.spp) {
            throw InputError(fmt::format(
                "the checkpoint holds up to {} samples per pixel; --spp {} is too small, use {} or more",
                most, job_.spp, most));
        }
        film_.restore(std::span(from.film).first(of_image));
        if (parts_) parts_->restore(std::span(from.film).subspan(of_image));
        for (std::size_t t = 0; t < states_.size(); ++t) states_[t].samples = from.tiles[t];
        tiles_.take_up_bad({from.bad_samples, from.first_bad, {}});
        report_.samples_done = from.samples_done;
        report_.passes_done = from.passes_done;
        monitor_.info(fmt::format("resumed: {} samples per pixel, rendered in {}", from.samples_done,
                                  duration_text(from.seconds)));
    }

    void look_at_features() {
        if (!job_.film.two_halves && !(job_.film.parts && job_.receivers.empty())) return;
        order({.kind = Order::features});
        const TimedPhase timed(preparing_);
        features_ = render_features(job_, options_.seed, kMostFeatureSamples, options_.workers, monitor_);
        if (allocation_ && leads()) allocation_->look_at(features_.image);
    }

    // Makes what all passes share, in that share of the time. Null if it was stopped.
    std::unique_ptr<const Session> begin(double share) {
        const double seconds = share * (options_.limits.seconds - elapsed());
        order({.kind = Order::begin, .seconds = seconds});
        return make_session(seconds);
    }
    std::optional<View> view() const {
        if (!job_.receivers.empty()) return std::nullopt;  // no camera sees them
        return view_of(job_);
    }
    std::unique_ptr<const Session> make_session(double seconds) {
        const TimedPhase timed(preparing_);
        const Deadline prepared = Deadline::after(seconds);
        auto session = integrator_->begin(
            {job_.scene, options_.seed, options_.workers, monitor_, view(), prepared, job_.film.two_halves},
            report_.once);
        return monitor_.stopped() ? nullptr : std::move(session);
    }

    // One pass serves all samples.
    void render_rounds() {
        StopRule rule(options_.limits, job_.spp);
        int& done = report_.samples_done;
        if (enough(rule, done)) return end(rule.reason());
        const auto session = begin(kPreparation);
        const auto estimator = session ? prepare(*session, 0, monitor_, report_.passes) : nullptr;
        report_.rays_prepare = rays_so_far();
        if (!estimator) return end("user");
        Progress progress(monitor_, "image", way(), options_.limits);
        const auto round_from = [&] {
            const int round = next_round(done, tile_seconds_, ends_in_time());
            return allocation_ ? std::min(round, SampleAllocation::next_decision(done) - done) : round;
        };
        while (const int round = rule.next(done, round_from(), elapsed())) {
            const double before = imaging_.seconds;
            const Swept swept = render_tiles(*estimator, done + round, progress);
            if (swept == Swept::stopped) return end("user");
            if (swept == Swept::out_of_time) return end(rule.time_is_up(), progress);
            done += round;
            if (allocation_) decide(done);
            tile_seconds_ = (imaging_.seconds - before) * options_.workers.threads /
                            (static_cast<double>(round) * tiles_.tiles());
            progress.round(elapsed());
            if (has_error(rule, done)) break;
            show();
        }
        // As many tiles as there is time for get one more sample.
        if (rule.out_of_time() && render_tiles(*estimator, done + 1, progress) == Swept::stopped)
            return end("user");
        progress.finish();
        end(rule.reason());
    }

    // Every pass is prepared, looked at once and forgotten.
    void render_passes() {
        const int samples = integrator_->samples_per_pass();
        StopRule rule(options_.limits, static_cast<int>((std::int64_t{job_.spp} + samples - 1) / samples));
        int& done = report_.passes_done;
        if (enough(rule, done)) {
            take_up_report();
            return end(rule.reason());
        }
        const auto session = begin(kPassPreparation);
        if (!session) return end("user");
        take_up_report();
        Progress progress(monitor_, "passes", way(), options_.limits);
        while (rule.next(done, 1, elapsed()) > 0) {
            const Swept swept = render_pass(*session, progress);
            if (swept == Swept::stopped) return end("user");
            if (swept == Swept::out_of_time) return end(rule.time_is_up(), progress);
            progress.round(elapsed());
            if (has_error(rule, done)) break;
            show();
        }
        // A last pass for as many tiles as there is time for, if it can be prepared in it.
        if (rule.out_of_time() && elapsed() + last_preparing_ < options_.limits.seconds &&
            render_pass(*session, progress) == Swept::stopped)
            return end("user");
        progress.finish();
        end(rule.reason());
    }

    Swept render_pass(const Session& session, Progress& progress) {
        const int end = std::min(report_.samples_done + integrator_->samples_per_pass(), job_.spp);
        // The samples of a pass belong together, and a render that goes on to more passes has all of them:
        // what it needs is the image before a last pass that is cut short, by their number or by time.
        if (end - report_.samples_done < integrator_->samples_per_pass() ||
            elapsed() + last_pass_ >= options_.limits.seconds)
            keep_the_last();
        const double began = elapsed();
        PassStatistics statistics;
        PassMonitor quiet(monitor_);
        const auto estimator = prepare(session, report_.passes_done, quiet, statistics);
        if (!estimator) return Swept::stopped;
        const Swept swept = render_tiles(*estimator, end, progress);
        if (swept != Swept::whole) return swept;
        report_.passes.add(statistics);
        report_.samples_done = end;
        ++report_.passes_done;
        last_pass_ = elapsed() - began;
        return swept;
    }

    std::unique_ptr<const Estimator> prepare(const Session& session, int pass, Monitor& monitor,
                                             PassStatistics& statistics) {
        order({.kind = Order::pass, .number = pass});
        return make_estimator(session, pass, monitor, statistics);
    }
    std::unique_ptr<const Estimator> make_estimator(const Session& session, int pass, Monitor& monitor,
                                                    PassStatistics& statistics) {
        const TimedPhase timed(preparing_);
        auto estimator = session.pass(static_cast<std::uint32_t>(pass), monitor, statistics);
        last_preparing_ = timed.seconds();
        return estimator;
    }

    void decide(int done) {
        if (!exchange_) return allocation_->decide(done);
        order({.kind = Order::decide, .number = done});
        exchange_->decide(done);
    }

    // All pixels' samples up to `end`, those that are there left out. Not whole: some pixels have them, some
    // have not.
    Swept render_tiles(const Estimator& estimator, int end, Progress& progress) {
        if (report_.samples_done > 0) return sweep(estimator, {end}, progress);
        for (int step = 0; step < TileRenderer::kFirstSteps; ++step) {
            // However little time there is: something to see everywhere.
            const Swept swept = sweep(estimator, {end, step, step > 0}, progress);
            if (swept != Swept::whole) return swept;
        }
        return Swept::whole;
    }

    bool wants(const Sweep& sweep, std::size_t tile) const {
        const TileState& there = states_[tile];
        return sweep.first_step ? there.samples == 0 && there.first_steps <= *sweep.first_step
                                : there.samples < sweep.end;
    }
    void render_tile(const Estimator& estimator, const Sweep& sweep, std::size_t tile) {
        const auto number = static_cast<int>(tile);
        if (sweep.first_step) {
            tiles_.render_first(estimator, number, sweep.end, *sweep.first_step);
        } else {
            tiles_.render(estimator, number, states_[tile].samples, sweep.end);
        }
        note(sweep, tile);
    }
    // The tile has what a sweep gives it. Returns how many samples that were, those of a tile's first steps
    // with the last of them.
    int note(const Sweep& sweep, std::size_t tile) {
        TileState& there = states_[tile];
        if (sweep.first_step && ++there.first_steps < TileRenderer::kFirstSteps) return 0;
        return sweep.end - std::exchange(there.samples, sweep.end);
    }

    // All tiles, unless it may end before that and has to: the user or the time says so. With an end in time
    // they come in an order that is spread over the image early on.
    Swept sweep(const Estimator& estimator, const Sweep& sweep, Progress& progress) {
        const std::int64_t tiles = tiles_.tiles(), stride = ends_in_time() ? spreading_stride(tiles) : 1;
        for (;;) {
            std::optional<TimedPhase> timed(imaging_);
            std::vector<std::int64_t> left;
            for (std::int64_t i = 0; i < tiles; ++i) {
                const std::int64_t tile = i * stride % tiles;
                if (wants(sweep, static_cast<std::size_t>(tile))) left.push_back(tile);
            }
            const bool whole = exchange_ ? sweep_by_ranks(estimator, sweep, std::move(left), progress)
                                         : sweep_alone(estimator, sweep, left, progress);
            timed.reset();
            if (whole) return Swept::whole;
            if (monitor_.stopped()) return Swept::stopped;
            if (is_out_of_time()) return Swept::out_of_time;
            pause();
        }
    }

    bool sweep_alone(const Estimator& estimator, const Sweep& sweep, std::span<const std::int64_t> left,
                     Progress& progress) {
        std::atomic<bool> whole{true}, began{false};
        parallel_chunks(options_.workers, static_cast<std::int64_t>(left.size()), [&](std::int64_t i) {
            // Between two pauses something is done, however often they are due.
            if (sweep.may_end && (monitor_.stopped() || is_out_of_time() || (began && pause_due()))) {
                whole = false;
                return;
            }
            const auto tile = static_cast<std::size_t>(left[static_cast<std::size_t>(i)]);
            const std::int32_t before = states_[tile].samples;
            render_tile(estimator, sweep, tile);
            progress.tile(states_[tile].samples - before);
            began = true;
        });
        return whole;
    }

    // By all ranks: the same, and what the others did is noted.
    bool sweep_by_ranks(const Estimator& estimator, const Sweep& sweep, std::vector<std::int64_t> left,
                        Progress& progress) {
        Ranks& ranks = *options_.workers.ranks;
        const std::size_t all = left.size();
        const int last_step = TileRenderer::kFirstSteps - 1;
        const int each =
            sweep.first_step.value_or(last_step) == last_step ? sweep.end - report_.samples_done : 0;
        std::atomic<std::int64_t> told{0}, done{0};
        std::atomic<bool> began{false};
        Ranks::Loop loop;
        loop.items = std::move(left);
        if (sweep.may_end) {
            loop.seconds = options_.limits.seconds - elapsed();
            loop.ends = [&] {
                return ranks.asked_to_stop() || is_out_of_time() || (began.exchange(true) && pause_due());
            };
        }
        loop.advance = [&](std::int64_t tiles) {
            told += tiles * each;
            progress.tile(static_cast<int>(tiles * each));
        };
        order({.kind = Order::sweep_tiles, .sweep = sweep});
        std::atomic<std::size_t> own{0};
        const std::vector<std::int64_t> others =
            exchange_->render(options_.workers, std::move(loop), [&](std::size_t tile) {
                const std::int32_t before = states_[tile].samples;
                render_tile(estimator, sweep, tile);
                done += states_[tile].samples - before;
                ++own;
            });
        for (const std::int64_t tile : others) done += note(sweep, static_cast<std::size_t>(tile));
        progress.tile(static_cast<int>(done - told));
        is_apart_ = true;
        return own + others.size() == all;
    }

    bool leads() const { return !exchange_ || options_.workers.ranks->leads(); }

    // What each rank did.
    void report_ranks() {
        if (!exchange_) return;
        Ranks& ranks = *options_.workers.ranks;
        order({.kind = Order::report});
        Packer own;
        own(RankReport{ranks.host(ranks.rank()), options_.workers.threads, exchange_->rendered(),
                       job_.scene.rays(), preparing_.seconds, imaging_.seconds, preparing_.processor,
                       imaging_.processor, peak_memory()});
        for (const std::span<const std::byte> bytes : ranks.gather("reports", own.take())) {
            Unpacker unpacker(bytes);
            unpacker(report_.ranks.emplace_back());
        }
        report_.traffic = ranks.traffic();
    }

    // For whatever looks at the whole image.
    void bring_together() {
        if (!exchange_ || !is_apart_) return;
        order({.kind = Order::bring_together});
        exchange_->bring_together();
        is_apart_ = false;
    }

    bool ends_in_time() const { return std::isfinite(options_.limits.seconds); }
    bool is_out_of_time() const { return ends_in_time() && elapsed() >= options_.limits.seconds; }

    // Nothing works on the image in between.
    bool pause_due() const {
        const double now = clock_.seconds();
        return watch_timer_.due(now) || (keepable_ && checkpoint_timer_.due(now));
    }
    void pause() {
        if (checkpoint_timer_.due(clock_.seconds())) keep();
        // Displays have the measured light: denoising it takes longer than they wait.
        if (watch_timer_.due(clock_.seconds())) present(options_.watch, watch_timer_, false);
    }
    // After whole rounds and passes.
    void show() {
        if (show_timer_.due(clock_.seconds())) present(options_.show, show_timer_, true);
        pause();
    }
    void present(const std::function<void(const RenderResult&)>& to, Recurring& when, bool denoised) {
        const double begin = clock_.seconds();
        bring_together();
        to(result(denoised));
        when.done(begin, clock_.seconds());
    }

    // Keeps the image as it is, and never again: what comes is nothing to go on from.
    void keep_the_last() {
        keep();
        keepable_ = false;
    }

    void keep() {
        if (!options_.keep || !keepable_) return;
        const double begin = clock_.seconds();
        bring_together();
        Checkpoint now;
        now.seconds = elapsed();
        now.samples_done = report_.samples_done;
        now.passes_done = report_.passes_done;
        for (const TileState& state : states_) now.tiles.push_back(state.samples);
        now.film = film_.sums();
        if (allocation_) now.allocation = allocation_->state();
        if (parts_) {
            const std::vector<std::byte> parts = parts_->sums();
            now.film.insert(now.film.end(), parts.begin(), parts.end());
        }
        now.bad_samples = bad_samples().count;
        now.first_bad = bad_samples().first;
        now.rays = rays();
        now.invalid_rays = invalid_rays();
        if (in_passes_) {
            now.numbers = report_.numbers();
            now.notes = report_.notes();
        }
        options_.keep(std::move(now));
        checkpoint_timer_.done(begin, clock_.seconds());
    }

    // Whether what was taken up needs nothing more: then nothing is prepared. Asked at the end of a round or
    // pass alone, where the render before did the same.
    bool enough(StopRule& rule, int done) {
        const auto other = [this](const TileState& state) { return state.samples != report_.samples_done; };
        if (done == 0 || std::any_of(states_.begin(), states_.end(), other)) return false;
        return has_error(rule, done) || rule.next(done, 1, elapsed()) == 0;
    }

    // What passes before the checkpoint reported.
    void take_up_report() {
        if (options_.resume) report_.restore(options_.resume->numbers, options_.resume->notes);
    }

    Progress::Span way() const {
        Progress::Span span;
        if (job_.spp != kNoEndOfSamples) {
            span.asked = static_cast<std::uint64_t>(tiles_.tiles()) * static_cast<std::uint64_t>(job_.spp);
        }
        for (const TileState& state : states_) span.there += static_cast<std::uint64_t>(state.samples);
        span.seconds = earlier();
        return span;
    }

    void end(std::string_view reason, Progress& progress) {
        progress.finish();
        end(reason);
    }
    void end(std::string_view reason) {
        report_.complete = reason != "user";
        report_.ended_by = reason;
    }

    RenderResult result(bool denoised) const {
        RenderResult result{film_.develop(job_.film.scale, job_.film.colours), report_};
        RenderReport& report = result.report;
        report.samples_not_finite = bad_samples().count;
        report.rays_invalid = invalid_rays();
        report.rays_total = rays();
        // Infinity is no number to write down.
        Film::ErrorEstimate error = film_.error();
        const bool has_error = std::isfinite(error.relative), ended_by_error = report.ended_by == "error";
        if (has_error && (error.is_known || ended_by_error)) report.relative_error = error.relative;
        report.pixels_apart = std::move(error.apart);
        result.image.attributes["lucerna.unit"] = report_.unit;
        if (job_.film.crop_end != V2i(0, 0)) {
            result.image.corner = job_.film.crop_begin;
            result.image.picture = {job_.film.width, job_.film.height};
        }
        if (denoised && job_.film.parts) {
            result.parts = parts_->develop(job_.film.scale, job_.film.colours);
            if (job_.receivers.empty()) add_channels(*result.parts, features_.more, "");
        }
        if (denoised && parts_) result.chance = parts_->develop_chance(job_.film.scale, job_.film.colours);
        if (!denoised || !film_.has_two_halves()) return result;
        result.layers = layers();
        // The filters would need pixels around the part's edges, which other parts have.
        if (job_.film.is_part()) return result;
        Denoised picture = denoise(*result.layers, options_.workers);
        result.denoised = std::move(picture.image);
        // Infinite where it is not known. An estimate that ended the render is stated, however uncertain it
        // is.
        const bool is_stated = picture.error_is_known || ended_by_error;
        if (has_error) {
            report.blur = error.blur;
            report.denoised_error = is_stated ? std::hypot(picture.relative_error, error.blur) : INFINITY;
        }
        return result;
    }

    Layers layers() const {
        const auto half = [this](int h) { return film_.develop_half(h, job_.film.scale, job_.film.colours); };
        return {{half(0), half(1)}, features_.image};
    }

    // Whether so many samples, or passes, are enough for the error that is asked for: of the denoised
    // picture, where there is one. That takes longer to tell than a round, and is not asked after each.
    bool has_error(StopRule& rule, int done) {
        if (!rule.wants_error()) return false;
        if (!film_.has_two_halves()) {
            bring_together();
            return rule.satisfied(done, film_.relative_error());
        }
        constexpr unsigned kLooks = 4;  // from one power of two to the next
        const unsigned number = static_cast<unsigned>(done),
                       step = std::max(1U, std::bit_floor(number) / kLooks);
        if (done < StopRule::kLeastForError || number % step != 0) return false;
        bring_together();
        // More samples do not mend what the photons of one set of maps blur: at least half of the error is
        // left to noise, so that the render ends.
        const double blur = film_.error().blur, most = options_.limits.error / std::sqrt(2.0);
        return rule.satisfied(done, std::hypot(denoise(layers(), options_.workers).relative_error,
                                               in_passes_ ? blur : std::min(blur, most)));
    }

    // Of all renders of this image.
    double earlier() const { return options_.resume ? options_.resume->seconds : 0; }
    double elapsed() const { return earlier() + clock_.seconds(); }
    std::uint64_t rays() const {
        const std::uint64_t own = exchange_ ? exchange_->rays() : job_.scene.rays();
        return own + (options_.resume ? options_.resume->rays : 0);
    }
    std::uint64_t invalid_rays() const {
        const std::uint64_t own = exchange_ ? exchange_->invalid_rays() : job_.scene.invalid_rays();
        return own + (options_.resume ? options_.resume->invalid_rays : 0);
    }
    const BadSamples& bad_samples() const {
        return exchange_ ? exchange_->bad_samples() : tiles_.bad_samples();
    }
    std::uint64_t rays_so_far() const {
        if (!exchange_) return job_.scene.rays();
        order({.kind = Order::count});
        exchange_->count();
        return exchange_->rays();
    }

    std::string unit() const {
        const Quantity quantity = quantity_of(job_.integrator);
        const std::string text = unit_text(quantity, scene_unit(job_.scene));
        return job_.film.scale != 1 ? text + fmt::format(", times {:g}", job_.film.scale) : text;
    }

    void warn() {
        if (bad_samples().count > 0) {
            monitor_.warn(fmt::format("{} samples were not finite and were left out; the first: {}",
                                      bad_samples().count, bad_samples().first));
        }
        if (invalid_rays() > 0) {
            monitor_.warn(fmt::format("{} rays were not finite and were ignored", invalid_rays()));
        }
        if (const std::size_t without = film_.without_sample();
            report_.samples_done == 0 && report_.complete && without > 0) {
            monitor_.warn(
                fmt::format("there was not enough time for one sample per pixel: {} of {} pixels show the "
                            "value of a neighbour",
                            without, film_.width() * film_.height()));
        }
    }

    const Job& job_;
    const RenderOptions& options_;
    Monitor& monitor_;
    Stopwatch clock_;
    std::unique_ptr<Integrator> integrator_;
    bool in_passes_;
    Film film_;
    Features features_;
    std::optional<SampleAllocation> allocation_;  // none: all pixels get as many samples
    std::optional<LayerFilms> parts_;
    TileRenderer tiles_;
    std::vector<TileState> states_;                 // by tile
    mutable std::optional<TileExchange> exchange_;  // on ranks
    bool is_apart_ = false;                         // the ranks have newer sums than rank 0
    RenderReport report_;
    PhaseTime preparing_, imaging_;  // of this render
    double last_preparing_ = 0;      // of them, the last pass's
    double last_pass_ = 0;           // seconds of the last pass
    double tile_seconds_ = 0;        // of one sample of a tile's pixels, by one thread
    Recurring show_timer_, watch_timer_, checkpoint_timer_;
    bool keepable_ = true;  // the image is one from which others can go on
};

}  // namespace

RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor) {
    if (options.maps.any() && !std::holds_alternative<PhotonMapSettings>(job.integrator)) {
        throw InputError(fmt::format("only photonmap can save and load its maps; the integrator is {}",
                                     integrator_name(job.integrator)));
    }
    if (!job.receivers.empty() && !make_integrator(job.integrator)->takes_receivers()) {
        throw InputError(fmt::format("{} cannot compute the illuminance at points in space; use path",
                                     integrator_name(job.integrator)));
    }
    require_image_memory(job, options);
    warn_of_unseen_lights(job.scene, job.integrator, monitor);
    warn_of_glowing_media(job.scene, job.integrator, monitor);
    Ranks* const ranks = options.workers.ranks;
    if (!ranks) return Run(job, options, monitor).render();
    RanksMonitor of_all(*ranks, monitor);
    ranks->listen_to([&monitor] { return monitor.stopped(); });
    Run run(job, options, of_all);
    if (ranks->leads()) return run.render();
    run.follow();
    return {};
}

}  // namespace lucerna
