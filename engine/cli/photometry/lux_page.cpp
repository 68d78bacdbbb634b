#include "engine/cli/photometry/lux_page.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/version.h"
#include "engine/cli/page_parts.h"
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
constexpr double kFurtherPlan = 620;  // pixels, width of the plans that are not of task areas

// Returns a row of cells <th> or <td>, the first `text_columns` of text and the others of the style of
// numbers, but for the last one, which has the style `last`.
std::string row(const std::vector<std::string>& cells, std::string_view cell, std::size_t text_columns,
                std::string_view last = "number") {
    std::string html = "<tr>";
    for (std::size_t c = 0; c < cells.size(); ++c) {
        const std::string_view style = c < text_columns ? "" : c + 1 < cells.size() ? "number" : last;
        html += fmt::format("<{0}{1}>{2}</{0}>", cell,
                            style.empty() ? std::string() : fmt::format(" class=\"{}\"", style),
                            html_text(cells[c]));
    }
    return html + "</tr>\n";
}

// Returns a table of text cells; the first row is the heading, and numbers are right-aligned.
std::string table(const std::vector<std::vector<std::string>>& rows, std::size_t text_columns) {
    std::string html = "<table>\n<thead>" + row(rows.front(), "th", text_columns) + "</thead>\n";
    for (std::size_t r = 1; r < rows.size(); ++r) html += row(rows[r], "td", text_columns);
    return html + "</table>\n";
}

std::string summary(const IlluminanceReport& report) {
    const std::string unit = " [" + unit_as_written(report.unit) + "]";
    std::vector<std::vector<std::string>> rows{
        {"surface", "kind", "points", "mean" + unit, "least" + unit, "greatest" + unit, "U₀", "direct"}};
    for (const SurfaceIlluminance& of : report.surfaces) {
        rows.push_back({plain_text(of.surface.name), std::string(receiver_kind_name(of.surface.kind)),
                        fmt::format("{} × {}", of.surface.points.x, of.surface.points.y),
                        reading_text(of.mean), reading_text(of.least), reading_text(of.greatest),
                        reading_text(of.uniformity),
                        of.mean.value > 0 ? fmt::format("{:.1f} %", 100 * of.direct / of.mean.value) : "–"});
    }
    std::string html = table(rows, 2);
    for (const SurfaceIlluminance& of : report.surfaces) {
        if (const std::string text = cut_off_text(of); !text.empty())
            html += fmt::format("<p>{}</p>\n", html_text(text));
    }
    return html;
}

std::string colours(const IlluminanceReport& report, const ColourReport& colour) {
    if (colour.surfaces.empty()) return {};
    std::string html = fmt::format("<h2>Colour of the light</h2>\n<p>{}.</p>\n<div class=\"wide\">{}</div>\n",
                                   html_text(colour_heading()), table(colour_rows(report, colour), 1));
    for (const std::string& line : colour_lines(colour)) html += fmt::format("<p>{}.</p>\n", html_text(line));
    return html;
}

std::string uncertainty(const IlluminanceReport& report, const MeasurementUncertainty& lamps) {
    if (lamps.replicates == 0) return {};
    std::string html = fmt::format(
        "<h2>Uncertainty of the lamps' measurement</h2>\n<p>{}.</p>\n<div class=\"wide\">{}</div>\n",
        html_text(uncertainty_heading(lamps)), table(uncertainty_rows(report, lamps), 2));
    for (const std::string& line : uncertainty_lines(lamps))
        html += fmt::format("<p>{}.</p>\n", html_text(line));
    return html;
}

// Rounds to multiples of 1 / `parts`, without -0.
double rounded(double x, double parts) {
    return std::round(parts * x) / parts + 0.0;
}

// Formats a unit vector to two decimals.
std::string direction_text(const V3d& axis) {
    if (axis == V3d(0)) return "–";
    return fmt::format("({:g}, {:g}, {:g})", rounded(axis.x, 100), rounded(axis.y, 100),
                       rounded(axis.z, 100));
}

std::string flux_text(double flux) {
    return flux >= 1000 ? fmt::format("{:.0f}", flux) : fmt::format("{:.4g}", flux);
}

// Lists where the luminaires are and to where they shine.
std::string places(const IlluminanceReport& report) {
    if (report.lamps.empty()) return "<p>None with a position in the scene.</p>";
    std::vector<std::vector<std::string>> rows{
        {"kind", "file", "x [m]", "y [m]", "z [m]", "direction", fmt::format("flux [{}]", report.flux_unit)}};
    constexpr std::size_t kMost = 200;
    for (const LuminairePlace& lamp : report.lamps) {
        if (rows.size() > kMost) break;
        rows.push_back({lamp.kind, plain_line(lamp.file), fmt::format("{:.3f}", lamp.place.x),
                        fmt::format("{:.3f}", lamp.place.y), fmt::format("{:.3f}", lamp.place.z),
                        direction_text(lamp.axis), flux_text(lamp.flux)});
    }
    std::string html = table(rows, 2);
    if (report.lamps.size() > kMost) html += fmt::format("<p>And {} more.</p>", report.lamps.size() - kMost);
    return html;
}

std::string beam_text(const LuminaireType& type) {
    if (!(type.beam.peak > 0)) return {};
    const auto angle = [](double degrees) {
        return degrees > 0 ? fmt::format("{:.0f}°", degrees) : std::string("–");
    };
    return fmt::format("{} × {}", angle(type.beam.beam_angle[0]), angle(type.beam.beam_angle[1]));
}

std::string luminaires(const IlluminanceReport& report, const std::vector<LuminaireType>& types) {
    if (types.empty()) return "<p>None with a position in the scene.</p>";
    const std::string& unit = report.flux_unit;
    std::vector<std::vector<std::string>> rows{{"luminaire", "kind", "number", "flux of each [" + unit + "]",
                                                "flux of all [" + unit + "]", "power of each [W]",
                                                "efficacy [lm/W]", "peak intensity [cd]", "CCT [K]",
                                                "beam angle C0 × C90", "size [m]"}};
    double all = 0, watts = 0;
    std::string figures;
    for (std::size_t i = 0; i < types.size(); ++i) {
        const LuminaireType& type = types[i];
        const double flux = static_cast<double>(type.count) * type.flux;
        all += flux;
        watts += static_cast<double>(type.count) * type.watts;
        rows.push_back({fmt::format("L{} {}", i + 1, plain_line(type.file)), type.kind,
                        std::to_string(type.count), flux_text(type.flux), flux_text(flux),
                        type.watts > 0 ? fmt::format("{:.4g}", type.watts) : "–",
                        type.watts > 0 ? fmt::format("{:.0f}", type.flux / type.watts) : "–",
                        type.beam.peak > 0 ? fmt::format("{:.4g}", type.beam.peak) : "–",
                        type.kelvin > 0 ? fmt::format("{:.0f}", type.kelvin) : "–", beam_text(type),
                        fmt::format("{:.2g} × {:.2g} × {:.2g}", type.size.x, type.size.y, type.size.z)});
        if (type.polar.empty()) continue;
        const std::string& source = type.provenance.empty() ? type.file : type.provenance;
        figures += fmt::format("<figure>{}<figcaption>L{}: {}</figcaption></figure>\n", type.polar, i + 1,
                               html_text(plain_line(source)));
    }
    rows.push_back({"all", "", "", "", flux_text(all), watts > 0 ? fmt::format("{:.4g}", watts) : "–",
                    watts > 0 ? fmt::format("{:.0f}", all / watts) : "–", "", "", "", ""});
    return "<div class=\"wide\">" + table(rows, 2) + "</div>\n<div class=\"row\">" + figures + "</div>";
}

std::string rooms(const std::vector<RoomText>& rooms) {
    if (rooms.empty()) return {};
    std::vector<std::vector<std::string>> rows{{"room", "area [m²]", "bounds [m]", "clear height [m]",
                                                "walls", "reflectance of floor", "of walls", "of ceiling"}};
    for (std::size_t i = 0; i < rooms.size(); ++i) {
        const RoomText& room = rooms[i];
        const auto& [floor, walls, ceiling] = room.reflectances;
        rows.push_back({std::to_string(i + 1), fmt::format("{:.1f}", room.area),
                        fmt::format("{:.2f} × {:.2f}", room.size.x, room.size.y),
                        fmt::format("{:.2f}", room.size.z), std::to_string(room.walls),
                        fmt::format("{:.2f}", floor), fmt::format("{:.2f}", walls),
                        fmt::format("{:.2f}", ceiling)});
    }
    return "<h2>Room</h2>\n<div class=\"wide\">" + table(rows, 1) +
           "</div>\n<p>Reflectances are means over what is met at right angles, furniture before the walls "
           "included.</p>\n";
}

// How a verdict is shown, in the order of Verdict.
struct Mark {
    const char *style, *sign;
};
constexpr Mark kMarks[] = {{"met", "✔ "}, {"missed", "✘ "}, {"undecided", "? "}};

std::string requirements(const std::vector<Judgement>& judgements) {
    if (judgements.empty()) return {};
    std::string html = fmt::format("<h2>Requirements (EN 12464-1:2021)</h2>\n<p class=\"verdict\">{}.</p>\n",
                                   html_text(judgements_summary(judgements)));
    // Missed requirements come first, then undecided ones.
    std::vector<Judgement> sorted = judgements;
    const auto rank = [](const Judgement& one) {
        return one.verdict == Verdict::missed ? 0 : one.verdict == Verdict::undecided ? 1 : 2;
    };
    std::ranges::stable_sort(sorted, {}, rank);
    const std::vector<std::vector<std::string>> rows = judgement_rows(sorted);
    html += "<div class=\"wide\"><table>\n<thead>" + row(rows.front(), "th", 3, "") + "</thead>\n";
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const Mark& mark = kMarks[static_cast<std::size_t>(sorted[i].verdict)];
        std::vector<std::string> cells = rows[i + 1];
        cells.back() = mark.sign + cells.back();
        html += row(cells, "td", 3, mark.style);
    }
    return html + "</table>\n</div>\n";
}

std::string glare(const std::vector<GlareReport>& reports) {
    if (reports.empty()) return {};
    std::vector<std::vector<std::string>> rows{
        {"observer", "x [m]", "y [m]", "z [m]", "looks along", "UGR", "background [cd/m²]", "E_v [lx]"}};
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        const auto metres = [](double x) { return fmt::format("{:.2f}", x); };
        rows.push_back({plain_text(by.name), metres(by.eye.x), metres(by.eye.y), metres(by.eye.z),
                        direction_text(V3d(by.view)), rating_text(report.ugr),
                        reading_text(report.background), reading_text(report.vertical)});
    }
    return "<h2>Glare</h2>\n<div class=\"wide\">" + table(rows, 1) + "</div>\n";
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
        "wide, with the longer side d of the surface in metres (EN 12464-1)."};
    if (const std::string text = maintenance_text(results.report, page.maintenance); !text.empty())
        lines.push_back(text);
    if (!page.rooms.empty()) lines.emplace_back("Surfaces reflect as the model says.");
    if (!results.judgements.empty()) {
        lines.emplace_back(
            "A requirement is met or missed where the whole interval of the value is on one side of "
            "the limit, and undecided otherwise.");
    }
    if (!results.glare.empty()) {
        lines.emplace_back(
            "UGR is rated for observers before the middle of each wall who look across the room, "
            "from the luminance that each of them sees of the luminaires, filtered by 12 mm, with "
            "the initial flux.");
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
    return table({{"what", "value"},
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

// Describes the position of a plan's axes in the scene.
std::string place_text(const CalculationSurface& surface) {
    const auto point = [&](const V3d& p) {
        return fmt::format("({:g}, {:g}, {:g})", rounded(p.x, 1e4), rounded(p.y, 1e4), rounded(p.z, 1e4));
    };
    const V3d& corner = surface.corner;
    return fmt::format(
        "Positions in the scene, in metres: x from {0} to {1}, y from {0} to {2}; points {3:.3g} by "
        "{4:.3g} m apart.",
        point(corner), point(corner + surface.u), point(corner + surface.v),
        surface.u.length() / surface.points.x, surface.v.length() / surface.points.y);
}

std::string capitalised(std::string text) {
    text.front() = static_cast<char>(text.front() - 'a' + 'A');  // a lower-case letter
    return text;
}

std::string facts(const Facts& facts) {
    std::vector<std::vector<std::string>> rows{{"name", "content"}};
    for (const auto& [name, value] : facts) rows.push_back({plain_line(name), plain_line(value)});
    return table(rows, 2);
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

PlanFigure plan_of(const IlluminanceReport& report, std::size_t surface, std::span<const double> values,
                   const LuxPage& page) {
    const CalculationSurface& grid = report.surfaces[surface].surface;
    const bool is_level = grid.is_level(page.up_axis);
    PlanFigure plan = plan_of(grid, values, report.unit,
                              is_level ? std::span(report.lamps) : std::span<const LuminairePlace>());
    plan.drawings = page.model[surface];
    return plan;
}

PlanFigure plan_of(const IlluminanceReport& report, std::size_t surface, const LuxPage& page) {
    std::vector<double> values;
    for (const PointIlluminance& point : report.surfaces[surface].points) values.push_back(point.all.value);
    return plan_of(report, surface, values, page);
}

std::string lux_page(const LuxResults& results, const LuxPage& page) {
    const IlluminanceReport& report = results.report;
    std::string plans, further;
    for (std::size_t i = 0; i < report.surfaces.size(); ++i) {
        const SurfaceIlluminance& surface = report.surfaces[i];
        PlanFigure plan = plan_of(report, i, page);
        const bool is_level = surface.surface.is_level(page.up_axis);
        plan.title.clear();  // the heading says it
        const bool is_wide = surface.surface.u.length() > 2.5 * surface.surface.v.length();
        if (i >= page.tasks && !is_wide) plan.width = kFurtherPlan;
        if (is_level) label_walls(page, surface.surface, plan);
        (i < page.tasks ? plans : further) +=
            fmt::format("<figure{}><h2>{}</h2>{}<figcaption>{}{}</figcaption></figure>\n",
                        is_wide ? " class=\"broad\"" : "", html_text(plain_text(surface.surface.name)),
                        plan_svg(plan), html_text(place_text(surface.surface)), is_level ? kPlanKey : "");
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
         {"summary", summary(report)},
         {"picture", page.picture ? fmt::format("<figure><img src=\"{}\" alt=\"The scene\"></figure>",
                                                data_url(*page.picture))
                                  : std::string()},
         {"requirements", requirements(results.judgements)},
         {"rooms", rooms(page.rooms)},
         {"colour", colours(report, results.colour)},
         {"uncertainty", uncertainty(report, results.uncertainty)},
         {"plans", plans},
         {"glare", glare(results.glare)},
         {"assumptions", assumptions(results, page)},
         {"luminaires", luminaires(report, page.luminaires)},
         {"places", places(report)},
         {"settings", settings(report, page)},
         {"files", facts(page.facts)}});
}

}  // namespace lucerna
