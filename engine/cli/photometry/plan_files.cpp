#include "engine/cli/photometry/plan_files.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/image/image.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

bool is_png(const std::filesystem::path& file) {
    return suffix_of(file) == ".png";
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
    plan.outlines.push_back({{{0, 0}, {width, 0}, {width, height}, {0, height}}, true});
    for (const LuminairePlace& lamp : lamps) {
        const V3d from = lamp.place - surface.corner;
        const Imath::V2d at(from.dot(surface.u) / width, from.dot(surface.v) / height);
        if (at.x >= 0 && at.x <= width && at.y >= 0 && at.y <= height) plan.lamps.push_back({at, {}});
    }
    return plan;
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
