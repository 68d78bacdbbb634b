#include "engine/cli/acquire_scene.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/monitor.h"
#include "engine/cli/sums_file.h"
#include "engine/pbrt/read_scene.h"
#include "engine/scene/arithmetic.h"
#include "lights/measurement/rig_file.h"

namespace lucerna {
namespace {

constexpr double kSecondsBetweenSaves = 60;

// Names the work by what it is made of: the description, the scene's text, and, as meshes and included files
// are not in that text, what the scene does with its first paths.
std::uint64_t key_of(const SceneEmitter& emitter, const Rig& rig, const Scene& scene,
                     const LuminaireParameters& parameters, const Workers& workers) {
    WordHash key;
    key.add(arithmetic());
    add(key, rig);
    key.add(static_cast<std::uint64_t>(parameters.paths));
    key.add(static_cast<std::uint64_t>(parameters.block));
    key.add(parameters.seed);
    for (const char c : read_text(emitter.file)) key.add(static_cast<std::uint64_t>(c));
    LuminaireParameters first = parameters;
    first.block = std::min<std::int64_t>(parameters.paths, 1 << 16);
    const LuminaireBlock block = trace_luminaire(scene, first, 0, workers);
    for (std::size_t i = 0; i < block.rays.size(); ++i) {
        const LampRay& ray = block.rays[i];
        const V3f tint = block.tints.of(i);
        for (const float number :
             {ray.o.x, ray.o.y, ray.o.z, ray.d.x, ray.d.y, ray.d.z, ray.flux, tint.x, tint.y, tint.z})
            key.add(double{number});
    }
    return key.value();
}

double luminance_of(const V3d& flux) {
    return double{luminance(Rgb(V3f(flux)))};
}

// Traces and measures the blocks that are missing.
void measure_blocks(const Scene& scene, const LuminaireParameters& parameters,
                    const std::filesystem::path& part, const Workers& workers, Monitor& monitor,
                    AcquisitionState& state) {
    Phase phase(monitor, "light paths", static_cast<std::uint64_t>(parameters.paths));
    phase.advance(state.flux.ledger.paths);
    Stopwatch since_save;
    for (; state.blocks < parameters.blocks(); ++state.blocks) {
        if (monitor.stopped()) {
            if (part.empty()) throw Stopped("stopped before all light paths were traced");
            save_state(part, state);
            throw Stopped(fmt::format("stopped after {} of {} light paths; the same command goes on from {}",
                                      state.flux.ledger.paths, parameters.paths, part.string()));
        }
        if (!part.empty() && since_save.seconds() > kSecondsBetweenSaves) {
            save_state(part, state);
            since_save = Stopwatch();
        }
        const LuminaireBlock block = trace_luminaire(scene, parameters, state.blocks, workers);
        add_rays(state.sums, block.rays, workers, block.tints);
        state.flux.add(block.flux);
        phase.advance(block.flux.ledger.paths);
    }
}

// Brings the sums to the flux of one lamp.
SceneAcquisition result_of(const SceneEmitter& emitter, const LuminaireParameters& parameters,
                           const AcquisitionState& state) {
    const double paths = static_cast<double>(parameters.paths);  // >= 1
    const double leaving = luminance_of(state.flux.forward + state.flux.backward);
    if (!(leaving > 0)) throw InputError({emitter.file.string()}, "no light leaves the luminaire");
    const double share = emitter.flux > 0 ? emitter.flux / leaving : 1 / paths;
    const double forward = luminance_of(state.flux.forward);
    LightFieldInfo info;
    // Nothing forwards: the field is black, and its colour of no matter.
    if (forward > 0) {
        const Rgb light(V3f(state.flux.forward / forward));
        // A field's file has its colour in linear sRGB, outside the gamut too.
        info.colour =
            parameters.colours.is_srgb() ? light : xyz_to_rgb(parameters.colours.light_to_xyz(light));
    }
    info.unit = emitter.unit;
    info.provenance = fmt::format("luminaire {} traced with {} light paths, seed {}",
                                  emitter.file.filename().string(), parameters.paths, parameters.seed);
    SceneAcquisition made{
        images_of(state.sums, share, info), state.sums.account, {}, {}, {}, parameters.paths};
    made.images.flux = share * leaving;
    made.account.total = share * leaving;
    made.account.backward = share * luminance_of(state.flux.backward);
    for (double* flux : {&made.account.beside_s, &made.account.beside_m, &made.account.not_in_basis})
        *flux *= share;
    const LightField field = field_of(made.images);
    made.account.captured = field.info().captured;
    made.emitted = share * luminance_of(state.flux.ledger.emitted);
    made.absorbed = share * luminance_of(state.flux.ledger.absorbed);
    made.noise = sampling_noise(state.sums, share, field);
    return made;
}

}  // namespace

SceneAcquisition acquire_scene(const SceneEmitter& emitter, const Rig& rig, const std::filesystem::path& part,
                               const Workers& workers, Monitor& monitor) {
    FilterSums sums(rig);
    SceneOverrides overrides;
    overrides.strict = emitter.strict;
    const Job job = read_scene(emitter.file, overrides, workers, monitor);
    if (emitter.when_read) emitter.when_read(job);
    LuminaireParameters parameters;
    parameters.paths = emitter.rays;
    parameters.seed = emitter.seed;
    parameters.block = emitter.block;
    parameters.colours = job.film.colours;
    parameters.side = emitter.side;
    try {
        check_luminaire(job.scene, parameters);
    } catch (const InputError& error) {
        throw InputError({emitter.file.string()}, error.what());
    }
    const std::uint64_t key = part.empty() ? 0 : key_of(emitter, rig, job.scene, parameters, workers);
    AcquisitionState state{key, 0, {}, std::move(sums)};
    if (!part.empty()) {
        if (auto kept = load_state(part, key, rig)) {
            state = std::move(*kept);
            monitor.info(fmt::format("going on after {} of {} light paths", state.flux.ledger.paths,
                                     parameters.paths));
        }
    }
    measure_blocks(job.scene, parameters, part, workers, monitor, state);
    try {
        return result_of(emitter, parameters, state);
    } catch (const InputError&) {  // a fault of the luminaire: its sums are of no use, and in the way of a
                                   // better one's
        std::error_code none;
        if (!part.empty()) std::filesystem::remove(part, none);
        throw;
    }
}

}  // namespace lucerna
