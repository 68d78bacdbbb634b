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
#include "engine/cli/light/light_commands.h"
#include "engine/cli/photometry/luminaire_types.h"
#include "engine/cli/photometry/lux_page.h"
#include "engine/cli/photometry/lux_replicates.h"
#include "engine/cli/photometry/photometry_options.h"
#include "engine/cli/photometry/plan_files.h"
#include "engine/cli/photometry/surface_options.h"
#include "engine/cli/render/checkpointing.h"
#include "engine/colour/tone.h"
#include "engine/image/displayed.h"
#include "engine/image/image.h"
#include "engine/photometry/daylight_factor.h"
#include "engine/photometry/en12464.h"
#include "engine/photometry/far_field_error.h"
#include "engine/photometry/glare.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/photometry/light_colour.h"
#include "engine/photometry/maintenance.h"
#include "engine/photometry/measurement_uncertainty.h"
#include "engine/system/printed_page.h"
#include "engine/text/plain_text.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_bootstrap.h"

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

constexpr double kPrecisionOfReports = 0.005;

struct LuxCommand {
    PhotometryOptions common;
    std::string image, html, pdf, plan, picture;
    bool has_page() const { return !html.empty() || !pdf.empty(); }
    SurfaceOptions surfaces;
    IlluminanceOptions options;
    Requirements requirements;
    MaintenanceFactors maintenance;
    std::vector<std::pair<std::string, std::string>> about;
    double eye_height = 1.2;  // m
    bool daylight_factor = false, far_field_error = false, replicates = false, colour = false;
    bool has_precision = false;
    bool requires_any() const {
        return std::ranges::any_of(requirements, [](const auto& range) { return range.has_value(); });
    }
};

std::vector<CalculationSurface> surfaces_of(const LuxCommand& command, const Job& job) {
    std::vector<CalculationSurface> surfaces = command.surfaces.all(job);
    if (surfaces.empty()) {
        if (const std::string& option = command.surfaces.shaped_by; !option.empty() && !job.surfaces.empty())
            throw InputError(
                {option},
                "applies to --height, --floors and --surface only, and not to the scene's surfaces");
        surfaces = job.surfaces;
    }
    if (surfaces.empty()) {
        throw InputError({command.common.scene},
                         "has no CalculationSurface; use --height 0.75, --floors 0.75 or --surface "
                         "NAME=X,Y,Z:X,Y,Z:X,Y,Z");
    }
    return surfaces;
}

// The surfaces of the requirements and the glare ratings of their observers.
struct Required {
    RoomSurfaces room;
    std::vector<GlareReport> glare;
};

Required required_of(const LuxCommand& command, std::span<const CalculationSurface> tasks, const Job& job,
                     Monitor& monitor) {
    const int up = command.surfaces.up_axis.value_or(up_axis_of(job.camera));
    const bool right_handed = job.camera.settings().world_from_camera.determinant() < 0;
    Required required{
        room_surfaces(job.scene, tasks, command.requirements, command.eye_height, up, right_handed), {}};
    if (required.room.observers.empty()) return required;
    GlareOptions options;
    options.seed = command.options.seed;
    options.workers = command.options.workers;
    options.seconds = 0.2 * command.options.seconds;
    CommandFiles same;  // the files of the first reading
    required.glare = glare_at(required.room.observers, command.common.read(options.workers, same, monitor),
                              options, monitor);
    return required;
}

RoomText room_text(const Room& room, const Scene& scene) {
    const V3d size = room.bounds().size();
    const int up = room.up_axis();
    return {V3d(size[(up + 1) % 3], size[(up + 2) % 3], size[up]), room.walls().size(),
            room.reflectances(scene)};
}

// Returns the illuminance that daylight factors are relative to.
double sky_of(const LuxCommand& command, const Scene& scene) {
    for (const auto& [is_set, option] : {std::pair(command.far_field_error, "--far-field-error"),
                                         std::pair(command.replicates, "--replicates")}) {
        if (is_set) throw InputError({option}, "is about lamps, which a daylight factor leaves out");
    }
    for (const auto& [is_set, option] : {std::pair(command.maintenance.applies(), "--maintenance-factor"),
                                         std::pair(command.requires_any(), "--require")}) {
        if (is_set) throw InputError({option}, "is about illuminances, not about daylight factors");
    }
    try {
        return sky_illuminance(scene);
    } catch (const InputError& error) {
        throw InputError({command.common.scene}, error.what());
    }
}

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

struct ByFarField {
    IlluminanceReport report;
    double floor = 0;          // the largest error of the lamps' grids
    bool has_opening = false;  // of any lamp
};

// Measures the same points with the lamps' far fields, which shine from a point or from the luminous opening
// that `light farfield` writes.
ByFarField by_far_field(const LuxCommand& command, std::span<const CalculationSurface> surfaces,
                        double seconds, bool from_point, Monitor& monitor) {
    ByFarField result;
    PhotometryOptions common = command.common;
    const Workers& workers = command.options.workers;
    std::size_t lamps = 0;
    FarFieldGrid as_rendered;
    as_rendered.as_rendered = true;
    common.overrides.far_field = [&](const std::filesystem::path& file) {
        ++lamps;
        PhotometricWeb made = far_field_of(file, as_rendered, workers, monitor);
        result.floor = std::max(result.floor, made.info().grid_error);
        result.has_opening = result.has_opening || made.info().opening.faces().second > 0;
        if (from_point) made.set_opening({});
        return made;
    };
    CommandFiles same;  // the files of the first reading
    Job job = common.read(workers, same, monitor);
    if (lamps == 0) {
        throw InputError({command.common.scene},
                         "has no measured lamp; --far-field-error compares the near field of a light field "
                         "or ray file with its far field");
    }
    IlluminanceOptions options = command.options;
    // Independent of the other computations.
    options.seed ^= from_point ? 0x9e3779b97f4a7c15U : 0xd1b54a32d192ed03U;
    options.seconds = seconds;
    result.report = illuminance_on(surfaces, std::move(job), options, monitor);
    maintain(result.report, command.maintenance);
    return result;
}

// The run from the opening is left out if no lamp has one, as ray files have not.
FarFieldErrors far_field_errors_of(const LuxCommand& command, std::span<const CalculationSurface> surfaces,
                                   const IlluminanceReport& near, RunTimes& times, Monitor& monitor) {
    FarFieldErrors errors;
    const ByFarField point = by_far_field(command, surfaces, times.by_lamps(), true, monitor);
    errors.floor = point.floor;
    errors.from_point = far_field_errors(near, point.report);
    if (!point.has_opening) return errors;
    const ByFarField opening = by_far_field(command, surfaces, times.by_lamps(), false, monitor);
    errors.from_opening = far_field_errors(near, opening.report);
    return errors;
}

PlanFigure error_plan(PlanFigure plan, const FarFieldError& error, std::string_view from) {
    plan.title = fmt::format("error of the far field from {}: {}", from, plan.title);
    plan.unit = "%";
    plan.scale = {};
    plan.scale.map = ColourMap::diverging;
    plan.isolines.shown = false;
    const int columns = plan.values.columns, rows = plan.values.rows;
    for (int row = 0; row < rows; ++row) {
        for (int x = 0; x < columns; ++x) {
            const auto to = static_cast<std::size_t>(row * columns + x);
            plan.values.values[to] =
                100 * error.points[static_cast<std::size_t>((rows - 1 - row) * columns + x)].value;
        }
    }
    return plan;
}

// Adds plans of the errors to the page, and writes them beside the plan of illuminance.
void draw_errors(const LuxCommand& command, const IlluminanceReport& report, const FarFieldErrors& errors,
                 LuxPage& page) {
    const auto draw = [&](const std::vector<FarFieldError>& surfaces, std::string_view from,
                          std::string_view map) {
        for (std::size_t i = 0; i < surfaces.size(); ++i) {
            const PlanFigure plan =
                error_plan(plan_of(report.surfaces[i], report, page.model[i]), surfaces[i], from);
            page.more_plans.push_back(plan);
            if (!command.plan.empty()) write_plan(of_map(of_surface(command.plan, i), map), plan);
        }
    };
    draw(errors.from_point, "a point", kErrorMap);
    draw(errors.from_opening, "the luminous opening", kOpeningErrorMap);
}

constexpr int kColourRuns = 4;  // at most

// Returns no colours, with a warning, if it was stopped.
ColourReport colour_of(const LuxCommand& command, const std::set<std::filesystem::path>& lamps,
                       const IlluminanceReport& report, RunTimes& times, Monitor& monitor) {
    const auto read = [&](const WorkingSpace& intervals) {
        SceneOverrides overrides = command.common.overrides;
        overrides.colours = intervals;
        return read_scene(command.common.scene, overrides, command.options.workers, monitor);
    };
    ColourReport colour;
    try {
        colour = colour_on(
            report, read, command.options, [&times] { return times.by_lamps(); }, monitor);
    } catch (const Stopped& stopped) {
        monitor.warn(fmt::format("colours are not computed: {}", stopped.what()));
        return colour;
    }
    for (const std::filesystem::path& lamp : lamps) {
        const Lumigraph fields = read_lumigraph(lamp);
        for (const LightField* field : fields_of(fields))
            colour.spectra_error = std::max(colour.spectra_error, field->info().spectra.error);
    }
    return colour;
}

// Returns no uncertainty, with a warning, if there are too few replicates.
MeasurementUncertainty uncertainty_of(const IlluminanceReport& report,
                                      const std::vector<IlluminanceReport>& by_replicate, int asked,
                                      Monitor& monitor) {
    const int done = static_cast<int>(by_replicate.size());
    if (done < kLeastReplicates) {
        monitor.warn(fmt::format("{} of {} replicates were computed; an uncertainty needs at least {}", done,
                                 asked, kLeastReplicates));
        return {};
    }
    if (done < asked) monitor.warn(fmt::format("{} of {} replicates were computed", done, asked));
    return measurement_uncertainty(report, by_replicate);
}

PlanFigure uncertainty_plan(const IlluminanceReport& report, const MeasurementUncertainty& uncertainty,
                            std::size_t surface) {
    std::vector<double> values;
    for (const LampUncertainty& point : uncertainty.surfaces[surface].points)
        values.push_back(point.expanded);
    PlanFigure plan = plan_of(report.surfaces[surface].surface, values, report.unit, report.lamps);
    plan.title = "uncertainty by the lamps' measurement (k = 2): " + plan.title;
    plan.isolines.shown = false;
    return plan;
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

void act(const LuxCommand& command, const CommandContext& context) {
    const Stopwatch clock;
    CommandFiles files;
    command.common.declare(files);
    if (!command.html.empty()) files.writes(command.html, ".html", "--html");
    if (!command.pdf.empty()) files.writes(command.pdf, ".pdf", "--pdf");
    const std::string browser = command.pdf.empty() ? std::string() : printing_browser("--pdf");
    std::optional<Image> picture;
    if (!command.picture.empty()) {
        if (!command.has_page())
            throw InputError({"--picture"}, "applies only together with --html or --pdf");
        files.reads(command.picture);
        Image image = read_exr(command.picture);
        show_denoised(image);
        const PictureLook look = PictureOptions().look(image);
        picture = displayed(image, look);
    }
    ConsoleMonitor monitor(context.err, context.err, command.common.console(context));
    std::set<std::filesystem::path> lamps;
    PhotometryOptions common = command.common;
    common.overrides.lamp_file = [&lamps](const std::filesystem::path& file) {
        lamps.insert(file);
        return file;
    };
    common.overrides.without_sun = command.daylight_factor;
    Job job = common.read(command.options.workers, files, monitor);
    const double sky = command.daylight_factor ? sky_of(command, job.scene) : 0;
    const StopOnSignals listening(context.process);
    const Required required = required_of(command, surfaces_of(command, job), job, monitor);
    const std::vector<CalculationSurface>& surfaces = required.room.surfaces;
    const int replicates =
        command.replicates ? replicates_of(lamps, command.common.scene, files, monitor) : 0;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        if (!command.image.empty()) files.writes(of_surface(command.image, i), ".exr", "--image");
        if (!command.plan.empty()) declare_plan(of_surface(command.plan, i), files);
        for (const std::string_view map : {kErrorMap, kOpeningErrorMap}) {
            if (!command.plan.empty() && command.far_field_error)
                declare_plan(of_map(of_surface(command.plan, i), map), files);
        }
        if (!command.plan.empty() && command.replicates)
            declare_plan(of_map(of_surface(command.plan, i), kUncertaintyMap), files);
    }
    for (const CalculationSurface& surface : surfaces) {
        std::vector<V3d> points;
        for (int y = 0; y < surface.points.y; ++y) {
            for (int x = 0; x < surface.points.x; ++x) {
                if (surface.counts(x, y)) points.push_back(surface.position(x, y));
            }
        }
        warn_outside(job.scene, "surface \"" + plain_text(surface.name) + "\"", points, monitor);
    }
    LuxPage page{command.common.scene, {}, std::move(picture), command.options.seed};
    page.maintenance = command.maintenance;
    const int up = command.surfaces.up_axis.value_or(up_axis_of(job.camera));
    for (const CalculationSurface& surface : surfaces) {
        const bool is_drawn = command.has_page() || !command.plan.empty();
        page.model.push_back(is_drawn ? model_lines(job.scene, surface, up) : std::vector<PlanDrawing>());
    }
    if (command.has_page()) {
        page.facts = picture_facts(job, command.options.seed);
        page.about = command.about;
        page.tasks = static_cast<std::size_t>(std::ranges::count(required.room.areas, Area::task));
        page.luminaires = luminaire_types(job.scene, command.options.workers, monitor);
        for (const Room& room : required.room.rooms) page.rooms.push_back(room_text(room, job.scene));
        page.glare = required.glare;
    }

    IlluminanceOptions options = command.options;
    if (command.has_page() && !command.has_precision) options.precision = kPrecisionOfReports;
    const int runs = 1 + (command.far_field_error ? 2 : 0) + (command.colour ? kColourRuns : 0);
    RunTimes times(clock, command.options.seconds, runs, replicates);
    options.seconds = times.by_lamps();
    IlluminanceReport report = illuminance_on(surfaces, std::move(job), options, monitor);
    if (command.daylight_factor) report = daylight_factors(std::move(report), sky);
    maintain(report, command.maintenance);
    const std::vector<Judgement> judgements =
        judge(required.room, report.surfaces, required.glare, command.requirements);
    FarFieldErrors errors;
    if (command.far_field_error) errors = far_field_errors_of(command, surfaces, report, times, monitor);
    if (command.colour && report.ended_by != "user")
        page.colour = colour_of(command, lamps, report, times, monitor);
    if (replicates > 0 && report.ended_by != "user") {
        std::vector<IlluminanceReport> by_replicate =
            by_replicates(command.common, surfaces, report, command.options, replicates, times, monitor);
        for (IlluminanceReport& of_replicate : by_replicate) maintain(of_replicate, command.maintenance);
        page.uncertainty = uncertainty_of(report, by_replicate, replicates, monitor);
        if (page.uncertainty.replicates > 0) {
            for (const std::filesystem::path& lamp : lamps)
                page.uncertainty.fields.push_back(
                    field_error(lamp.string(), fields_of(read_lumigraph(lamp))));
        }
    }
    const MeasurementUncertainty& uncertainty = page.uncertainty;
    if (!command.common.csv.empty())
        write_text(command.common.csv, illuminance_csv(report, uncertainty, page.colour));
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        if (!command.image.empty())
            write_exr(of_surface(command.image, i), illuminance_image(report.surfaces[i], report));
        if (!command.plan.empty())
            write_plan(of_surface(command.plan, i), plan_of(report.surfaces[i], report, page.model[i]));
    }
    draw_errors(command, report, errors, page);
    for (std::size_t i = 0; i < uncertainty.surfaces.size(); ++i) {
        const PlanFigure plan = uncertainty_plan(report, uncertainty, i);
        page.more_plans.push_back(plan);
        if (!command.plan.empty()) write_plan(of_map(of_surface(command.plan, i), kUncertaintyMap), plan);
    }
    page.judgements = judgements;
    if (command.has_page()) {
        const std::string html = lux_page(report, page);
        if (!command.html.empty()) write_text(command.html, html);
        if (!command.pdf.empty()) print_page(html, command.pdf, browser);
    }
    if (command.common.prints_json()) {
        context.out << illuminance_json(report, uncertainty, errors, page.colour, judgements);
    } else {
        if (!command.common.json.empty())
            write_text(command.common.json, illuminance_json(report, uncertainty, errors, page.colour, judgements));
        context.out << illuminance_text(report) << judgements_text(judgements) << end_text(report) << '\n';
        context.out << colour_text(report, page.colour) << far_field_text(errors);
        if (uncertainty.replicates > 0) context.out << uncertainty_text(report, uncertainty);
    }
    if (report.ended_by == "user")
        throw Stopped("interrupted: the confidence intervals are wider than --precision");
    if (command.colour && page.colour.surfaces.empty() && monitor.stopped())
        throw Stopped("interrupted: colours are not computed");
    if (uncertainty.replicates < replicates && monitor.stopped()) {
        throw Stopped(fmt::format("interrupted: {} of {} replicates are in the uncertainty",
                                  uncertainty.replicates, replicates));
    }
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
             "Em=500,U0=0.6,UGR=19,Ez=150,walls=150,ceiling=100",
             [command](const std::string& word) {
                 command->requirements = parse_requirements({"--require"}, word);
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
