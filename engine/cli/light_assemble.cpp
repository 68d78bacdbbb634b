// lucerna light assemble: photographs of a real rig into a light field.
#include <fmt/ostream.h>

#include <memory>

#include "engine/base/files.h"
#include "engine/cli/command_files.h"
#include "engine/cli/light_commands.h"
#include "lights/measurement/photographs.h"

namespace lucerna {
namespace {

constexpr const char* kAssembleFooter =
    R"(The manifest says which photographs there are, how the rig stood and how the camera counts;
docs/photographs.md is its reference. A virtual rig writes one with its photographs:
  lucerna light acquire RIG.toml -o lamp.exr --photographs FOLDER

Examples:
  lucerna light assemble measured/manifest.toml -o lamp.exr
  lucerna light assemble measured/manifest.toml -o lamp.exr --threads 1)";

struct AssembleCommand {
    std::string manifest;
    LampOutput lamp;
};

void print_assembly(std::ostream& out, const Assembly& assembly) {
    fmt::print(out, "photographs          {} of {} x {} pixels, {:.3g} to a pixel of M\n",
               assembly.photographs, assembly.size.x, assembly.size.y, assembly.density);
    fmt::print(out, "hot pixels           {}, of all dark frames\n", assembly.hot);
    fmt::print(out, "saturated pixels     {} in every exposure\n", assembly.saturated);
    if (assembly.noise > 0 && assembly.signal > 0) {
        fmt::print(out, "noise                {:.3g} % of the coefficients' root mean square\n",
                   100 * assembly.noise / assembly.signal);
    }
}

void act_assemble(const AssembleCommand& command, const CommandContext& context) {
    require_readable(command.manifest);
    CommandFiles files;
    files.reads(command.manifest);
    declare_lamp(command.lamp, files);
    ConsoleMonitor monitor(context.out, context.err, console_settings(command.lamp, context));
    const Manifest manifest = read_manifest(std::filesystem::path(command.manifest));
    files.reads(files_of(manifest));
    const Assembly assembly = assemble(manifest, command.lamp.workers, monitor);
    const LightField field = naming(command.manifest, [&] { return field_of(assembly.images); });
    finish_lamp(field, command.lamp, monitor, context);
    if (!command.lamp.quiet) print_assembly(context.out, assembly);
}

}  // namespace

void add_light_assemble(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<AssembleCommand>();
    CLI::App& app = *light.add_subcommand("assemble", "Make a light field of photographs of a real rig");
    app.footer(kAssembleFooter);
    app.add_option("MANIFEST", command->manifest, "what was photographed, and how; .toml")->required();
    add_lamp_output(app, command->lamp);
    app.callback([command, &context] { act_assemble(*command, context); });
}

}  // namespace lucerna
