#include "engine/cli/photometry/lux_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
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
constexpr const char* kOpenSides =
    " A side without a wall up to the ceiling is open: it is no wall, and there is no observer before it.";
constexpr double kFurtherPlan = 460;  // pixels, width of the plans that are not of task areas

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

// Rounds to multiples of 1 / `parts`, without -0.
double rounded(double x, double parts) {
    return std::round(parts * x) / parts + 0.0;
}

// Formats a vector to two decimals.
std::string point_text(const V3d& point) {
    return fmt::format("({:g}, {:g}, {:g})", rounded(point.x, 100), rounded(point.y, 100),
                       rounded(point.z, 100));
}

std::string direction_text(const V3d& axis) {
    return axis == V3d(0) ? "–" : point_text(axis);
}

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

std::string flux_text(double flux) {
    return flux >= 1e5 ? fmt::format("{:.0f}", flux) : fmt::format("{:.6g}", rounded(flux, 10));
}

// Lists where the luminaires are and to where they shine.
std::string places(const IlluminanceReport& report, const LuxPage& page) {
    const std::vector<LuminairePlace>& lamps = page.luminaires.places;
    if (lamps.empty()) return "<p>None with a position in the scene.</p>";
    std::vector<std::vector<std::string>> rows{{"luminaire", "group", "x [m]", "y [m]", "z [m]", "direction",
                                                "aims at [m]", fmt::format("flux [{}]", report.flux_unit)}};
    constexpr std::size_t kMost = 200;
    for (std::size_t i = 0; i < std::min(lamps.size(), kMost); ++i) {
        const LuminairePlace& lamp = lamps[i];
        rows.push_back({fmt::format("L{} {}", page.luminaires.type_of[i] + 1, plain_line(lamp.file)),
                        page.groups.empty() ? "–" : plain_line(page.groups[i]),
                        fmt::format("{:.3f}", lamp.place.x), fmt::format("{:.3f}", lamp.place.y),
                        fmt::format("{:.3f}", lamp.place.z), direction_text(lamp.axis),
                        lamp.aim ? point_text(*lamp.aim) : "–", flux_text(lamp.flux)});
    }
    std::string html = table(rows, 2);
    if (lamps.size() > kMost) html += fmt::format("<p>And {} more.</p>", lamps.size() - kMost);
    return html;
}

// Returns the heights of a type's luminaires above the floor, of their middles; empty without a room.
std::string mounting_text(const LuxPage& page, std::size_t type) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = 0; i < page.luminaires.places.size(); ++i) {
        if (page.luminaires.type_of[i] != type) continue;
        const double height = page.luminaires.places[i].place[page.up_axis] - page.floor;
        low = std::min(low, height);
        high = std::max(high, height);
    }
    if (!std::isfinite(low)) return {};
    const bool is_one = high - low < 5e-3;
    return is_one ? fmt::format("{:.2f} m", low) : fmt::format("{:.2f} to {:.2f} m", low, high);
}

// Returns the data sheet of a type: its polar diagram and its facts.
std::string sheet(const LuxPage& page, std::size_t type) {
    const LuminaireType& of = page.luminaires.types[type];
    std::string rows;
    const auto add = [&rows](std::string_view name, std::string_view text) {
        rows += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", html_text(plain_line(name)),
                            html_text(plain_line(text)));
    };
    for (const auto& [name, text] : of.facts) add(name, text);
    if (const std::string height = mounting_text(page, type); !height.empty()) add("mounting height", height);
    return fmt::format(
        "<figure class=\"sheet\">{}<figcaption><strong>L{} "
        "{}</strong><table>{}</table></figcaption></figure>\n",
        of.polar, type + 1, html_text(plain_line(of.file.empty() ? of.kind : of.file)), rows);
}

std::string luminaires(const IlluminanceReport& report, const LuxPage& page) {
    const std::vector<LuminaireType>& types = page.luminaires.types;
    if (types.empty()) return "<p>None with a position in the scene.</p>";
    const std::string& unit = report.flux_unit;
    std::vector<std::vector<std::string>> rows{{"luminaire", "kind", "number", "flux of each [" + unit + "]",
                                                "flux of all [" + unit + "]", "power of each [W]",
                                                "power of all [W]", "efficacy [lm/W]"}};
    // Efficacy is that of the luminaires whose power is known.
    double all = 0, known = 0, watts = 0;
    std::string sheets;
    const auto number = [](double x) { return x > 0 ? fmt::format("{:.4g}", x) : std::string("–"); };
    const auto efficacy = [](double flux, double power) {
        return power > 0 ? fmt::format("{:.0f}", flux / power) : std::string("–");
    };
    for (std::size_t i = 0; i < types.size(); ++i) {
        const LuminaireType& type = types[i];
        const auto count = static_cast<double>(type.count);
        all += count * type.flux;
        watts += count * type.watts;
        if (type.watts > 0) known += count * type.flux;
        rows.push_back({fmt::format("L{} {}", i + 1, plain_line(type.file)), type.kind,
                        std::to_string(type.count), flux_text(type.flux), flux_text(count * type.flux),
                        number(type.watts), number(count * type.watts), efficacy(type.flux, type.watts)});
        sheets += sheet(page, i);
    }
    rows.push_back({"all", "", "", "", flux_text(all), "", number(watts), efficacy(known, watts)});
    if (page.lights_outside > 0) {
        sheets += fmt::format("<p>{} more lights are outside the rooms. Their light counts.</p>\n",
                              page.lights_outside);
    }
    return "<div class=\"wide\">" + table(rows, 2) + "</div>\n<div class=\"row\">" + sheets + "</div>";
}

// Returns the mean illuminance of the level task areas in a room, weighted by their areas [lx].
double mean_of_tasks(const IlluminanceReport& report, const RoomText& room, int up_axis) {
    double sum = 0, area = 0;
    for (const std::size_t task : room.tasks) {
        const SurfaceIlluminance& of = report.surfaces[task];
        if (!of.surface.is_level(up_axis)) continue;
        const double size = of.surface.u.cross(of.surface.v).length();
        sum += size * of.mean.value;
        area += size;
    }
    return area > 0 ? sum / area : 0;
}

std::string energy(const IlluminanceReport& report, const LuxPage& page) {
    if (page.rooms.empty()) return {};
    std::vector<std::vector<std::string>> rows{{"room", "luminaires", "power [W]", "power density [W/m²]",
                                                "mean of the level task areas [lx]", "W/m² per 100 lx"}};
    if (page.hours > 0) {
        rows.front().emplace_back("energy in a year [kWh]");
        rows.front().emplace_back("LENI [kWh/m²]");
    }
    bool is_known = true;
    for (std::size_t i = 0; i < page.rooms.size(); ++i) {
        const RoomText& room = page.rooms[i];
        const double density = room.watts / room.area, lux = mean_of_tasks(report, room, page.up_axis);
        const double kilowatt_hours = room.watts * page.hours / 1000;
        is_known = is_known && room.watts > 0;
        const auto number = [&](double x, const char* digits) {
            return room.watts > 0 && std::isfinite(x) ? fmt::format(fmt::runtime(digits), x)
                                                      : std::string("–");
        };
        std::vector<std::string> row{std::to_string(i + 1),
                                     std::to_string(room.luminaires),
                                     number(room.watts, "{:.4g}"),
                                     number(density, "{:.2f}"),
                                     lux > 0 ? fmt::format("{:.1f}", lux) : "–",
                                     number(density / lux * 100, "{:.2f}")};
        if (page.hours > 0) {
            row.push_back(number(kilowatt_hours, "{:.0f}"));
            row.push_back(number(kilowatt_hours / room.area, "{:.1f}"));
        }
        rows.push_back(std::move(row));
    }
    std::string html = "<h2>Energy</h2>\n<div class=\"wide\">" + table(rows, 1) + "</div>\n";
    if (!is_known)
        html += "<p>–: the electrical power of a luminaire in the room is not stated by its file.</p>\n";
    if (page.hours > 0)
        html += fmt::format(
            "<p>Energy and LENI are those of {:g} h of use in a year at full power, without controls.</p>\n",
            page.hours);
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
    return "<h2>Room</h2>\n<div class=\"wide\">" + table(rows, 1) +
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
    return "<h2>Glare</h2>\n<div class=\"wide\">" + table(rows, 1) +
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
         {"luminaires", luminaires(report, page)},
         {"energy", energy(report, page)},
         {"places", places(report, page)},
         {"settings", settings(report, page)},
         {"files", facts(page.facts)}});
}

}  // namespace lucerna
