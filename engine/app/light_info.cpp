// lucerna light info: what is in a lamp's file.
#include <filesystem>
#include <memory>

#include "engine/app/lamp_text.h"
#include "engine/app/light_commands.h"
#include "engine/base/files.h"
#include "lights/ray_set.h"

namespace lucerna {
namespace {

constexpr const char* kInfoFooter = R"(Examples:
  lucerna light info lamp.exr
  lucerna light info lamp.tm25ray)";

void act_info(const std::string& file, const CommandContext& context) {
    require_readable(file);
    ConsoleMonitor monitor(context.out, context.err, {false, true, context.around.stop, {}});
    if (std::filesystem::path(file).extension() == ".exr") {
        print_light_field(context.out, read_light_field(file), {});
    } else {
        print_ray_set(context.out, read_tm25(file, monitor));
    }
}

}  // namespace

void add_light_info(CLI::App& light, const CommandContext& context) {
    const auto file = std::make_shared<std::string>();
    CLI::App& app = *light.add_subcommand("info", "Geometry, flux and losses of a light field or a ray file");
    app.footer(kInfoFooter);
    app.add_option("LAMP", *file, "light field (.exr) or rays (.tm25ray)")->required();
    app.callback([file, &context] { act_info(*file, context); });
}

}  // namespace lucerna
