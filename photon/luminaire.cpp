#include "photon/luminaire.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/ranks/ranks.h"
#include "engine/system/memory.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// Moves p along d to where the line leaves the box; leaves it in place if it does not meet the box ahead.
V3f moved_out(const V3f& p, const V3f& d, const Box3f& box) {
    double enters = -INFINITY, leaves = INFINITY;
    for (int a = 0; a < 3; ++a) {
        // A quotient of 0 by 0, in the plane of a face, is NaN, which std::min and std::max ignore here.
        const double low = (double{box.min[a]} - double{p[a]}) / double{d[a]};
        const double high = (double{box.max[a]} - double{p[a]}) / double{d[a]};
        enters = std::max(enters, std::min(low, high));
        leaves = std::min(leaves, std::max(low, high));
    }
    if (!(leaves > 0 && leaves >= enters && std::isfinite(leaves))) return p;
    return V3f(V3d(p) + leaves * V3d(d));
}

void add_each(std::vector<V3d>& sums, const std::vector<V3d>& more) {
    sums.resize(std::max(sums.size(), more.size()), V3d(0));
    for (std::size_t i = 0; i < more.size(); ++i) sums[i] += more[i];
}

// Collects the rays in which the light of one chunk of paths leaves.
struct EscapedRays : LightPathVisitor {
    V3d origin{0, 0, 0};  // origin of the scene
    Box3f box;            // of the scene's surfaces, relative to its origin
    WorkingSpace colours;
    SlabAxes side;
    bool all_sides = false;
    LuminaireBlock block;
    std::uint32_t material = 0;  // of the last hit
    V3d booked{0, 0, 0};         // of ledger.absorbed, in block.absorbed

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, block.rays, block.tints.first, block.tints.each, block.tints.rays, block.flux,
                block.absorbed, material, booked);
    }

    // The ledger does not know the materials. Paths are traced one by one, so that what it gained since the
    // last hit was absorbed there.
    void book_absorbed() {
        const V3d gained = ledger.absorbed - booked;
        if (gained == V3d(0)) return;
        if (block.absorbed.size() <= material) block.absorbed.resize(material + 1, V3d(0));
        block.absorbed[material] += gained;
        booked = ledger.absorbed;
    }
    void hit(const LightPathHit& at) {
        book_absorbed();
        material = at.hit.material;
    }

    void escape(const LightPathEscape& at) {
        const bool turned = !all_sides && !side.straight();
        const V3f d = turned ? V3f(side.to_slab(V3d(at.d))) : at.d;
        if (!all_sides && !(d.z > kLeastForward)) {
            block.flux.backward += V3d(at.power);
            return;
        }
        block.flux.forward += V3d(at.power);
        const float flux = luminance(at.power);
        // Power without luminance has no colour.
        block.tints.add(flux > 0 ? V3f(colours.light_to_xyz(at.power / flux)) : block.tints.first);
        const V3d from = V3d(all_sides ? moved_out(at.from.p, at.d, box) : at.from.p) + origin;
        block.rays.push_back({V3f(turned ? side.to_slab(from) : from), d, flux});
    }
};

}  // namespace

void check_luminaire(const Scene& scene, const LuminaireParameters& parameters) {
    if (parameters.paths < 1 || parameters.paths > (std::int64_t{1} << 32)) {
        throw InputError(fmt::format("{} light paths; expected 1 to 4294967296", parameters.paths));
    }
    if (parameters.block < 1)
        throw InputError(fmt::format("blocks of {} light paths; 1 or more", parameters.block));
    for (const auto& light : scene.lights()) {
        if (light->is_at_infinity()) {
            throw InputError(fmt::format(
                "a luminaire may only have lights with a position; this one has a light of type {}",
                light->kind()));
        }
    }
    double power = 0;
    for (const auto& light : scene.lights()) power += light->power();
    if (!(power > 0)) throw InputError("the luminaire has no light with any power");
    if (!scene.media().all.empty()) {
        throw InputError(
            "media in a luminaire are not supported, as the flux that they absorb is not accounted for");
    }
}

LuminaireBlock trace_luminaire(const Scene& scene, const LuminaireParameters& parameters, std::int64_t index,
                               const Workers& workers) {
    const std::int64_t first = index * parameters.block;
    const std::int64_t count = std::min(parameters.block, parameters.paths - first);
    LightPathRequest paths;
    paths.first = first;
    paths.count = count;
    paths.seed = parameters.seed;
    paths.purpose = Purpose::acquisition;
    paths.interleaved = false;  // rays keep the order of their paths
    Monitor silent;             // the caller reports the progress
    std::vector<EscapedRays> chunks;
    trace_light_paths({scene, workers, silent}, paths, chunks, [&](std::int64_t n) {
        EscapedRays chunk;
        chunk.side = parameters.side;
        chunk.origin = scene.origin();
        chunk.colours = parameters.colours;
        chunk.box = scene.bounds();
        chunk.all_sides = parameters.all_sides;
        chunk.block.rays.reserve(static_cast<std::size_t>(n));  // each path leaves at most once
        return chunk;
    });
    LuminaireBlock block;
    std::size_t rays = 0;
    for (const EscapedRays& chunk : chunks) rays += chunk.block.rays.size();
    block.rays.reserve(rays);
    for (EscapedRays& chunk : chunks) {
        chunk.block.flux.ledger = chunk.ledger;
        block.rays.insert(block.rays.end(), chunk.block.rays.begin(), chunk.block.rays.end());
        block.tints.add(chunk.block.tints);
        block.flux.add(chunk.block.flux);
        chunk.book_absorbed();  // at the last hit of the chunk
        add_each(block.absorbed, chunk.block.absorbed);
    }
    return block;
}

RaySet trace_rays(const Scene& scene, const LuminaireParameters& parameters, FluxUnit unit,
                  const Workers& workers, Monitor& monitor) {
    return trace_whole_luminaire(scene, parameters, unit, workers, monitor).rays;
}

TracedLuminaire trace_whole_luminaire(const Scene& scene, const LuminaireParameters& parameters,
                                      FluxUnit unit, const Workers& workers, Monitor& monitor) {
    check_luminaire(scene, parameters);
    require_memory(bytes_of(static_cast<std::uint64_t>(parameters.paths), sizeof(LampRay)),
                   fmt::format("the rays of {} light paths", parameters.paths), "trace fewer light paths");
    TracedLuminaire made;
    RaySet& set = made.rays;
    set.unit = unit;
    RayTints tints;
    Phase phase(monitor, "light paths", static_cast<std::uint64_t>(parameters.paths));
    for (std::int64_t index = 0; index < parameters.blocks(); ++index) {
        const LuminaireBlock block = trace_luminaire(scene, parameters, index, workers);
        if (monitor.stopped() || (workers.ranks && workers.ranks->stopped()))
            throw Stopped("stopped before all light paths were traced");
        set.rays.insert(set.rays.end(), block.rays.begin(), block.rays.end());
        tints.add(block.tints);
        made.flux.add(block.flux);
        add_each(made.absorbed, block.absorbed);
        phase.advance(block.flux.ledger.paths);
    }
    const double share = 1.0 / static_cast<double>(parameters.paths);  // paths >= 1
    made.flux.scale(share);
    for (V3d& absorbed : made.absorbed) absorbed *= share;
    const Rgb forward(V3f(made.flux.forward));
    set.flux = light_of(made.flux.forward + made.flux.backward);
    set.skipped_flux = light_of(made.flux.backward);
    if (!(luminance(forward) > 0)) {
        if (parameters.all_sides) throw InputError("no light leaves the luminaire");
        throw InputError(fmt::format("no light leaves the luminaire towards {}", parameters.side.name()));
    }
    set.xyz = parameters.colours.light_to_xyz(forward / luminance(forward));
    set.tristimulus = std::move(tints.each);
    for (LampRay& ray : set.rays) ray.flux *= static_cast<float>(share);
    return made;
}

}  // namespace lucerna
