// lucerna light info: what is in a lamp's file.
#include <memory>

#include "engine/app/lamp_file.h"
#include "engine/app/lamp_text.h"
#include "engine/app/light_commands.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

constexpr const char* kInfoFooter = R"(Examples:
  lucerna light info lamp.exr
  lucerna light info lamp.tm25ray)";

void act_info(const std::string& file, const CommandContext& context) {
    require_readable(file);
    ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
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
    CLI::App& app = *light.add_subcommand("info", "Geometry, flux and losses of a light field or a ray file");
    app.footer(kInfoFooter);
    app.add_option("LAMP", *file, "light field (.exr) or rays (.tm25ray, .dat, .ray)")->required();
    app.callback([file, &context] { act_info(*file, context); });
}

}  // namespace lucerna
