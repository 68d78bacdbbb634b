// Measures the engine's rates on one core (rays, photon paths, density estimates) and a whole image.
//
// All figures are for the Cornell box of scenes/cornell. Items per second are per core: each benchmark but
// the last uses one thread.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "engine/base/warp.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

Job cornell() {
    Monitor silent;
    return read_scene(std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes/cornell/cornell.pbrt", {},
                      Workers{}, silent);
}

// Returns rays like those of a path tracer: from random points of the box in random directions.
std::vector<Ray> random_rays(const Scene& scene, std::size_t n) {
    Sampler sampler(1, Purpose::bench, 0, 0);
    const Box3f box = scene.bounds();
    std::vector<Ray> rays(n);
    for (Ray& ray : rays) {
        const V3f u(sampler.next(), sampler.next(), sampler.next());
        ray = {box.min + (V3f(0.05F) + 0.9F * u) * box.size(), square_to_sphere(sampler.next2())};
    }
    return rays;
}

void nearest_hits(benchmark::State& state) {
    const Job job = cornell();
    const auto rays = random_rays(job.scene, 1 << 14);
    std::size_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(job.scene.intersect(rays[i++ % rays.size()]));
    state.SetItemsProcessed(state.iterations());
}
BENCHMARK(nearest_hits)->Name("rays/nearest_hit");

void shadow_rays(benchmark::State& state) {
    const Job job = cornell();
    const auto rays = random_rays(job.scene, 1 << 14);
    const float length = job.scene.bounds().size().length() / 4;
    std::size_t i = 0;
    for (auto _ : state) {
        const Ray& ray = rays[i++ % rays.size()];
        benchmark::DoNotOptimize(job.scene.unoccluded(SurfacePoint{ray.o}, ray.d, length));
    }
    state.SetItemsProcessed(state.iterations());
}
BENCHMARK(shadow_rays)->Name("rays/shadow");

void photon_paths(benchmark::State& state) {
    const Job job = cornell();
    Monitor silent;
    constexpr std::int64_t kPaths = 100'000;
    std::uint64_t deposits = 0;
    for (auto _ : state) {
        const PhotonMaps maps =
            build_photon_maps(job.scene, {kPaths, {true, true, true}, 1, 0}, Workers{1}, silent);
        for (const DepositCount& count : maps.counts) deposits += count.stored;
        benchmark::DoNotOptimize(maps.ledger.hits);
    }
    state.SetItemsProcessed(state.iterations() * kPaths);
    state.counters["deposits/s"] =
        benchmark::Counter(static_cast<double>(deposits), benchmark::Counter::kIsRate);
}
BENCHMARK(photon_paths)->Name("photons/paths_and_index")->Unit(benchmark::kMillisecond);

void density_estimates(benchmark::State& state) {
    const Job job = cornell();
    Monitor silent;
    const PhotonMaps maps =
        build_photon_maps(job.scene, {500'000, {false, true, false}, 1, 0}, Workers{}, silent);
    const DensityEstimateSettings settings{static_cast<int>(state.range(0)), 50, 2, KernelShape::epanechnikov,
                                           MetricKind::projected};
    const DensityEstimate density(*maps.find(MapKind::global), settings);
    std::vector<std::pair<Hit, V3f>> places;
    for (const Ray& ray : random_rays(job.scene, 1 << 12)) {
        if (const auto hit = job.scene.intersect(ray)) places.emplace_back(*hit, -ray.d);
    }
    std::size_t i = 0;
    for (auto _ : state) {
        const auto& [hit, wo] = places[i++ % places.size()];
        benchmark::DoNotOptimize(density.radiance(hit, job.scene.bsdf(hit), wo));
    }
    state.SetItemsProcessed(state.iterations());
}
BENCHMARK(density_estimates)->Name("density_estimates/k")->Arg(20)->Arg(50)->Arg(100)->Arg(500);

void whole_image(benchmark::State& state, const char* integrator) {
    Job job = cornell();
    job.integrator = make_settings(integrator, {});
    job.spp = 4;
    Monitor silent;
    double rays = 0;
    for (auto _ : state) {
        const RenderResult result = render(job, {1, Workers{}}, silent);
        benchmark::DoNotOptimize(result.image.data.data());
    }
    rays = static_cast<double>(job.scene.rays());
    state.counters["rays/s"] = benchmark::Counter(rays, benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(whole_image, path, "path")->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK_CAPTURE(whole_image, direct, "direct")->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK_CAPTURE(whole_image, photonmap, "photonmap")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(whole_image, igi, "igi")->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

}  // namespace
