// Measures how the cost of indirect light at a place grows with the number of VPLs, evaluated one by one or
// drawn from a tree, for bench/figures/igi_scaling.sh.
//
// PLACES places that the camera sees are lit, on one thread, by one set of VPLs of increasing size; the
// reference comes from a separate set of 2^22 light paths. Writes for each size and method
//
//   choice lights seconds noise error make_seconds bytes
//
// with the processor seconds of indirect light at one place; the relative variance of one such estimate as
// noise; its relative squared error against the reference as error, both averaged over places and, for small
// sets, over several sets; and as make_seconds the time to trace the paths and sort the lights, on all
// threads.
//
// usage: figure_igi_scaling SCENE.pbrt PLACES [TREESAMPLES]
#include <fmt/core.h>

#include <cstdlib>
#include <ctime>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/stats.h"
#include "engine/pbrt/read_scene.h"
#include "engine/text/units.h"
#include "engine/vpl/igi_vpls.h"
#include "engine/vpl/vpl_shading.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Place {
    Hit hit;
    Bsdf bsdf;
    V3f wo;
    Vertex vertex() const { return {hit, bsdf, wo}; }
};

std::vector<Place> places_seen(const Job& job, std::size_t count) {
    std::vector<Place> places;
    for (std::uint32_t i = 0; places.size() < count && i < 100 * count; ++i) {
        Sampler sampler = Sampler::stratified(1, Purpose::bench, 0, i);
        const V2f u = sampler.next2();
        const auto& film = job.camera.settings();
        const Ray ray = job.camera.ray(
            {u.x * static_cast<float>(film.width), u.y * static_cast<float>(film.height)}, {0.5F, 0.5F});
        const auto hit = job.scene.intersect(ray);
        if (!hit) continue;
        const Bsdf bsdf = job.scene.bsdf(*hit);
        if (!bsdf.is_delta() && !bsdf.is_black()) places.push_back({*hit, bsdf, -ray.d});
    }
    return places;
}

// A set of VPLs, ready for evaluation.
class Lit {
  public:
    Lit(const Scene& scene, IgiSettings settings, std::uint32_t paths, std::uint32_t pass,
        const Workers& workers)
        : lights_(make(scene, with_distance(scene, settings), paths, pass, workers)),
          shading_(scene, with_distance(scene, settings), paths) {}

    double luminance_at(const Place& place, std::uint32_t sample) const {
        Sampler sampler = Sampler::stratified(2, Purpose::bench, 1, sample);
        const float u = sampler.next();
        Rgb sum(0);
        const Vertex vertex = place.vertex();
        lights_.choose(vertex, 0, u, sampler, [&](const Vpl& light, float scale) {
            sum += scale * shading_.shade(vertex, light, Rgb(1), sampler);
        });
        return static_cast<double>(luminance(sum));
    }
    double make_seconds() const { return make_seconds_; }
    std::size_t count() const { return count_; }
    std::size_t bytes() const { return lights_.bytes(); }

  private:
    IgiVpls make(const Scene& scene, const IgiSettings& settings, std::uint32_t paths, std::uint32_t pass,
                 const Workers& workers) {
        Monitor silent;
        const Stopwatch watch;
        const VplSets sets = build_vpls(scene, {1, paths, 1, pass}, workers, silent);
        count_ = sets.lights.size();
        IgiVpls lights(sets, paths, settings, workers);
        make_seconds_ = watch.seconds();
        return lights;
    }

    double make_seconds_ = 0;  // set while lights_ is constructed
    std::size_t count_ = 0;
    IgiVpls lights_;
    VplShading shading_;
};

std::vector<double> reference_at(const Scene& scene, const std::vector<Place>& places,
                                 const Workers& workers) {
    IgiSettings settings;
    settings.choice = VplChoice::tree;
    settings.tree_samples = 64;
    settings.shadow_rays = 16;
    const Lit lit(scene, settings, 1U << 22, 1000, workers);
    std::vector<double> means(places.size());
    parallel_chunks(workers, static_cast<std::int64_t>(places.size()), [&](std::int64_t chunk) {
        const auto i = static_cast<std::size_t>(chunk);
        RunningStats stats;
        for (std::uint32_t k = 0; k < 512; ++k) stats.add(lit.luminance_at(places[i], k));
        means[i] = stats.mean();
    });
    return means;
}

void measure(const Scene& scene, const std::vector<Place>& places, const std::vector<double>& reference,
             VplChoice choice, std::uint32_t paths, IgiSettings settings, const Workers& workers) {
    settings.choice = choice;
    // Errors at very dark places must not dominate the mean.
    RunningStats all;
    for (const double value : reference) all.add(value);
    const double floor2 = sqr(0.05 * all.mean());

    const std::uint32_t sets = paths < 4096 ? 16 : 1;
    double seconds = 0, evaluations = 0, make = 0;
    std::size_t lights = 0, bytes = 0;
    RunningStats noise, error;
    for (std::uint32_t set = 0; set < sets; ++set) {
        const Lit lit(scene, settings, paths, set, workers);
        make += lit.make_seconds();
        lights += lit.count();
        bytes += lit.bytes();
        const double looked_at = static_cast<double>(places.size()) * static_cast<double>(lit.count());
        const bool loop = choice == VplChoice::loop;
        const auto times = static_cast<std::uint32_t>(loop ? std::clamp(2e9 / looked_at, 4.0, 32.0) : 32.0);
        const double begin = processor_seconds();
        for (std::size_t i = 0; i < places.size(); ++i) {
            RunningStats stats;
            const double scale = 1 / (sqr(reference[i]) + floor2);
            for (std::uint32_t k = 0; k < times; ++k) {
                const double value = lit.luminance_at(places[i], k);
                stats.add(value);
                error.add(sqr(value - reference[i]) * scale);
            }
            noise.add(stats.variance() * scale);
        }
        seconds += processor_seconds() - begin;
        evaluations += static_cast<double>(places.size()) * times;
    }
    fmt::print("{} {:.1f} {:.4g} {:.4g} {:.4g} {:.4g} {}\n", choice == VplChoice::loop ? "loop" : "tree",
               static_cast<double>(lights) / sets, seconds / evaluations, noise.mean(), error.mean(),
               make / sets, bytes / sets);
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3 && argc != 4) {
        fmt::print(stderr, "usage: figure_igi_scaling SCENE.pbrt PLACES [TREESAMPLES]\n");
        return 2;
    }
    try {
        const Workers workers;
        Monitor silent;
        const Job job = read_scene(argv[1], {}, workers, silent);
        const std::vector<Place> places =
            places_seen(job, static_cast<std::size_t>(std::max(1L, std::strtol(argv[2], nullptr, 10))));
        const std::vector<double> reference = reference_at(job.scene, places, workers);
        IgiSettings settings;
        if (argc == 4) settings.tree_samples = std::clamp(std::atoi(argv[3]), 1, 256);
        for (std::uint32_t paths = 16; paths <= 1U << 21; paths *= paths < 1U << 20 ? 4 : 2) {
            for (const auto choice : {VplChoice::loop, VplChoice::tree}) {
                measure(job.scene, places, reference, choice, paths, settings, workers);
            }
        }
    } catch (const std::exception& failure) {
        fmt::print(stderr, "{}\n", failure.what());
        return 1;
    }
    return 0;
}
