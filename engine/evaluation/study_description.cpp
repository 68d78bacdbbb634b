#include "engine/evaluation/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>
#include <string_view>

#include "engine/base/error.h"
#include "engine/integrators/settings.h"
#include "engine/system/toml.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr int kMostSeeds = 1000;
constexpr std::size_t kMostPoints = 10'000;
constexpr int kMostSpp = 1 << 24;

using Assignments = std::vector<std::pair<std::string, std::string>>;

// Adds the key to errors that do not name it.
template <typename Read>
auto naming(std::string_view key, const Read& read) {
    try {
        return read();
    } catch (const InputError& error) {
        const std::string text = error.what(), quoted = fmt::format("\"{}\"", key);
        throw InputError(text.find(quoted) == text.npos ? fmt::format("{} (key {})", text, quoted) : text);
    }
}

std::vector<std::string> split(const std::string& text, char at) {
    std::vector<std::string> parts;
    std::istringstream words(text);
    for (std::string part; std::getline(words, part, at);) parts.push_back(part);
    return parts;
}

// Expands "a=1|2 b=3" to all combinations, in which the last key changes fastest.
std::vector<Assignments> choices_of(const Location& at, const std::string& text) {
    std::vector<Assignments> all{{}};
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const auto [key, values] = parse_assignment(at, word);
        std::vector<Assignments> longer;
        for (const Assignments& some : all) {
            for (const std::string& value : split(values, '|')) {
                longer.push_back(some);
                longer.back().emplace_back(key, value);
            }
        }
        if (longer.empty() || longer.size() > kMostPoints) {
            throw InputError(at, fmt::format("\"{}\" has {} combinations of settings; expected 1 to {}", text,
                                             longer.size(), kMostPoints));
        }
        all = std::move(longer);
    }
    return all;
}

// The end of a render: a number of samples per pixel or a time.
struct RenderEnd {
    int spp = 0;
    double seconds = 0;
    std::string value;  // as users write it
};

std::vector<RenderEnd> ends_of(const TomlTable& table) {
    std::vector<RenderEnd> all;
    if (table.has("spp")) {
        for (const double spp : table.numbers("spp", 1, kMostSpp)) {
            if (spp != std::floor(spp)) {
                throw InputError(table.place_of("spp"),
                                 fmt::format("\"spp\" of {} is not accepted; expected whole numbers", spp));
            }
            all.push_back({static_cast<int>(spp), 0, fmt::format("{:.0f}", spp)});
        }
    }
    if (table.has("time")) {
        for (const double seconds : naming("time", [&] { return table.durations("time"); }))
            all.push_back({0, seconds, fmt::format("{:g}s", seconds)});
    }
    if (all.empty()) {
        const std::string_view key = table.has("time") ? "time" : "spp";
        throw InputError(
            table.place_of(key),
            "nothing ends the renders; expected one or more numbers of samples per pixel, as spp "
            "= [16], or times, as time = [\"5s\"]");
    }
    return all;
}

std::vector<StudyPoint> points_of(const TomlTable& table, const std::string& method) {
    const std::string integrator = table.text("integrator");
    const std::vector<RenderEnd> ends = ends_of(table);
    std::vector<StudyPoint> points;
    const auto choices =
        naming("set", [&] { return choices_of(table.place_of("set"), table.text("set", "")); });
    for (const Assignments& choice : choices) {
        for (const RenderEnd& end : ends) {
            StudyPoint point;
            point.method = method;
            point.overrides.integrator = integrator;
            point.overrides.set = choice;
            point.overrides.spp = end.spp;
            point.seconds = end.seconds;
            point.end_name = end.spp > 0 ? "spp" : "time";
            point.end_value = end.value;
            for (const auto& [key, value] : choice) point.settings += fmt::format("{}={} ", key, value);
            point.settings += fmt::format("{}={}", point.end_name, point.end_value);
            points.push_back(std::move(point));
        }
    }
    // Checks parameters here, so that a misspelt one is not found after an hour.
    IntegratorSettings settings =
        naming("integrator", [&] { return make_settings(integrator, table.place_of("integrator")); });
    for (const StudyPoint& point : points) {
        for (const auto& own : point.overrides.set) {
            naming("set", [&] {
                set_parameter(settings, own.first, parse_setting(own.second), table.place_of("set"));
            });
        }
    }
    table.done();
    return points;
}

StudyScene scene_of(const TomlTable& table) {
    StudyScene scene;
    scene.file = table.path("file");
    // Checks files here, so that a missing one is not found after the renders of other scenes.
    std::error_code unknown;
    if (!std::filesystem::is_regular_file(scene.file, unknown)) {
        throw InputError(
            table.place_of("file"),
            fmt::format("\"file\" of \"{}\" is no file; expected a scene's", one_line(scene.file.string())));
    }
    scene.name = table.text("name", scene.file.stem().string());
    if (table.has("resolution")) {
        scene.resolution = naming("resolution", [&] {
            return parse_size(table.place_of("resolution"), table.text("resolution"), 65536);
        });
    }
    scene.place = table.place_of("file");
    scene.mask_lamps = table.flag("mask_lamps", false);
    scene.mask_above = table.number("mask", 0, 1e30, std::numeric_limits<double>::infinity());
    table.done();
    return scene;
}

template <typename Things, typename Name>
void require_names_differ(const Things& things, const TomlTable& file, const char* what, Name&& name) {
    std::set<std::string> seen;
    for (const auto& thing : things) {
        if (!seen.insert(name(thing)).second) {
            throw InputError(file.place(), fmt::format("two {} are called \"{}\"", what, name(thing)));
        }
    }
}

}  // namespace

StudyDescription read_study(const std::filesystem::path& file) {
    const TomlTable table = TomlTable::read(file);
    StudyDescription description;
    description.title = table.text("title", file.stem().string());
    description.seeds = table.whole("seeds", 1, kMostSeeds, 2);
    for (const TomlTable& scene : table.tables("scene")) description.scenes.push_back(scene_of(scene));
    if (description.scenes.empty()) throw InputError(table.place(), "no [[scene]]; expected one or more");
    require_names_differ(description.scenes, table, "scenes",
                         [](const StudyScene& scene) { return scene.name; });

    const std::vector<StudyPoint> reference = points_of(table.table("reference"), "reference");
    if (reference.size() != 1) {
        throw InputError(
            table.place_of("reference"),
            fmt::format("the reference has {} combinations of settings; expected one", reference.size()));
    }
    description.reference = reference.front();
    for (const TomlTable& method : table.tables("method")) {
        for (StudyPoint& point : points_of(method, method.text("name")))
            description.points.push_back(std::move(point));
    }
    if (description.points.empty()) throw InputError(table.place(), "no [[method]]; expected one or more");
    require_names_differ(description.points, table, "methods with the same settings",
                         [](const StudyPoint& point) { return point.method + ", " + point.settings; });
    table.done();
    return description;
}

}  // namespace lucerna
