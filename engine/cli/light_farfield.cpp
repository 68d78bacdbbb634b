// lucerna light farfield: a lamp as it is seen from afar, as a polar diagram or a photometric file.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "engine/base/files.h"
#include "engine/cli/light_commands.h"
#include "engine/cli/outputs.h"
#include "engine/cli/photometric_text.h"
#include "engine/cli/polar_plot.h"
#include "lights/ies.h"
#include "lights/ldt.h"
#include "lights/measurement/far_field.h"

namespace lucerna {
namespace {

constexpr const char* kLightFarfieldFooter =
    R"(The far field is what is left of a lamp when it is so far away that only the direction counts: farther than
some five times its size (docs/photometry.md measures that). -o NAME.svg draws the polar diagram of the planes
C0-C180 and C90-C270; -o NAME.ies writes IES LM-63-2002, absolute. Both may be given.
A lamp in W needs --efficacy for a photometric file: how many lm each of its W is.

Examples:
  lucerna light farfield lamp.exr -o lamp.svg
  lucerna light farfield lamp.tm25ray -o lamp.ies -o lamp.svg --step 2.5
  lucerna light farfield street.ldt -o street.ies
  lucerna light farfield lamp-in-watts.exr -o lamp.ies --efficacy 320)";

struct FarFieldOptions {
    std::string lamp;
    std::vector<std::string> outputs;
    FarFieldGrid grid;
    double efficacy = 0;  // lm/W; 0: not given
    Workers workers;
    bool quiet = false;
};

struct Lamp {
    PhotometricWeb web;
    FluxUnit unit;
};

Lamp read_lamp(const FarFieldOptions& options, Monitor& monitor) {
    if (is_photometric(options.lamp)) return {read_photometric(options.lamp, monitor), FluxUnit::lumen};
    if (suffix_of(options.lamp) == ".exr") {
        const LightField field = read_light_field(options.lamp);
        return {far_field(field, options.grid, options.workers, monitor), field.info().unit};
    }
    const RaySet rays = read_rays(options.lamp, monitor);
    return {far_field(rays, options.grid), rays.unit};
}

void declare_files(const FarFieldOptions& options) {
    CommandFiles files;
    files.reads(options.lamp);
    for (const std::string& output : options.outputs) {
        const std::string suffix = suffix_of(output);
        if (suffix != ".svg" && suffix != ".ies")
            throw InputError({output}, fmt::format("\"{}\" cannot be written; .svg and .ies can", suffix));
        files.writes(output, suffix, "-o");
    }
}

void act(const FarFieldOptions& options, const CommandContext& context) {
    require_readable(options.lamp);
    declare_files(options);
    ConsoleMonitor monitor(context.out, context.err,
                           {context.around.terminal, options.quiet, context.around.stop, {}});
    Lamp lamp = naming(options.lamp, [&] { return read_lamp(options, monitor); });
    if (lamp.unit == FluxUnit::watt && options.efficacy > 0)
        lamp = {scaled(lamp.web, options.efficacy), FluxUnit::lumen};
    const bool photometric = lamp.unit == FluxUnit::lumen;
    const auto is_file = [](const std::string& output) { return suffix_of(output) == ".ies"; };
    if (!photometric && std::any_of(options.outputs.begin(), options.outputs.end(), is_file)) {
        throw InputError({options.lamp},
                         "the lamp is in W, an .ies file in lm; --efficacy LM_PER_W says how they go");
    }
    const std::string title = std::filesystem::path(options.lamp).stem().string();
    for (const std::string& output : options.outputs) {
        if (suffix_of(output) == ".svg") {
            write_text(output, polar_plot_svg(lamp.web, title, photometric ? "cd" : "W/sr",
                                              flux_unit_name(lamp.unit)));
        } else {
            write_ies(output, lamp.web, title);
        }
    }
    if (!options.quiet) print_photometric(context.out, lamp.web, lamp.unit);
}

}  // namespace

void add_light_farfield(CLI::App& light, const CommandContext& context) {
    const auto options = std::make_shared<FarFieldOptions>();
    CLI::App& app =
        *light.add_subcommand("farfield", "A lamp seen from afar: polar diagram, photometric file");
    app.footer(kLightFarfieldFooter);
    app.add_option("LAMP", options->lamp,
                   "light field (.exr), rays (.tm25ray, .dat, .ray) or photometric file (.ies, .ldt)")
        ->required();
    app.add_option("-o,--output", options->outputs, "polar diagram (.svg), photometric file (.ies)")
        ->type_name("FILE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(app, "--step", "DEGREES", "between angles from nadir, a divisor of 90 (default 1)",
             [options](const std::string& word) {
                 options->grid.polar_step = parse_number({"--step"}, word, 0.05, 45);
             });
    add_word(app, "--plane-step", "DEGREES", "between C planes, a divisor of 360 (default 5)",
             [options](const std::string& word) {
                 options->grid.azimuth_step = parse_number({"--plane-step"}, word, 0.05, 90);
             });
    add_word(app, "--efficacy", "LM_PER_W", "lumens that each W of a lamp in W is",
             [options](const std::string& word) {
                 options->efficacy = parse_number({"--efficacy"}, word, 1e-6, 683);
             });
    add_threads(app, options->workers);
    app.add_flag("--quiet", options->quiet, "say nothing but warnings and errors");
    app.callback([options, &context] { act(*options, context); });
}

}  // namespace lucerna
