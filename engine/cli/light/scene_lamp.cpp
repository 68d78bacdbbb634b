#include "engine/cli/light/scene_lamp.h"

#include <fmt/ostream.h>

#include <algorithm>
#include <map>

#include "engine/base/error.h"
#include "engine/base/version.h"
#include "engine/cli/light/light_commands.h"
#include "engine/pbrt/read_scene.h"
#include "engine/ranks/ranks.h"
#include "engine/scene/quantity.h"
#include "engine/text/plain_text.h"
#include "lights/lamp_edit.h"
#include "photon/luminaire.h"

namespace lucerna {
namespace {

// A stated flux has the unit of the lamp, whatever that of the scene.
FluxUnit unit_of(const SceneLampOptions& options, const Scene& scene) {
    const std::optional<FluxUnit> of_scene = scene_unit(scene);
    if (!of_scene) throw InputError("some lights of the luminaire are in W, some in lm; expected one unit");
    const bool is_known = scene.stated_unit() || *of_scene == FluxUnit::lumen;
    if (!options.unit) return *of_scene;
    if (options.flux > 0 || !is_known || *options.unit == *of_scene) return *options.unit;
    input_error({"--unit"}, "{}, but the light of the scene is in {}; use the same unit, or give --flux",
                flux_unit_name(*options.unit), flux_unit_name(*of_scene));
}

// Scales a luminaire to the flux that leaves it.
void scale_to(double leaving, TracedLuminaire& traced) {
    const double factor = leaving / traced.rays.flux;  // > 0: some light leaves
    traced.rays = dimmed(std::move(traced.rays), factor);
    traced.flux.scale(factor);
    for (V3d& absorbed : traced.absorbed) absorbed *= factor;
}

SceneLampAccount account_of(const TracedLuminaire& traced, const Scene& scene) {
    const Ledger& ledger = traced.flux.ledger;
    SceneLampAccount account;
    account.unit = traced.rays.unit;
    account.paths = static_cast<std::int64_t>(ledger.paths);
    account.emitted = light_of(ledger.emitted);
    account.leaving = light_of(ledger.escaped);
    account.cut = light_of(ledger.cut);
    account.roulette = light_of(ledger.roulette);
    std::map<std::string, double> by_name;
    for (std::size_t i = 0; i < traced.absorbed.size(); ++i) {
        const double flux = light_of(traced.absorbed[i]);
        if (flux != 0) by_name[scene.materials()[i].name] += flux;
    }
    for (const auto& [name, flux] : by_name) account.absorbed.push_back({name, flux});
    std::stable_sort(account.absorbed.begin(), account.absorbed.end(),
                     [](const auto& a, const auto& b) { return a.flux > b.flux; });
    return account;
}

TracedLuminaire traced_luminaire(const SceneLampOptions& options, const Job& job, const Workers& workers,
                                 Monitor& monitor) {
    LuminaireParameters parameters;
    parameters.paths = options.paths;
    parameters.seed = options.seed;
    parameters.colours = job.film.colours;
    parameters.all_sides = true;
    TracedLuminaire traced =
        trace_whole_luminaire(job.scene, parameters, unit_of(options, job.scene), workers, monitor);
    if (options.flux > 0) scale_to(options.flux, traced);
    traced.rays.provenance =
        fmt::format("luminaire {} traced with {} light paths, seed {}; lucerna {}",
                    options.file.filename().string(), options.paths, options.seed, program_version());
    return traced;
}

}  // namespace

std::optional<SceneLamp> make_scene_lamp(const SceneLampOptions& options, const Workers& workers,
                                         Monitor& monitor) {
    SceneOverrides overrides;
    overrides.strict = options.strict;
    const Job job = read_scene(options.file, overrides, workers, monitor);
    if (options.when_read) options.when_read(job);
    return naming(options.file.string(), [&]() -> std::optional<SceneLamp> {
        const TracedLuminaire traced = traced_luminaire(options, job, workers, monitor);
        if (workers.ranks && !workers.ranks->leads()) return std::nullopt;
        return SceneLamp{fit_lumigraph(traced.rays, options.lumigraph, workers.alone(), monitor),
                         account_of(traced, job.scene)};
    });
}

void print_account(std::ostream& out, const SceneLampAccount& account) {
    const auto line = [&](const std::string& name, double flux) {
        fmt::print(out, "{:<20} {:.6g} {} ({:.3g} %)\n", name, flux, flux_unit_name(account.unit),
                   100 * flux / account.emitted);  // > 0: some light leaves
    };
    fmt::print(out, "light paths          {}\n", account.paths);
    line("emitted", account.emitted);
    line("leaves the luminaire", account.leaving);
    for (const SceneLampAccount::Loss& loss : account.absorbed)
        line(fmt::format("absorbed by {}", plain_text(loss.material)), loss.flux);
    line("in cut-off paths", account.cut);
    line("roulette, mean 0", account.roulette);
}

}  // namespace lucerna
