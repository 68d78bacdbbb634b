#include "engine/cli/render/render_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/denoise/denoise.h"
#include "engine/integrators/integrator.h"

namespace lucerna {
namespace {

// Sets the samples of the requested passes. Without passes and samples, a limit alone ends the render.
void limit_samples(const RenderRequest& request, const Limits& limits, Job& job) {
    if (request.passes > 0) {
        const int samples = make_integrator(job.integrator)->samples_per_pass();
        if (samples == 0) {
            throw InputError({"--passes"}, fmt::format("{} does not work in passes; use --spp",
                                                       integrator_name(job.integrator)));
        }
        job.spp =
            static_cast<int>(std::min<std::int64_t>(std::int64_t{request.passes} * samples, kNoEndOfSamples));
    } else if (request.spp == 0) {
        if (has_limit(limits)) job.spp = kNoEndOfSamples;
    }
}

// Replaces the scene's own crop.
void crop(const PixelBox& to, FilmSettings& film) {
    if (to.end.x > film.width || to.end.y > film.height) {
        throw InputError({"--crop"}, fmt::format("pixels up to ({}, {}) are outside a picture of {} x {}",
                                                 to.end.x, to.end.y, film.width, film.height));
    }
    film.crop_begin = to.begin, film.crop_end = to.end;
}

}  // namespace

bool has_limit(const Limits& limits) {
    return std::isfinite(limits.seconds) || limits.error > 0;
}

void apply(const RenderRequest& request, const Limits& limits, Job& job) {
    limit_samples(request, limits, job);
    if (request.crop) crop(*request.crop, job.film);
    job.film.two_halves = request.denoise || request.layers;
    job.film.adaptive = job.film.two_halves && request.adaptive;
    job.film.parts = request.layers;
}

void complete_image(const RunFacts& facts, const Job& job, const FileLayers& layers, const Workers& workers,
                    RenderResult& result) {
    Image& image = result.image;
    image.attributes.merge(header_attributes(facts, job, result.report));
    if (result.denoised) add_channels(image, *result.denoised, "denoised.");
    if (layers.halves && result.denoiser_input) add_denoiser_input(image, *result.denoiser_input);
    if (layers.parts && result.parts) add_channels(image, *result.parts, "");
    // A part is denoised when it is merged, as the filters need pixels of other parts.
    if (result.denoised) add_denoised_groups(image, layers.chosen, facts.scene.string(), workers);
    keep_layers(image, layers.chosen);
}

}  // namespace lucerna
