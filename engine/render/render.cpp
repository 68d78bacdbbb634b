#include "engine/render/render.h"

#include <atomic>
#include <optional>

#include "engine/base/stopwatch.h"
#include "engine/render/film.h"
#include "engine/render/integrator.h"
#include "engine/render/tiles.h"
#include "engine/render/unseen_lights.h"

namespace lucerna {
namespace {

// Samples per pixel are taken in rounds that grow, so that a run that is stopped early has a whole image.
int next_round(int done) {
    return std::max(1, std::min(done, 16));
}

// Phases within a pass are not told: a thousand passes would be thousands of lines.
class PassMonitor final : public Monitor {
  public:
    explicit PassMonitor(Monitor& monitor) : monitor_(monitor) {}
    void warn(std::string_view line) override { monitor_.warn(line); }
    bool stopped() const override { return monitor_.stopped(); }

  private:
    Monitor& monitor_;
};

// The way through the image: by samples, or by time where that is what ends it.
class Progress {
  public:
    Progress(Monitor& monitor, std::string_view name, int tiles, int samples, const Limits& limits)
        : by_time_(std::isfinite(limits.seconds)),
          total_(by_time_ ? tenths(limits.seconds)
                 : samples == kNoEndOfSamples
                     ? 0
                     : static_cast<std::uint64_t>(tiles) * static_cast<std::uint64_t>(samples)),
          phase_(monitor, name, total_) {}

    // From any thread.
    void tile(int samples) {
        if (!by_time_) phase_.advance(static_cast<std::uint64_t>(samples));
    }
    void round(double seconds) {
        if (by_time_) advance_to(std::min(tenths(seconds), total_));
    }
    // It ended as it should: what is left of the time is not needed.
    void finish() {
        if (by_time_) advance_to(total_);
    }

  private:
    static std::uint64_t tenths(double seconds) {
        return static_cast<std::uint64_t>(std::min(seconds, 1e9) * 10);
    }
    void advance_to(std::uint64_t done) {
        if (done > done_) phase_.advance(done - done_);
        done_ = std::max(done, done_);
    }

    bool by_time_;
    std::uint64_t total_;
    std::uint64_t done_ = 0;
    Phase phase_;
};

// Seconds and counts of passes add up; energies, shares and notes are the last pass's.
void add_pass(RenderReport& all, const RenderReport& pass) {
    for (const auto& phase : pass.seconds) {
        const auto same = [&](const auto& entry) { return entry.first == phase.first; };
        const auto found = std::find_if(all.seconds.begin(), all.seconds.end(), same);
        if (found == all.seconds.end()) {
            all.seconds.push_back(phase);
        } else {
            found->second += phase.second;
        }
    }
    for (const auto& [name, number] : pass.numbers) {
        const bool counts = name.starts_with("paths.") || name.starts_with("photons.");
        all.numbers[name] = number + (counts ? all.numbers[name] : 0);
    }
    for (const auto& [name, note] : pass.notes) all.notes[name] = note;
}

// One render, from nothing to the image.
class Run {
  public:
    Run(const Job& job, const RenderOptions& options, Monitor& monitor)
        : job_(job),
          options_(options),
          monitor_(monitor),
          integrator_(make_integrator(job.integrator)),
          in_passes_(integrator_->samples_per_pass() > 0),
          film_(job.film.rendered_size().x, job.film.rendered_size().y,
                FilterSampler(job.film.filter).weight(), integrator_->samples_per_pass() > 1),
          tiles_(job, options.seed, film_, integrator_->samples_per_pass() > 1) {
        report_.notes["unit"] = unit();
    }

    RenderResult render() {
        if (in_passes_) {
            render_passes();
        } else {
            render_rounds();
        }
        report_.seconds.emplace_back("prepare", preparing_);
        report_.seconds.emplace_back("image", imaging_);
        warn();
        return result();
    }

  private:
    // One prepared pass serves all samples.
    void render_rounds() {
        const Stopwatch preparing;
        const auto estimator = integrator_->prepare({job_.scene, options_.seed, 0, options_.workers, monitor_,
                                                     report_, nullptr, &options_.maps, view()});
        preparing_ = preparing.seconds();
        report_.numbers["rays.prepare"] = static_cast<double>(job_.scene.rays());
        if (!estimator) return end("user");
        StopRule rule(options_.limits, job_.spp);
        Progress progress(monitor_, "image", tiles_.tiles(), job_.spp, options_.limits);
        int& done = report_.samples_done;
        while (const int round = rule.next(done, next_round(done), clock_.seconds())) {
            if (!look(*estimator, done, done + round, progress)) return end("user");
            done += round;
            progress.round(clock_.seconds());
            if (rule.wants_error() && rule.satisfied(done, film_.relative_error())) break;
            show();
        }
        progress.finish();
        end(rule.reason());
    }

    // Every pass is prepared, looked at once and forgotten.
    void render_passes() {
        const Stopwatch founding;
        const auto groundwork = integrator_->groundwork(
            {job_.scene, options_.seed, 0, options_.workers, monitor_, report_, nullptr, nullptr, view()});
        preparing_ = founding.seconds();
        if (monitor_.stopped()) return end("user");
        const int samples = integrator_->samples_per_pass();
        StopRule rule(options_.limits, static_cast<int>((std::int64_t{job_.spp} + samples - 1) / samples));
        Progress progress(monitor_, "passes", tiles_.tiles(), job_.spp, options_.limits);
        int& done = report_.passes_done;
        while (rule.next(done, 1, clock_.seconds()) > 0) {
            if (!render_pass(groundwork.get(), progress)) return end("user");
            progress.round(clock_.seconds());
            if (rule.wants_error() && rule.satisfied(done, film_.relative_error())) break;
            show();
        }
        progress.finish();
        end(rule.reason());
    }

    // False if it was stopped on the way.
    bool render_pass(const Groundwork* groundwork, Progress& progress) {
        const Stopwatch preparing;
        PassMonitor quiet(monitor_);
        RenderReport report;
        const auto estimator =
            integrator_->prepare({job_.scene, options_.seed, static_cast<std::uint32_t>(report_.passes_done),
                                  options_.workers, quiet, report, groundwork});
        preparing_ += preparing.seconds();
        if (!estimator) return false;
        const int first = report_.samples_done;
        const int end = std::min(first + integrator_->samples_per_pass(), job_.spp);
        if (!look(*estimator, first, end, progress)) return false;
        add_pass(report_, report);
        report_.samples_done = end;
        ++report_.passes_done;
        return true;
    }

    // The samples [first, end) of all pixels. False if it was stopped on the way: some pixels have them, some
    // have not.
    bool look(const Estimator& estimator, int first, int end, Progress& progress) {
        const Stopwatch imaging;
        std::atomic<bool> whole{true};
        parallel_chunks(options_.workers, tiles_.tiles(), [&](std::int64_t tile) {
            if (monitor_.stopped()) {
                whole = false;
                return;
            }
            tiles_.render(estimator, static_cast<int>(tile), first, end);
            progress.tile(end - first);
        });
        imaging_ += imaging.seconds();
        return whole;
    }

    void end(std::string_view reason) {
        report_.complete = reason != "user";
        report_.notes["ended_by"] = reason;
    }

    void show() {
        if (!options_.show || clock_.seconds() - shown_ < options_.show_every) return;
        options_.show(result());
        shown_ = clock_.seconds();
    }

    RenderResult result() const {
        RenderResult result{film_.develop(job_.film.scale), report_};
        std::map<std::string, double>& numbers = result.report.numbers;
        numbers["samples.not_finite"] = static_cast<double>(tiles_.bad_samples());
        numbers["rays.invalid"] = static_cast<double>(job_.scene.invalid_rays());
        numbers["rays.total"] = static_cast<double>(job_.scene.rays());
        numbers["passes.done"] = report_.passes_done;
        // Infinity is no number to write down.
        const double error = film_.relative_error();
        if (std::isfinite(error)) numbers["error.relative"] = error;
        result.image.attributes["lucerna.unit"] = report_.notes.at("unit");
        return result;
    }

    View view() const {
        const FilmSettings& film = job_.film;
        const V2i end = film.crop_end == V2i(0, 0) ? V2i(film.width, film.height) : film.crop_end;
        return {&job_.camera, V2f(film.crop_begin), V2f(end)};
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
        if (job_.scene.invalid_rays() > 0) {
            monitor_.warn(fmt::format("{} rays were not finite and met nothing", job_.scene.invalid_rays()));
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
    RenderReport report_;
    double preparing_ = 0, imaging_ = 0;  // seconds
    double shown_ = 0;                    // when, in seconds
};

}  // namespace

RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor) {
    if (options.maps.any() && !std::holds_alternative<PhotonMapSettings>(job.integrator)) {
        throw InputError(fmt::format("only photonmap keeps its maps in files; the integrator is {}",
                                     integrator_name(job.integrator)));
    }
    warn_of_unseen_lights(job.scene, job.integrator, monitor);
    warn_of_glowing_media(job.scene, job.integrator, monitor);
    return Run(job, options, monitor).render();
}

}  // namespace lucerna
