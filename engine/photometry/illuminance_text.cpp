#include "engine/photometry/illuminance_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/base/elementary.h"
#include "engine/scene/path_account.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Returns the number of columns of UTF-8 text without wide characters.
std::size_t columns_of(const std::string& text) {
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

nlohmann::json json_of(const Reading95& reading) {
    return {{"value", reading.value}, {"half_width", reading.half_width}};
}

nlohmann::json json_of(const V3d& v) {
    return {v.x, v.y, v.z};
}

nlohmann::json by_group(const IlluminanceReport& report, const std::vector<double>& values) {
    nlohmann::json groups = nlohmann::json::object();
    for (std::size_t g = 0; g < values.size(); ++g) groups[report.groups[g]] = values[g];
    return groups;
}

nlohmann::json json_of(const LampUncertainty& lamps, const Reading95& reading) {
    return {{"U", lamps.expanded},
            {"upper_bound", lamps.upper_bound},
            {"relative_uncertainty_of_U", lamps.relative},
            {"half_width_of_both", combined(reading, lamps)}};
}

nlohmann::json json_of(const FarFieldError& error) {
    nlohmann::json json{{"mean", json_of(error.mean)},
                        {"rms_over_points", error.rms},
                        {"least", json_of(error.least)},
                        {"greatest", json_of(error.greatest)},
                        {"values", nlohmann::json::array()}};
    for (const Reading95& point : error.points)  // null where there is no light
        json["values"].push_back(std::isnan(point.value) ? nlohmann::json() : json_of(point));
    return json;
}

std::string colour_headings() {
    std::string text;
    for (const ColourQuantity& of : kColourQuantities) {
        const std::string unit = of.unit.empty() ? std::string() : fmt::format(" [{}]", of.unit);
        text +=
            fmt::format(",{0}{1},half-width of 95 % of {0}{1},error of {0} by intervals{1}", of.name, unit);
    }
    return text;
}
// Leaves the fields of what is not defined empty.
std::string colour_fields(const LightColour& colour) {
    std::string text;
    for (std::size_t i = 0; i < kColourCount; ++i) {
        const Reading95& reading = colour.values[i];
        text += std::isnan(reading.value) ? ",,,"
                                          : fmt::format(",{:.7g},{:.3g},{:.3g}", reading.value,
                                                        reading.half_width, colour.by_intervals[i]);
    }
    return text;
}
// Numbers that are not defined are null.
nlohmann::json json_of(const LightColour& colour) {
    nlohmann::json json = nlohmann::json::object();
    for (std::size_t i = 0; i < kColourCount; ++i) {
        nlohmann::json& value = json[std::string(kColourQuantities[i].name)] = json_of(colour.values[i]);
        value["error_by_intervals"] = colour.by_intervals[i];
    }
    return json;
}

// Adds the lamps' uncertainty to a surface's numbers and its points.
void add_lamps(nlohmann::json& of, const SurfaceIlluminance& surface, const SurfaceUncertainty& lamps) {
    of["lamps"] = {{"mean", json_of(lamps.mean, surface.mean)},
                   {"least", json_of(lamps.least, surface.least)},
                   {"uniformity", json_of(lamps.uniformity, surface.uniformity)},
                   {"rms_over_points", lamps.rms}};
    for (std::size_t i = 0; i < surface.points.size(); ++i)
        of["values"][i]["lamps"] = json_of(lamps.points[i], surface.points[i].all);
}

}  // namespace

// Prints two significant digits of the half-width.
std::string reading_text(const Reading95& reading) {
    if (!(reading.half_width > 0)) return fmt::format("{:.4g}", reading.value);
    const auto magnitude = [](double x) { return static_cast<int>(std::floor(log10(x))); };
    const int places = std::max(0, 1 - magnitude(reading.half_width));
    constexpr int kMostPlaces = 6;
    if (places > kMostPlaces && std::fabs(reading.value) < 1) {
        const double size = std::fabs(reading.value);
        const int digits = size > 0 ? std::max(0, magnitude(size) + places) : 0;
        return fmt::format("{:.{}e} ± {:.1e}", reading.value, digits, reading.half_width);
    }
    return fmt::format("{:.{}f} ± {:.{}f}", reading.value, places, reading.half_width, places);
}

std::string table_text(const std::vector<std::vector<std::string>>& rows) {
    std::vector<std::size_t> widths(rows.front().size());
    for (const auto& row : rows) {
        for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], columns_of(row[c]));
    }
    std::string text;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t c = 0; c < row.size(); ++c) {
            line += row[c];
            if (c + 1 < row.size()) line.append(widths[c] - columns_of(row[c]) + 2, ' ');
        }
        text += line + '\n';
    }
    return text;
}

std::string cut_off_text(const SurfaceIlluminance& surface) {
    const std::size_t excluded = surface.excluded(), cut_off = surface.cut_off() - excluded;
    const std::string name = plain_text(surface.surface.name);
    std::string text;
    if (excluded > 0) {
        text = fmt::format(
            "\"{}\": {} of {} points lie outside the area or the room, or are hidden, and do not count\n",
            name, excluded, surface.points.size());
    }
    if (cut_off > 0) {
        text += fmt::format(
            "\"{}\": {} of {} points lie inside furniture, walls or closed rooms, where no light "
            "comes, and do not count\n",
            name, cut_off, surface.points.size() - excluded);
    }
    return text;
}

std::string quantity_text(const IlluminanceReport& report) {
    std::string text = fmt::format("{} in {}; ± is the half-width of the 95 % confidence interval",
                                   report.quantity, report.unit);
    if (report.sky_illuminance > 0) {
        text += fmt::format("; 100 % is {:.5g} {}, the illuminance of an unobstructed horizontal plane",
                            report.sky_illuminance, report.flux_unit == "lm" ? "lx" : "W/m^2");
    }
    return text;
}

std::string illuminance_text(const IlluminanceReport& report) {
    std::vector<std::vector<std::string>> rows{
        {"surface", "kind", "points", "mean", "least", "greatest", "U_0", "direct"}};
    for (const SurfaceIlluminance& surface : report.surfaces) {
        const CalculationSurface& grid = surface.surface;
        rows.push_back(
            {plain_text(grid.name), std::string(receiver_kind_name(grid.kind)),
             fmt::format("{} x {}", grid.points.x, grid.points.y), reading_text(surface.mean),
             reading_text(surface.least), reading_text(surface.greatest), reading_text(surface.uniformity),
             surface.mean.value > 0 ? fmt::format("{:.1f} %", 100 * surface.direct / surface.mean.value)
                                    : "-"});
    }
    std::string text = quantity_text(report) + '\n' + table_text(rows);
    for (const SurfaceIlluminance& surface : report.surfaces) text += cut_off_text(surface);
    return text;
}

namespace {

std::string limits_text(const Judgement& judgement) {
    const auto& [low, high] = judgement.limits;
    const std::string unit = judgement.unit.empty() ? "" : " " + judgement.unit;
    if (!(high > 0)) return fmt::format("≥ {:g}{}", low, unit);
    return low > 0 ? fmt::format("{:g} to {:g}{}", low, high, unit) : fmt::format("≤ {:g}{}", high, unit);
}

std::string value_text(const Judgement& judgement) {
    if (std::isnan(judgement.value.value)) return "undefined";
    if (judgement.requirement == "UGR" && judgement.value.value == 0) return "no luminaire in sight";
    return reading_text(judgement.value);
}

}  // namespace

std::vector<std::vector<std::string>> judgement_rows(std::span<const Judgement> judgements) {
    std::vector<std::vector<std::string>> rows{{"requirement", "of", "required", "value", "result"}};
    for (const Judgement& judgement : judgements) {
        rows.push_back({judgement.requirement, plain_text(judgement.of), limits_text(judgement),
                        value_text(judgement),
                        std::string(kVerdicts[static_cast<std::size_t>(judgement.verdict)])});
    }
    return rows;
}

std::string judgements_summary(std::span<const Judgement> judgements) {
    std::array<std::size_t, std::size(kVerdicts)> counts{};
    for (const Judgement& judgement : judgements) ++counts[static_cast<std::size_t>(judgement.verdict)];
    const auto count = [&](Verdict verdict) { return counts[static_cast<std::size_t>(verdict)]; };
    if (count(Verdict::met) == judgements.size())
        return fmt::format("all {} requirements are met", judgements.size());
    std::string text = fmt::format("{} of {} requirements are met", count(Verdict::met), judgements.size());
    if (count(Verdict::missed) > 0) text += fmt::format(", {} missed", count(Verdict::missed));
    if (count(Verdict::undecided) > 0)
        text += fmt::format(
            ", {} not decided at this precision (a smaller --precision or more --time can decide)",
            count(Verdict::undecided));
    return text;
}

std::string judgements_text(std::span<const Judgement> judgements) {
    if (judgements.empty()) return {};
    return "\nEN 12464-1: " + judgements_summary(judgements) + '\n' + table_text(judgement_rows(judgements)) +
           '\n';
}

std::string illuminance_csv(const IlluminanceReport& report, const MeasurementUncertainty& lamps,
                            const ColourReport& colour) {
    std::string text =
        fmt::format("surface,i,j,x,y,z,{1} [{0}],half-width of 95 % [{0}],direct [{0}],indirect [{0}]",
                    report.unit, report.symbol);
    for (const std::string& group : report.groups)
        text += ',' + csv_field(fmt::format("{} [{}]", plain_text(group), report.unit));
    if (lamps.replicates > 0)
        text += fmt::format(",U of lamps [{0}],upper bound,half-width of both [{0}]", report.unit);
    if (!colour.surfaces.empty()) text += colour_headings();
    text += '\n';
    for (std::size_t s = 0; s < report.surfaces.size(); ++s) {
        const SurfaceIlluminance& surface = report.surfaces[s];
        const std::string name = csv_field(plain_text(surface.surface.name));
        for (int y = 0; y < surface.surface.points.y; ++y) {
            for (int x = 0; x < surface.surface.points.x; ++x) {
                const V3d p = surface.surface.position(x, y);
                const PointIlluminance& point = surface.at(x, y);
                text += fmt::format("{},{},{},{:.7g},{:.7g},{:.7g}", name, x, y, p.x, p.y, p.z);
                if (point.is_cut_off()) {
                    text.append(4 + point.groups.size() + (lamps.replicates > 0 ? 3 : 0) +
                                    (colour.surfaces.empty() ? 0 : 3 * kColourCount),
                                ',');
                    text += '\n';
                    continue;
                }
                text += fmt::format(",{:.7g},{:.3g},{:.7g},{:.7g}", point.all.value, point.all.half_width,
                                    point.direct, point.indirect.value);
                for (const double group : point.groups) text += fmt::format(",{:.7g}", group);
                if (lamps.replicates > 0) {
                    const LampUncertainty& by_lamps = lamps.surfaces[s].points[surface.surface.index(x, y)];
                    text += fmt::format(",{:.3g},{},{:.3g}", by_lamps.expanded, int{by_lamps.upper_bound},
                                        combined(point.all, by_lamps));
                }
                if (!colour.surfaces.empty())
                    text += colour_fields(colour.surfaces[s].points[surface.surface.index(x, y)]);
                text += '\n';
            }
        }
    }
    return text;
}

std::string illuminance_json(const IlluminanceReport& report, const MeasurementUncertainty& lamps,
                             const FarFieldErrors& far_field, const ColourReport& colour,
                             std::span<const Judgement> judgements) {
    nlohmann::json json{{"quantity", report.quantity},
                        {"unit", report.unit},
                        {"confidence", 0.95},
                        {"precision", report.precision},
                        {"ended_by", report.ended_by},
                        {"sensors_of_a_point", report.sensors},
                        {"samples_of_a_sensor", report.samples},
                        {"rays", report.rays},
                        {"seconds", report.seconds},
                        {"surfaces", nlohmann::json::array()}};
    if (report.sky_illuminance > 0) json["sky_illuminance"] = report.sky_illuminance;
    if (lamps.replicates > 0) json["replicates"] = lamps.replicates;
    if (!colour.surfaces.empty()) {
        json["wavelength_intervals"] = colour.intervals;
        json["error_of_lamp_spectra"] = colour.spectra_error;
    }
    for (const FieldError& of : lamps.fields) {
        nlohmann::json field{{"file", plain_text(of.lamp)}};
        if (of.known) field["error_by_direction"] = of.by_direction, field["greatest_error"] = of.greatest;
        json["light_fields"].push_back(std::move(field));
    }
    for (std::size_t s = 0; s < report.surfaces.size(); ++s) {
        const SurfaceIlluminance& surface = report.surfaces[s];
        const CalculationSurface& grid = surface.surface;
        nlohmann::json of{{"name", plain_text(grid.name)},
                          {"kind", receiver_kind_name(grid.kind)},
                          {"corner", json_of(grid.corner)},
                          {"u", json_of(grid.u)},
                          {"v", json_of(grid.v)},
                          {"normal", json_of(V3d(grid.normal))},
                          {"points", {grid.points.x, grid.points.y}},
                          {"mean", json_of(surface.mean)},
                          {"least", json_of(surface.least)},
                          {"greatest", json_of(surface.greatest)},
                          {"uniformity", json_of(surface.uniformity)},
                          {"direct", surface.direct},
                          {"groups", by_group(report, surface.groups)},
                          {"values", nlohmann::json::array()}};
        for (const PointIlluminance& point : surface.points) {
            of["values"].push_back({{"value", point.all.value},
                                    {"half_width", point.all.half_width},
                                    {"direct", point.direct},
                                    {"indirect", json_of(point.indirect)},
                                    {"groups", by_group(report, point.groups)}});
        }
        if (lamps.replicates > 0) add_lamps(of, surface, lamps.surfaces[s]);
        if (!colour.surfaces.empty()) {
            of["colour"] = json_of(colour.surfaces[s].mean);
            for (std::size_t i = 0; i < surface.points.size(); ++i)
                of["values"][i]["colour"] = json_of(colour.surfaces[s].points[i]);
        }
        if (!far_field.from_point.empty()) of["far_field_error"]["point"] = json_of(far_field.from_point[s]);
        if (!far_field.from_opening.empty())
            of["far_field_error"]["opening"] = json_of(far_field.from_opening[s]);
        json["surfaces"].push_back(std::move(of));
    }
    for (const Judgement& judgement : judgements) {
        nlohmann::json of{{"requirement", judgement.requirement},
                          {"of", plain_text(judgement.of)},
                          {"value", json_of(judgement.value)},
                          {"result", kVerdicts[static_cast<std::size_t>(judgement.verdict)]}};
        if (judgement.limits.low > 0) of["at_least"] = judgement.limits.low;
        if (judgement.limits.high > 0) of["at_most"] = judgement.limits.high;
        json["requirements"].push_back(std::move(of));
    }
    return json.dump(1) + '\n';
}

Image illuminance_image(const SurfaceIlluminance& surface, const IlluminanceReport& report) {
    const CalculationSurface& grid = surface.surface;
    std::vector<std::string> channels{"Y", "half_width", "direct", "indirect"};
    for (const std::string& group : report.groups) channels.push_back(kLightGroupPrefix + group);
    Image image(grid.points.x, grid.points.y, channels);
    for (int y = 0; y < grid.points.y; ++y) {
        for (int x = 0; x < grid.points.x; ++x) {
            const PointIlluminance& point = surface.at(x, grid.points.y - 1 - y);
            std::vector<double> values{point.all.value, point.all.half_width, point.direct,
                                       point.indirect.value};
            values.insert(values.end(), point.groups.begin(), point.groups.end());
            for (std::size_t c = 0; c < values.size(); ++c)
                image.value(x, y, static_cast<int>(c)) = static_cast<float>(values[c]);
        }
    }
    image.attributes["lucerna.unit"] = report.unit;
    image.attributes["lucerna.surface"] = plain_text(grid.name);
    return image;
}

}  // namespace lucerna
