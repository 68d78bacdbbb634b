#include <fmt/format.h>

#include "engine/integrators/integrator.h"
#include "engine/ranks/ranks.h"
#include "engine/render/film.h"
#include "engine/render/job.h"
#include "engine/render/layer_films.h"
#include "engine/render/render.h"
#include "engine/render/render_checks.h"
#include "engine/system/memory.h"

namespace lucerna {

std::uint64_t image_memory(const Job& job, const RenderOptions& options) {
    constexpr std::uint64_t kImage = 6 * sizeof(float);  // R G B and their variances
    const V2i size = job.film.rendered_size();
    const std::uint64_t pixels = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
    const Film::Kind kind{1, make_integrator(job.integrator)->samples_per_pass() > 1, job.film.two_halves,
                          job.film.adaptive, job.film.two_halves};
    const std::uint64_t sums =
        Film::bytes_per_pixel(kind) +
        LayerFilms::bytes_per_pixel(kind, job.scene.light_groups(), {job.film.parts, job.film.chance});
    const std::uint64_t kept = (options.keep ? sums : 0) + (options.resume ? sums : 0);
    const std::uint64_t denoiser = job.film.two_halves ? kDenoiserBytesPerPixel : 0;
    return pixels * (sums + kImage + kept + denoiser);
}

void require_fitting_method(const Job& job, const RenderOptions& options) {
    if (options.maps.any() && !std::holds_alternative<PhotonMapSettings>(job.integrator)) {
        throw InputError(fmt::format("only photonmap can save and load its maps; the integrator is {}",
                                     integrator_name(job.integrator)));
    }
    if (!job.receivers.empty() && !make_integrator(job.integrator)->takes_receivers()) {
        throw InputError(fmt::format("{} cannot compute the illuminance at points in space; use path",
                                     integrator_name(job.integrator)));
    }
}

void require_image_memory(const Job& job, const RenderOptions& options) {
    const V2i size = job.film.rendered_size();
    const std::uint64_t ranks = options.workers.ranks ? options.workers.ranks->on_this_host() : 1;
    require_memory(
        ranks * image_memory(job, options), fmt::format("an image of {} x {} pixels", size.x, size.y),
        "use fewer pixels, or render a part of the image at a time (Film \"pixelbounds\" or \"cropwindow\")");
}

namespace {

// Names the light of a lamp known only by its particles that a method leaves out; empty: none.
struct LeftOut {
    std::string_view operator()(const PathSettings&) const { return "light is"; }
    std::string_view operator()(const DirectSettings&) const { return "light is"; }
    std::string_view operator()(const IgiSettings&) const { return "direct light is"; }
    std::string_view operator()(const PhotonMapSettings& s) const {
        return s.direct == DirectMethod::map ? "" : "direct light is";
    }
    std::string_view operator()(const ProgressiveSettings& s) const {
        return s.direct == DirectMethod::map ? "" : "direct light is";
    }
};

}  // namespace

void warn_of_unseen_lights(const Scene& scene, const IntegratorSettings& method, Monitor& monitor) {
    const std::string_view missing = std::visit(LeftOut{}, method);
    if (missing.empty()) return;
    std::uint64_t unseen = 0;
    std::string_view kind;
    for (const auto& light : scene.lights()) {
        if (!light->only_particles() || !(light->power() > 0)) continue;
        if (unseen++ == 0) kind = light->kind();
    }
    if (unseen == 0) return;
    monitor.warn(
        fmt::format("{} of type \"{}\" can only be found by particles, so the {} missing from this picture; "
                    "use photonmap with \"string direct\" \"map\", or convert it with lucerna light import",
                    unseen == 1 ? "a light" : fmt::format("{} lights", unseen), kind, missing));
}

void warn_of_glowing_media(const Scene& scene, const IntegratorSettings& method, Monitor& monitor) {
    if (std::holds_alternative<PathSettings>(method)) return;
    if (const Medium* medium = emitting_medium(scene.media())) {
        monitor.warn(fmt::format(
            "medium \"{}\" emits light, which is missing from this picture; use path to include it",
            medium->name));
    }
}

}  // namespace lucerna
