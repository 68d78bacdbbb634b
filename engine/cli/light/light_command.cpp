// lucerna light: makes light fields of lamps, and prints their contents.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <filesystem>
#include <memory>

#include "engine/cli/command_files.h"
#include "engine/cli/light/lamp_text.h"
#include "engine/cli/light/light_commands.h"
#include "engine/system/files.h"
#include "lights/cell_table.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

constexpr const char* kLightFooter = R"(Examples:
  lucerna light import lamp.tm25ray -o lamp.exr
  lucerna light acquire --radius 25mm --flux 1500 --unit lm -o lamp.exr
  lucerna light edit led.exr --move 20mm,0,0 led.exr --move=-20mm,0,0 --turn z,180 -o lamp.exr
  lucerna light info lamp.exr
  lucerna light project lamp.exr --distance 1m -o wall.exr --png
  lucerna light view lamp.exr -o views.png
  lucerna light ugr lamp.exr -o ugr.csv)";

constexpr int kMostPerSide = 4096;  // views or pixels

}  // namespace

void add_lamp_output(CLI::App& app, LampOutput& output) {
    app.add_option("-o,--output", output.file, "the light field")->type_name("LAMP.exr")->required();
    add_threads(app, output.workers);
    app.add_flag("--quiet", output.quiet, "print warnings and errors only");
}

void declare_lamp(const std::filesystem::path& file, std::string_view by, CommandFiles& files) {
    files.writes(file, ".exr", by);
    files.writes_beside(cell_table_file(file), by);
}

ConsoleSettings console_settings(const LampOutput& output, const CommandContext& context) {
    return {context.process.terminal, output.quiet, context.process.stop, {}};
}

void add_planes(CLI::App& app, V2i& views, V2i& pixels, double& distance) {
    add_word(app, "--views", "WxH", "filter positions on the sampling plane",
             [&views](const std::string& word) { views = parse_size({"--views"}, word, kMostPerSide); });
    add_word(app, "--pixels", "WxH", "pixels of a view's image on the measurement plane",
             [&pixels](const std::string& word) { pixels = parse_size({"--pixels"}, word, kMostPerSide); });
    add_word(app, "--distance", "LENGTH", "distance between the planes, for example 40mm",
             [&distance](const std::string& word) { distance = parse_length({"--distance"}, word); });
}

Lumigraph write_lamp(const Lumigraph& made, const std::filesystem::path& file, const Workers& workers,
                     Monitor& monitor) {
    write_lumigraph(file, made);
    Lumigraph lamp = read_lumigraph(file);
    load_or_build_cell_tables(file, fields_of(lamp), workers, monitor);
    return lamp;
}

Lumigraph finish_lamp(const Lumigraph& made, const LampOutput& output, ConsoleMonitor& monitor,
                      const CommandContext& context) {
    Lumigraph lamp = write_lamp(made, output.file, output.workers, monitor);
    if (output.quiet) return lamp;
    print_lumigraph(context.out, lamp, output.workers);
    std::error_code unknown;
    const auto size = std::filesystem::file_size(output.file, unknown);
    fmt::print(context.out, "light field          {} ({})\n", output.file,
               unknown ? std::string("size unknown") : bytes_text(static_cast<double>(size)));
    return lamp;
}

void add_light_command(CLI::App& program, const CommandContext& context) {
    CLI::App& light = *program.add_subcommand("light", "Make and inspect light fields of lamps");
    light.footer(kLightFooter);
    light.require_subcommand(1);
    add_light_import(light, context);
    add_light_acquire(light, context);
    add_light_edit(light, context);
    add_light_emit(light, context);
    add_light_assemble(light, context);
    add_light_info(light, context);
    add_light_project(light, context);
    add_light_view(light, context);
    add_light_farfield(light, context);
    add_light_ugr(light, context);
}

void add_efficacy(CLI::App& app, double& efficacy) {
    add_word(
        app, "--efficacy", "LM_PER_W",
        "luminous efficacy of a lamp in W, in lm/W (default: as its file states)",
        [&efficacy](const std::string& word) { efficacy = parse_number({"--efficacy"}, word, 1e-6, 683); });
}

// lucerna light info: prints the contents of a lamp's file.

namespace {

constexpr const char* kLightInfoFooter = R"(Examples:
  lucerna light info lamp.exr
  lucerna light info lamp.tm25ray
  lucerna light info lamp.ies
  lucerna light info lamp.gldf#variant-2)";

void act_info(const std::string& file, const CommandContext& context) {
    require_readable(photometric_file(file));
    ConsoleMonitor monitor(context.out, context.err, {false, true, context.process.stop, {}});
    if (is_photometric(file))
        return print_photometric(context.out, read_photometric(file, monitor), FluxUnit::lumen);
    const LampFile lamp = read_lamp_file(file, monitor);
    if (const auto* field = std::get_if<Lumigraph>(&lamp)) {
        print_lumigraph(context.out, *field, {});
        if (field->flux() > 0) print_beam(context.out, far_field(*field, {}, {}, monitor), field->unit());
    } else {
        const RaySet& rays = std::get<RaySet>(lamp);
        print_ray_set(context.out, rays);
        if (rays.flux > 0) print_beam(context.out, rays);
    }
}

}  // namespace

void add_light_info(CLI::App& light, const CommandContext& context) {
    const auto file = std::make_shared<std::string>();
    CLI::App& app = *light.add_subcommand("info", "Print geometry, flux and losses of a lamp's file");
    app.footer(kLightInfoFooter);
    app.add_option(
           "LAMP", *file,
           "light field (.exr), rays (.tm25ray, .dat, .ray) or photometric file (.ies, .ldt, .xml, .gldf)")
        ->type_name("FILE")
        ->required();
    app.callback([file, &context] { act_info(*file, context); });
}

}  // namespace lucerna
