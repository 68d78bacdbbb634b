#include "engine/photometry/glare_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/photometry/illuminance_text.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

std::string short_text(const Reading95& reading) {
    return std::isfinite(reading.value) ? fmt::format("{:.4g}", reading.value) : "none";
}

// Formats a number for a table; numbers that are not finite give an empty cell.
std::string csv_number(double value, int digits) {
    return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : std::string();
}

}  // namespace

std::string rating_text(const Reading95& rating) {
    if (std::isnan(rating.value)) return "undefined";
    return std::isfinite(rating.value) ? reading_text(rating) : "none";
}

std::string glare_text(std::span<const GlareReport> reports) {
    const bool daylight = std::any_of(reports.begin(), reports.end(),
                                      [](const GlareReport& report) { return report.daylight.has_value(); });
    constexpr const char* kRow = "{:<16} {:<24} {:<20} {:>15} {:>15} {:>15} {:>10} {:>10} {:>10}{}\n";
    const auto triple = [](const auto& v) { return fmt::format("{:.4g} {:.4g} {:.4g}", v.x, v.y, v.z); };
    std::string text =
        fmt::format(fmt::runtime(kRow), "observer", "at", "looks along", "UGR", "UGR CIE 232", "UGR of means",
                    "L_b cd/m²", "E_v lx", "luminaires", daylight ? fmt::format(" {:>14}", "DGP") : "");
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        const V3f view = by.view + V3f(0);  // turns -0 into 0
        text += fmt::format(
            fmt::runtime(kRow), plain_text(by.name), triple(by.eye), triple(view), rating_text(report.ugr),
            rating_text(report.ugr_effective), rating_text(report.ugr_even), short_text(report.background),
            short_text(report.vertical), report.sources.size(),
            report.daylight ? fmt::format(" {:>14}", reading_text(report.daylight->dgp)) : "");
    }
    return text;
}

std::string glare_csv(std::span<const GlareReport> reports) {
    std::string text =
        "observer,x,y,z,view x,view y,view z,UGR,half-width of 95 %,UGR of means,L_b [cd/m^2],E_v "
        "[lx],luminaires,DGP,half-width of 95 % of DGP,UGR CIE 232\n";
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        const bool rated = std::isfinite(report.ugr.value);
        text += fmt::format(
            "{},{:.7g},{:.7g},{:.7g},{:.4g},{:.4g},{:.4g},{},{},{},{:.5g},{:.5g},{},{},{}\n",
            csv_field(plain_text(by.name)), by.eye.x, by.eye.y, by.eye.z, by.view.x, by.view.y, by.view.z,
            csv_number(report.ugr.value, 4), csv_number(rated ? report.ugr.half_width : NAN, 2),
            csv_number(report.ugr_even.value, 4), report.background.value, report.vertical.value,
            report.sources.size(),
            report.daylight
                ? fmt::format("{:.4g},{:.2g}", report.daylight->dgp.value, report.daylight->dgp.half_width)
                : ",",
            csv_number(report.ugr_effective.value, 4));
    }
    return text;
}

std::string glare_json(std::span<const GlareReport> reports) {
    const auto number = [](const Reading95& reading) {
        nlohmann::json of{{"value", nullptr}, {"half_width", nullptr}};
        if (std::isfinite(reading.value)) of = {{"value", reading.value}, {"half_width", reading.half_width}};
        return of;
    };
    nlohmann::json json = nlohmann::json::array();
    for (const GlareReport& report : reports) {
        const Observer& by = report.observer;
        nlohmann::json of{{"name", plain_text(by.name)},
                          {"eye", {by.eye.x, by.eye.y, by.eye.z}},
                          {"view", {by.view.x, by.view.y, by.view.z}},
                          {"ugr", number(report.ugr)},
                          {"ugr_of_means", number(report.ugr_even)},
                          {"ugr_cie_232", number(report.ugr_effective)},
                          {"background", number(report.background)},
                          {"vertical", number(report.vertical)},
                          {"sources", nlohmann::json::array()}};
        for (const GlareSource& source : report.sources) {
            of["sources"].push_back({{"light", source.light},
                                     {"kind", source.kind},
                                     {"solid_angle", source.solid_angle},
                                     {"luminance", source.luminance},
                                     {"position_index", source.position},
                                     {"term_of_mean", number(source.even)},
                                     {"term", number(source.seen)},
                                     {"effective_solid_angle", source.effective.solid_angle},
                                     {"effective_luminance", source.effective.luminance},
                                     {"term_of_effective_part", number(source.effective.term)}});
        }
        if (report.daylight) {
            const DaylightGlare& glare = *report.daylight;
            nlohmann::json& to = of["daylight"];
            to = {{"dgp", number(glare.dgp)},
                  {"mean_luminance", glare.mean_luminance},
                  {"sources", nlohmann::json::array()}};
            for (const DaylightSource& source : glare.sources) {
                const V3f& w = source.towards;
                to["sources"].push_back({{"towards", {w.x, w.y, w.z}},
                                         {"solid_angle", source.solid_angle},
                                         {"luminance", number(source.luminance)},
                                         {"position_index", source.position}});
            }
        }
        json.push_back(std::move(of));
    }
    return json.dump(1) + '\n';
}

}  // namespace lucerna
