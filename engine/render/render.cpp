#include "engine/render/render.h"

#include <atomic>
#include <mutex>

#include "engine/base/stopwatch.h"
#include "engine/base/stream.h"
#include "engine/render/film.h"
#include "engine/render/integrator.h"
#include "engine/render/unseen_lights.h"

namespace lucerna {
namespace {

constexpr int kTile = 16;  // pixels; the unit of work and of progress

// Samples per pixel are taken in rounds that grow, so that a run that is stopped early has a whole image.
int next_round(int done, int spp) {
    return std::min(std::max(1, std::min(done, 16)), spp - done);
}

// One finished set-up of the loop: everything a tile needs.
class TileRenderer {
  public:
    TileRenderer(const Job& job, std::uint64_t seed, const Estimator& estimator, Film& film)
        : job_(job), seed_(seed), estimator_(estimator), film_(film), filter_(job.film.filter) {}

    int tiles_across() const { return (film_.width() + kTile - 1) / kTile; }
    int tiles() const { return tiles_across() * ((film_.height() + kTile - 1) / kTile); }

    void render(int tile, int first_sample, int end_sample) {
        const int x0 = tile % tiles_across() * kTile;
        const int y0 = tile / tiles_across() * kTile;
        for (int y = y0; y < std::min(y0 + kTile, film_.height()); ++y) {
            for (int x = x0; x < std::min(x0 + kTile, film_.width()); ++x) {
                for (int s = first_sample; s < end_sample; ++s) sample_pixel(x, y, s);
            }
        }
    }

    std::uint64_t bad_samples() const { return bad_samples_; }
    std::string first_bad() const { return first_bad_; }

  private:
    void sample_pixel(int x, int y, int sample) {
        // Numbers go by the place in the whole picture: a part of it is the same picture, cut out.
        const V2i whole = V2i(x, y) + job_.film.crop_begin;
        const auto pixel = static_cast<std::uint64_t>(whole.y) * static_cast<std::uint64_t>(job_.film.width) +
                           static_cast<std::uint64_t>(whole.x);
        Stream stream = Stream::stratified(seed_, Purpose::camera, pixel, static_cast<std::uint32_t>(sample));
        const FilterSampler::Sample place = filter_.sample(stream.next2());
        const V2f at =
            V2f(static_cast<float>(whole.x) + 0.5F, static_cast<float>(whole.y) + 0.5F) + place.offset;
        const V2f lens = stream.next2();
        const Rgb radiance = estimator_.radiance(job_.camera.ray(at, lens), stream);
        if (is_finite(radiance)) {
            film_.add(x, y, radiance, place.weight);
        } else {
            report_bad(x, y, sample, radiance);
        }
    }

    // A sample that is not a number is left out of the image and named, so that it can be found again.
    void report_bad(int x, int y, int sample, const Rgb& value) {
        const std::lock_guard lock(mutex_);
        if (bad_samples_++ == 0) {
            first_bad_ = fmt::format("pixel ({}, {}) sample {} seed {}: {} {} {}", x, y, sample, seed_,
                                     value.x, value.y, value.z);
        }
    }

    const Job& job_;
    std::uint64_t seed_;
    const Estimator& estimator_;
    Film& film_;
    FilterSampler filter_;
    std::mutex mutex_;
    std::uint64_t bad_samples_ = 0;
    std::string first_bad_;
};

// Renders all rounds, or as many as there is time for. Returns the samples per pixel that are complete.
int render_rounds(TileRenderer& tiles, int spp, const Workers& workers, Monitor& monitor) {
    Phase phase(monitor, "image",
                static_cast<std::uint64_t>(tiles.tiles()) * static_cast<std::uint64_t>(spp));
    int done = 0;
    while (done < spp) {
        const int round = next_round(done, spp);
        std::atomic<bool> whole{true};
        parallel_chunks(workers, tiles.tiles(), [&](std::int64_t tile) {
            if (monitor.stopped()) {
                whole = false;
                return;
            }
            tiles.render(static_cast<int>(tile), done, done + round);
            phase.advance(static_cast<std::uint64_t>(round));
        });
        if (!whole) break;
        done += round;
    }
    return done;
}

}  // namespace

RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor) {
    RenderResult result;
    RenderReport& report = result.report;
    const V2i size = job.film.rendered_size();
    Film film(size.x, size.y, FilterSampler(job.film.filter).weight());

    // Prepare.
    warn_of_unseen_lights(job.scene, job.integrator, monitor);
    const Stopwatch preparing;
    const auto integrator = make_integrator(job.integrator);
    const auto estimator =
        integrator->prepare({job.scene, options.seed, 0, options.workers, monitor, report});
    report.seconds.emplace_back("prepare", preparing.seconds());
    report.numbers["rays.prepare"] = static_cast<double>(job.scene.rays());

    // Render.
    if (estimator) {
        const Stopwatch rendering;
        TileRenderer tiles(job, options.seed, *estimator, film);
        report.samples_done = render_rounds(tiles, job.spp, options.workers, monitor);
        report.seconds.emplace_back("image", rendering.seconds());
        report.numbers["samples.not_finite"] = static_cast<double>(tiles.bad_samples());
        if (tiles.bad_samples() > 0) {
            monitor.warn(fmt::format("{} samples were not finite and were left out; the first: {}",
                                     tiles.bad_samples(), tiles.first_bad()));
        }
    }
    report.complete = report.samples_done == job.spp;
    if (job.scene.invalid_rays() > 0) {
        monitor.warn(fmt::format("{} rays were not finite and met nothing", job.scene.invalid_rays()));
    }
    report.numbers["rays.invalid"] = static_cast<double>(job.scene.invalid_rays());
    report.numbers["rays.total"] = static_cast<double>(job.scene.rays());
    result.image = film.develop(job.film.scale);
    const Quantity quantity = quantity_of(job.integrator);
    std::string unit = unit_text(quantity, common_unit(job.scene.lights()));
    if (job.film.scale != 1) unit += fmt::format(", times {:g}", job.film.scale);
    result.image.attributes["lucerna.unit"] = unit;
    report.notes["unit"] = unit;
    return result;
}

}  // namespace lucerna
