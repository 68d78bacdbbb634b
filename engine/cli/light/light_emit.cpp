// lucerna light emit: samples a light field as rays for optics programs.
#include <fmt/ostream.h>

#include <memory>

#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/light/light_commands.h"
#include "engine/system/files.h"
#include "lights/cell_table.h"
#include "lights/measurement/emit_rays.h"
#include "lights/ray_set.h"

namespace lucerna {
namespace {

constexpr const char* kEmitFooter =
    R"(The rays start on the sampling plane, in the frame of the file that the lamp came from. Their total flux is the measured
flux of the lamp; a lamp in lumens gives rays in lumens. The suffix selects the format: .tm25ray (IES TM-25), .dat (Zemax
binary), .ray (LightTools binary) or .speos.ray (SPEOS). The same command always writes the same bytes.

SPEOS's format has watts and a wavelength for each ray. If the lamp has the colour of a single wavelength, that one is
written; any other lamp is written as light of 555 nm, to which a spectrum is assigned in SPEOS. Lumens become the watts
that they have at the wavelength.

Modes, the placement of a ray within its cell of the light field:
  exact      according to the field; rays of equal energy
  constant   uniform over the cell; rays of equal energy, slightly less accurate

Examples:
  lucerna light emit lamp.exr --rays 1000000 -o lamp.tm25ray
  lucerna light emit lamp.exr --rays 5000000 --seed 7 -o lamp.dat)";

struct EmitCommand {
    std::string lamp, output;
    std::int64_t rays = 1'000'000;
    std::uint64_t seed = 0;
    std::string mode = "exact";
    Workers workers;
    bool quiet = false;
};

EmissionMode mode_of(const std::string& word) {
    if (word == "exact") return EmissionMode::exact;
    if (word == "constant") return EmissionMode::constant;
    input_error({"--mode"}, "\"{}\" is not accepted; expected exact or constant", word);
}

void act_emit(const EmitCommand& command, const CommandContext& context) {
    const EmissionMode mode = mode_of(command.mode);
    require_readable(command.lamp);
    if (!has_ray_suffix(command.output))
        input_error({command.output}, "the format of a ray file is chosen by its suffix; expected {}",
                    kRaySuffixes);
    CommandFiles files;
    files.reads(command.lamp);
    files.reads(cell_table_file(command.lamp));
    files.writes(command.output, "", "-o");
    ConsoleMonitor monitor(context.out, context.err,
                           {context.process.terminal, command.quiet, context.process.stop, {}});
    const LampEmission lamp(command.lamp, mode, command.seed, command.workers, monitor);
    const StopOnSignals listening(context.process);  // so that an unfinished file is removed
    const RayFileInfo info = lamp.write(command.output, static_cast<std::uint64_t>(command.rays), monitor);
    if (command.quiet) return;
    std::error_code unknown;
    const auto size = std::filesystem::file_size(command.output, unknown);
    fmt::print(context.out, "rays                 {}\n", info.rays);
    fmt::print(context.out, "flux                 {:.6g} {}\n", info.flux, flux_unit_name(info.unit));
    fmt::print(context.out, "ray file             {} ({})\n", command.output,
               unknown ? std::string("size unknown") : bytes_text(static_cast<double>(size)));
}

}  // namespace

void add_light_emit(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<EmitCommand>();
    CLI::App& app = *light.add_subcommand("emit", "Write a light field's light as rays for optics programs");
    app.footer(kEmitFooter);
    app.add_option("LAMP", command->lamp, "light field, .exr")->required()->type_name("LAMP.exr");
    app.add_option("-o,--output", command->output, "the ray file")->type_name("RAYS")->required();
    add_word(app, "--rays", "N", "number of rays (default 1000000)", [command](const std::string& word) {
        command->rays = parse_whole({"--rays"}, word, 1, 4'000'000'000);
    });
    add_word(app, "--seed", "N", "seed of the random numbers (default 0)",
             [command](const std::string& word) { command->seed = parse_seed({"--seed"}, word); });
    app.add_option("--mode", command->mode, "placement of rays in a cell: exact (default) or constant")
        ->type_name("MODE");
    add_threads(app, command->workers);
    app.add_flag("--quiet", command->quiet, "print warnings and errors only");
    app.callback([command, &context] { act_emit(*command, context); });
}

}  // namespace lucerna
