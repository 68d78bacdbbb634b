#include "photon/luminaire.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/stopped.h"
#include "photon/light_path.h"

namespace lucerna {
namespace {

constexpr std::int64_t kLuminairePathsPerChunk =
    4096;  // paths per chunk; fixed, so that results do not depend on threads

// What a particle is when it leaves.
void count_escape(const LightPathEscape& exit, const V3d& origin, LuminaireBlock& made) {
    if (!(exit.d.z > kLeastForward)) {
        made.tally.backward += V3d(exit.power);
        return;
    }
    made.tally.forward += V3d(exit.power);
    made.rays.push_back({V3f(V3d(exit.from.p) + origin), exit.d, luminance(exit.power)});
}

void trace_paths(const Scene& scene, std::uint64_t seed, std::int64_t begin, std::int64_t end,
                 LuminaireBlock& made) {
    Emission emission(scene, seed, Purpose::acquisition, 0);
    Ledger& ledger = made.tally.ledger;
    emission.for_each(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          ++ledger.paths;
                          if (!start) {
                              ++ledger.not_emitted;
                              return;
                          }
                          Sampler sampler = Sampler::stratified(seed, Purpose::acquisition, 0, path);
                          trace_light_path(
                              scene, *start, sampler, ledger, [](const LightPathHit& /*at*/) {},
                              [](const LightPathScatter& /*at*/) {},
                              [&](const LightPathEscape& exit) { count_escape(exit, scene.origin(), made); });
                      });
}

}  // namespace

void check_luminaire(const Scene& scene, const LuminaireParameters& parameters) {
    if (parameters.paths < 1 || parameters.paths > (std::int64_t{1} << 32)) {
        throw InputError(fmt::format("{} light paths; 1 to 4294967296 can be traced", parameters.paths));
    }
    if (parameters.block < 1)
        throw InputError(fmt::format("blocks of {} light paths; 1 or more", parameters.block));
    for (const auto& light : scene.lights()) {
        if (light->kind() == "distant" || light->kind() == "infinite") {
            throw InputError(fmt::format(
                "a luminaire is lit by its own lights, which have a place; this one has a light of kind {}",
                light->kind()));
        }
    }
    double power = 0;
    for (const auto& light : scene.lights()) power += light->power();
    if (!(power > 0)) throw InputError("the luminaire has no light with any power");
    if (!scene.media().all.empty()) {
        throw InputError("media in a luminaire: a lamp's account has no place for what they absorb");
    }
}

LuminaireBlock trace_luminaire(const Scene& scene, const LuminaireParameters& parameters, std::int64_t index,
                               const Workers& workers) {
    const std::int64_t first = index * parameters.block;
    const std::int64_t count = std::min(parameters.block, parameters.paths - first);
    std::vector<LuminaireBlock> chunks(
        static_cast<std::size_t>((count + kLuminairePathsPerChunk - 1) / kLuminairePathsPerChunk));
    parallel_ranges(
        workers, count, kLuminairePathsPerChunk,
        [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
            LuminaireBlock& made = chunks[static_cast<std::size_t>(chunk)];
            made.rays.reserve(static_cast<std::size_t>(end - begin));  // each path leaves once at most
            trace_paths(scene, parameters.seed, first + begin, first + end, made);
        });
    LuminaireBlock block;
    std::size_t rays = 0;
    for (const LuminaireBlock& chunk : chunks) rays += chunk.rays.size();
    block.rays.reserve(rays);
    for (const LuminaireBlock& chunk : chunks) {
        block.rays.insert(block.rays.end(), chunk.rays.begin(), chunk.rays.end());
        block.tally.add(chunk.tally);
    }
    return block;
}

RaySet trace_rays(const Scene& scene, const LuminaireParameters& parameters, FluxUnit unit,
                  const Workers& workers, Monitor& monitor) {
    check_luminaire(scene, parameters);
    RaySet set;
    set.unit = unit;
    LuminaireTally tally;
    Phase phase(monitor, "light paths", static_cast<std::uint64_t>(parameters.paths));
    for (std::int64_t index = 0; index < parameters.blocks(); ++index) {
        if (monitor.stopped()) throw Stopped("stopped before all light paths were traced");
        const LuminaireBlock block = trace_luminaire(scene, parameters, index, workers);
        set.rays.insert(set.rays.end(), block.rays.begin(), block.rays.end());
        tally.add(block.tally);
        phase.advance(block.tally.ledger.paths);
    }
    const double share = 1.0 / static_cast<double>(parameters.paths);  // paths >= 1
    tally.scale(share);
    const Rgb forward(V3f(tally.forward));
    set.flux = double{luminance(Rgb(V3f(tally.forward + tally.backward)))};
    set.skipped_flux = double{luminance(Rgb(V3f(tally.backward)))};
    if (!(luminance(forward) > 0)) throw InputError("no light leaves the luminaire towards +z");
    set.colour = forward / luminance(forward);
    for (LampRay& ray : set.rays) ray.flux *= static_cast<float>(share);
    return set;
}

}  // namespace lucerna
