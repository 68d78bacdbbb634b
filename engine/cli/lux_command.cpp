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
#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/illuminance_text.h"

namespace lucerna {
namespace {

constexpr const char* kLuxFooter =
    R"(Works out illuminance at points of calculation surfaces: parallelograms in space through which light passes. A scene
names them,

    CalculationSurface "work plane" "point3 P" [0 0.75 0  0 0.75 5  4 0.75 0]

by a corner and the ends of the two sides from there; the side from which the first turns to the second
counterclockwise is lit. Or the command line does: --surface "work plane=0,0.75,0:0,0.75,5:4,0.75,0", or
--height 0.75 for a horizontal plane through the whole model, so far above its lowest point. Lengths are those of the
scene, which are metres. Without --spacing the points lie as EN 12464-1 has them.

For each surface: mean, least and greatest illuminance, the uniformity U_0 = least / mean, and the share of direct light.
Each number has a 95 % confidence interval; --precision 2% (the default) goes on until no point's interval is wider than
± 2 % of its surface's mean. Everything is computed by path tracing, without bias.

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

struct SurfaceWord {
    std::string name;
    std::array<V3d, 3> corners;
};

struct LuxCommand {
    std::string scene, csv, image, json;
    SceneOverrides overrides;
    std::vector<SurfaceWord> surfaces;
    std::vector<double> heights;
    double margin = 0;
    std::optional<int> up_axis;
    std::optional<double> spacing;
    ReceiverKind kind = ReceiverKind::planar;
    std::optional<V3d> facing;
    IlluminanceOptions options;
    bool quiet = false;
};

// "x,y,z"
V3d parse_point(const Location& at, std::string_view word) {
    constexpr double kFar = 1e9;
    V3d p;
    std::string_view rest = word;
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t comma = rest.find(',');
        if ((comma == rest.npos) != (axis == 2))
            input_error(at, "\"{}\" is no point; X,Y,Z is, as 0,0.75,2.5", one_line(word));
        p[axis] = parse_number(at, rest.substr(0, comma), -kFar, kFar);
        rest.remove_prefix(comma == rest.npos ? rest.size() : comma + 1);
    }
    return p;
}

SurfaceWord parse_surface(const Location& at, std::string_view word) {
    const auto [name, place] = parse_assignment(at, word);
    SurfaceWord surface{name, {}};
    std::string_view rest = place;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::size_t colon = rest.find(':');
        if ((colon == rest.npos) != (corner == 2)) {
            input_error(at,
                        "\"{}\" is no surface; NAME=X,Y,Z:X,Y,Z:X,Y,Z is, a corner and the ends of the two "
                        "sides from there",
                        one_line(word));
        }
        surface.corners[corner] = parse_point(at, rest.substr(0, colon));
        rest.remove_prefix(colon == rest.npos ? rest.size() : colon + 1);
    }
    return surface;
}

int parse_axis(const Location& at, std::string_view word) {
    constexpr std::string_view axes = "xyz";
    if (word.size() != 1 || axes.find(word) == axes.npos)
        input_error(at, "\"{}\" is no axis; x, y or z is", one_line(word));
    return static_cast<int>(axes.find(word));
}

ReceiverKind parse_kind(const Location& at, std::string_view word) {
    const auto found = std::find(std::begin(kReceiverKinds), std::end(kReceiverKinds), word);
    if (found == std::end(kReceiverKinds)) {
        input_error(at, "\"{}\" is no kind of illuminance; {} are accepted", one_line(word),
                    fmt::join(kReceiverKinds, ", "));
    }
    return static_cast<ReceiverKind>(found - std::begin(kReceiverKinds));
}

// The axis of the world that is most nearly upward in the picture.
int up_axis_of(const Camera& camera) {
    const M44d& m = camera.settings().world_from_camera;
    const V3d up(m[1][0], m[1][1], m[1][2]);
    int axis = 1;
    for (const int other : {0, 2}) {
        if (std::fabs(up[other]) > std::fabs(up[axis])) axis = other;
    }
    return axis;
}

// What all surfaces of the command line have in common.
CalculationSurface surface_at(const LuxCommand& command, std::string name, const std::array<V3d, 3>& corners,
                              const Location& at) {
    CalculationSurface surface;
    surface.name = std::move(name);
    surface.corner = corners[0];
    surface.u = corners[1] - corners[0];
    surface.v = corners[2] - corners[0];
    surface.kind = command.kind;
    const V3d above = surface.u.cross(surface.v).normalized();  // zero of a surface that is refused below
    surface.up = V3f(above);
    surface.normal = V3f(command.facing.value_or(above));
    const double u = surface.u.length(), v = surface.v.length();
    surface.points = command.spacing ? points_apart(u, v, *command.spacing) : default_points(u, v);
    check_surface(surface, at);
    return surface;
}

CalculationSurface horizontal_plane(const LuxCommand& command, const Job& job, double height) {
    const Location at{"--height"};
    const Box3f bounds = job.scene.bounds();
    if (bounds.isEmpty()) input_error(at, "the scene has no surfaces above which a plane could lie");
    const int up = command.up_axis.value_or(up_axis_of(job.camera)), a = (up + 1) % 3, b = (up + 2) % 3;
    V3d least = V3d(bounds.min) + job.scene.origin(), most = V3d(bounds.max) + job.scene.origin();
    least[up] += height;
    for (const int side : {a, b}) least[side] += command.margin, most[side] -= command.margin;
    if (!(least[a] < most[a]) || !(least[b] < most[b]) || !(least[up] <= most[up])) {
        input_error(
            at,
            "a plane at {:g} with a margin of {:g} does not lie within the scene, which is {:g} x {:g} "
            "wide and {:g} high",
            height, command.margin, most[a] - least[a] + 2 * command.margin,
            most[b] - least[b] + 2 * command.margin, most[up] - least[up] + height);
    }
    std::array<V3d, 3> corners{least, least, least};
    corners[1][a] = most[a];  // up is a x b
    corners[2][b] = most[b];
    return surface_at(command, fmt::format("height {:g}", height), corners, at);
}

std::vector<CalculationSurface> surfaces_of(const LuxCommand& command, const Job& job) {
    std::vector<CalculationSurface> surfaces;
    for (const SurfaceWord& word : command.surfaces)
        surfaces.push_back(surface_at(command, word.name, word.corners, {"--surface"}));
    for (const double height : command.heights) surfaces.push_back(horizontal_plane(command, job, height));
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
    const std::string reached =
        fmt::format("± {:.2g} % of the mean at the worst point", 100 * report.precision);
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

void add_surface_options(CLI::App& app, LuxCommand& command) {
    app.add_option_function<std::vector<std::string>>(
           "--surface",
           [&command](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   command.surfaces.push_back(parse_surface({"--surface"}, word));
           },
           "a calculation surface, in the place of the scene's: a corner, and the ends of the two sides from "
           "there; may be repeated")
        ->type_name("NAME=X,Y,Z:X,Y,Z:X,Y,Z")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option_function<std::vector<std::string>>(
           "--height",
           [&command](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   command.heights.push_back(parse_number({"--height"}, word, -1e9, 1e9));
           },
           "a horizontal plane through the model, so far above its lowest point; may be repeated")
        ->type_name("M")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(
        app, "--margin", "M", "of such a plane, from the model's sides (default 0)",
        [&command](const std::string& word) { command.margin = parse_number({"--margin"}, word, 0, 1e9); });
    add_word(app, "--up", "AXIS", "of such a plane: x, y or z (default: the one nearest to the camera's)",
             [&command](const std::string& word) { command.up_axis = parse_axis({"--up"}, word); });
    add_word(app, "--spacing", "M", "of points, at the most (default: as EN 12464-1 has it)",
             [&command](const std::string& word) {
                 command.spacing = parse_number({"--spacing"}, word, 1e-6, 1e9);
             });
    add_word(app, "--kind", "KIND",
             fmt::format("of illuminance: {} (default planar)", fmt::join(kReceiverKinds, ", ")),
             [&command](const std::string& word) { command.kind = parse_kind({"--kind"}, word); });
    add_word(app, "--facing", "X,Y,Z", "where heads look (default: across the surface)",
             [&command](const std::string& word) {
                 const V3d w = parse_point({"--facing"}, word);
                 if (!(w.length() > 0)) input_error({"--facing"}, "0,0,0 is no direction");
                 command.facing = w.normalized();
             });
}

}  // namespace

void add_lux_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<LuxCommand>();
    CLI::App& app = *program.add_subcommand("lux", "Work out illuminance on calculation surfaces");
    app.footer(kLuxFooter);
    app.add_option("SCENE", command->scene, "scene file in pbrt's text format")->required();
    app.add_option("-o,--output", command->csv, "write a line for each point")->type_name("FILE.csv");
    app.add_option(
           "--image", command->image,
           "write an OpenEXR image with a pixel for each point; FILE-2.exr and so on for further surfaces")
        ->type_name("FILE.exr");
    app.add_option("--json", command->json, "write everything as JSON; - for standard output")
        ->type_name("FILE");
    add_surface_options(app, *command);
    add_word(app, "--precision", "SHARE",
             "of a surface's mean: the half-width of the widest interval at which to end (default 2%)",
             [command](const std::string& word) {
                 command->options.precision = parse_share({"--precision"}, word);
             });
    add_word(
        app, "--time", "TIME", "ends after that long at the latest, as 30s, 5min, 2h",
        [command](const std::string& word) { command->options.seconds = parse_duration({"--time"}, word); });
    add_word(app, "--samples", "N", "of each head, in the place of --precision: the same numbers whenever",
             [command](const std::string& word) {
                 command->options.most_samples =
                     static_cast<int>(parse_whole({"--samples"}, word, 1, 1 << 24));
             });
    add_word(app, "--seed", "N", "starts the random numbers (default 0)",
             [command](const std::string& word) { command->options.seed = parse_seed({"--seed"}, word); });
    add_threads(app, command->options.workers);
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
