#include "engine/vpl/vpl.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/system/memory.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// One thread traces at most this many paths at a time.
constexpr std::int64_t kMostPathsPerChunk = 8192;

// Makes the VPLs of one chunk of paths.
struct ChunkVpls : LightPathVisitor {
    VplGloss gloss{};
    int longest = kMaxBounces;
    bool by_light = false;  // whether VPLs store which light they came from
    std::vector<Vpl> lights;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, lights);
    }
    void hit(const LightPathHit& at) {
        if (longest < 0) return;
        make_vpls(at, gloss, [&](const Vpl& light) {
            lights.push_back(light);
            if (by_light) lights.back().light = at.start.light;
        });
    }
    void scatter(const LightPathScatter& at) {
        if (longest < 0) return;
        lights.push_back({SurfacePoint{at.p}, at.power, true, at.g, at.d, kept_bounces(at.path.bounces()),
                          by_light ? at.start.light : 0});
    }
};

// Throws InputError if there is too little memory for the VPLs, whose number the first chunks' paths tell.
// VPLs are held as chunks leave them, in one array, and in the order of the store.
void require_memory_for_vpls(const std::vector<ChunkVpls>& chunks, std::int64_t paths, std::int64_t all) {
    constexpr double kOrdered = 64;
    const double lights =
        expected_of(chunks, paths, all, [](const ChunkVpls& part) { return part.lights.size(); });
    require_memory(static_cast<std::uint64_t>(lights * (2 * sizeof(Vpl) + kOrdered)),
                   fmt::format("about {:.2g} virtual point lights from {} light paths", lights, all),
                   "use fewer sets, or fewer light paths per set (nsets, nlights)");
}

}  // namespace

VplSets build_vpls(const Scene& scene, const VplParameters& parameters, const Workers& workers,
                   Monitor& monitor) {
    // Path indices are consecutive, so that the 2^k paths of a set form a low-discrepancy net, and so do all
    // paths of all sets. A chunk is a set, or a piece of one, since both are powers of 2.
    const std::uint64_t all = std::uint64_t{parameters.sets} * parameters.paths;
    constexpr std::uint64_t kMostPaths = std::uint64_t{1} << 32;  // limit of path indices
    if (all > kMostPaths) {
        throw InputError(
            fmt::format("{} sets of {} light paths are too many; at most {} paths in all can be "
                        "emitted (nsets, nlights)",
                        parameters.sets, parameters.paths, kMostPaths));
    }
    LightPathRequest paths;
    paths.count = static_cast<std::int64_t>(all);
    paths.seed = parameters.seed;
    paths.purpose = Purpose::vpl;
    paths.pass = parameters.pass;
    paths.emission = parameters.emission;
    paths.specular_below = vpl_specular_below(parameters.gloss);
    paths.longest = parameters.longest;
    paths.per_chunk = std::min<std::int64_t>(parameters.paths, kMostPathsPerChunk);
    paths.interleaved = false;  // keeps VPLs in the order of their paths
    paths.phase = "virtual point lights";
    std::vector<ChunkVpls> chunks;
    trace_light_paths(
        {scene, workers, monitor}, paths, chunks,
        [&](std::int64_t /*count*/) {
            ChunkVpls chunk;
            chunk.gloss = parameters.gloss;
            chunk.longest = parameters.longest;
            chunk.by_light = !scene.light_groups().empty();
            return chunk;
        },
        require_memory_for_vpls);
    std::size_t total = 0;
    for (const ChunkVpls& part : chunks) total += part.lights.size();
    if (total > 0xffffffffU) {
        throw InputError(
            fmt::format("{} virtual point lights are too many; at most {} fit", total, 0xffffffffU));
    }
    VplSets result;
    result.lights.reserve(total);
    result.begins.push_back(0);
    std::int64_t done = 0;
    for (ChunkVpls& part : chunks) {
        result.lights.insert(result.lights.end(), part.lights.begin(), part.lights.end());
        result.ledger.add(part.ledger);
        part = {};  // lights must not be held twice for longer than needed
        done += paths.per_chunk;
        if (done % parameters.paths == 0)
            result.begins.push_back(static_cast<std::uint32_t>(result.lights.size()));
    }
    result.ledger.scale(1.0 / (static_cast<double>(parameters.sets) * parameters.paths));
    return result;
}

}  // namespace lucerna
