#include "engine/render/render.h"

#include <atomic>
#include <bit>
#include <numeric>
#include <optional>

#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/render/features.h"
#include "engine/render/film.h"
#include "engine/render/job.h"
#include "engine/render/part_films.h"
#include "engine/render/progress.h"
#include "engine/render/render_checks.h"
#include "engine/render/tiles.h"

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

// One render, from nothing, or from what another one left, to the image.
class Run {
  public:
    Run(const Job& job, const RenderOptions& options, Monitor& monitor)
        : job_(job),
          options_(options),
          monitor_(monitor),
          integrator_(make_integrator(job.integrator, options.maps)),
          in_passes_(integrator_->samples_per_pass() > 0),
          film_(job.film.rendered_size().x, job.film.rendered_size().y,
                {FilterSampler(job.film.filter).weight(), integrator_->samples_per_pass() > 1,
                 job.film.two_halves, is_adaptive()}),
          parts_(make_part_films()),
          tiles_(job, options.seed, film_, integrator_->samples_per_pass(), parts_ ? &*parts_ : nullptr,
                 is_adaptive() ? &allocation_.emplace(film_) : nullptr),
          samples_(static_cast<std::size_t>(tiles_.tiles())),
          first_steps_(samples_.size()),
          show_timer_(options.show ? options.show_every : kNever),
          watch_timer_(options.watch ? options.watch_every : kNever, true),
          checkpoint_timer_(options.keep ? options.keep_every : kNever) {
        report_.unit = unit();
        if (options.resume) take_up(*options.resume);
    }

    RenderResult render() {
        if (job_.film.two_halves || job_.film.parts) {
            const Stopwatch looking;
            features_ = render_features(job_, options_.seed, kMostFeatureSamples, options_.workers, monitor_);
            preparing_ += looking.seconds();
        }
        if (allocation_) allocation_->look_at(features_.image);
        if (in_passes_) {
            render_passes();
        } else {
            render_rounds();
        }
        if (options_.resume) report_.seconds.add("earlier", options_.resume->seconds);
        report_.seconds.add("prepare", preparing_);
        report_.seconds.add("image", imaging_);
        warn();
        keep();
        const Stopwatch denoising;
        RenderResult last = result(true);
        if (last.denoised) last.report.seconds.add("denoise", denoising.seconds());
        if (options_.watch) options_.watch(last);
        return last;
    }

  private:
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    // Shares of the time that is left within which preparations are to be done: of what serves all samples,
    // and of what a pass makes, of which there should be many.
    static constexpr double kPreparation = 0.25, kPassPreparation = 0.1;

    // However many samples the image has: it may be gone on with, and they allocate what comes then.
    static constexpr int kMostFeatureSamples = 16;

    bool is_adaptive() const { return job_.film.two_halves && job_.film.adaptive && !in_passes_; }

    std::optional<PartFilms> make_part_films() const {
        if (!job_.film.parts) return std::nullopt;
        const std::string why = integrator_->why_no_light_groups();
        if (!job_.scene.light_groups().empty() && !why.empty())
            throw InputError("the scene has light groups, and " + why);
        const Film::Kind kind{FilterSampler(job_.film.filter).weight(), integrator_->samples_per_pass() > 1,
                              is_adaptive(), is_adaptive()};
        return PartFilms(film_.width(), film_.height(), kind, job_.scene.light_groups());
    }

    enum class Swept : std::uint8_t { whole, out_of_time, stopped };

    // Goes on from a checkpoint whose facts are this render's.
    void take_up(const Checkpoint& from) {
        const int per_pass = integrator_->samples_per_pass();
        const std::size_t of_image = film_.bytes_of_sums();
        const std::size_t of_parts = parts_ ? parts_->bytes_of_sums() : 0;
        if (from.tiles.size() != samples_.size() || from.film.size() != of_image + of_parts ||
            (in_passes_ && std::int64_t{from.passes_done} * per_pass != from.samples_done) ||
            (allocation_ ? !allocation_->restore(from.allocation) : !from.allocation.empty())) {
            throw InputError("the checkpoint is of an image of another kind or size");
        }
        const int most = *std::max_element(from.tiles.begin(), from.tiles.end());
        if (most > job_.spp) {
            throw InputError(
                fmt::format("the checkpoint holds {} samples per pixel, more than the {} asked for; {} or "
                            "more are accepted",
                            most, job_.spp, most));
        }
        film_.restore(std::span(from.film).first(of_image));
        if (parts_) parts_->restore(std::span(from.film).subspan(of_image));
        samples_ = from.tiles;
        tiles_.take_up_bad(from.bad_samples, from.first_bad);
        report_.samples_done = from.samples_done;
        report_.passes_done = from.passes_done;
    }

    // Makes what all passes share, in that share of the time. Null if it was stopped.
    std::unique_ptr<const Session> begin(double share) {
        const Stopwatch preparing;
        const Deadline prepared = Deadline::after(share * (options_.limits.seconds - elapsed()));
        auto session = integrator_->begin({job_.scene, options_.seed, options_.workers, monitor_,
                                           view_of(job_), prepared, job_.film.two_halves},
                                          report_.once);
        preparing_ += preparing.seconds();
        return monitor_.stopped() ? nullptr : std::move(session);
    }

    // One pass serves all samples.
    void render_rounds() {
        StopRule rule(options_.limits, job_.spp);
        int& done = report_.samples_done;
        if (enough(rule, done)) return end(rule.reason());
        const auto session = begin(kPreparation);
        const auto estimator = session ? prepare(*session, 0, monitor_, report_.passes) : nullptr;
        report_.rays_prepare = job_.scene.rays();
        if (!estimator) return end("user");
        Progress progress(monitor_, "image", way(), options_.limits);
        const auto round_from = [&] {
            const int round = next_round(done, tile_seconds_, ends_in_time());
            return allocation_ ? std::min(round, SampleAllocation::next_decision(done) - done) : round;
        };
        while (const int round = rule.next(done, round_from(), elapsed())) {
            const double before = imaging_;
            const Swept swept = render_tiles(*estimator, done + round, progress);
            if (swept == Swept::stopped) return end("user");
            if (swept == Swept::out_of_time) return end(rule.time_is_up(), progress);
            done += round;
            if (allocation_) allocation_->decide(done);
            tile_seconds_ = (imaging_ - before) * options_.workers.threads /
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
        const Stopwatch preparing;
        auto estimator = session.pass(static_cast<std::uint32_t>(pass), monitor, statistics);
        last_preparing_ = preparing.seconds();
        preparing_ += last_preparing_;
        return estimator;
    }

    // All pixels' samples up to `end`, those that are there left out. Not whole: some pixels have them, some
    // have not.
    Swept render_tiles(const Estimator& estimator, int end, Progress& progress) {
        if (report_.samples_done > 0) {
            return sweep(true, [&](std::size_t tile) {
                std::int32_t& there = samples_[tile];
                if (there >= end) return false;
                tiles_.render(estimator, static_cast<int>(tile), there, end);
                progress.tile(end - there);
                there = end;
                return true;
            });
        }
        for (int step = 0; step < TileRenderer::kFirstSteps; ++step) {
            // However little time there is: something to see everywhere.
            const Swept swept = sweep(step > 0, [&](std::size_t tile) {
                if (samples_[tile] > 0 || first_steps_[tile] > step) return false;
                tiles_.render_first(estimator, static_cast<int>(tile), end, step);
                if (++first_steps_[tile] < TileRenderer::kFirstSteps) return true;
                samples_[tile] = end;
                progress.tile(end);
                return true;
            });
            if (swept != Swept::whole) return swept;
        }
        return Swept::whole;
    }

    // Calls render(tile) for all tiles, unless it may end before that and has to: the user or the time says
    // so. render() is false where there is nothing to do. With an end in time they come in an order that is
    // spread over the image early on.
    template <typename Render>
    Swept sweep(bool may_end, Render&& render) {
        const std::int64_t tiles = tiles_.tiles(), stride = ends_in_time() ? spreading_stride(tiles) : 1;
        for (;;) {
            const Stopwatch imaging;
            std::atomic<bool> whole{true}, began{false};
            parallel_chunks(options_.workers, tiles, [&](std::int64_t i) {
                // Between two pauses something is done, however often they are due.
                if (may_end && (monitor_.stopped() || is_out_of_time() || (began && pause_due()))) {
                    whole = false;
                    return;
                }
                if (!render(static_cast<std::size_t>(i * stride % tiles))) return;
                began = true;
            });
            imaging_ += imaging.seconds();
            if (whole) return Swept::whole;
            if (monitor_.stopped()) return Swept::stopped;
            if (is_out_of_time()) return Swept::out_of_time;
            pause();
        }
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
        Checkpoint now;
        now.seconds = elapsed();
        now.samples_done = report_.samples_done;
        now.passes_done = report_.passes_done;
        now.tiles = samples_;
        now.film = film_.sums();
        if (allocation_) now.allocation = allocation_->state();
        if (parts_) {
            const std::vector<std::byte> parts = parts_->sums();
            now.film.insert(now.film.end(), parts.begin(), parts.end());
        }
        now.bad_samples = tiles_.bad_samples();
        now.first_bad = tiles_.first_bad();
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
    bool enough(StopRule& rule, int done) const {
        const auto other = [this](std::int32_t samples) { return samples != report_.samples_done; };
        if (done == 0 || std::any_of(samples_.begin(), samples_.end(), other)) return false;
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
        for (const std::int32_t samples : samples_) span.there += static_cast<std::uint64_t>(samples);
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
        report.samples_not_finite = tiles_.bad_samples();
        report.rays_invalid = invalid_rays();
        report.rays_total = rays();
        // Infinity is no number to write down.
        Film::ErrorEstimate error = film_.error();
        if (std::isfinite(error.relative)) report.relative_error = error.relative;
        report.pixels_apart = std::move(error.apart);
        result.image.attributes["lucerna.unit"] = report_.unit;
        if (job_.film.crop_end != V2i(0, 0)) {
            result.image.corner = job_.film.crop_begin;
            result.image.picture = {job_.film.width, job_.film.height};
        }
        if (denoised && parts_) {
            result.parts = parts_->develop(job_.film.scale, job_.film.colours);
            add_channels(*result.parts, features_.more, "");
        }
        if (!denoised || !film_.has_two_halves()) return result;
        result.layers = layers();
        // What filters look at around a part's edges is in other parts.
        if (job_.film.is_part()) return result;
        Denoised picture = denoise(*result.layers, options_.workers);
        result.denoised = std::move(picture.image);
        if (report.relative_error) report.denoised_error = picture.relative_error;
        return result;
    }

    Layers layers() const {
        const auto half = [this](int h) { return film_.develop_half(h, job_.film.scale, job_.film.colours); };
        return {{half(0), half(1)}, features_.image};
    }

    // Whether so many samples, or passes, are enough for the error that is asked for: of the denoised
    // picture, where there is one. That takes longer to tell than a round, and is not asked after each.
    bool has_error(StopRule& rule, int done) const {
        if (!rule.wants_error()) return false;
        if (!film_.has_two_halves()) return rule.satisfied(done, film_.relative_error());
        constexpr unsigned kLooks = 4;  // from one power of two to the next
        const unsigned number = static_cast<unsigned>(done),
                       step = std::max(1U, std::bit_floor(number) / kLooks);
        if (done < StopRule::kLeastForError || number % step != 0) return false;
        return rule.satisfied(done, denoise(layers(), options_.workers).relative_error);
    }

    // Of all renders of this image.
    double earlier() const { return options_.resume ? options_.resume->seconds : 0; }
    double elapsed() const { return earlier() + clock_.seconds(); }
    std::uint64_t rays() const { return job_.scene.rays() + (options_.resume ? options_.resume->rays : 0); }
    std::uint64_t invalid_rays() const {
        return job_.scene.invalid_rays() + (options_.resume ? options_.resume->invalid_rays : 0);
    }

    std::string unit() const {
        const Quantity quantity = quantity_of(job_.integrator);
        const std::string text = unit_text(quantity, common_unit(job_.scene.lights()));
        return job_.film.scale != 1 ? text + fmt::format(", times {:g}", job_.film.scale) : text;
    }

    void warn() {
        if (tiles_.bad_samples() > 0) {
            monitor_.warn(fmt::format("{} samples were not finite and were left out; the first: {}",
                                      tiles_.bad_samples(), tiles_.first_bad()));
        }
        if (invalid_rays() > 0) {
            monitor_.warn(fmt::format("{} rays were not finite and met nothing", invalid_rays()));
        }
        if (const std::size_t without = film_.without_sample();
            report_.samples_done == 0 && report_.complete && without > 0) {
            monitor_.warn(
                fmt::format("there was no time for a sample of each pixel: {} of {} show the value of one "
                            "beside them",
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
    std::optional<PartFilms> parts_;
    TileRenderer tiles_;
    std::vector<std::int32_t> samples_;  // that each tile's pixels have
    RenderReport report_;
    double preparing_ = 0, imaging_ = 0;  // seconds, of this render
    double last_preparing_ = 0;           // of them, the last pass's
    double last_pass_ = 0;                // seconds of the last pass
    double tile_seconds_ = 0;             // of one sample of a tile's pixels, by one thread
    std::vector<int> first_steps_;        // of each tile's first samples, those that are done
    Recurring show_timer_, watch_timer_, checkpoint_timer_;
    bool keepable_ = true;  // the image is one from which others can go on
};

}  // namespace

RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor) {
    if (options.maps.any() && !std::holds_alternative<PhotonMapSettings>(job.integrator)) {
        throw InputError(fmt::format("only photonmap keeps its maps in files; the integrator is {}",
                                     integrator_name(job.integrator)));
    }
    require_image_memory(job, options);
    warn_of_unseen_lights(job.scene, job.integrator, monitor);
    warn_of_glowing_media(job.scene, job.integrator, monitor);
    return Run(job, options, monitor).render();
}

}  // namespace lucerna
