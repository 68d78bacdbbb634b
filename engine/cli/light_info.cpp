// lucerna light info: what is in a lamp's file.
#include <memory>

#include "engine/base/files.h"
#include "engine/cli/lamp_file.h"
#include "engine/cli/lamp_text.h"
#include "engine/cli/light_commands.h"
#include "engine/cli/photometric_text.h"
#include "lights/ldt.h"

namespace lucerna {
namespace {

constexpr const char* kInfoFooter = R"(Examples:
  lucerna light info lamp.exr
  lucerna light info lamp.tm25ray
  lucerna light info lamp.ies)";

void act_info(const std::string& file, const CommandContext& context) {
    require_readable(file);
    ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
    if (is_photometric(file))
        return print_photometric(context.out, read_photometric(file, monitor), FluxUnit::lumen);
    const LampFile lamp = read_lamp_file(file, monitor);
    if (const auto* field = std::get_if<LightField>(&lamp)) {
        print_light_field(context.out, *field, {});
    } else {
        print_ray_set(context.out, std::get<RaySet>(lamp));
    }
}

}  // namespace

void add_light_info(CLI::App& light, const CommandContext& context) {
    const auto file = std::make_shared<std::string>();
    CLI::App& app = *light.add_subcommand("info", "Geometry, flux and losses of a lamp's file");
    app.footer(kInfoFooter);
    app.add_option("LAMP", *file,
                   "light field (.exr), rays (.tm25ray, .dat, .ray) or photometric file (.ies, .ldt)")
        ->required();
    app.callback([file, &context] { act_info(*file, context); });
}

}  // namespace lucerna
