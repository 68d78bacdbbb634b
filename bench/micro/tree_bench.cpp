// Compares our photon tree with FLANN's on the searches that the engine makes: at the hits of camera rays in
// the Cornell box, and at those of gather rays from there, among the photons of its Global map.
//
// Both answer the same searches in turn within one measurement, so that disturbances by other programs affect
// both; every answer is compared. The arguments are photons and k.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <map>
#include <numeric>
#include <random>

#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "photon/build_maps.h"
#include "photon/photon_map.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

struct Place {
    V3f x, n;
};

// Returns places of which half are hits of camera rays and half are hits of gather rays from there.
std::vector<Place> places_of(const Job& job, std::size_t count) {
    Sampler sampler(1, Purpose::bench, 0, 0);
    std::vector<Place> places;
    const auto add_hit = [&](const Ray& ray) -> std::optional<Hit> {
        auto hit = job.scene.intersect(ray);
        if (!hit) return std::nullopt;
        places.push_back({hit->at.p, hit->at.n.dot(ray.d) > 0 ? -hit->at.n : hit->at.n});
        return hit;
    };
    while (places.size() < count) {
        const V2f pixel = sampler.next2();
        const V2f film(pixel.x * static_cast<float>(job.film.width),
                       pixel.y * static_cast<float>(job.film.height));
        const auto hit = add_hit(job.camera.ray(film, sampler.next2()));
        if (!hit) continue;
        const Frame frame(places.back().n);
        const V3f d = frame.to_world(square_to_cosine_hemisphere(sampler.next2()));
        add_hit(Ray{hit->at.towards(d), d});
    }
    places.resize(count);
    return places;
}

struct Setting {
    Job job;
    Photons deposited;  // unordered
    float radius;       // largest search radius, the renderer's default
    std::vector<Place> places;
};

Photons shuffled(const PhotonMap& map, std::size_t count) {
    std::vector<std::uint32_t> order(map.size());
    std::iota(order.begin(), order.end(), 0U);
    std::shuffle(order.begin(), order.end(), std::mt19937(1));
    Photons deposited;
    deposited.reserve(count);
    for (const std::uint32_t i : std::span(order).first(std::min(count, order.size()))) {
        deposited.add(map.positions()[i], map.normals()[i], map.photons()[i]);
    }
    return deposited;
}

const Setting& setting_of(std::size_t photons) {
    static std::map<std::size_t, Setting> made;  // a benchmark's arguments recur many times
    const auto found = made.find(photons);
    if (found != made.end()) return found->second;
    made.clear();  // one at a time, because the largest takes gigabytes
    Monitor silent;
    Job job = read_scene(std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes/cornell/cornell.pbrt", {},
                         Workers{}, silent);
    MapParameters parameters;
    parameters.paths = 1;  // the target determines the number
    parameters.wanted[static_cast<std::size_t>(MapKind::global)] = true;
    parameters.targets[static_cast<std::size_t>(MapKind::global)] = static_cast<std::int64_t>(photons);
    const PhotonMaps maps = build_photon_maps(job.scene, parameters, Workers{}, silent);
    Photons deposited = shuffled(*maps.find(MapKind::global), photons);
    const float radius = 0.05F * job.scene.bounds().size().length();
    std::vector<Place> places = places_of(job, 1 << 14);
    return made.emplace(photons, Setting{std::move(job), std::move(deposited), radius, std::move(places)})
        .first->second;
}

// Runs one search and folds its result into a number that any other photon or order would change.
std::uint64_t search(const PhotonMap& map, const Place& at, std::size_t k, float radius, MetricKind metric) {
    const NearPhotons near(map, at.x, TangentMetric(at.x, at.n, metric, 2), k, radius * radius);
    std::uint64_t sum = near.found().size();
    for (const Neighbour& n : near.found()) sum = sum * 0x9e3779b97f4a7c15U + n.rank();
    return sum;
}

void report(benchmark::State& state, double tree, double flann, const char* unit) {
    state.counters[std::string("tree_") + unit] = tree;
    state.counters[std::string("flann_") + unit] = flann;
    state.counters["flann/tree"] = flann / tree;
}

void searches(benchmark::State& state, MetricKind metric) {
    const Setting& setting = setting_of(static_cast<std::size_t>(state.range(0)));
    const auto k = static_cast<std::size_t>(state.range(1));
    const PhotonMap tree(setting.deposited, IndexKind::tree);
    const PhotonMap flann(setting.deposited, IndexKind::flann);
    double seconds_tree = 0;
    double seconds_flann = 0;
    std::size_t count = 0;
    constexpr std::size_t kTurn = 256;
    const auto turn = [&](const PhotonMap& map, double& seconds) {
        const std::clock_t begin = std::clock();  // processor time: others may use the machine
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < kTurn; ++i) {
            sum +=
                search(map, setting.places[(count + i) % setting.places.size()], k, setting.radius, metric);
        }
        seconds += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
        return sum;
    };
    for (auto _ : state) {
        const bool tree_first = count / kTurn % 2 == 0;
        const std::uint64_t a = tree_first ? turn(tree, seconds_tree) : turn(flann, seconds_flann);
        const std::uint64_t b = tree_first ? turn(flann, seconds_flann) : turn(tree, seconds_tree);
        if (a != b) {
            state.SkipWithError("the two indices found different photons");
            break;
        }
        count += kTurn;
    }
    const double scale = 1e6 / static_cast<double>(count);
    report(state, seconds_tree * scale, seconds_flann * scale, "us");
}

// Measures the work of all threads together. Our time includes ordering everything that a map holds; FLANN's
// is only that of its tree.
void builds(benchmark::State& state) {
    const Setting& setting = setting_of(static_cast<std::size_t>(state.range(0)));
    const Workers workers{static_cast<int>(state.range(1))};
    double seconds_tree = 0;
    double seconds_flann = 0;
    for (auto _ : state) {
        const std::clock_t begin = std::clock();
        { const PhotonMap map(setting.deposited, IndexKind::tree, workers); }
        const std::clock_t between = std::clock();
        benchmark::DoNotOptimize(make_flann_tree(setting.deposited.positions));
        seconds_tree += static_cast<double>(between - begin) / CLOCKS_PER_SEC;
        seconds_flann += static_cast<double>(std::clock() - between) / CLOCKS_PER_SEC;
    }
    const double scale = 1e3 / static_cast<double>(state.iterations());
    report(state, seconds_tree * scale, seconds_flann * scale, "ms");
}

void all_searches(benchmark::internal::Benchmark* b) {
    for (const int photons : {100'000, 1'000'000, 10'000'000}) {
        for (const int k : {20, 50, 100, 500}) b->Args({photons, k});
    }
}
void all_builds(benchmark::internal::Benchmark* b) {
    for (const int photons : {100'000, 1'000'000, 10'000'000}) {
        for (const int threads : {1, 2}) b->Args({photons, threads});
    }
}

BENCHMARK_CAPTURE(searches, projected, MetricKind::projected)
    ->Name("tree/k_nearest")
    ->Apply(all_searches)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(searches, euclidean, MetricKind::euclidean)
    ->Name("tree/k_nearest_euclidean")
    ->Args({1'000'000, 50})
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(builds)->Name("tree/build")->Apply(all_builds)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
