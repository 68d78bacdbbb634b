#include "engine/cli/photometry/lux_page.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/version.h"
#include "engine/cli/page_parts.h"
#include "engine/cli/photometry/plan_files.h"
#include "engine/figures/markup.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

// Returns a table of text cells; the first row is the heading, and numbers are right-aligned.
std::string table(const std::vector<std::vector<std::string>>& rows, std::size_t text_columns) {
    std::string html = "<table>\n";
    for (std::size_t r = 0; r < rows.size(); ++r) {
        const std::string cell = r == 0 ? "th" : "td";
        html += "<tr>";
        for (std::size_t c = 0; c < rows[r].size(); ++c) {
            html += fmt::format("<{0}{1}>{2}</{0}>", cell, c < text_columns ? "" : " class=\"number\"",
                                html_text(rows[r][c]));
        }
        html += "</tr>\n";
    }
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
        if (of.cut_off() > 0) html += fmt::format("<p>{}</p>\n", html_text(cut_off_text(of)));
    }
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

// Formats a unit vector to two decimals.
std::string direction_text(const V3d& axis) {
    if (axis == V3d(0)) return "all around";
    const auto rounded = [](double x) { return std::round(100 * x) / 100 + 0.0; };  // turns -0 into 0
    return fmt::format("({:g}, {:g}, {:g})", rounded(axis.x), rounded(axis.y), rounded(axis.z));
}

std::string lamps(const IlluminanceReport& report) {
    if (report.lamps.empty()) return "<p>None with a position in the scene.</p>";
    std::vector<std::vector<std::string>> rows{
        {"kind", "file", "x [m]", "y [m]", "z [m]", "direction", fmt::format("flux [{}]", report.flux_unit)}};
    constexpr std::size_t kMost = 200;
    for (const LuminairePlace& lamp : report.lamps) {
        if (rows.size() > kMost) break;
        rows.push_back({lamp.kind, plain_line(lamp.file), fmt::format("{:.3f}", lamp.place.x),
                        fmt::format("{:.3f}", lamp.place.y), fmt::format("{:.3f}", lamp.place.z),
                        direction_text(lamp.axis), fmt::format("{:.4g}", lamp.flux)});
    }
    std::string html = table(rows, 2);
    if (report.lamps.size() > kMost) html += fmt::format("<p>And {} more.</p>", report.lamps.size() - kMost);
    return html;
}

std::string settings(const IlluminanceReport& report, const LuxPage& page) {
    return table(
        {{"what", "value"},
         {"program", fmt::format("lucerna {}", program_version())},
         {"method", "path tracing, unbiased"},
         {"intervals", "95 %, Student's t, from independently sampled sensors"},
         {"widest interval",
          fmt::format("± {:.2g} % of its point's illuminance, or of the surface's mean if that is more",
                      100 * report.precision)},
         {"ended by", report.ended_by},
         {"samples per point", fmt::format("{} sensors × {}", report.sensors, report.samples)},
         {"rays", fmt::format("{:.3g}", static_cast<double>(report.rays))},
         {"seed", std::to_string(page.seed)},
         {"time", duration_text(report.seconds)}},
        2);
}

// Describes the position of a plan's axes in the scene.
std::string place_text(const CalculationSurface& surface) {
    const auto point = [](const V3d& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); };
    const V3d& corner = surface.corner;
    return fmt::format(
        "Positions in the scene, in metres: x from {0} to {1}, y from {0} to {2}; points {3:.3g} by "
        "{4:.3g} m apart.",
        point(corner), point(corner + surface.u), point(corner + surface.v),
        surface.u.length() / surface.points.x, surface.v.length() / surface.points.y);
}

std::string facts(const Facts& facts) {
    std::vector<std::vector<std::string>> rows{{"name", "content"}};
    for (const auto& [name, value] : facts) rows.push_back({plain_line(name), plain_line(value)});
    return table(rows, 2);
}

}  // namespace

PlanFigure plan_of(const SurfaceIlluminance& surface, const IlluminanceReport& report) {
    std::vector<double> values;
    for (const PointIlluminance& point : surface.points) values.push_back(point.all.value);
    return plan_of(surface.surface, values, report.unit, report.lamps);
}

std::string lux_page(const IlluminanceReport& report, const LuxPage& page) {
    std::string plans;
    for (const SurfaceIlluminance& surface : report.surfaces) {
        plans += fmt::format("<h2>{}</h2>\n<figure>{}<figcaption>{}</figcaption></figure>\n",
                             html_text(plain_text(surface.surface.name)), plan_svg(plan_of(surface, report)),
                             html_text(place_text(surface.surface)));
    }
    for (const PlanFigure& plan : page.more_plans)
        plans += fmt::format("<h2>{}</h2>\n<figure>{}</figure>\n", html_text(plan.title), plan_svg(plan));
    return filled(
        kLuxPage,
        {{"title", html_text("Illuminance: " + plain_text(page.scene))},
         {"style", std::string(kPageStyle)},
         {"verdict", html_text(fmt::format("Illuminance in {}; ± is the half-width of the 95 % confidence "
                                           "interval. Initial values: no maintenance factor is applied.",
                                           unit_as_written(report.unit)))},
         {"summary", summary(report)},
         {"picture", page.picture ? fmt::format("<figure><img src=\"{}\" alt=\"The scene\"></figure>",
                                                data_url(*page.picture))
                                  : std::string()},
         {"uncertainty", uncertainty(report, page.uncertainty)},
         {"plans", plans},
         {"lamps", lamps(report)},
         {"settings", settings(report, page)},
         {"files", facts(page.facts)}});
}

}  // namespace lucerna
