#include "engine/render/outputs.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/render/feature_filter.h"

namespace lucerna {
namespace {

// Returns the interval of what is wanted; what is not wanted is never due.
double interval(bool is_wanted, double seconds) {
    return is_wanted ? seconds : std::numeric_limits<double>::infinity();
}

// Fills what the result shows of pixels without a sample.
void fill(const Film& film, int spacing, const Image& features, const Workers& workers,
          RenderResult& result) {
    const FeatureFilter filter({film.width(), film.height()}, sampled_pixels(film, workers), spacing,
                               features, workers);
    std::vector<Image*> images{&result.image};
    if (result.parts) images.push_back(&*result.parts);
    if (result.chance) images.push_back(&*result.chance);
    filter.fill(images);
}

// Returns every `spacing`-th pixel of every `spacing`-th row.
Image lattice_of(const Image& image, int spacing, const Workers& workers) {
    Image lattice((image.width + spacing - 1) / spacing, (image.height + spacing - 1) / spacing,
                  image.channels);
    lattice.space = image.space;
    const auto channels = static_cast<std::ptrdiff_t>(image.channels.size());
    parallel_chunks(workers.alone(), lattice.height, [&](std::int64_t row) {
        const auto y = static_cast<int>(row);
        for (int x = 0; x < lattice.width; ++x) {
            std::copy_n(
                image.data.begin() + static_cast<std::ptrdiff_t>(image.index(spacing * x, spacing * y)),
                channels, lattice.data.begin() + static_cast<std::ptrdiff_t>(lattice.index(x, y)));
        }
    });
    return lattice;
}

// Denoises the pixels of a lattice, and upsamples the picture to all pixels.
Denoised denoise_lattice(const DenoiserInput& input, int spacing, const Workers& workers) {
    const auto lattice_of = [&](const Image& image) { return lucerna::lattice_of(image, spacing, workers); };
    DenoiserInput part{{lattice_of(input.halves[0]), lattice_of(input.halves[1])},
                       lattice_of(input.features)};
    complete_halves(part.halves, 1, part.features, workers);
    Denoised lattice = denoise(part, workers);
    const V2i size(input.features.width, input.features.height);
    Denoised picture{Image::rgb(size.x, size.y), lattice.relative_error, lattice.error_is_known};
    picture.image.space = lattice.image.space;
    std::vector<std::uint8_t> known(input.features.data.size() / kFeatureChannels);
    parallel_chunks(workers.alone(), lattice.image.height, [&](std::int64_t row) {
        const auto y = static_cast<int>(row);
        for (int x = 0; x < lattice.image.width; ++x) {
            const std::size_t to = picture.image.index(x * spacing, y * spacing);
            known[to / 3] = 1;
            std::copy_n(&lattice.image.data[lattice.image.index(x, y)], 3, &picture.image.data[to]);
        }
    });
    FeatureFilter(size, std::move(known), spacing, input.features, workers).fill({&picture.image});
    return picture;
}

// Adds the denoised picture and its estimated error.
void add_denoised(const Film::ErrorEstimate& error, Denoised picture, RenderResult& result) {
    result.denoised = std::move(picture.image);
    if (!std::isfinite(error.relative)) return;
    // The error is infinite if it is unknown. An estimate that ended the render is stated, however uncertain
    // it is.
    const bool is_stated = picture.error_is_known || result.report.ended_by == "error";
    result.report.blur = error.blur;
    result.report.denoised_error = is_stated ? hypot(picture.relative_error, error.blur) : INFINITY;
}

}  // namespace

RenderResult develop(const Job& job, const ImageInProgress& image, const RenderReport& report_so_far,
                     const Finishing* denoising, const Workers& workers) {
    const float scale = job.film.scale;
    const WorkingSpace& colours = job.film.colours;
    RenderResult result{image.film().develop(scale, colours, workers), report_so_far};
    RenderReport& report = result.report;
    report.samples_not_finite = image.bad_samples().count;
    report.rays_invalid = image.invalid_rays();
    report.rays_total = image.rays();
    // An infinite error is not reported.
    Film::ErrorEstimate error = image.film().error(workers);
    if (std::isfinite(error.relative) && (error.is_known || report.ended_by == "error"))
        report.relative_error = error.relative;
    report.pixels_apart = std::move(error.apart);
    result.image.attributes["lucerna.unit"] = report.unit;
    if (job.film.crop_end != V2i(0, 0)) {
        result.image.corner = job.film.crop_begin;
        result.image.picture = {job.film.width, job.film.height};
    }
    const int spacing = report.samples_done > 0 ? 1 : image.film().spacing(workers);
    const Image& features = image.features().image;
    if (!denoising) {
        fill(image.film(), spacing, features, workers, result);
        return result;
    }
    if (job.film.parts) {
        result.parts = image.layer_films()->develop(scale, colours, workers);
        if (job.receivers.empty()) add_channels(*result.parts, image.features().more, "");
    }
    if (image.layer_films()) result.chance = image.layer_films()->develop_chance(scale, colours, workers);
    if (image.film().has_two_halves() && job.receivers.empty()) {
        result.denoiser_input = image.denoiser_input();
        // Without features, the denoiser compares light alone.
        if (features.data.empty())
            result.denoiser_input->features =
                Image(result.image.width, result.image.height, feature_channels());
    }
    // The filters need pixels beyond the edges of a crop, which `lucerna merge` has.
    const bool denoises = result.denoiser_input && denoising->denoises && !job.film.is_part();
    const int apart = std::max(spacing, denoising->spacing);
    if (denoises && apart > 1)
        add_denoised(error, denoise_lattice(*result.denoiser_input, apart, workers), result);
    fill(image.film(), spacing, features, workers, result);
    // Halves that have been filtered on a lattice alone, and are not stored, stay as they are.
    if (result.denoiser_input && (!denoises || apart == 1 || job.film.parts))
        complete_halves(result.denoiser_input->halves, spacing, features, workers);
    if (denoises && apart == 1) add_denoised(error, denoise(*result.denoiser_input, workers), result);
    return result;
}

void warn_of_losses(const ImageInProgress& image, const RenderReport& report, Monitor& monitor) {
    if (const BadSamples& bad = image.bad_samples(); bad.count > 0) {
        monitor.warn(
            fmt::format("{} samples were not finite and were left out; the first: {}", bad.count, bad.first));
    }
    if (image.invalid_rays() > 0)
        monitor.warn(fmt::format("{} rays were not finite and were ignored", image.invalid_rays()));
    if (report.samples_done > 0 || !report.complete) return;
    if (const int spacing = image.film().spacing(); spacing > 1) {
        monitor.warn(
            fmt::format("there was not enough time for one sample per pixel: the image is rendered at {} of "
                        "its resolution and upsampled",
                        spacing == 2 ? "half" : "a quarter"));
    }
}

Outputs::Outputs(const Job& job, const RenderOptions& options, const RenderClock& clock,
                 ImageInProgress& image, const RenderReport& report, const Finishing& finishing,
                 bool in_passes)
    : job_(job),
      options_(options),
      clock_(clock),
      image_(image),
      report_(report),
      finishing_(finishing),
      in_passes_(in_passes),
      show_timer_(interval(bool(options.show), options.show_every)),
      watch_timer_(interval(bool(options.watch), options.watch_every), true),
      checkpoint_timer_(interval(bool(options.keep), options.keep_every)) {}

bool Outputs::is_pause_due() const {
    const double now = clock_.seconds();
    return watch_timer_.is_due(now) || (can_keep_ && checkpoint_timer_.is_due(now));
}

void Outputs::pause(bool after_round) {
    struct Due {
        bool show, keep, watch;
    };
    const double now = clock_.seconds();
    const Due due = agreed(options_.workers, Due{after_round && show_timer_.is_due(now),
                                                 checkpoint_timer_.is_due(now), watch_timer_.is_due(now)});
    if (due.show) present(options_.show, show_timer_, true);
    if (due.keep) keep();
    // Displays get the image as measured: denoising takes longer than they wait.
    if (due.watch) present(options_.watch, watch_timer_, false);
}

void Outputs::present(const std::function<void(const RenderResult&)>& to, Recurring& when, bool denoised) {
    const double begin = clock_.seconds();
    image_.gather();
    if (leads()) to(develop(job_, image_, report_, denoised ? &finishing_ : nullptr, options_.workers));
    when.done(begin, clock_.seconds());
}

void Outputs::keep() {
    if (!options_.keep || !can_keep_) return;
    const double begin = clock_.seconds();
    image_.gather();
    if (!leads()) return;
    Checkpoint checkpoint;
    checkpoint.seconds = clock_.elapsed();
    checkpoint.samples_done = report_.samples_done;
    checkpoint.passes_done = report_.passes_done;
    image_.save(checkpoint);
    if (in_passes_) {
        checkpoint.numbers = report_.numbers();
        checkpoint.notes = report_.notes();
    }
    options_.keep(std::move(checkpoint));
    checkpoint_timer_.done(begin, clock_.seconds());
}

void Outputs::keep_the_last() {
    keep();
    can_keep_ = false;
}

}  // namespace lucerna
