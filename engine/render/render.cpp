#include "engine/render/render.h"

#include <atomic>
#include <numeric>
#include <optional>

#include "engine/base/monitor.h"
#include "engine/integrators/integrator.h"
#include "engine/render/film.h"
#include "engine/render/job.h"
#include "engine/render/progress.h"
#include "engine/render/render_checks.h"
#include "engine/render/tiles.h"

namespace lucerna {
namespace {

// Samples per pixel are taken in rounds that grow, so that a run that is stopped early has a whole image.
int next_round(int done) {
    return std::max(1, std::min(done, 16));
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
                FilterSampler(job.film.filter).weight(), integrator_->samples_per_pass() > 1),
          tiles_(job, options.seed, film_, integrator_->samples_per_pass() > 1),
          samples_(static_cast<std::size_t>(tiles_.tiles())),
          show_timer_(options.show ? options.show_every : kNever),
          watch_timer_(options.watch ? options.watch_every : kNever, true),
          checkpoint_timer_(options.keep ? options.keep_every : kNever) {
        report_.unit = unit();
        if (options.resume) take_up(*options.resume);
    }

    RenderResult render() {
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
        const RenderResult last = result();
        if (options_.watch) options_.watch(last);
        return last;
    }

  private:
    static constexpr double kNever = std::numeric_limits<double>::infinity();

    // Goes on from a checkpoint whose facts are this render's.
    void take_up(const Checkpoint& from) {
        const int per_pass = integrator_->samples_per_pass();
        if (from.tiles.size() != samples_.size() || from.film.size() != film_.bytes_of_sums() ||
            (in_passes_ && std::int64_t{from.passes_done} * per_pass != from.samples_done)) {
            throw InputError("the checkpoint is of an image of another kind or size");
        }
        const int most = *std::max_element(from.tiles.begin(), from.tiles.end());
        if (most > job_.spp) {
            throw InputError(
                fmt::format("the checkpoint holds {} samples per pixel, more than the {} asked for; {} or "
                            "more are accepted",
                            most, job_.spp, most));
        }
        film_.restore(from.film);
        samples_ = from.tiles;
        tiles_.take_up_bad(from.bad_samples, from.first_bad);
        report_.samples_done = from.samples_done;
        report_.passes_done = from.passes_done;
    }

    // Makes what all passes share. Null if it was stopped.
    std::unique_ptr<const Session> begin() {
        const Stopwatch preparing;
        auto session = integrator_->begin(
            {job_.scene, options_.seed, options_.workers, monitor_, view_of(job_)}, report_.once);
        preparing_ += preparing.seconds();
        return monitor_.stopped() ? nullptr : std::move(session);
    }

    // One pass serves all samples.
    void render_rounds() {
        StopRule rule(options_.limits, job_.spp);
        int& done = report_.samples_done;
        if (enough(rule, done)) return end(rule.reason());
        const auto session = begin();
        const auto estimator = session ? prepare(*session, 0, monitor_, report_.passes) : nullptr;
        report_.rays_prepare = job_.scene.rays();
        if (!estimator) return end("user");
        Progress progress(monitor_, "image", way(), options_.limits);
        while (const int round = rule.next(done, next_round(done), elapsed())) {
            if (!render_tiles(*estimator, done + round, progress)) return end("user");
            done += round;
            progress.round(elapsed());
            if (rule.wants_error() && rule.satisfied(done, film_.relative_error())) break;
            show();
        }
        if (rule.out_of_time() && !fill(*estimator, done + 1, progress)) return end("user");
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
        const auto session = begin();
        if (!session) return end("user");
        take_up_report();
        Progress progress(monitor_, "passes", way(), options_.limits);
        while (rule.next(done, 1, elapsed()) > 0) {
            if (!render_pass(*session, progress)) return end("user");
            progress.round(elapsed());
            if (rule.wants_error() && rule.satisfied(done, film_.relative_error())) break;
            show();
        }
        if (rule.out_of_time() && !fill_pass(*session, progress)) return end("user");
        progress.finish();
        end(rule.reason());
    }

    // False if it was stopped on the way.
    bool render_pass(const Session& session, Progress& progress) {
        const int end = std::min(report_.samples_done + integrator_->samples_per_pass(), job_.spp);
        // The samples of a pass belong together, and a render that goes on to more passes has all of them:
        // what it needs is the image before a last pass that is cut short.
        if (end - report_.samples_done < integrator_->samples_per_pass()) keep_the_last();
        PassStatistics statistics;
        PassMonitor quiet(monitor_);
        const auto estimator = prepare(session, report_.passes_done, quiet, statistics);
        if (!estimator) return false;
        if (!render_tiles(*estimator, end, progress)) return false;
        report_.passes.add(statistics);
        report_.samples_done = end;
        ++report_.passes_done;
        return true;
    }

    std::unique_ptr<const Estimator> prepare(const Session& session, int pass, Monitor& monitor,
                                             PassStatistics& statistics) {
        const Stopwatch preparing;
        auto estimator = session.pass(static_cast<std::uint32_t>(pass), monitor, statistics);
        last_preparing_ = preparing.seconds();
        preparing_ += last_preparing_;
        return estimator;
    }

    // A last pass for as many tiles as there is time for, if it can be prepared in it.
    bool fill_pass(const Session& session, Progress& progress) {
        if (elapsed() + last_preparing_ >= options_.limits.seconds) return true;
        keep_the_last();
        PassStatistics statistics;
        PassMonitor quiet(monitor_);
        const auto estimator = prepare(session, report_.passes_done, quiet, statistics);
        return estimator &&
               fill(*estimator, report_.samples_done + integrator_->samples_per_pass(), progress);
    }

    // The samples up to `end` of as many tiles as there is time for, spread over the image. False if it was
    // stopped on the way.
    bool fill(const Estimator& estimator, int end, Progress& progress) {
        const Stopwatch imaging;
        const std::int64_t tiles = tiles_.tiles(), stride = spreading_stride(tiles);
        parallel_chunks(options_.workers, tiles, [&](std::int64_t i) {
            const std::int64_t tile = i * stride % tiles;
            std::int32_t& there = samples_[static_cast<std::size_t>(tile)];
            if (there >= end || monitor_.stopped() || elapsed() >= options_.limits.seconds) return;
            tiles_.render(estimator, static_cast<int>(tile), there, end);
            progress.tile(end - there);
            there = end;
        });
        imaging_ += imaging.seconds();
        return !monitor_.stopped();
    }

    // All pixels' samples up to `end`, those that are there left out. False if it was stopped on the way:
    // some pixels have them, some have not.
    bool render_tiles(const Estimator& estimator, int end, Progress& progress) {
        for (;;) {
            const Stopwatch imaging;
            std::atomic<bool> whole{true}, began{false};
            parallel_chunks(options_.workers, tiles_.tiles(), [&](std::int64_t tile) {
                std::int32_t& there = samples_[static_cast<std::size_t>(tile)];
                if (there >= end) return;
                // Between two pauses something is done, however often they are due.
                if (monitor_.stopped() || (began && pause_due())) {
                    whole = false;
                    return;
                }
                began = true;
                tiles_.render(estimator, static_cast<int>(tile), there, end);
                progress.tile(end - there);
                there = end;
            });
            imaging_ += imaging.seconds();
            if (whole) return true;
            if (monitor_.stopped()) return false;
            pause();
        }
    }

    // Nothing works on the image in between.
    bool pause_due() const {
        const double now = clock_.seconds();
        return watch_timer_.due(now) || (keepable_ && checkpoint_timer_.due(now));
    }
    void pause() {
        if (checkpoint_timer_.due(clock_.seconds())) keep();
        if (watch_timer_.due(clock_.seconds())) present(options_.watch, watch_timer_);
    }
    // After whole rounds and passes.
    void show() {
        if (show_timer_.due(clock_.seconds())) present(options_.show, show_timer_);
        pause();
    }
    void present(const std::function<void(const RenderResult&)>& to, Recurring& when) {
        const double begin = clock_.seconds();
        to(result());
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
        return (rule.wants_error() && rule.satisfied(done, film_.relative_error())) ||
               rule.next(done, 1, elapsed()) == 0;
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

    void end(std::string_view reason) {
        report_.complete = reason != "user";
        report_.ended_by = reason;
    }

    RenderResult result() const {
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
        return result;
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
    }

    const Job& job_;
    const RenderOptions& options_;
    Monitor& monitor_;
    Stopwatch clock_;
    std::unique_ptr<Integrator> integrator_;
    bool in_passes_;
    Film film_;
    TileRenderer tiles_;
    std::vector<std::int32_t> samples_;  // that each tile's pixels have
    RenderReport report_;
    double preparing_ = 0, imaging_ = 0;  // seconds, of this render
    double last_preparing_ = 0;           // of them, the last pass's
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
