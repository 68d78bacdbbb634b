// lucerna light import: a ray file into a light field.
#include <fmt/ostream.h>

#include <memory>

#include "engine/app/lamp_text.h"
#include "engine/app/light_commands.h"
#include "engine/app/outputs.h"
#include "engine/base/files.h"
#include "lights/ray_projection.h"

namespace lucerna {
namespace {

constexpr const char* kImportFooter =
    R"(What is not given is chosen from the rays. The light field is for a scene's
  LightSource "lightfield" "string filename" "lamp.exr"

Examples:
  lucerna light import lamp.tm25ray -o lamp.exr
  lucerna light import lamp.tm25ray -o lamp.exr --views 16x16 --pixels 96x96 --capture 99%
  lucerna light import lamp.tm25ray -o lamp.exr --distance 40mm --height 0.5mm)";

struct ImportOptions {
    std::string rays;
    FitOptions fit;
    LampOutput lamp;
};

void act_import(const ImportOptions& options, const CommandContext& context) {
    require_readable(options.rays);
    require_writable(options.lamp.file, ".exr");
    ConsoleMonitor monitor(context.out, context.err, console_settings(options.lamp, context));
    const RaySet rays = read_rays(options.rays, monitor);
    const Projection made = naming(
        options.rays, [&] { return fit_light_field(rays, options.fit, options.lamp.workers, monitor); });
    finish_lamp(made.field, options.lamp, monitor, context);
    if (!options.lamp.quiet) print_account(context.out, made.account, rays.unit);
}

}  // namespace

void add_light_import(CLI::App& light, const CommandContext& context) {
    const auto options = std::make_shared<ImportOptions>();
    CLI::App& app = *light.add_subcommand("import", "Make a light field from a measured lamp's rays");
    app.footer(kImportFooter);
    app.add_option("RAYS", options->rays, "ray file: IES TM-25 (.tm25ray), Zemax (.dat) or LightTools (.ray)")
        ->required();
    add_planes(app, options->fit.views, options->fit.pixels, options->fit.distance);
    add_word(app, "--capture", "SHARE", "of the forward light that the planes should catch (default 98%)",
             [options](const std::string& word) { options->fit.capture = parse_share({"--capture"}, word); });
    add_word(app, "--height", "LENGTH",
             "of the sampling plane in the rays' frame (default: where most rays start)",
             [options](const std::string& word) { options->fit.z = parse_place({"--height"}, word); });
    add_lamp_output(app, options->lamp);
    app.callback([options, &context] { act_import(*options, context); });
}

}  // namespace lucerna
