#include "engine/render/image_memory.h"

#include <fmt/format.h>

#include "engine/base/memory.h"
#include "engine/integrators/integrator.h"
#include "engine/render/film.h"
#include "engine/render/job.h"
#include "engine/render/render.h"

namespace lucerna {

std::uint64_t image_memory(const Job& job, const RenderOptions& options) {
    constexpr std::uint64_t kImage = 6 * sizeof(float);  // R G B and their variances
    const V2i size = job.film.rendered_size();
    const std::uint64_t pixels = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
    const std::uint64_t sums = Film::bytes_per_pixel(make_integrator(job.integrator)->samples_per_pass() > 1);
    const std::uint64_t kept = (options.keep ? sums : 0) + (options.resume ? sums : 0);
    return pixels * (sums + kImage + kept);
}

void require_image_memory(const Job& job, const RenderOptions& options) {
    const V2i size = job.film.rendered_size();
    require_memory(image_memory(job, options), fmt::format("an image of {} x {} pixels", size.x, size.y),
                   "fewer pixels are accepted, or a part of the image at a time (Film \"pixelbounds\" or "
                   "\"cropwindow\")");
}

}  // namespace lucerna
