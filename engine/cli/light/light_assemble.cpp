// lucerna light assemble: turns photographs of a real rig into a light field.
#include <fmt/ostream.h>

#include <memory>

#include "engine/cli/command_files.h"
#include "engine/cli/light/light_commands.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/measurement/join_sides.h"
#include "lights/measurement/photographs.h"

namespace lucerna {
namespace {

constexpr const char* kAssembleFooter =
    R"(The manifest lists the photographs and describes the rig's geometry and the camera's response; see
docs/reference/photographs.md. A virtual rig writes one with its photographs:
  lucerna light acquire RIG.toml -o lamp.exr --photographs FOLDER

A lamp that emits towards several sides is photographed in several sessions, turned in front of the rig. Each further
session is given with the side of the lamp that faced the rig, in the frame of the first session, whose side is +z. Light
that is in two sessions is divided between them by its direction.

Examples:
  lucerna light assemble measured/manifest.toml -o lamp.exr
  lucerna light assemble measured/manifest.toml -o lamp.exr --threads 1
  lucerna light assemble front/manifest.toml --side=-z=back/manifest.toml -o lamp.exr)";

struct AssembleCommand {
    std::string manifest;
    struct Side {
        SlabAxes axes;
        std::string manifest;
    };
    std::vector<Side> more;  // sessions of the other sides
    LampOutput lamp;
};

void print_assembly(std::ostream& out, const Assembly& assembly) {
    fmt::print(out, "photographs          {} of {} x {} pixels, {:.3g} per pixel of M\n",
               assembly.photographs, assembly.size.x, assembly.size.y, assembly.density);
    fmt::print(out, "hot pixels           {}, in all dark frames\n", assembly.hot);
    fmt::print(out, "saturated pixels     {} in every exposure\n", assembly.saturated);
    if (assembly.noise > 0 && assembly.signal > 0) {
        fmt::print(out, "noise                {:.3g} % of the coefficients' root mean square\n",
                   100 * assembly.noise / assembly.signal);
    }
}

void act_assemble(const AssembleCommand& command, const CommandContext& context) {
    std::vector<AssembleCommand::Side> sessions{{SlabAxes{}, command.manifest}};
    sessions.insert(sessions.end(), command.more.begin(), command.more.end());
    CommandFiles files;
    std::vector<SlabAxes> axes;
    for (const auto& session : sessions) axes.push_back(session.axes);
    require_different_sides("--side", axes);  // the first session is +z
    for (const auto& session : sessions) {
        require_readable(session.manifest);
        files.reads(session.manifest);
    }
    declare_lamp(command.lamp.file, "-o", files);
    ConsoleMonitor monitor(context.out, context.err, console_settings(command.lamp, context));
    std::vector<Manifest> manifests;
    for (const auto& session : sessions) {
        manifests.push_back(read_manifest(std::filesystem::path(session.manifest)));
        files.reads(files_of(manifests.back()));
    }
    std::vector<Slab> sides;
    std::vector<Assembly> assemblies;
    for (std::size_t i = 0; i < sessions.size(); ++i) {
        assemblies.push_back(assemble(manifests[i], command.lamp.workers, monitor));
        sides.push_back(
            {sessions[i].axes, naming(sessions[i].manifest, [&] { return field_of(assemblies[i].images); })});
        assemblies[i].images.positive = {}, assemblies[i].images.negative = {};  // the field has a copy
    }
    finish_lamp(join_sides(std::move(sides)), command.lamp, monitor, context);
    if (command.lamp.quiet) return;
    for (const Assembly& assembly : assemblies) print_assembly(context.out, assembly);
}

}  // namespace

void add_light_assemble(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<AssembleCommand>();
    CLI::App& app = *light.add_subcommand("assemble", "Make a light field from photographs of a real rig");
    app.footer(kAssembleFooter);
    app.add_option("MANIFEST", command->manifest, "description of the photographs, .toml")
        ->required()
        ->type_name("MANIFEST.toml");
    app.add_option_function<std::vector<std::string>>(
           "--side",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words) {
                   const std::size_t equals = word.find('=');
                   if (equals == std::string::npos)
                       input_error({"--side"}, "\"{}\" is not accepted; expected AXIS=MANIFEST",
                                   one_line(word));
                   command->more.push_back(
                       {parse_side("--side", word.substr(0, equals)), word.substr(equals + 1)});
               }
           },
           "the photographs of another side of the lamp; may be repeated")
        ->type_name("AXIS=MANIFEST")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_lamp_output(app, command->lamp);
    app.callback([command, &context] { act_assemble(*command, context); });
}

}  // namespace lucerna
