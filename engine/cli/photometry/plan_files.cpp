#include "engine/cli/photometry/plan_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

// Names the axes after those of the scene if the surface's sides lie along these.
void name_axes(const CalculationSurface& surface, PlanFigure& plan) {
    const V3d sides[] = {surface.u.normalized(), surface.v.normalized()};
    int along[2] = {-1, -1};
    for (int side = 0; side < 2; ++side) {
        for (int axis = 0; axis < 3; ++axis) {
            if (sides[side][axis] > 1 - 1e-9) along[side] = axis;
        }
    }
    if (along[0] < 0 || along[1] < 0) return;
    for (int side = 0; side < 2; ++side) {
        plan.axes[static_cast<std::size_t>(side)] = std::string(1, "xyz"[along[side]]);
        plan.origin[side] = surface.corner[along[side]];
    }
}

}  // namespace

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
    name_axes(surface, plan);
    plan.outlines.push_back({{{0, 0}, {width, 0}, {width, height}, {0, height}}, true});
    for (const LuminairePlace& lamp : lamps) {
        const V3d from = lamp.place - surface.corner;
        const Imath::V2d at(from.dot(surface.u) / width, from.dot(surface.v) / height);
        if (!(at.x >= 0 && at.x <= width && at.y >= 0 && at.y <= height)) continue;
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
    constexpr double kBelow = 0.03, kAbove = 0.75, kAround = 0.6, kWall = 0.1, kSpacing = 0.02;  // m
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
    for (const auto& [at, width] : {std::pair(height - kBelow, 0.8), std::pair(height + kAbove, 2.2)}) {
        PlanDrawing drawing{{}, width};
        for (const SectionLine& line : section(scene, box, up_axis, at, kSpacing)) {
            const V3d from = line.from - surface.corner, to = line.to - surface.corner;
            drawing.lines.push_back({Imath::V2d(from.dot(u), from.dot(v)), Imath::V2d(to.dot(u), to.dot(v))});
        }
        if (!drawing.lines.empty()) drawings.push_back(std::move(drawing));
    }
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
