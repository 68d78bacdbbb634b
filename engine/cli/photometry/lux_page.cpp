#include "engine/cli/photometry/lux_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/version.h"
#include "engine/cli/page_parts.h"
#include "engine/cli/page_tables.h"
#include "engine/cli/photometry/lux_page_luminaires.h"
#include "engine/cli/photometry/plan_files.h"
#include "engine/figures/markup.h"
#include "engine/photometry/glare_text.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr const char* kPlanKey =
    " Thin lines: furniture just below the surface; thick lines: walls and what else is higher. Crossed "
    "circles "
    "and dashed outlines: luminaires.";
constexpr const char* kOpenSides =
    " A side without a wall up to the ceiling is open: it is no wall, and there is no observer before it.";
constexpr double kFurtherPlan = 460;  // pixels, width of the plans that are not of task areas

// To first order, as if the darkest and the brightest point were independent.
Reading95 least_over_greatest(const SurfaceIlluminance& of) {
    const double greatest = of.greatest.value;
    if (!(greatest > 0)) return {0, 0};
    const double ratio = of.least.value / greatest;
    return {ratio, hypot(of.least.half_width, ratio * of.greatest.half_width) / greatest};
}

// Returns the height of a level surface above the floor, or above the origin if there is no room.
std::string height_text(const CalculationSurface& surface, const LuxPage& page) {
    if (!surface.is_level(page.up_axis)) return "–";
    const double floor = std::isnan(page.floor) ? 0 : page.floor;
    return fmt::format("{:.2f}", rounded(surface.corner[page.up_axis] - floor, 100));
}

std::string summary(const IlluminanceReport& report, const LuxPage& page) {
    const std::string unit = " [" + unit_as_written(report.unit) + "]";
    std::vector<std::vector<std::string>> rows{{"surface", "kind", "height [m]", "points", "mean" + unit,
                                                "least" + unit, "greatest" + unit, "U₀", "least / greatest",
                                                "direct"}};
    for (const SurfaceIlluminance& of : report.surfaces) {
        rows.push_back({plain_text(of.surface.name), std::string(receiver_kind_name(of.surface.kind)),
                        height_text(of.surface, page),
                        fmt::format("{} × {}", of.surface.points.x, of.surface.points.y),
                        reading_text(of.mean), reading_text(of.least), reading_text(of.greatest),
                        reading_text(of.uniformity), reading_text(least_over_greatest(of)),
                        of.mean.value > 0 ? fmt::format("{:.1f} %", 100 * of.direct / of.mean.value) : "–"});
    }
    std::string html = html_table(rows, 2);
    for (const SurfaceIlluminance& of : report.surfaces) {
        if (const std::string text = cut_off_text(of); !text.empty())
            html += fmt::format("<p>{}</p>\n", html_text(text));
    }
    return html;
}

std::string colours(const IlluminanceReport& report, const ColourReport& colour) {
    if (colour.surfaces.empty()) return {};
    std::string html = fmt::format("<h2>Colour of the light</h2>\n<p>{}.</p>\n<div class=\"wide\">{}</div>\n",
                                   html_text(colour_heading()), html_table(colour_rows(report, colour), 1));
    for (const std::string& line : colour_lines(colour)) html += fmt::format("<p>{}.</p>\n", html_text(line));
    return html;
}

std::string uncertainty(const IlluminanceReport& report, const MeasurementUncertainty& lamps) {
    if (lamps.replicates == 0) return {};
    std::string html = fmt::format(
        "<h2>Uncertainty of the lamps' measurement</h2>\n<p>{}.</p>\n<div class=\"wide\">{}</div>\n",
        html_text(uncertainty_heading(lamps)), html_table(uncertainty_rows(report, lamps), 2));
    for (const std::string& line : uncertainty_lines(lamps))
        html += fmt::format("<p>{}.</p>\n", html_text(line));
    return html;
}

std::string rooms(const std::vector<RoomText>& rooms) {
    if (rooms.empty()) return {};
    std::vector<std::vector<std::string>> rows{{"room", "area [m²]", "bounds [m]", "clear height [m]",
                                                "walls", "reflectance of floor", "of walls", "of ceiling"}};
    bool is_open_sided = false;
    for (std::size_t i = 0; i < rooms.size(); ++i) {
        const RoomText& room = rooms[i];
        is_open_sided = is_open_sided || room.is_open_sided;
        const auto& [floor, walls, ceiling] = room.reflectances;
        rows.push_back({std::to_string(i + 1), fmt::format("{:.1f}", room.area),
                        fmt::format("{:.2f} × {:.2f}", room.size.x, room.size.y),
                        fmt::format("{:.2f}", room.size.z), std::to_string(room.walls),
                        fmt::format("{:.2f}", floor), fmt::format("{:.2f}", walls),
                        fmt::format("{:.2f}", ceiling)});
    }
    return "<h2>Room</h2>\n<div class=\"wide\">" + html_table(rows, 1) +
           "</div>\n<p>Reflectances are those of most of each surface (medians)." +
           (is_open_sided ? kOpenSides : "") + "</p>\n";
}

// How a verdict is shown, in the order of Verdict.
struct Mark {
    const char *style, *sign;
};
constexpr Mark kMarks[] = {{"met", "✔ "}, {"missed", "✘ "}, {"undecided", "? "}};

std::string requirements(const std::vector<Judgement>& judgements, const std::string& task) {
    if (judgements.empty()) return {};
    std::string html = fmt::format("<h2>Requirements (EN 12464-1:2021)</h2>\n<p class=\"verdict\">{}.</p>\n",
                                   html_text(judgements_summary(judgements)));
    if (!task.empty()) html += fmt::format("<p>Required: {}.</p>\n", html_text(plain_line(task)));
    // Missed requirements come first, then undecided ones.
    std::vector<Judgement> sorted = judgements;
    const auto rank = [](const Judgement& one) {
        return one.verdict == Verdict::missed ? 0 : one.verdict == Verdict::undecided ? 1 : 2;
    };
    std::ranges::stable_sort(sorted, {}, rank);
    std::vector<std::vector<std::string>> rows = judgement_rows(sorted);
    rows.front()[1] = "surface or observer";
    html += "<div class=\"wide\"><table>\n<thead>" + html_row(rows.front(), "th", 3, "") + "</thead>\n";
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const Mark& mark = kMarks[static_cast<std::size_t>(sorted[i].verdict)];
        std::vector<std::string> cells = rows[i + 1];
        cells.back() = mark.sign + cells.back();
        html += html_row(cells, "td", 3, mark.style);
    }
    return html + "</table>\n</div>\n";
}

std::string glare(const std::vector<GlareReport>& reports) {
    if (reports.empty()) return {};
    std::vector<std::vector<std::string>> rows{{"observer", "x [m]", "y [m]", "z [m]", "looks along", "UGR",
                                                "background luminance [cd/m²]",
                                                "illuminance at the eye [lx]"}};
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        const auto metres = [](double x) { return fmt::format("{:.2f}", x); };
        rows.push_back({plain_text(by.name), metres(by.eye.x), metres(by.eye.y), metres(by.eye.z),
                        direction_text(V3d(by.view)), rating_text(report.ugr),
                        reading_text(report.background), reading_text(report.vertical)});
    }
    return "<h2>Glare</h2>\n<div class=\"wide\">" + html_table(rows, 1) +
           "</div>\n<p>All of these are initial values, without the maintenance factor.</p>\n";
}

// A daylight factor knows no maintenance.
std::string maintenance_text(const IlluminanceReport& report, const MaintenanceFactors& factors) {
    if (report.sky_illuminance > 0) return {};
    if (!factors.applies()) return "Initial values: no maintenance factor is applied.";
    std::string text = fmt::format("Maintained values, with the maintenance factor {:g}", factors.all);
    for (const auto& [group, factor] : factors.groups)
        text += fmt::format(", {:g} for \"{}\"", factor, plain_text(group));
    return text + '.';
}

// Says what the numbers rest on.
std::string assumptions(const LuxResults& results, const LuxPage& page) {
    std::vector<std::string> lines{
        fmt::format(
            "Quantities are in {}. ± is the half-width of the 95 % confidence interval of the "
            "computation; the model, the luminaires' data and their measurement have errors of their own.",
            unit_as_written(results.report.unit)),
        "Points lie in the middle of the cells of a grid. Where none is given, the cell is 0.2 m × "
        "5^log10(d) "
        "wide (EN 12464-1); d is the longer side of the surface in metres, or the shorter one if the longer "
        "is "
        "at least twice as long."};
    if (const std::string text = maintenance_text(results.report, page.maintenance); !text.empty())
        lines.push_back(text);
    if (page.margin > 0) {
        lines.push_back(
            fmt::format("Planes across the model or a floor keep {:g} m from its sides.", page.margin));
    }
    if (page.has_daylight) lines.emplace_back("Illuminances include the light of the sky or the sun.");
    if (!page.rooms.empty()) lines.emplace_back("Surfaces reflect as the model says.");
    if (!results.judgements.empty()) {
        lines.emplace_back(
            "A requirement is met or missed where the whole interval of the value is on one side of "
            "the limit, and undecided otherwise: a longer computation narrows the interval.");
    }
    if (!results.glare.empty()) {
        lines.emplace_back(
            "UGR is rated for observers before the middle of each wall who look across the room, "
            "from the luminances that each of them sees of the luminaires, averaged over 12 mm of the "
            "luminaire as the eye does (CIE 232:2019).");
    }
    std::string html = "<h2>Assumptions</h2>\n<ul>\n";
    for (const std::string& line : lines) html += fmt::format("<li>{}</li>\n", html_text(line));
    return html + "</ul>\n";
}

std::string about(const LuxPage& page) {
    if (page.about.empty()) return {};
    std::string html = "<table class=\"about\">\n";
    for (const auto& [name, text] : page.about)
        html += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", html_text(plain_line(name)),
                            html_text(plain_line(text)));
    return html + "</table>\n";
}

std::string settings(const IlluminanceReport& report, const LuxPage& page) {
    return html_table({{"what", "value"},
                       {"program", fmt::format("lucerna {}", program_version())},
                       {"method", "path tracing, unbiased"},
                       {"intervals", "95 %, Student's t, from independently sampled sensors"},
                       {"widest interval",
                        fmt::format("± {:.2g} % of its point's {}, or of the surface's mean if that is more",
                                    100 * report.precision, report.quantity)},
                       {"ended by", report.ended_by},
                       {"samples per point", fmt::format("{} sensors × {}", report.sensors, report.samples)},
                       {"rays", fmt::format("{:.3g}", static_cast<double>(report.rays))},
                       {"seed", std::to_string(page.seed)},
                       {"time", duration_text(report.seconds)}},
                      2);
}

// Describes the position of a plan in the scene.
std::string place_text(const CalculationSurface& surface) {
    const V3d& corner = surface.corner;
    return fmt::format(
        "Lower left corner at {} m in the scene, lower right at {}, upper left at {}; points {:.3g} by "
        "{:.3g} m "
        "apart.",
        point_text(corner), point_text(corner + surface.u), point_text(corner + surface.v),
        surface.u.length() / surface.points.x, surface.v.length() / surface.points.y);
}

std::string capitalised(std::string text) {
    text.front() = static_cast<char>(text.front() - 'a' + 'A');  // a lower-case letter
    return text;
}

std::string facts(const Facts& facts) {
    std::vector<std::vector<std::string>> rows{{"name", "content"}};
    for (const auto& [name, value] : facts) rows.push_back({plain_line(name), plain_line(value)});
    return html_table(rows, 2);
}

// Names the walls in a plan of a level surface.
void label_walls(const LuxPage& page, const CalculationSurface& surface, PlanFigure& plan) {
    const V3d u = surface.u.normalized(), v = surface.v.normalized();
    for (const auto& [middle, name] : page.walls) {
        const V3d from = middle - surface.corner;
        plan.labels.push_back({{from.dot(u), from.dot(v)}, name});
    }
}

}  // namespace

PlanFigure plan_of(const IlluminanceReport& report, std::size_t surface, std::vector<double> values,
                   const LuxPage& page) {
    const CalculationSurface seen =
        as_seen(report.surfaces[surface].surface, page.up_axis, page.right_handed, &values);
    PlanFigure plan = plan_of(
        seen, values, report.unit,
        seen.is_level(page.up_axis) ? std::span(page.luminaires.places) : std::span<const LuminairePlace>());
    plan.drawings = page.model[surface];
    return plan;
}

PlanFigure plan_of(const IlluminanceReport& report, std::size_t surface, const LuxPage& page) {
    std::vector<double> values;
    for (const PointIlluminance& point : report.surfaces[surface].points) values.push_back(point.all.value);
    return plan_of(report, surface, std::move(values), page);
}

std::string lux_page(const LuxResults& results, const LuxPage& page) {
    const IlluminanceReport& report = results.report;
    std::string plans, further;
    for (std::size_t i = 0; i < report.surfaces.size(); ++i) {
        const SurfaceIlluminance& surface = report.surfaces[i];
        PlanFigure plan = plan_of(report, i, page);
        const CalculationSurface seen = as_seen(surface.surface, page.up_axis, page.right_handed);
        const bool is_level = seen.is_level(page.up_axis);
        plan.title.clear();  // the heading says it
        const bool is_wide = seen.u.length() > 2.5 * seen.v.length();
        if (i >= page.tasks && !is_wide) plan.width = kFurtherPlan;
        if (is_level) label_walls(page, seen, plan);
        (i < page.tasks ? plans : further) +=
            fmt::format("<figure{}><h2>{}</h2>{}<figcaption>{}{}</figcaption></figure>\n",
                        is_wide ? " class=\"broad\"" : "", html_text(plain_text(surface.surface.name)),
                        plan_svg(plan), html_text(place_text(seen)), is_level ? kPlanKey : "");
    }
    if (!further.empty()) plans += "<div class=\"row plans\">" + further + "</div>\n";
    for (const PlanFigure& plan : page.more_plans)
        plans += fmt::format("<h2>{}</h2>\n<figure>{}</figure>\n", html_text(plan.title), plan_svg(plan));
    return filled(
        kLuxPage,
        {{"title", html_text("Lighting calculation: " + plain_text(page.scene))},
         {"style", std::string(kPageStyle)},
         {"about", about(page)},
         {"quantity", capitalised(report.quantity)},
         {"verdict", html_text(fmt::format("{}. {}", capitalised(unit_as_written(quantity_text(report))),
                                           maintenance_text(report, page.maintenance)))},
         {"summary", summary(report, page)},
         {"picture", page.picture ? fmt::format("<figure><img src=\"{}\" alt=\"The scene\"></figure>",
                                                data_url(*page.picture))
                                  : std::string()},
         {"requirements", requirements(results.judgements, page.task)},
         {"rooms", rooms(page.rooms)},
         {"colour", colours(report, results.colour)},
         {"uncertainty", uncertainty(report, results.uncertainty)},
         {"plans", plans},
         {"glare", glare(results.glare)},
         {"assumptions", assumptions(results, page)},
         {"luminaires", luminaires_section(report, page)},
         {"energy", energy_section(report, page)},
         {"places", places_section(report, page)},
         {"settings", settings(report, page)},
         {"files", facts(page.facts)}});
}

}  // namespace lucerna
