// Measures the cost of a photon pass beside that of its rays, for the table of docs/results/results.md.
//
// Traces PATHS light paths of each scene and stores every photon that can be stored, without building the
// index; then gives the same rays, in the same order, to Embree alone, which only reports whether they hit
// something. The two alternate ROUNDS times on one thread, then on two. Writes for each scene
//
//   scene paths rays deposits | Mpaths/s Mrays/s Mdeposits/s bare_Mrays/s ratio | speed-up and bare speed-up
//
// Rates are per second of processor time on one thread, from the best round of each; the ratio is the median
// over rounds. Speed-ups are of wall clock time, the best round on two threads against the best round on one,
// and are meaningless if other programs use the machine. The last columns give the ratio of the processor
// time that two threads took to that of one for the same work.
//
// usage: figure_photon_throughput PATHS ROUNDS SCENE.pbrt …
#include <fmt/core.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/figures/figure_main.h"
#include "engine/base/monitor.h"
#include "engine/pbrt/read_scene.h"
#include "engine/text/units.h"
#include "photon/build_maps.h"

namespace {

using namespace lucerna;  // a program of its own, not a header

// Seconds of the wall clock, and of processor time over all threads.
struct Cost {
    double wall = 0, processor = 0;
};

double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class Meter {
  public:
    Cost read() const { return {wall_.seconds(), processor_seconds() - start_}; }

  private:
    Stopwatch wall_;
    double start_ = processor_seconds();
};

// Measures the tracing phase, without the index.
class TraceMeter : public Monitor {
  public:
    void begin(std::string_view, std::uint64_t) override { meter_ = Meter(); }
    void end() override { cost_ = meter_.read(); }
    const Cost& cost() const { return cost_; }

  private:
    Meter meter_;
    Cost cost_;
};

struct Round {
    Cost trace, bare;
};

std::vector<Round> take_turns(const Scene& scene, const MapParameters& parameters,
                              const std::vector<Ray>& rays, std::int64_t rounds, int threads) {
    std::vector<Round> all;
    const Workers workers{threads};
    std::uint64_t hits = 0;
    for (std::int64_t i = 0; i < rounds; ++i) {
        TraceMeter trace;
        const PhotonMaps maps = build_photon_maps(scene, parameters, workers, trace);
        const Meter bare;
        hits = scene.count_hits(rays, workers);
        all.push_back({trace.cost(), bare.read()});
        if (hits != maps.ledger.hits) {
            throw std::runtime_error(
                fmt::format("the light paths hit {} surfaces, their rays {}", maps.ledger.hits, hits));
        }
    }
    return all;
}

template <typename Measure>
double least(const std::vector<Round>& rounds, Measure&& measure) {
    double best = INFINITY;
    for (const Round& round : rounds) best = std::min(best, measure(round));
    return best;
}

template <typename Measure>
double median(const std::vector<Round>& rounds, Measure&& measure) {
    std::vector<double> values;
    for (const Round& round : rounds) values.push_back(measure(round));
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

void measure(const std::string& file, std::int64_t paths, std::int64_t rounds) {
    Monitor silent;
    const Job job = read_scene(file, {}, Workers{}, silent);
    const Scene& scene = job.scene;
    if (!scene.media().empty()) throw std::runtime_error(file + ": media's own rays are not counted here");
    MapParameters parameters;
    parameters.paths = paths;
    parameters.wanted = {true, true, true, false};
    parameters.seed = 1;

    // Counts rays and deposits once.
    const std::vector<Ray> rays = rays_of_light_paths(scene, parameters);
    const std::uint64_t before = scene.rays();
    const PhotonMaps maps = build_photon_maps(scene, parameters, Workers{1}, silent);
    if (scene.rays() - before != rays.size()) throw std::runtime_error(file + ": not the rays of the pass");
    std::uint64_t deposits = 0;
    for (const DepositCount& count : maps.counts) deposits += count.stored;

    // Measures the times.
    const auto one = take_turns(scene, parameters, rays, rounds, 1),
               two = take_turns(scene, parameters, rays, rounds, 2);
    const auto trace_wall = [](const Round& r) { return r.trace.wall; };
    const auto bare_wall = [](const Round& r) { return r.bare.wall; };
    const auto trace_time = [](const Round& r) { return r.trace.processor; };
    const auto bare_time = [](const Round& r) { return r.bare.processor; };
    const auto ratio = [](const Round& r) { return r.bare.processor / r.trace.processor; };
    const auto rate = [](double count, double seconds) { return count / seconds * 1e-6; };
    const auto n = static_cast<double>(rays.size());
    fmt::print("{:<14} {} {} {} | {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} | {:.2f} {:.2f} | {:.2f} {:.2f}\n",
               std::filesystem::path(file).stem().string(), paths, rays.size(), deposits,
               rate(static_cast<double>(paths), least(one, trace_time)), rate(n, least(one, trace_time)),
               rate(static_cast<double>(deposits), least(one, trace_time)), rate(n, least(one, bare_time)),
               median(one, ratio), least(one, trace_wall) / least(two, trace_wall),
               least(one, bare_wall) / least(two, bare_wall), least(two, trace_time) / least(one, trace_time),
               least(two, bare_time) / least(one, bare_time));
}

void run(const std::vector<std::string>& words) {
    if (words.size() < 3) throw std::runtime_error("PATHS ROUNDS SCENE.pbrt … are needed");
    const std::int64_t paths = parse_whole({"PATHS"}, words[0], 1, std::int64_t{1} << 26);
    const std::int64_t rounds = parse_whole({"ROUNDS"}, words[1], 1, 1000);
    fmt::print(
        "# scene paths rays deposits | Mpaths/s Mrays/s Mdeposits/s bare_Mrays/s ratio | speed-up of the "
        "trace, "
        "of Embree | processor time on two threads over one: trace, Embree\n");
    for (std::size_t i = 2; i < words.size(); ++i) measure(words[i], paths, rounds);
}

}  // namespace

int main(int argc, char** argv) {
    return lucerna::figure_main("figure_photon_throughput", argc, argv, run);
}
