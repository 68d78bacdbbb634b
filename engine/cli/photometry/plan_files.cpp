#include "engine/cli/photometry/plan_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include "engine/base/error.h"
#include "engine/image/image.h"
#include "engine/image/pictures.h"
#include "engine/photometry/section.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

bool is_png(const std::filesystem::path& file) {
    return suffix_of(file) == ".png";
}

// Names the axes after those of the scene along which the surface's sides lie.
void name_axes(const CalculationSurface& surface, PlanFigure& plan) {
    const V3d sides[] = {surface.u.normalized(), surface.v.normalized()};
    for (std::size_t side = 0; side < 2; ++side) {
        for (int axis = 0; axis < 3; ++axis) {
            if (!(sides[side][axis] > 1 - 1e-9)) continue;
            plan.axes[side] = std::string(1, "xyz"[axis]);
            plan.origin[static_cast<int>(side)] = surface.corner[axis];
        }
    }
}

}  // namespace

CalculationSurface as_seen(const CalculationSurface& surface, int up_axis, bool right_handed,
                           std::vector<double>* values) {
    const bool is_level = surface.is_level(up_axis);
    V3d towards_viewer(surface.normal);
    if (is_level) {
        towards_viewer = V3d(0);
        towards_viewer[up_axis] = 1;
    }
    const bool is_turned_right = surface.u.cross(surface.v).dot(towards_viewer) >= 0;
    if (is_turned_right == right_handed) return surface;
    CalculationSurface seen = surface;
    if (is_level) {
        std::swap(seen.u, seen.v);
        std::swap(seen.points.x, seen.points.y);
    } else {
        seen.corner += seen.u;
        seen.u = -seen.u;
    }
    seen.excluded.clear();  // which points count is in the values
    if (values == nullptr) return seen;
    const std::vector<double> given = std::exchange(*values, {});
    for (int y = 0; y < seen.points.y; ++y) {
        for (int x = 0; x < seen.points.x; ++x) {
            const std::size_t from =
                is_level ? surface.index(y, x) : surface.index(surface.points.x - 1 - x, y);
            values->push_back(given[from]);
        }
    }
    return seen;
}

PlanFigure plan_of(const CalculationSurface& surface, std::span<const double> values, const std::string& unit,
                   std::span<const LuminairePlace> lamps) {
    const double width = surface.u.length(), height = surface.v.length();
    PlanFigure plan;
    plan.title = plain_text(surface.name);
    plan.unit = unit;
    const int columns = surface.points.x, rows = surface.points.y;
    plan.values.columns = columns;
    plan.values.rows = rows;
    for (int y = rows - 1; y >= 0; --y) {
        for (int x = 0; x < columns; ++x)
            plan.values.values.push_back(values[static_cast<std::size_t>(y * columns + x)]);
    }
    plan.spacing = {width / columns, height / rows};
    plan.first = {plan.spacing.x / 2, height - plan.spacing.y / 2};
    plan.axes = {"across", "up"};
    name_axes(surface, plan);
    plan.outlines.push_back({{{0, 0}, {width, 0}, {width, height}, {0, height}}, true});
    for (const LuminairePlace& lamp : lamps) {
        const V3d from = lamp.place - surface.corner;
        const Imath::V2d at(from.dot(surface.u) / width, from.dot(surface.v) / height);
        const auto across = [&lamp](const V3d& side) {
            const V3d along = side.normalized();
            return std::fabs(along.x) * lamp.size.x + std::fabs(along.y) * lamp.size.y +
                   std::fabs(along.z) * lamp.size.z;
        };
        plan.lamps.push_back({at, {}, {across(surface.u), across(surface.v)}});
    }
    return plan;
}

std::vector<PlanDrawing> model_lines(const Scene& scene, const CalculationSurface& surface, int up_axis,
                                     std::span<const Room> rooms) {
    constexpr double kBelow = 0.03, kStep = 0.04, kDeepest = 0.25;  // m, of sections below the surface
    constexpr double kAbove = 0.75, kAround = 0.6, kWall = 0.1, kSpacing = 0.02;  // m
    constexpr double kSmall = 0.3;  // share of the room's length: the plan of a smaller surface is its own
    if (!surface.is_level(up_axis)) return {};
    Imath::Box<V3d> box;
    for (const double u : {0.0, 1.0}) {
        for (const double v : {0.0, 1.0}) box.extendBy(surface.corner + u * surface.u + v * surface.v);
    }
    const double height = box.center()[up_axis];
    const V3d middle = surface.corner + 0.5 * (surface.u + surface.v);
    const auto length = [](const V3d& size) { return std::max({size.x, size.y, size.z}); };
    const auto room = std::ranges::find_if(rooms, [&](const Room& each) {
        return length(box.size()) > kSmall * length(each.bounds().size()) &&
               each.bounds().intersects(middle) && each.holds(scene, middle);
    });
    if (room != rooms.end()) box.extendBy(room->bounds());
    box.min -= V3d(room != rooms.end() ? kWall : kAround);
    box.max += V3d(room != rooms.end() ? kWall : kAround);
    const V3d u = surface.u.normalized(), v = surface.v.normalized();
    std::vector<PlanDrawing> drawings;
    const auto draw = [&](const std::vector<double>& heights, double width) {
        // Lines of several heights that are the same to a millimetre are drawn once.
        std::set<std::array<std::int64_t, 4>> known;
        PlanDrawing drawing{{}, width};
        for (const double at : heights) {
            for (const SectionLine& line : section(scene, box, up_axis, at, kSpacing)) {
                const V3d from = line.from - surface.corner, to = line.to - surface.corner;
                const Imath::V2d a(from.dot(u), from.dot(v)), b(to.dot(u), to.dot(v));
                const auto whole = [](double x) { return static_cast<std::int64_t>(std::llround(1000 * x)); };
                if (known.insert({whole(a.x), whole(a.y), whole(b.x), whole(b.y)}).second)
                    drawing.lines.push_back({a, b});
            }
        }
        if (!drawing.lines.empty()) drawings.push_back(std::move(drawing));
    };
    std::vector<double> below;
    for (double depth = kBelow; depth < kDeepest; depth += kStep) below.push_back(height - depth);
    draw(below, 0.8);
    draw({height + kAbove}, 2.2);
    return drawings;
}

std::filesystem::path of_surface(const std::filesystem::path& file, std::size_t surface) {
    if (surface == 0) return file;
    return of_map(file, std::to_string(surface + 1));
}

std::filesystem::path of_map(const std::filesystem::path& file, std::string_view map) {
    return file.parent_path() / fmt::format("{}-{}{}", file.stem().string(), map, file.extension().string());
}

void declare_plan(const std::filesystem::path& file, CommandFiles& files) {
    if (!is_png(file) && suffix_of(file) != ".svg")
        input_error({file.string()}, "a plan's name must end in .svg or .png");
    files.writes(file, "", "--plan");
    if (is_png(file)) pictures(file);  // the library that draws it must be available
}

void write_plan(const std::filesystem::path& file, const PlanFigure& plan) {
    const std::string svg = plan_svg(plan);
    if (is_png(file)) {
        write_png_display(file, drawn(svg, file));
    } else {
        write_text(file, svg);
    }
}

}  // namespace lucerna
