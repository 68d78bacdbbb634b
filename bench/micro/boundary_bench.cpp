// Measures the cost of the boundary correction in estimates per second on one core, on scenes/cornell.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "engine/base/warp.h"
#include "engine/pbrt/read_scene.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

void estimates(benchmark::State& state, Boundary boundary) {
    Monitor silent;
    const Job job = read_scene(std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes/cornell/cornell.pbrt", {},
                               Workers{}, silent);
    MapParameters parameters;
    parameters.paths = 500'000;
    parameters.wanted[static_cast<std::size_t>(MapKind::global)] = true;
    parameters.seed = 1;
    const PhotonMaps maps = build_photon_maps(job.scene, parameters, Workers{}, silent);
    DensityEstimateSettings settings;
    settings.k = static_cast<int>(state.range(0));
    settings.radius = 50;
    settings.boundary = boundary;
    Sampler sampler(1, Purpose::bench, 0, 0);
    const DensityEstimate density(*maps.find(MapKind::global), settings,
                                  Probing{job.scene, sampler.split(1)});
    std::vector<SurfacePoint> places;
    const Box3f box = job.scene.bounds();
    for (int i = 0; i < 1 << 12; ++i) {
        const V3f u(sampler.next(), sampler.next(), sampler.next());
        const V3f d = square_to_sphere(sampler.next2());
        const auto hit = job.scene.intersect({box.min + (V3f(0.05F) + 0.9F * u) * box.size(), d});
        if (!hit) continue;
        places.push_back(hit->at);
        if (places.back().n.dot(d) > 0) places.back().n = -places.back().n;
    }
    std::size_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(density.irradiance(places[i++ % places.size()]));
    state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(estimates, none, Boundary::none)->Arg(50)->Arg(100);
BENCHMARK_CAPTURE(estimates, probes, Boundary::probes)->Arg(50)->Arg(100);

}  // namespace
