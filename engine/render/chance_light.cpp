#include "engine/render/chance_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "engine/base/deadline_monitor.h"
#include "engine/base/elementary.h"
#include "engine/base/stats.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/quantity.h"
#include "engine/text/units.h"
#include "kdtree/box_tree.h"
#include "photon/density_estimate.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

constexpr std::int64_t kPaths = 1 << 17;
constexpr std::int64_t kPathsPerChunk = 2048;  // 64 chunks give the standard error

LightPathRequest light_paths(const ChanceLightWork& work) {
    LightPathRequest paths;
    paths.count = kPaths;
    paths.per_chunk = kPathsPerChunk;
    paths.seed = work.seed;
    paths.purpose = Purpose::importance;
    paths.pass = 1;
    paths.use = PathUse::began_specular;
    paths.longest = work.longest - 1;  // one more follows at the receiver or surface
    paths.phase = "cross-check by light paths";
    return paths;
}

// Keeps the hits of a chunk of paths on surfaces that store photons.
struct HitVisitor : LightPathVisitor {
    Photons photons;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, photons);
    }
    void hit(const LightPathHit& at) {
        if (!at.path.began_specular || !stores_photons(at.bsdf)) return;
        photons.add_hit(at.hit.at, at.d, at.power / static_cast<float>(kPaths), at.start.light, at.start.cell,
                        at.path.bounces(), at.path.strayed);
    }
};

const auto kNoMemoryTest = [](const auto&, std::int64_t, std::int64_t) {};

}  // namespace

double missing_light(const ChanceLight& by_light_paths, const ChanceLight& met, double standard_errors) {
    const double missing = by_light_paths.value - met.value;
    const double error = hypot(by_light_paths.standard_error, met.standard_error);
    return missing > standard_errors * error ? missing : 0.0;
}

bool has_chance_light(const Scene& scene) {
    return scene.has_specular() && !scene.lights().empty();
}

ChanceLight chance_light_in_view(const Job& job, const ChanceLightWork& work) {
    constexpr std::size_t kLeastPhotons = 64;
    std::vector<HitVisitor> chunks;
    trace_light_paths(
        {work.scene, work.workers, work.monitor}, light_paths(work), chunks,
        [](std::int64_t) { return HitVisitor(); }, kNoMemoryTest);
    if (work.monitor.stopped()) return {};
    Photons all;
    for (const HitVisitor& chunk : chunks) all.append(chunk.photons);
    const std::size_t photons = all.size();
    if (photons < kLeastPhotons) return {};
    const PhotonMap map(all);
    DensityEstimateSettings how;
    how.k = static_cast<int>(kLeastPhotons);
    how.radius = largest_radius(diagonal(work.scene));
    const DensityEstimate estimate(map, how);
    const bool meter = quantity_of(job.integrator) == Quantity::illuminance;
    constexpr std::int64_t kRays = 8192, kRaysPerChunk = 256;
    const auto look = [&](Ray ray, std::uint32_t, Sampler& sampler, std::vector<double>& found) {
        Rgb throughput(1);
        double seen = 0;
        for (int bounce = 0; bounce < kRouletteFromSpecular; ++bounce) {
            const auto hit = work.scene.intersect(ray);
            if (!hit) break;
            const Bsdf bsdf = meter ? white_receiver(*hit) : work.scene.bsdf(*hit);
            if (stores_photons(bsdf)) {
                const Rgb radiance = estimate.radiance(*hit, bsdf.diffuse_part(), -ray.d).value;
                seen = double{luminance(throughput * (meter ? meter_reading(radiance) : radiance))};
                break;
            }
            const auto sample = bsdf.sample(-ray.d, {sampler.next(), sampler.next2()}, Transport::radiance);
            if (!sample || !sample->delta) break;
            throughput *= sample->weight;
            ray = Ray{hit->at.towards(sample->wi), sample->wi};
        }
        found.push_back(seen);
    };
    RunningStats rays;
    for (const auto& chunk : trace_view_rays<std::vector<double>>(
             view_of(job), {kRays, kRaysPerChunk, work.seed}, work.workers, look)) {
        for (const double value : chunk) rays.add(value);
    }
    // The number of photons is uncertain, too, and each is seen by many rays.
    const double of_photons = 2 * rays.mean() / std::sqrt(static_cast<double>(photons));
    return {rays.mean(), hypot(rays.standard_error(), of_photons)};
}

ChanceLight mean_of(const Image& image) {
    const std::size_t channels = image.channels.size();
    std::vector<double> values;
    for (std::size_t at = 0; at + 2 < image.data.size(); at += channels) {
        const float* rgb = &image.data[at];
        values.push_back(std::max(0.0, double{luminance(Rgb(rgb[0], rgb[1], rgb[2]))}));
    }
    const double limit = limit_of_most(values);
    RunningStats of_most;
    for (const double value : values) {
        if (value <= limit) of_most.add(value);
    }
    return {of_most.mean(), of_most.standard_error()};
}

MissingInImage missing_in(const Job& job, const RenderResult& result, const ChanceLight& there) {
    constexpr double kStandardErrors = 3, kLeastShare = 0.01;
    MissingInImage missing;
    if (!result.chance) return missing;
    missing.mean = mean_of(result.image).value;
    const double scale = double{job.film.scale};
    missing.missing = missing_light({scale * there.value, scale * there.standard_error},
                                    mean_of(*result.chance), kStandardErrors);
    if (!(missing.missing > kLeastShare * missing.mean)) missing.missing = 0;
    return missing;
}

void record_chance_light(Job& job) {
    job.film.chance = std::holds_alternative<PathSettings>(job.integrator) && !job.film.is_part() &&
                      has_chance_light(job.scene);
}

std::optional<ChanceLight> light_that_paths_hardly_find(Job& job, const RenderOptions& options,
                                                        Monitor& monitor) {
    constexpr double kMostShare = 0.05;
    record_chance_light(job);
    if (!job.film.chance) return std::nullopt;
    const bool can_be_cut = !options.workers.ranks;
    DeadlineMonitor cut(monitor,
                        can_be_cut ? Deadline::after(kMostShare * options.limits.seconds) : Deadline());
    const int longest = most_bounces(std::get<PathSettings>(job.integrator).max_depth);
    const ChanceLight found =
        chance_light_in_view(job, {job.scene, options.seed, longest, options.workers, cut});
    if (cut.stopped() && !monitor.stopped()) return std::nullopt;
    return found;
}

void warn_of_missing_light(const Job& job, const ChanceLight& there, RenderResult& result, Monitor& monitor) {
    const MissingInImage missing = missing_in(job, result, there);
    if (!(missing.missing > 0)) return;
    monitor.warn(fmt::format(
        "about {} of the image's light is missing, by a cross-check with light paths: it comes over mirrors, "
        "lenses or solid glass from lamps that are too small for path tracing to meet; the image's error is "
        "not known; use photonmap, progressive or igi",
        percent_text(missing.share())));
    result.report.relative_error.reset();
    result.report.denoised_error.reset();
}

}  // namespace lucerna
