// lucerna glare: rates glare at observers' eyes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

#include "engine/base/error.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/photometry/photometry_options.h"
#include "engine/cli/photometry/plan_files.h"
#include "engine/cli/photometry/surface_options.h"
#include "engine/image/image.h"
#include "engine/photometry/glare.h"
#include "engine/photometry/glare_text.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr const char* kGlareFooter =
    R"(Rates the discomfort glare of the scene's luminaires: UGR = 8 log10(0.25 / L_b sum L^2 w / p^2), with the background
luminance L_b and, for each luminaire, the luminance L, the solid angle w and the position index p (CIE 117). The lights of
the scene must be in lm.

UGR is computed in three ways. "UGR" is from the luminance of each luminaire as seen by the observer, with the near field of
the lamp, filtered with a Gaussian of 12 mm on the luminaire: a few bright points cause more glare than a uniform surface of
the same intensity. "UGR CIE 232" is from the mean of that luminance where it is above 500 cd/m^2 and the solid angle of this
part. "UGR of means" is from the mean luminance of the whole luminaire, as with a photometric file. --blur 0mm turns the
filter off, and there is then no UGR CIE 232. Luminaires behind panes and media are rated as they are seen through them. What
is seen of lights over mirrors, lenses or solid glass counts in the background luminance; where it is more than 1 % of the
light at the eye, a warning names it.

Where the scene has a sky or a sun (an infinite or distant light), the daylight glare probability is computed, too:
DGP = 5.87e-5 E_v + 9.18e-2 log10(1 + sum L^2 w / (E_v^1.87 P^2)) + 0.16 (Wienold and Christoffersen 2006), below 0.35
imperceptible, above 0.45 intolerable. What glares is all that is brighter than 5 times the mean luminance of what the
observer sees, or than --threshold. --image writes that view, an angular fisheye of 180 degrees, for lucerna falsecolour.

An observer is the position of an eye and the point it looks at: --eye "desk=1,1.2,3:1,1.2,0". --height 1.2 places observers
on a horizontal grid across the whole model, --floors 1.2 above each of its floors; they look in each direction of --view.
Without any of these, the observer is the scene's camera.

Examples:
  lucerna glare room.pbrt
  lucerna glare room.pbrt --eye "desk=1,1.2,3:1,1.2,0" --eye "door=4,1.7,1:0,1.7,1"
  lucerna glare room.pbrt --height 1.2 --margin 0.5 --spacing 1 --view 1,0,0 --view 0,0,1 -o glare.csv
  lucerna glare room.pbrt --height 1.2 --plan ugr.svg
  lucerna glare office.pbrt --eye "desk=1,1.2,3:1,1.2,0" --image view.exr)";

constexpr std::size_t kDefaultViews = 4;  // along the horizontal axes

struct Eye {
    std::string name;
    V3d from, to;
};

struct GlareCommand {
    PhotometryOptions common;
    std::vector<Eye> eyes;
    SurfaceOptions grid;
    std::vector<V3d> views;
    std::string plan, image;
    GlareOptions options;
};

constexpr std::string_view kEyeForm =
    "expected NAME=X,Y,Z:X,Y,Z, the position of an eye and the point it looks at";

Eye parse_eye(const Location& at, std::string_view word) {
    const auto [name, places] = parse_named(at, word, kEyeForm);
    const std::size_t colon = places.find(':');
    if (colon == std::string::npos)
        input_error(at, "\"{}\" is not an observer; {}", one_line(word), kEyeForm);
    Eye eye{name, parse_point(at, std::string_view(places).substr(0, colon)),
            parse_point(at, std::string_view(places).substr(colon + 1))};
    if (!((eye.to - eye.from).length() > 0))
        input_error(at, "\"{}\" looks at its own position", one_line(word));
    return eye;
}

std::vector<Observer> observers_of(const GlareCommand& command, const Job& job) {
    const int axis = command.grid.up(job);
    V3f up(0);
    up[axis] = 1;
    const bool right_handed = is_right_handed(job);
    std::vector<Observer> observers;
    for (const Eye& eye : command.eyes)
        observers.push_back({eye.name, eye.from, V3f((eye.to - eye.from).normalized()), up, right_handed});
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
                    observers.push_back({grid.name, grid.position(x, y), V3f(view), up, right_handed});
            }
        }
    }
    if (observers.empty()) {
        const M44d& m = job.camera.settings().world_from_camera;
        const auto row = [&m](int i) { return V3d(m[i][0], m[i][1], m[i][2]); };
        observers.push_back(
            {"camera", row(3) + job.scene.origin(), V3f(row(2).normalized()), up, right_handed});
    }
    return observers;
}

// The rating that a plan shows.
struct RatingMap {
    const char* unit;
    ScaleRange range;
    double (*rating)(const GlareReport& report);  // NaN: none
};
// The ranges extend from imperceptible to intolerable glare [CIE 117:1995, EN 17037:2018].
const RatingMap kUgrMap{"UGR", {10, 31}, [](const GlareReport& report) { return report.ugr.value; }};
const RatingMap kDgpMap{"DGP", {0.2, 0.6}, [](const GlareReport& report) {
                            return report.daylight ? report.daylight->dgp.value : NAN;
                        }};
constexpr std::string_view kDgp = "dgp";  // in the file name of its plan

// Returns the greatest rating of all views at each point of a grid; NaN if there is none.
std::vector<double> worst_ratings(std::span<const GlareReport> of_grid, std::size_t views,
                                  const RatingMap& map) {
    std::vector<double> worst;
    for (std::size_t i = 0; i + views <= of_grid.size(); i += views) {
        double most = -INFINITY;
        for (const GlareReport& report : of_grid.subspan(i, views))
            most = std::fmax(most, map.rating(report));
        worst.push_back(std::isfinite(most) ? most : NAN);
    }
    return worst;
}

void write_plans(const GlareCommand& command, std::span<const CalculationSurface> grids,
                 std::span<const GlareReport> reports, std::span<const LuminairePlace> lamps, int up_axis,
                 bool right_handed, bool daylight) {
    const std::size_t views = command.views.empty() ? kDefaultViews : command.views.size();
    std::size_t first = command.eyes.size();
    for (std::size_t i = 0; i < grids.size(); ++i) {
        const std::size_t of_grid = static_cast<std::size_t>(grids[i].points.x * grids[i].points.y) * views;
        const auto write = [&](const std::filesystem::path& file, const RatingMap& map) {
            std::vector<double> values = worst_ratings(reports.subspan(first, of_grid), views, map);
            const CalculationSurface seen = as_seen(grids[i], up_axis, right_handed, &values);
            PlanFigure plan = plan_of(seen, values, map.unit, lamps);
            plan.scale.range = map.range;
            write_plan(file, plan);
        };
        const std::filesystem::path file = of_surface(command.plan, i);
        write(file, kUgrMap);
        if (daylight) write(of_map(file, kDgp), kDgpMap);
        first += of_grid;
    }
}

void act(const GlareCommand& command, const CommandContext& context) {
    const Stopwatch clock;
    CommandFiles files;
    command.common.declare(files);
    ConsoleMonitor monitor(context.err, context.err, command.common.console(context));
    Job job = command.common.read(command.options.workers, files, monitor);
    const std::vector<Observer> observers = observers_of(command, job);
    for (const Eye& eye : command.eyes)
        warn_outside(job.scene, "observer \"" + plain_text(eye.name) + "\"", {{eye.from}}, monitor);
    const std::vector<CalculationSurface> grids = command.grid.all(job);
    if (!command.plan.empty() && grids.empty())
        throw InputError({"--plan"}, "needs a grid of observers: --height or --floors");
    const bool daylight = has_daylight(job.scene);
    for (std::size_t i = 0; !command.plan.empty() && i < grids.size(); ++i) {
        declare_plan(of_surface(command.plan, i), files);
        if (daylight) declare_plan(of_map(of_surface(command.plan, i), kDgp), files);
    }
    for (std::size_t i = 0; !command.image.empty() && i < observers.size(); ++i)
        files.writes(of_surface(command.image, i), ".exr", "--image");
    const std::vector<LuminairePlace> lamps = luminaires_of(job.scene);
    const int up_axis = command.grid.up(job);
    const bool right_handed = is_right_handed(job);
    GlareOptions options = command.options;
    options.seconds -= clock.seconds();
    if (!command.image.empty()) {
        options.view = [&command](std::size_t observer, const LuminanceView& view) {
            write_exr(of_surface(command.image, observer), view_image(view));
        };
    }
    const StopOnSignals listening(context.process);
    const std::vector<GlareReport> reports = glare_at(observers, std::move(job), options, monitor);
    if (!command.common.csv.empty()) write_text(command.common.csv, glare_csv(reports));
    if (!command.plan.empty()) write_plans(command, grids, reports, lamps, up_axis, right_handed, daylight);
    if (command.common.prints_json()) {
        context.out << glare_json(reports);
        return;
    }
    if (!command.common.json.empty()) write_text(command.common.json, glare_json(reports));
    context.out << glare_text(reports);
}

}  // namespace

void add_glare_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<GlareCommand>();
    CLI::App& app =
        *program.add_subcommand("glare", "Rate discomfort glare, of luminaires (UGR) and of daylight (DGP)");
    app.footer(kGlareFooter);
    add_photometry_files(app, command->common, "observer",
                         "all results, including the term of each luminaire,");
    app.add_option_function<std::vector<std::string>>(
           "--eye",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words) command->eyes.push_back(parse_eye({"--eye"}, word));
           },
           "an observer: the position of the eye and the point it looks at; may be repeated")
        ->type_name("NAME=X,Y,Z:X,Y,Z")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_height_options(app, command->grid);
    app.add_option_function<std::vector<std::string>>(
           "--view",
           [command](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   command->views.push_back(parse_direction({"--view"}, word));
           },
           "viewing direction at the --height and --floors points; may be repeated (default: the four "
           "horizontal axes)")
        ->type_name("X,Y,Z")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option(
           "--plan", command->plan,
           "draw a plan of the greatest UGR of all views at each point of the grid, and where there is a "
           "sky or a sun also one of DGP, FILE-dgp.svg; FILE-2.svg and so on for further grids")
        ->type_name("FILE.svg|.png");
    app.add_option("--image", command->image,
                   "write what the observer sees as an OpenEXR image in cd/m^2, an angular fisheye of 180 "
                   "degrees; FILE-2.exr and so on for further observers")
        ->type_name("FILE.exr");
    add_word(app, "--threshold", "NUMBER",
             "DGP: luminance above which a part of the view glares, in cd/m^2; up to 100: in multiples of "
             "the mean luminance of the view (default 5)",
             [command](const std::string& word) {
                 command->options.threshold = parse_number({"--threshold"}, word, 0, 1e9);
             });
    add_word(app, "--blur", "LENGTH",
             "full width at half maximum of the Gaussian filter on the luminaire (default 12mm)",
             [command](const std::string& word) {
                 command->options.blur = parse_place({"--blur"}, word);
                 if (!(command->options.blur >= 0)) input_error({"--blur"}, "{} is negative", word);
             });
    add_word(
        app, "--precision", "SHARE",
        "stop when the confidence intervals of L_b and of E_v are no wider than ± this share of them, and "
        "noise in the view changes DGP by no more than ± a quarter of it (default 2%)",
        [command](const std::string& word) {
            command->options.precision = parse_share({"--precision"}, word);
        });
    add_word(
        app, "--time", "TIME", "time limit, for example 30s, 5min, 2h",
        [command](const std::string& word) { command->options.seconds = parse_duration({"--time"}, word); });
    add_photometry_options(app, command->common, command->options.seed, command->options.workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
