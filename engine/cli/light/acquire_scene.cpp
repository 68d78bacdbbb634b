#include "engine/cli/light/acquire_scene.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/cli/light/sums_file.h"
#include "engine/cli/parallel_job.h"
#include "engine/pbrt/read_scene.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/arithmetic.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"
#include "lights/measurement/rig_file.h"

namespace lucerna {
namespace {

constexpr double kSecondsBetweenSaves = 60;

// Hashes everything that determines the result: the description, the scene's text and the scene's behaviour
// on its first paths, because the text does not contain meshes and included files.
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

// Traces and measures the missing blocks. Afterwards rank 0 has all sums.
class BlockMeasurement {
  public:
    BlockMeasurement(const Scene& scene, const LuminaireParameters& parameters,
                     const std::filesystem::path& part, const Workers& workers, Monitor& monitor,
                     AcquisitionState& state)
        : scene_(scene),
          parameters_(parameters),
          part_(part),
          workers_(workers),
          monitor_(monitor),
          state_(state) {}

    void run() {
        Phase phase(monitor_, "light paths", static_cast<std::uint64_t>(parameters_.paths));
        phase.advance(state_.flux.ledger.paths);
        Stopwatch since_save;
        for (; state_.blocks < parameters_.blocks(); ++state_.blocks) {
            if (monitor_.stopped()) stop();
            const bool is_due = !part_.empty() && since_save.seconds() > kSecondsBetweenSaves;
            if (agreed(workers_, is_due)) {
                save();
                since_save = Stopwatch();
            }
            const LuminaireBlock block = trace_luminaire(scene_, parameters_, state_.blocks, workers_);
            const bool is_whole = !workers_.ranks || !workers_.ranks->stopped();
            if (!is_whole || !add_rays(state_.sums, block.rays, workers_, block.tints)) stop();
            state_.flux.add(block.flux);
            phase.advance(block.flux.ledger.paths);
        }
        gather();
    }

  private:
    void gather() {
        if (workers_.ranks) state_.sums.gather(*workers_.ranks);
    }
    void save() {
        gather();
        if (!part_.empty()) save_state(part_, state_);
    }
    [[noreturn]] void stop() {
        save();
        if (part_.empty()) throw Stopped("stopped before all light paths were traced");
        throw Stopped(fmt::format("stopped after {} of {} light paths; the same command continues from {}",
                                  state_.flux.ledger.paths, parameters_.paths, part_.string()));
    }

    const Scene& scene_;
    const LuminaireParameters& parameters_;
    const std::filesystem::path& part_;
    const Workers& workers_;
    Monitor& monitor_;
    AcquisitionState& state_;
};

// Scales the sums to the flux of one lamp.
SceneAcquisition result_of(const SceneEmitter& emitter, const LuminaireParameters& parameters,
                           const AcquisitionState& state) {
    const double paths = static_cast<double>(parameters.paths);  // >= 1
    const double leaving = light_of(state.flux.forward + state.flux.backward);
    if (!(leaving > 0)) throw InputError({emitter.file.string()}, "no light leaves the luminaire");
    const double share = emitter.flux > 0 ? emitter.flux / leaving : 1 / paths;
    const double forward = light_of(state.flux.forward);
    LightFieldInfo info;
    // Without forward light the field is black, and its colour does not matter.
    if (forward > 0) {
        const Rgb light(V3f(state.flux.forward / forward));
        // A field's file has its colour in linear sRGB, possibly outside the gamut.
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
    made.account.backward = share * light_of(state.flux.backward);
    for (double* flux : {&made.account.beside_s, &made.account.beside_m, &made.account.not_in_basis})
        *flux *= share;
    const LightField field = field_of(made.images);
    made.account.captured = field.info().captured;
    made.emitted = share * light_of(state.flux.ledger.emitted);
    made.absorbed = share * light_of(state.flux.ledger.absorbed);
    made.noise = sampling_noise(state.sums, share, field);
    return made;
}

}  // namespace

namespace {

// A stated flux has the lamp's unit whatever the scene's; otherwise the scene must be in the lamp's unit.
void require_unit(const SceneEmitter& emitter, const Scene& scene) {
    const std::optional<FluxUnit> stated = scene.stated_unit();
    if (!stated || *stated == emitter.unit || emitter.flux > 0) return;
    input_error({emitter.file.string()},
                "the scene states its light in {}, but the lamp's unit is {}; use the same unit, or give the "
                "lamp's flux",
                flux_unit_name(*stated), flux_unit_name(emitter.unit));
}

}  // namespace

SceneAcquisition acquire_scene(const SceneEmitter& emitter, const Rig& rig, const std::filesystem::path& part,
                               const Workers& workers, Monitor& monitor) {
    FilterSums sums(rig);
    SceneOverrides overrides;
    overrides.strict = emitter.strict;
    const Job job = read_scene(emitter.file, overrides, workers, monitor);
    require_unit(emitter, job.scene);
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
    const bool names_work = workers.ranks || !part.empty();
    const std::uint64_t key = names_work ? key_of(emitter, rig, job.scene, parameters, workers.alone()) : 0;
    if (workers.ranks) {
        require_same_facts(*workers.ranks, "measure a different lamp",
                           {{"luminaire", fmt::format("{} ({:016x})", emitter.file.string(), key)}});
    }
    AcquisitionState state{key, 0, {}, std::move(sums)};
    if (!part.empty()) {
        if (auto kept = load_state(part, key, rig)) {
            state = std::move(*kept);
            monitor.info(fmt::format("continuing after {} of {} light paths", state.flux.ledger.paths,
                                     parameters.paths));
        }
    }
    state.blocks = agreed(workers, state.blocks);
    if (workers.ranks && state.blocks > 0) state.sums.copy_from_rank_0(*workers.ranks);
    BlockMeasurement(job.scene, parameters, part, workers, monitor, state).run();
    if (workers.ranks && !workers.ranks->leads()) return {};
    try {
        return result_of(emitter, parameters, state);
    } catch (const InputError&) {  // the sums of a faulty luminaire are useless and block a corrected one
        std::error_code none;
        if (!part.empty()) std::filesystem::remove(part, none);
        throw;
    }
}

}  // namespace lucerna
