#include "engine/cli/photometry/lux_page_luminaires.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/cli/page_tables.h"
#include "engine/figures/markup.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

std::string flux_text(double flux) {
    return flux >= 1e5 ? fmt::format("{:.0f}", flux) : fmt::format("{:.6g}", rounded(flux, 10));
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

}  // namespace

double rounded(double x, double parts) {
    return std::round(parts * x) / parts + 0.0;
}

std::string point_text(const V3d& point) {
    return fmt::format("({:g}, {:g}, {:g})", rounded(point.x, 100), rounded(point.y, 100),
                       rounded(point.z, 100));
}

std::string direction_text(const V3d& axis) {
    return axis == V3d(0) ? "–" : point_text(axis);
}

std::string luminaires_section(const IlluminanceReport& report, const LuxPage& page) {
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
    return "<div class=\"wide\">" + html_table(rows, 2) + "</div>\n<div class=\"row\">" + sheets + "</div>";
}

std::string energy_section(const IlluminanceReport& report, const LuxPage& page) {
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
    std::string html = "<h2>Energy</h2>\n<div class=\"wide\">" + html_table(rows, 1) + "</div>\n";
    if (!is_known)
        html += "<p>–: the electrical power of a luminaire in the room is not stated by its file.</p>\n";
    if (page.hours > 0)
        html += fmt::format(
            "<p>Energy and LENI are those of {:g} h of use in a year at full power, without controls.</p>\n",
            page.hours);
    return html;
}

std::string places_section(const IlluminanceReport& report, const LuxPage& page) {
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
    std::string html = html_table(rows, 2);
    if (lamps.size() > kMost) html += fmt::format("<p>And {} more.</p>", lamps.size() - kMost);
    return html;
}

}  // namespace lucerna
