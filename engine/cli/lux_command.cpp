// lucerna lux: illuminance on calculation surfaces.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/surface_options.h"
#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/illuminance_text.h"

namespace lucerna {
namespace {

constexpr const char* kLuxFooter =
    R"(Computes illuminance at points of calculation surfaces: parallelograms in space through which light passes. A scene
names them,

    CalculationSurface "work plane" "point3 P" [0 0.75 0  0 0.75 5  4 0.75 0]

by a corner and the ends of the two sides from there; the side from which the first turns to the second
counterclockwise is lit. Or the command line does: --surface "work plane=0,0.75,0:0,0.75,5:4,0.75,0", or
--height 0.75 for a horizontal plane through the whole model, so far above its lowest point. Lengths are those of the
scene, which are metres. Without --spacing the points lie as EN 12464-1 has them.

For each surface: mean, least and greatest illuminance, the uniformity U_0 = least / mean, and the share of direct light.
Each number has a 95 % confidence interval; --precision 2% (the default) continues until no point's interval is wider than
± 2 % of its illuminance, or of its surface's mean where that is more. --time ends earlier. Everything is computed by
path tracing, without bias.

Kinds: planar (as a photometer that lies on the surface reads it), cylindrical, semicylindrical, hemispherical and
spherical (EN 12665; scalar illuminance is four times the last). --facing has planar heads look elsewhere: the vertical
illuminance at the height of eyes is --facing 1,0,0.

-o writes a line for each point, with direct and indirect light, and what each light group of the scene brings: groups
can be dimmed there without another run. --image writes a pixel for each point.

Examples:
  lucerna lux room.pbrt -o lux.csv
  lucerna lux room.pbrt --height 0.75 --margin 0.5 --spacing 0.25
  lucerna lux room.pbrt --height 1.2 --kind cylindrical --precision 5% --json lux.json
  lucerna lux room.pbrt --surface "desk=1,0.75,1:2.6,0.75,1:1,0.75,1.8" --time 30s)";

struct LuxCommand {
    std::string scene, csv, image, json;
    SceneOverrides overrides;
    SurfaceOptions surfaces;
    IlluminanceOptions options;
    bool quiet = false;
};

std::vector<CalculationSurface> surfaces_of(const LuxCommand& command, const Job& job) {
    std::vector<CalculationSurface> surfaces = command.surfaces.all(job);
    if (surfaces.empty()) surfaces = job.surfaces;
    if (surfaces.empty()) {
        throw InputError({command.scene},
                         "names no CalculationSurface; --height 0.75, or --surface "
                         "NAME=X,Y,Z:X,Y,Z:X,Y,Z, is accepted in its place");
    }
    return surfaces;
}

// "lux.exr" -> "lux-2.exr" of the second of several surfaces.
std::filesystem::path image_of(const LuxCommand& command, std::size_t surface) {
    const std::filesystem::path file = command.image;
    if (surface == 0) return file;
    return file.parent_path() /
           fmt::format("{}-{}{}", file.stem().string(), surface + 1, file.extension().string());
}

std::string end_text(const IlluminanceReport& report) {
    const std::string reached = fmt::format("± {:.2g} % at the worst point", 100 * report.precision);
    return fmt::format("{}; {} samples for each point, {}", reached,
                       static_cast<std::int64_t>(report.heads) * report.samples,
                       duration_text(report.seconds));
}

void act(const LuxCommand& command, const CommandContext& context) {
    require_readable(command.scene);
    CommandFiles files;
    files.reads(command.scene);
    if (!command.csv.empty()) files.writes(command.csv, "", "-o");
    if (!command.json.empty() && command.json != "-") files.writes(command.json, "", "--json");
    ConsoleMonitor monitor(
        context.err, context.err,
        {context.around.terminal, command.quiet || !context.around.terminal, context.around.stop, {}});
    Job job = read_scene(command.scene, command.overrides, command.options.workers, monitor);
    files.reads(job.files);
    const std::vector<CalculationSurface> surfaces = surfaces_of(command, job);
    for (std::size_t i = 0; i < surfaces.size() && !command.image.empty(); ++i)
        files.writes(image_of(command, i), ".exr", "--image");

    const Listening listening(context.around);
    const IlluminanceReport report = illuminance_on(surfaces, std::move(job), command.options, monitor);
    if (!command.csv.empty()) write_text(command.csv, illuminance_csv(report));
    for (std::size_t i = 0; i < surfaces.size() && !command.image.empty(); ++i)
        write_exr(image_of(command, i), illuminance_image(report.surfaces[i], report));
    if (command.json == "-") {
        context.out << illuminance_json(report);
    } else {
        if (!command.json.empty()) write_text(command.json, illuminance_json(report));
        context.out << illuminance_text(report) << end_text(report) << '\n';
    }
    if (report.ended_by == "user") throw Stopped("interrupted: the intervals are wider than was asked for");
}

}  // namespace

void add_lux_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<LuxCommand>();
    CLI::App& app = *program.add_subcommand("lux", "Compute illuminance on calculation surfaces");
    app.footer(kLuxFooter);
    app.add_option("SCENE", command->scene, "scene file in pbrt's text format")->required();
    app.add_option("-o,--output", command->csv, "write a line for each point")->type_name("FILE.csv");
    app.add_option(
           "--image", command->image,
           "write an OpenEXR image with a pixel for each point; FILE-2.exr and so on for further surfaces")
        ->type_name("FILE.exr");
    app.add_option("--json", command->json, "write everything as JSON; - for standard output")
        ->type_name("FILE");
    add_surface_options(app, command->surfaces);
    add_word(app, "--precision", "SHARE",
             "of a point's illuminance, or of the mean: the half-width of the widest interval at which to "
             "end (default 2%)",
             [command](const std::string& word) {
                 command->options.precision = parse_share({"--precision"}, word);
             });
    add_word(
        app, "--time", "TIME", "end after this time at the latest, as 30s, 5min, 2h",
        [command](const std::string& word) { command->options.seconds = parse_duration({"--time"}, word); });
    add_word(app, "--samples", "N", "of each head, instead of --precision: the same results in every run",
             [command](const std::string& word) {
                 command->options.most_samples =
                     static_cast<int>(parse_whole({"--samples"}, word, 1, 1 << 24));
             });
    add_word(app, "--seed", "N", "seed of the random numbers (default 0)",
             [command](const std::string& word) { command->options.seed = parse_seed({"--seed"}, word); });
    add_threads(app, command->options.workers);
    add_unit_option(app, command->overrides.unit);
    app.add_flag("--skip-missing", command->overrides.skip_missing,
                 "leave out meshes and textures whose file does not exist, with a warning");
    app.add_flag("--strict", command->overrides.strict,
                 "refuse what is not rendered as the scene says, instead of a warning");
    app.add_flag("--quiet", command->quiet, "print results, warnings and errors only");
    app.callback([command, &context] {
        command->overrides.colours = WorkingSpace();
        act(*command, context);
    });
}

}  // namespace lucerna
