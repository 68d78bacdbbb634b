// lucerna lux: computes illuminance on calculation surfaces.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/photometry/lux_page.h"
#include "engine/cli/photometry/lux_runs.h"
#include "engine/cli/photometry/lux_scene.h"
#include "engine/cli/photometry/plan_files.h"
#include "engine/cli/render/checkpointing.h"
#include "engine/colour/tone.h"
#include "engine/image/displayed.h"
#include "engine/image/image.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/system/printed_page.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr const char* kLuxFooter =
    R"(Computes illuminance at points on calculation surfaces: parallelograms in space that light passes through. The scene
defines them,

    CalculationSurface "work plane" "point3 P" [0 0.75 0  0 0.75 5  4 0.75 0]

by a corner and the other ends of the two sides from it; the surface receives light on the side from which the turn from
the first to the second side is counterclockwise. They can also be given on the command line:
--surface "work plane=0,0.75,0:0,0.75,5:4,0.75,0", --height 0.75 for a horizontal plane across the whole model, 0.75 m
above its lowest point, or --floors 0.75 for one above each floor, which is found as a level surface with 2 m of clear height
above it. Lengths are metres, or have a unit: 75cm. Without --spacing the points are placed
according to EN 12464-1.

Results for each surface: mean, minimum and maximum illuminance, the uniformity U_0 = minimum / mean, and the share of direct
light. Each number has a 95 % confidence interval; with --precision 2% (the default) the computation continues until no
point's interval is wider than ± 2 % of its illuminance, or of the surface's mean if that is more. --time stops it earlier;
without it the computation ends with a warning where that precision would take more than an hour.
Points are computed by path tracing, unbiased. Light passes panes (thindielectric) in a straight line and is sampled
through them. Light that comes over mirrors, lenses or solid glass from lamps that paths seldom meet is estimated by light
paths from the lamps that pass close to a point: the more paths, the closer. The intervals include what this blur changes; a
warning tells where it stays larger than --precision. Points inside furniture, walls and closed rooms do not count: their
cells are empty, and a line tells how many they are.

Kinds: planar (as read by a photometer on the surface), cylindrical, semicylindrical, hemispherical and spherical (EN 12665;
scalar illuminance is four times the spherical). --facing turns sensors to another direction: for example,
--facing 1,0,0 gives the vertical illuminance at eye height. Cylindrical and spherical sensors face no direction.

--require Em=500,U0=0.6,UGR=19 judges the lighting by EN 12464-1: each requirement is met, missed, or not decided where the
interval of its value holds the limit. The surfaces are the task areas; further ones are calculated where requirements need
them, in the room that is found around each task area: its surround (0.5 m) and background (3 m), walls, ceiling, and
cylindrical illuminance at --eye-height. UGR is rated from the middle of each side of the room. --maintenance-factor 0.8 turns
all illuminances into maintained ones; --maintenance-factor spots=0.7 is that of a light group. The requirements:

{}
--require tasks.csv#34.2 takes them from the row 34.2 of a table of your own, whose first line names the columns: "reference",
"task" and requirements, for example reference,task,Em,U0,UGR,Ra. Values may follow and replace those of the row:
--require tasks.csv#34.2,UGR=16.

--daylight-factor divides by the illuminance of an unobstructed horizontal plane under the scene's sky, and prints per cent.
The scene's light must be one sky, for example LightSource "sky" "string type" "cie-16"; the sky's own sun is left out.

--far-field-error shows how accurate a photometric file would be in this scene: it computes everything again with the
far-field intensities of each measured lamp, once from a point and once from the luminous opening that lucerna light farfield
writes, and reports the relative errors of the illuminance; with --plan and --html also as maps. It prints the floor of the method, too: by how much the table of intensities, in steps of
1 by 5 degrees, differs from the lamp's own.

--replicates computes how uncertain the numbers are because the lamps were measured with a finite number of rays: it computes
everything again with each of the lamps' bootstrap replicates, which lucerna light import --replicates 20 writes beside a lamp,
and reports the expanded uncertainty (k = 2) of mean, minimum, U_0 and points, beside the Monte Carlo interval and combined
with it. It takes about as many times as long as there are replicates. If the scatter of the replicates is not
distinguishable from Monte Carlo noise, an upper bound is given; a smaller --precision lowers it. Included is what the choice
of resolution and smoothing adds, which differs from one ray file to the next; not included are the mean bias by them and
systematic errors of the measurement. Beside it stands the error of each lamp's light field by held-out rays, which includes
that bias. With --plan and --html also as a map. --time is for all runs together.

--colour computes the colour of the light at each point from the spectra of the lamps: correlated colour temperature and Duv,
the colour rendering indices R_a and R_9 (CIE 13.3), fidelity and gamut R_f and R_g (TM-30), and the melanopic equivalent
daylight illuminance (CIE S 026). All lights need a spectrum: light fields have those of the rays that they were imported
from, other lights those of a colour as "spectrum" or "blackbody". Where all surfaces are grey the result is exact but for the
lamps' own spectra; otherwise reflectances are taken in nine intervals of wavelengths, whose error is printed. It takes one
more run, or four where surfaces have colours. The intervals of confidence are as above.

-o writes a line for each point, with direct and indirect light, and the contribution of each light group of the scene, so
that groups can be dimmed there without another run. --image writes a pixel for each point.

Examples:
  lucerna lux room.pbrt -o lux.csv --plan lux.svg
  lucerna lux room.pbrt --height 0.75 --html report.html --picture room.exr
  lucerna lux room.pbrt --height 0.75 --margin 0.5 --spacing 0.25
  lucerna lux room.pbrt --require Em=500,U0=0.6,UGR=19,Ez=150,walls=150,ceiling=100 --maintenance-factor 0.8 --html report.html
  lucerna lux room.pbrt --height 0.75 --replicates --precision 0.5%
  lucerna lux scenes/window/window.pbrt --daylight-factor
  lucerna lux room.pbrt --height 1.2 --facing 1,0,0 --colour -o eyes.csv
  lucerna lux room.pbrt --height 1.2 --kind cylindrical --precision 5% --json lux.json
  lucerna lux room.pbrt --surface "desk=1,0.75,1:2.6,0.75,1:1,0.75,1.8" --time 30s)";

constexpr std::string_view kErrorMap = "error", kOpeningErrorMap = "opening-error",
                           kUncertaintyMap = "uncertainty";

std::string end_text(const IlluminanceReport& report) {
    const std::string reached =
        std::isfinite(report.precision)
            ? fmt::format("± {} at the least accurate point", percent_text(report.precision))
            : "light is missing at points where none was found";
    return fmt::format("{}; {} samples for each point, {}", reached,
                       static_cast<std::int64_t>(report.sensors) * report.samples,
                       duration_text(report.seconds));
}

// Returns a plan of other values than illuminance, without isolines.
PlanFigure plan_of_others(const IlluminanceReport& report, std::size_t surface, std::vector<double> values,
                          const std::string& title, const LuxPage& page) {
    PlanFigure plan = plan_of(report, surface, std::move(values), page);
    plan.title = title + ": " + plan.title;
    plan.isolines.shown = false;
    return plan;
}

// Adds plans of the errors to the page, and writes them beside the plan of illuminance.
void draw_errors(const LuxCommand& command, const LuxResults& results, LuxPage& page) {
    const auto draw = [&](const std::vector<FarFieldError>& surfaces, std::string_view from,
                          std::string_view map) {
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            std::vector<double> values;
            for (const Reading95& point : surfaces[i].points) values.push_back(100 * point.value);
            PlanFigure plan = plan_of_others(results.report, i, values,
                                             fmt::format("error of the far field from {}", from), page);
            plan.unit = "%";
            plan.scale.map = ColourMap::diverging;
            page.more_plans.push_back(plan);
            if (!command.plan.empty()) write_plan(of_map(of_surface(command.plan, i), map), plan);
        }
    };
    draw(results.errors.from_point, "a point", kErrorMap);
    draw(results.errors.from_opening, "the luminous opening", kOpeningErrorMap);
}

void draw_uncertainties(const LuxCommand& command, const LuxResults& results, LuxPage& page) {
    for (std::size_t i = 0; i < results.uncertainty.surfaces.size(); ++i) {
        std::vector<double> values;
        for (const LampUncertainty& point : results.uncertainty.surfaces[i].points)
            values.push_back(point.expanded);
        const PlanFigure plan =
            plan_of_others(results.report, i, values, "uncertainty by the lamps' measurement (k = 2)", page);
        page.more_plans.push_back(plan);
        if (!command.plan.empty()) write_plan(of_map(of_surface(command.plan, i), kUncertaintyMap), plan);
    }
}

// Replaces R, G and B by the denoised image if there is one.
void show_denoised(Image& image) {
    for (const std::string name : {"R", "G", "B"}) {
        const auto measured = find_channel(image, name), denoised = find_channel(image, "denoised." + name);
        if (!measured || !denoised) return;
        for (std::size_t at = 0; at < image.data.size(); at += image.channels.size())
            image.data[at + *measured] = image.data[at + *denoised];
    }
}

std::optional<Image> picture_of(const LuxCommand& command, CommandFiles& files) {
    if (command.picture.empty()) return std::nullopt;
    if (!command.has_page()) throw InputError({"--picture"}, "applies only together with --html or --pdf");
    files.reads(command.picture);
    Image image = read_exr(command.picture);
    show_denoised(image);
    const PictureLook look = PictureOptions().look(image);
    return displayed(image, look);
}

void declare_images(const LuxCommand& command, std::size_t surfaces, CommandFiles& files) {
    for (std::size_t i = 0; i < surfaces; ++i) {
        if (!command.image.empty()) files.writes(of_surface(command.image, i), ".exr", "--image");
        if (command.plan.empty()) continue;
        const std::filesystem::path plan = of_surface(command.plan, i);
        declare_plan(plan, files);
        for (const std::string_view map : {kErrorMap, kOpeningErrorMap}) {
            if (command.far_field_error) declare_plan(of_map(plan, map), files);
        }
        if (command.replicates) declare_plan(of_map(plan, kUncertaintyMap), files);
    }
}

void warn_of_points_outside(std::span<const CalculationSurface> surfaces, const Scene& scene,
                            Monitor& monitor) {
    for (const CalculationSurface& surface : surfaces) {
        std::vector<V3d> points;
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x) {
                if (surface.counts(x, y)) points.push_back(surface.position(x, y));
            }
        }
        warn_outside(scene, "surface \"" + plain_text(surface.name) + "\"", points, monitor);
    }
}

// Writes the images and plans, and adds the further plans to the page.
void write_images(const LuxCommand& command, const LuxResults& results, LuxPage& page) {
    const IlluminanceReport& report = results.report;
    for (std::size_t i = 0; i < report.surfaces.size(); ++i) {
        if (!command.image.empty())
            write_exr(of_surface(command.image, i), illuminance_image(report.surfaces[i], report));
        if (!command.plan.empty()) write_plan(of_surface(command.plan, i), plan_of(report, i, page));
    }
    if (!command.draws_plans()) return;
    draw_errors(command, results, page);
    draw_uncertainties(command, results, page);
}

void print(const LuxCommand& command, const LuxResults& results, std::ostream& out) {
    const auto& [report, glare, judgements, errors, colour, uncertainty] = results;
    if (command.common.prints_json()) {
        out << illuminance_json(report, uncertainty, errors, colour, judgements);
        return;
    }
    if (!command.common.json.empty())
        write_text(command.common.json, illuminance_json(report, uncertainty, errors, colour, judgements));
    out << illuminance_text(report) << judgements_text(judgements) << end_text(report) << '\n';
    out << colour_text(report, colour) << far_field_text(errors);
    if (uncertainty.replicates > 0) out << uncertainty_text(report, uncertainty);
}

void act(const LuxCommand& command, const CommandContext& context) {
    const Stopwatch clock;
    CommandFiles files;
    command.common.declare(files);
    if (!command.html.empty()) files.writes(command.html, ".html", "--html");
    if (!command.pdf.empty()) files.writes(command.pdf, ".pdf", "--pdf");
    if (!command.requirements.table.empty()) files.reads(command.requirements.table);
    for (const auto& [is_given, option] :
         {std::pair(command.hours > 0, "--hours"), std::pair(!command.about.empty(), "--about")}) {
        if (is_given && !command.has_page())
            throw InputError({option}, "applies only together with --html or --pdf");
    }
    const std::string browser = command.pdf.empty() ? std::string() : printing_browser("--pdf");
    std::optional<Image> picture = picture_of(command, files);
    ConsoleMonitor monitor(context.err, context.err, command.common.console(context));
    std::set<std::filesystem::path> lamps;
    PhotometryOptions common = command.common;
    common.overrides.lamp_file = [&lamps](const std::filesystem::path& file) {
        lamps.insert(file);
        return file;
    };
    common.overrides.without_sun = command.daylight_factor;
    Job job = common.read(command.options.workers, files, monitor);
    const LuxRuns runs(command, clock, lamps, job, files, monitor);
    declare_images(command, runs.surfaces().size(), files);
    warn_of_points_outside(runs.surfaces(), job.scene, monitor);
    LuxPage page = described(command, runs.room(), job, monitor);
    page.picture = std::move(picture);

    const StopOnSignals listening(context.process);
    const LuxResults results = runs.compute(std::move(job));
    if (!command.common.csv.empty())
        write_text(command.common.csv, illuminance_csv(results.report, results.uncertainty, results.colour));
    write_images(command, results, page);
    if (command.has_page()) {
        const std::string html = lux_page(results, page);
        if (!command.html.empty()) write_text(command.html, html);
        if (!command.pdf.empty()) print_page(html, command.pdf, browser);
    }
    print(command, results, context.out);
    runs.throw_if_stopped(results);
}

}  // namespace

void add_lux_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<LuxCommand>();
    CLI::App& app = *program.add_subcommand("lux", "Compute illuminance on calculation surfaces");
    std::string requirements;
    for (const RequirementName& one : kRequirements)
        requirements += fmt::format("  {:<11} {}\n", one.name, one.what);
    app.footer(fmt::format(fmt::runtime(kLuxFooter), requirements));
    add_photometry_files(app, command->common, "point", "all results");
    app.add_option(
           "--image", command->image,
           "write an OpenEXR image with a pixel for each point; further surfaces go to FILE-2.exr and so on")
        ->type_name("FILE.exr");
    app.add_option(
           "--plan", command->plan,
           "draw a plan in false colour with isolux lines; further surfaces go to FILE-2.svg and so on")
        ->type_name("FILE.svg|.png");
    app.add_option("--html", command->html,
                   "write a report as one self-contained page: results, plans, luminaires, settings and "
                   "hashes of the scene's files")
        ->type_name("FILE.html");
    app.add_option("--pdf", command->pdf,
                   "write the report as PDF; Chromium, Chrome or Edge prints it and must be installed")
        ->type_name("FILE.pdf");
    app.add_option_function<std::vector<std::string>>(
           "--about",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   command->about.push_back(parse_named({"--about"}, word, "expected NAME=TEXT"));
           },
           "a line at the head of the report, for example \"Project=Town hall\"; may be repeated")
        ->type_name("NAME=TEXT")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--picture", command->picture, "rendered image of the scene to show in the report")
        ->type_name("FILE.exr");
    add_surface_options(app, command->surfaces);
    add_word(app, "--require", "NAME=VALUE,...",
             "judge by EN 12464-1 whether the lighting meets these requirements, for example "
             "Em=500,U0=0.6,UGR=19,Ez=150,walls=150,ceiling=100, or those of a row of your own table, "
             "tasks.csv#34.2",
             [command](const std::string& word) {
                 command->requirements = parse_required_lighting({"--require"}, word);
             });
    add_word(app, "--hours", "NUMBER",
             "hours of use in a year, for the energy that the report states: at full power, without controls",
             [command](const std::string& word) {
                 constexpr double kYear = 8784;
                 command->hours = parse_number({"--hours"}, word, 0, kYear);
             });
    add_word(app, "--eye-height", "LENGTH",
             "height of eyes above the floor for Ez, modelling and UGR (default 1.2, for people who sit)",
             [command](const std::string& word) {
                 command->eye_height = parse_metres({"--eye-height"}, word, 0.1, 3);
             });
    app.add_option_function<std::vector<std::string>>(
           "--maintenance-factor",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   parse_maintenance({"--maintenance-factor"}, word, command->maintenance);
           },
           "multiply all illuminance, or that of a light group, by this factor (default 1); may be repeated")
        ->type_name("[GROUP=]NUMBER")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_flag("--daylight-factor", command->daylight_factor,
                 "report illuminances in per cent of that of an unobstructed horizontal plane under the sky");
    app.add_flag("--far-field-error", command->far_field_error,
                 "also compute everything with the far-field intensities of each measured lamp, from a point "
                 "and from its luminous opening, and report the errors");
    app.add_flag(
        "--replicates", command->replicates,
        "also compute everything with each bootstrap replicate of the measured lamps, and report the "
        "uncertainty of their measurement");
    app.add_flag(
        "--colour", command->colour,
        "also compute the colour of the light from the lamps' spectra: colour temperature, R_a, R_9, "
        "R_f, R_g and melanopic illuminance");
    add_word(app, "--precision", "SHARE",
             "stop when each point's confidence interval is no wider than ± this share of its illuminance, "
             "or of the surface's mean if that is more (default 2%; 0.5% with --html or --pdf)",
             [command](const std::string& word) {
                 command->options.precision = parse_share({"--precision"}, word);
                 command->has_precision = true;
             });
    add_word(
        app, "--time", "TIME", "stop after this time at the latest, for example 30s, 5min, 2h",
        [command](const std::string& word) { command->options.seconds = parse_duration({"--time"}, word); });
    add_word(app, "--samples", "N", "samples per sensor; replaces --precision and makes results reproducible",
             [command](const std::string& word) {
                 command->options.most_samples =
                     static_cast<int>(parse_whole({"--samples"}, word, 1, 1 << 24));
             });
    add_photometry_options(app, command->common, command->options.seed, command->options.workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
