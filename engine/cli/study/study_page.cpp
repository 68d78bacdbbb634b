#include "engine/cli/study/study_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/base/version.h"
#include "engine/cli/page_parts.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/figures/colour_maps.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

Json estimate_json(const std::optional<Estimate>& e) {
    if (!e) return nullptr;
    return {{"value", e->value}, {"error", e->error ? Json(*e->error) : Json(nullptr)}};
}

template <typename T>
Json optional_json(const std::optional<T>& value) {
    return value ? Json(*value) : Json(nullptr);
}

Json picture_json(const StudyPicture& picture) {
    return {{"src", picture.url}, {"factor", picture.factor}};
}

Json point_json(const StudyResult& r, const PointPictures& pictures) {
    return {{"method", r.method},
            {"settings", r.settings},
            {"set", r.set},
            {"seconds", r.seconds},
            {"error", r.error()},
            {"error2_error", optional_json(r.error2_error)},
            {"bias2", estimate_json(r.bias2)},
            {"noise2", estimate_json(r.noise2)},
            {"flip", optional_json(r.flip)},
            {"ratio", r.mean_ratio},
            {"best", r.best},
            {"radiance", picture_json(pictures.radiance)},
            {"maps", picture_json(pictures.maps)}};
}

// Returns the noise of the scene's reference, a fraction; 0 if not stated.
double reference_noise(const std::vector<StudyResult>& results, const std::string& scene) {
    const auto found = std::find_if(results.begin(), results.end(),
                                    [&](const StudyResult& result) { return result.scene == scene; });
    return found == results.end() ? 0 : std::sqrt(found->reference_noise2);
}

Json scene_json(const StudyReport& report, std::size_t i) {
    const std::string& name = report.description.scenes[i].name;
    const ScenePictures& pictures = report.pictures[i];
    Json scene{{"name", name},
               {"width", pictures.width},
               {"height", pictures.height},
               {"stops", pictures.stops},
               {"noise", reference_noise(report.results, name)},
               {"reference", picture_json(pictures.reference)}};
    scene["points"] = Json::array();
    std::size_t next = 0;
    for (const StudyResult& result : report.results) {
        if (result.scene == name) scene["points"].push_back(point_json(result, pictures.points.at(next++)));
    }
    return scene;
}

// Returns 256 colours of a map, as in the pictures of `compare`.
template <typename Colour>
Json palette_json(Colour&& colour) {
    Json palette = Json::array();
    for (int i = 0; i < 256; ++i) {
        const Rgb c = colour(i) * 255.0F;
        for (const float v : {c.x, c.y, c.z}) palette.push_back(static_cast<int>(std::lround(v)));
    }
    return palette;
}

Json study_data(const StudyReport& report) {
    constexpr ErrorCode kCode;
    Json data{{"title", report.description.title},
              {"seeds", report.description.seeds},
              {"code", {{"least", kCode.least}, {"most", kCode.most}}}};
    data["signed"] = palette_json([](int i) { return diverging_colour((i - 128) / 127.0); });
    data["flip"] = palette_json([](int i) { return magma_colour(i / 255.0); });
    data["methods"] = Json::array();
    for (const StudyPoint& point : report.description.points) {
        const auto& known = data["methods"];
        if (std::find(known.begin(), known.end(), Json(point.method)) == known.end())
            data["methods"].push_back(point.method);
    }
    data["scenes"] = Json::array();
    for (std::size_t i = 0; i < report.pictures.size(); ++i) data["scenes"].push_back(scene_json(report, i));
    return data;
}

// Returns JSON in which no text can close the script element.
std::string script_json(const Json& json) {
    std::string text;
    for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
        if (c == '<')
            text += "\\u003c";
        else
            text += c;
    }
    return text;
}

template <typename Things>
std::string listed(const Things& things, const char* between) {
    return fmt::format("{}", fmt::join(things, between));
}

// Returns a table of machines, dates and program; warns if times of the page are not comparable.
std::string origin_html(const StudyReport& report) {
    const StudyOrigin& origin = report.origin;
    const auto row = [](const char* name, const std::string& value) {
        return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", name, html_text(value));
    };
    std::string dates = origin.dates.empty() ? "not known" : *origin.dates.begin();
    if (origin.dates.size() > 1) dates += " to " + *origin.dates.rbegin();
    std::string html = "<table>\n";
    html += row("rendered", dates + " (UTC)");
    html += row("machine", origin.machines.empty() ? "not known" : listed(origin.machines, "; "));
    if (!origin.hosts.empty()) {
        html += row("hosts", listed(origin.hosts, ", ") + "; each render was timed on the host that made it");
    }
    html += row("threads", listed(origin.threads, ", "));
    html += row("program", fmt::format("lucerna {}", program_version()));
    html += row("reference", fmt::format("{}, {}", report.description.reference.overrides.integrator,
                                         report.description.reference.settings));
    html += row("renders of each point", fmt::format("{}", report.description.seeds));
    html += "<tr><th>again</th><td><code>" + html_text(report.command) + "</code></td></tr>\n</table>\n";
    if (origin.machines.size() > 1 || origin.threads.size() > 1) {
        html +=
            "<p class=\"caution\">The renders were made on different machines or with different numbers of "
            "threads, so their times cannot be compared. To render everything again, remove the folder "
            "“runs”.</p>\n";
    }
    return html;
}

std::string advice_html(const std::vector<StudyResult>& results) {
    std::string html;
    for (const std::string& line : advice(results)) html += "<li>" + html_text(line) + "</li>\n";
    return html;
}

std::string doubts_html(const std::vector<StudyResult>& results) {
    std::string html;
    for (const std::string& line : doubts(results))
        html += "<p class=\"caution\">Caution: " + html_text(line) + ".</p>\n";
    return html;
}

std::string scaled_line(const StudyReport& report) {
    std::size_t shrunk = 0, left_out = 0;
    const auto count = [&](const StudyPicture& picture) {
        shrunk += picture.factor > 1;
        left_out += picture.url.empty();
    };
    for (const ScenePictures& scene : report.pictures) {
        count(scene.reference);
        for (const PointPictures& point : scene.points) count(point.radiance), count(point.maps);
    }
    std::string line = "The images are those of the first seed.";
    if (shrunk > 0)
        line += fmt::format(
            " To keep the page small, {} of its pictures are scaled down; each states its scale.", shrunk);
    if (left_out > 0) line += fmt::format(" {} are left out.", left_out);
    return line;
}

}  // namespace

std::string study_page(const StudyReport& report) {
    return filled(kStudyPage, {{"title", html_text(report.description.title)},
                               {"style", std::string(kPageStyle) + std::string(kStudyStyle)},
                               {"doubts", doubts_html(report.results)},
                               {"advice", advice_html(report.results)},
                               {"scaled", html_text(scaled_line(report))},
                               {"origin", origin_html(report)},
                               {"description", html_text(report.description_text)},
                               {"d3", std::string(kD3)},
                               {"strip", std::string(kImageStrip)},
                               {"script", std::string(kStudyScript)},
                               {"data", script_json(study_data(report))}});
}

}  // namespace lucerna
