#include "photon/luminaire.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

// Collects the rays in which the light of one chunk of paths leaves.
struct EscapedRays : LightPathVisitor {
    V3d origin{0, 0, 0};  // origin of the scene
    WorkingSpace colours;
    SlabAxes side;
    LuminaireBlock block;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, block.rays, block.tints.first, block.tints.each, block.tints.rays, block.flux);
    }

    void escape(const LightPathEscape& at) {
        const V3f d = side.straight() ? at.d : V3f(side.to_slab(V3d(at.d)));
        if (!(d.z > kLeastForward)) {
            block.flux.backward += V3d(at.power);
            return;
        }
        block.flux.forward += V3d(at.power);
        const float flux = luminance(at.power);
        // Power without luminance has no colour.
        block.tints.add(flux > 0 ? V3f(colours.light_to_xyz(at.power / flux)) : block.tints.first);
        const V3d from = V3d(at.from.p) + origin;
        block.rays.push_back({V3f(side.straight() ? from : side.to_slab(from)), d, flux});
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
        chunk.origin = scene.origin();
        chunk.colours = parameters.colours;
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
    }
    return block;
}

RaySet trace_rays(const Scene& scene, const LuminaireParameters& parameters, FluxUnit unit,
                  const Workers& workers, Monitor& monitor) {
    check_luminaire(scene, parameters);
    RaySet set;
    set.unit = unit;
    LuminaireFlux flux;
    RayTints tints;
    Phase phase(monitor, "light paths", static_cast<std::uint64_t>(parameters.paths));
    for (std::int64_t index = 0; index < parameters.blocks(); ++index) {
        if (monitor.stopped()) throw Stopped("stopped before all light paths were traced");
        const LuminaireBlock block = trace_luminaire(scene, parameters, index, workers);
        set.rays.insert(set.rays.end(), block.rays.begin(), block.rays.end());
        tints.add(block.tints);
        flux.add(block.flux);
        phase.advance(block.flux.ledger.paths);
    }
    const double share = 1.0 / static_cast<double>(parameters.paths);  // paths >= 1
    flux.scale(share);
    const Rgb forward(V3f(flux.forward));
    set.flux = double{luminance(Rgb(V3f(flux.forward + flux.backward)))};
    set.skipped_flux = double{luminance(Rgb(V3f(flux.backward)))};
    if (!(luminance(forward) > 0)) throw InputError("no light leaves the luminaire towards +z");
    set.xyz = parameters.colours.light_to_xyz(forward / luminance(forward));
    set.tristimulus = std::move(tints.each);
    for (LampRay& ray : set.rays) ray.flux *= static_cast<float>(share);
    return set;
}

}  // namespace lucerna
