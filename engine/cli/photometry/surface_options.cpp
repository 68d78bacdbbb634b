#include "engine/cli/photometry/surface_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/photometry/floors.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr double kFar = 1e9;  // m

constexpr std::string_view kSurfaceForm =
    "expected NAME=X,Y,Z:X,Y,Z:X,Y,Z, a corner and the other ends of the two sides from it";

SurfaceOptions::Named parse_surface(const Location& at, std::string_view word) {
    const auto [name, place] = parse_named(at, word, kSurfaceForm);
    SurfaceOptions::Named surface{name, {}};
    std::string_view rest = place;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::size_t colon = rest.find(':');
        if ((colon == rest.npos) != (corner == 2))
            input_error(at, "\"{}\" is not a surface; {}", one_line(word), kSurfaceForm);
        surface.corners[corner] = parse_point(at, rest.substr(0, colon));
        rest.remove_prefix(colon == rest.npos ? rest.size() : colon + 1);
    }
    return surface;
}

int parse_axis(const Location& at, std::string_view word) {
    constexpr std::string_view axes = "xyz";
    if (word.size() != 1 || axes.find(word) == axes.npos)
        input_error(at, "\"{}\" is not an axis; expected x, y or z", one_line(word));
    return static_cast<int>(axes.find(word));
}

ReceiverKind parse_kind(const Location& at, std::string_view word) {
    const std::optional<ReceiverKind> kind = receiver_kind(word);
    if (!kind) {
        input_error(at, "\"{}\" is not a kind of illuminance; expected {}", one_line(word),
                    fmt::join(kReceiverKinds, ", "));
    }
    return *kind;
}

}  // namespace

CalculationSurface surface_at(const SurfaceOptions& options, std::string name,
                              const std::array<V3d, 3>& corners, const Location& at) {
    CalculationSurface surface;
    surface.name = std::move(name);
    surface.corner = corners[0];
    surface.u = corners[1] - corners[0];
    surface.v = corners[2] - corners[0];
    surface.kind = options.kind;
    const V3d above = surface.u.cross(surface.v).normalized();  // zero if degenerate, rejected below
    surface.up = V3f(above);
    if (options.facing && !has_facing(options.kind)) input_error(at, "{}", no_facing_text(options.kind));
    surface.normal = V3f(options.facing.value_or(above));
    const double u = surface.u.length(), v = surface.v.length();
    surface.points = options.spacing ? points_apart(u, v, *options.spacing) : default_points(u, v);
    check_surface(surface, at);
    return surface;
}

namespace {

// Returns the horizontal plane at the lower end of a box.
CalculationSurface horizontal_plane(const SurfaceOptions& options, const Imath::Box<V3d>& box, int up,
                                    const std::string& name, const Location& at) {
    std::array<V3d, 3> corners{box.min, box.min, box.min};
    for (int side = 1; side <= 2; ++side) {  // up is the first side x the second
        const int axis = (up + side) % 3;
        const double width = box.max[axis] - box.min[axis];
        if (!(width > 2 * options.margin)) {
            input_error(at, "there is nothing left of a plane {:g} wide with a margin of {:g}", width,
                        options.margin);
        }
        for (V3d& corner : corners) corner[axis] += options.margin;
        corners[static_cast<std::size_t>(side)][axis] = box.max[axis] - options.margin;
    }
    return surface_at(options, name, corners, at);
}

CalculationSurface plane_above_lowest(const SurfaceOptions& options, const Job& job, int up, double height) {
    const Location at{"--height"};
    const Box3f bounds = job.scene.bounds();
    if (bounds.isEmpty()) input_error(at, "the scene has no surfaces");
    Imath::Box<V3d> box(V3d(bounds.min) + job.scene.origin(), V3d(bounds.max) + job.scene.origin());
    const double high = box.max[up] - box.min[up];
    if (!(height >= 0 && height <= high))
        input_error(at, "a plane at {:g} is not within the scene, which is {:g} high", height, high);
    box.min[up] += height;
    return horizontal_plane(options, box, up, fmt::format("height {:g}", height), at);
}

std::vector<CalculationSurface> planes_above_floors(const SurfaceOptions& options, const Job& job, int up) {
    const Location at{"--floors"};
    const std::vector<Floor> floors = floors_of(job.scene, up);
    if (floors.empty()) {
        input_error(at,
                    "the scene has no level surface with 2 m of clear height above it; use --height or "
                    "--surface");
    }
    std::vector<CalculationSurface> planes;
    for (const double height : options.floors) {
        for (std::size_t i = 0; i < floors.size(); ++i) {
            Imath::Box<V3d> box(floors[i].least, floors[i].most);
            box.min[up] += height;
            planes.push_back(
                horizontal_plane(options, box, up,
                                 fmt::format("floor {} at {:g}, height {:g}", i + 1,
                                             std::round(100 * floors[i].height) / 100 + 0.0, height),
                                 at));
        }
    }
    return planes;
}

}  // namespace

std::pair<std::string, std::string> parse_named(const Location& at, std::string_view word,
                                                std::string_view form) {
    const std::size_t equals = word.find('=');
    if (equals == word.npos || equals == 0 || equals + 1 == word.size())
        input_error(at, "\"{}\" is not accepted; {}", one_line(word), form);
    return {std::string(word.substr(0, equals)), std::string(word.substr(equals + 1))};
}

namespace {

// Parses "X,Y,Z", each by `number`.
template <typename Number>
V3d parse_triple(const Location& at, std::string_view word, std::string_view what, Number&& number) {
    V3d p;
    std::string_view rest = word;
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t comma = rest.find(',');
        if ((comma == rest.npos) != (axis == 2)) input_error(at, "\"{}\" is not a {}", one_line(word), what);
        p[axis] = number(rest.substr(0, comma));
        rest.remove_prefix(comma == rest.npos ? rest.size() : comma + 1);
    }
    return p;
}

}  // namespace

V3d parse_point(const Location& at, std::string_view word) {
    return parse_triple(
        at, word, "point; expected X,Y,Z in metres or with a unit, for example 0,0.75,2.5 or 0,75cm,2.5m",
        [&](std::string_view part) { return parse_metres(at, part, -kFar, kFar); });
}

V3d parse_direction(const Location& at, std::string_view word) {
    const V3d w = parse_triple(at, word, "direction; expected X,Y,Z, for example 1,0,0",
                               [&](std::string_view part) { return parse_number(at, part, -kFar, kFar); });
    if (!(w.length() > 0)) input_error(at, "{} is not a direction", one_line(word));
    return w.normalized();
}

int SurfaceOptions::up(const Job& job) const {
    return up_axis.value_or(up_axis_of(job.camera));
}

bool is_right_handed(const Job& job) {
    return job.camera.settings().world_from_camera.determinant() < 0;
}

int up_axis_of(const Camera& camera) {
    const M44d& m = camera.settings().world_from_camera;
    const V3d up(m[1][0], m[1][1], m[1][2]);
    int axis = 1;
    for (const int other : {0, 2}) {
        if (std::fabs(up[other]) > std::fabs(up[axis])) axis = other;
    }
    return axis;
}

void warn_outside(const Scene& scene, const std::string& what, std::span<const V3d> points,
                  Monitor& monitor) {
    const Box3f bounds = scene.bounds();
    if (bounds.isEmpty()) {
        monitor.warn(what + ": the scene has no surfaces, and only the lamps' own light arrives");
        return;
    }
    const V3d slack(1e-3 * double{diagonal(scene)});  // points on the floor count as inside
    const V3d least = V3d(bounds.min) + scene.origin() - slack,
              most = V3d(bounds.max) + scene.origin() + slack;
    const auto outside = std::count_if(points.begin(), points.end(), [&](const V3d& p) {
        return !Imath::Box<V3d>(least, most).intersects(p);
    });
    if (outside > 0) {
        monitor.warn(
            fmt::format("{}: {} of {} points lie outside the scene, which reaches from {:g}, {:g}, {:g} to "
                        "{:g}, {:g}, {:g}",
                        what, outside, points.size(), least.x, least.y, least.z, most.x, most.y, most.z));
    }
}

std::vector<CalculationSurface> SurfaceOptions::all(const Job& job) const {
    std::vector<CalculationSurface> all;
    for (const Named& named : surfaces)
        all.push_back(surface_at(*this, named.name, named.corners, {"--surface"}));
    const int up = this->up(job);
    for (const double height : heights) all.push_back(plane_above_lowest(*this, job, up, height));
    if (!floors.empty()) {
        for (CalculationSurface& plane : planes_above_floors(*this, job, up)) all.push_back(std::move(plane));
    }
    return all;
}

void add_height_options(CLI::App& app, SurfaceOptions& options) {
    app.add_option_function<std::vector<std::string>>(
           "--height",
           [&options](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   options.heights.push_back(parse_metres({"--height"}, word, -kFar, kFar));
           },
           "a horizontal plane across the model, this length (metres, or for example 75cm) above its lowest "
           "point; may be repeated")
        ->type_name("LENGTH")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option_function<std::vector<std::string>>(
           "--floors",
           [&options](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   options.floors.push_back(parse_metres({"--floors"}, word, 0, kFar));
           },
           "a horizontal plane across each floor of the model, this length above it; may be repeated")
        ->type_name("LENGTH")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(app, "--margin", "LENGTH",
             "margin between a --height or --floors plane and the model's or floor's sides (default 0)",
             [&options](const std::string& word) {
                 options.shaped_by = "--margin";
                 options.margin = parse_metres({"--margin"}, word, 0, kFar);
             });
    add_word(app, "--up", "AXIS",
             "vertical axis of --height and --floors planes: x, y or z (default: the axis closest to the "
             "camera's up vector)",
             [&options](const std::string& word) { options.up_axis = parse_axis({"--up"}, word); });
    add_word(app, "--spacing", "LENGTH", "largest spacing of points (default: according to EN 12464-1)",
             [&options](const std::string& word) {
                 options.shaped_by = "--spacing";
                 options.spacing = parse_metres({"--spacing"}, word, 1e-6, kFar);
             });
}

void add_surface_options(CLI::App& app, SurfaceOptions& options) {
    app.add_option_function<std::vector<std::string>>(
           "--surface",
           [&options](const std::vector<std::string>& words) {
               for (const std::string& word : words)
                   options.surfaces.push_back(parse_surface({"--surface"}, word));
           },
           "a calculation surface, replacing those of the scene: a corner and the other ends of the two "
           "sides from it; may be repeated")
        ->type_name("NAME=X,Y,Z:X,Y,Z:X,Y,Z")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_height_options(app, options);
    add_word(app, "--kind", "KIND",
             fmt::format("kind of illuminance: {} (default planar)", fmt::join(kReceiverKinds, ", ")),
             [&options](const std::string& word) {
                 options.shaped_by = "--kind";
                 options.kind = parse_kind({"--kind"}, word);
             });
    add_word(app, "--facing", "X,Y,Z",
             "direction that planar, semicylindrical and hemispherical sensors face (default: the surface "
             "normal)",
             [&options](const std::string& word) {
                 options.shaped_by = "--facing";
                 options.facing = parse_direction({"--facing"}, word);
             });
}

}  // namespace lucerna
