// lucerna glare: the unified glare rating at observers' eyes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/plain_text.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/surface_options.h"
#include "engine/pbrt/read_scene.h"
#include "engine/photometry/glare.h"

namespace lucerna {
namespace {

constexpr const char* kGlareFooter =
    R"(Rates the discomfort glare of the scene's luminaires: UGR = 8 log10(0.25 / L_b sum L^2 w / p^2), with the background's
luminance L_b, a luminaire's luminance L, its solid angle w and its position index p (CIE 117). The lights of the scene must
count in lm.

Twice: by each luminaire's mean luminance, as a photometric file would have it, and as it is seen from there, by the near field
of the lamp: a few bright points glare more than an even surface of the same intensity. What is seen is filtered by a
Gaussian of 12 mm on the luminaire, as CIE 232 has it for uneven luminaires; --blur 0mm does without.

An observer is an eye and what it looks at: --eye "desk=1,1.2,3:1,1.2,0". --height 1.2 has eyes on a horizontal grid
through the whole model instead, which look along each --view. Without either the eye is the scene's camera.

Examples:
  lucerna glare room.pbrt
  lucerna glare room.pbrt --eye "desk=1,1.2,3:1,1.2,0" --eye "door=4,1.7,1:0,1.7,1"
  lucerna glare room.pbrt --height 1.2 --margin 0.5 --spacing 1 --view 1,0,0 --view 0,0,1 -o glare.csv)";

struct Eye {
    std::string name;
    V3d from, to;
};

struct GlareCommand {
    std::string scene, csv, json;
    SceneOverrides overrides;
    std::vector<Eye> eyes;
    SurfaceOptions grid;
    std::vector<V3d> views;
    GlareOptions options;
    bool quiet = false;
};

Eye parse_eye(const Location& at, std::string_view word) {
    const auto [name, places] = parse_assignment(at, word);
    const std::size_t colon = places.find(':');
    if (colon == std::string::npos) {
        input_error(at, "\"{}\" is no observer; NAME=X,Y,Z:X,Y,Z is, an eye and a point that it looks at",
                    one_line(word));
    }
    Eye eye{name, parse_point(at, std::string_view(places).substr(0, colon)),
            parse_point(at, std::string_view(places).substr(colon + 1))};
    if (!((eye.to - eye.from).length() > 0)) input_error(at, "\"{}\" looks at its own eye", one_line(word));
    return eye;
}

std::vector<Observer> observers_of(const GlareCommand& command, const Job& job) {
    const int axis = command.grid.up_axis.value_or(up_axis_of(job.camera));
    V3f up(0);
    up[axis] = 1;
    std::vector<Observer> observers;
    for (const Eye& eye : command.eyes)
        observers.push_back({eye.name, eye.from, V3f((eye.to - eye.from).normalized()), up});
    std::vector<V3d> views = command.views;
    if (views.empty()) {
        for (const int across : {(axis + 1) % 3, (axis + 2) % 3}) {
            for (const double sign : {1.0, -1.0}) {
                V3d view(0);
                view[across] = sign;
                views.push_back(view);
            }
        }
    }
    for (const CalculationSurface& grid : command.grid.all(job)) {
        for (int y = 0; y < grid.points.y; ++y) {
            for (int x = 0; x < grid.points.x; ++x) {
                for (const V3d& view : views)
                    observers.push_back({grid.name, grid.position(x, y), V3f(view), up});
            }
        }
    }
    if (observers.empty()) {
        const M44d& m = job.camera.settings().world_from_camera;
        const auto row = [&m](int i) { return V3d(m[i][0], m[i][1], m[i][2]); };
        observers.push_back({"camera", row(3) + job.scene.origin(), V3f(row(2).normalized()), up});
    }
    return observers;
}

std::string reading_text(const Reading95& reading) {
    return std::isfinite(reading.value) ? fmt::format("{:.4g}", reading.value) : "none";
}

std::string rating_text(const Reading95& rating) {
    return std::isfinite(rating.value) ? fmt::format("{:.1f} ± {:.1f}", rating.value, rating.half_width)
                                       : "none";
}

std::string text_of(const std::vector<GlareReport>& reports) {
    std::string text = fmt::format("{:<16} {:<28} {:>12} {:>12} {:>10} {:>10} {:>10}\n", "observer", "at",
                                   "UGR", "UGR of means", "L_b cd/m²", "E_v lx", "luminaires");
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        text += fmt::format("{:<16} {:<28} {:>12} {:>12} {:>10} {:>10} {:>10}\n", plain_text(by.name),
                            fmt::format("{:.4g} {:.4g} {:.4g}", by.eye.x, by.eye.y, by.eye.z),
                            rating_text(report.ugr), rating_text(report.ugr_even),
                            reading_text(report.background), reading_text(report.vertical),
                            report.sources.size());
    }
    return text;
}

std::string csv_of(const std::vector<GlareReport>& reports) {
    std::string text =
        "observer,x,y,z,view x,view y,view z,UGR,half-width of 95 %,UGR of means,L_b [cd/m^2],E_v "
        "[lx],luminaires\n";
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        text += fmt::format(
            "\"{}\",{:.7g},{:.7g},{:.7g},{:.4g},{:.4g},{:.4g},{:.4g},{:.2g},{:.4g},{:.5g},{:.5g},{}\n",
            plain_text(by.name), by.eye.x, by.eye.y, by.eye.z, by.view.x, by.view.y, by.view.z,
            report.ugr.value, report.ugr.half_width, report.ugr_even.value, report.background.value,
            report.vertical.value, report.sources.size());
    }
    return text;
}

std::string json_of(const std::vector<GlareReport>& reports) {
    const auto number = [](const Reading95& reading) {
        nlohmann::json of{{"value", nullptr}, {"half_width", reading.half_width}};
        if (std::isfinite(reading.value)) of["value"] = reading.value;
        return of;
    };
    nlohmann::json json = nlohmann::json::array();
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        nlohmann::json of{{"name", plain_text(by.name)},
                          {"eye", {by.eye.x, by.eye.y, by.eye.z}},
                          {"view", {by.view.x, by.view.y, by.view.z}},
                          {"ugr", number(report.ugr)},
                          {"ugr_of_means", number(report.ugr_even)},
                          {"background", number(report.background)},
                          {"vertical", number(report.vertical)},
                          {"sources", nlohmann::json::array()}};
        for (const GlareSource& source : report.sources) {
            of["sources"].push_back({{"light", source.light},
                                     {"kind", source.kind},
                                     {"solid_angle", source.solid_angle},
                                     {"luminance", source.luminance},
                                     {"position_index", source.position},
                                     {"term_of_mean", number(source.even)},
                                     {"term", number(source.seen)}});
        }
        json.push_back(std::move(of));
    }
    return json.dump(1) + '\n';
}

void act(const GlareCommand& command, const CommandContext& context) {
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
    const std::vector<Observer> observers = observers_of(command, job);
    const Listening listening(context.around);
    const std::vector<GlareReport> reports = glare_at(observers, std::move(job), command.options, monitor);
    if (!command.csv.empty()) write_text(command.csv, csv_of(reports));
    if (command.json == "-") {
        context.out << json_of(reports);
        return;
    }
    if (!command.json.empty()) write_text(command.json, json_of(reports));
    context.out << text_of(reports);
}

}  // namespace

void add_glare_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<GlareCommand>();
    CLI::App& app = *program.add_subcommand("glare", "Rate the discomfort glare of luminaires (UGR)");
    app.footer(kGlareFooter);
    app.add_option("SCENE", command->scene, "scene file in pbrt's text format")->required();
    app.add_option("-o,--output", command->csv, "write a line for each observer")->type_name("FILE.csv");
    app.add_option("--json", command->json,
                   "write everything, each luminaire's term too, as JSON; - for standard output")
        ->type_name("FILE");
    app.add_option_function<std::vector<std::string>>(
           "--eye",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words) command->eyes.push_back(parse_eye({"--eye"}, word));
           },
           "an observer: an eye, and a point that it looks at; may be repeated")
        ->type_name("NAME=X,Y,Z:X,Y,Z")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_height_options(app, command->grid);
    app.add_option_function<std::vector<std::string>>(
           "--view",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words) {
                   const V3d view = parse_point({"--view"}, word);
                   if (!(view.length() > 0)) input_error({"--view"}, "0,0,0 is no direction");
                   command->views.push_back(view.normalized());
               }
           },
           "where eyes of such a plane look; may be repeated (default: the four horizontal axes)")
        ->type_name("X,Y,Z")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(app, "--blur", "LENGTH", "full width at half maximum of the filter (default 12mm)",
             [command](const std::string& word) {
                 command->options.blur = parse_place({"--blur"}, word);
                 if (!(command->options.blur >= 0)) input_error({"--blur"}, "{} is less than nothing", word);
             });
    add_word(app, "--precision", "SHARE", "of the background: the half-width of its interval (default 2%)",
             [command](const std::string& word) {
                 command->options.precision = parse_share({"--precision"}, word);
             });
    add_word(
        app, "--time", "TIME", "the background's at the most, as 30s, 5min, 2h",
        [command](const std::string& word) { command->options.seconds = parse_duration({"--time"}, word); });
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
