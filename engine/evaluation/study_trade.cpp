#include "engine/evaluation/study_trade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "engine/base/units.h"
#include "engine/base/version.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

// A field of RFC 4180.
std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"') quoted += c;
        quoted += c;
    }
    return quoted + '"';
}

std::vector<std::string> scenes_of(const std::vector<StudyResult>& results) {
    std::vector<std::string> names;
    for (const StudyResult& result : results) {
        if (std::find(names.begin(), names.end(), result.scene) == names.end()) names.push_back(result.scene);
    }
    return names;
}

const StudyResult* fastest(const std::vector<StudyResult>& results, const std::string& scene, double error) {
    const StudyResult* best = nullptr;
    for (const StudyResult& result : results) {
        if (result.scene != scene || !(result.error() <= error)) continue;
        if (!best || result.seconds < best->seconds) best = &result;
    }
    return best;
}

}  // namespace

double StudyResult::error() const {
    return std::sqrt(error2);
}

void mark_best(std::vector<StudyResult>& results) {
    for (StudyResult& result : results) {
        result.best = std::none_of(results.begin(), results.end(), [&](const StudyResult& other) {
            const bool no_worse = other.seconds <= result.seconds && other.error2 <= result.error2;
            return other.scene == result.scene && no_worse &&
                   (other.seconds < result.seconds || other.error2 < result.error2);
        });
    }
}

std::vector<std::string> advice(const std::vector<StudyResult>& results) {
    constexpr double kErrors[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5};
    std::vector<std::string> lines;
    for (const std::string& scene : scenes_of(results)) {
        const StudyResult* last = nullptr;
        for (const double error : kErrors) {
            const StudyResult* best = fastest(results, scene, error);
            if (!best || best == last) continue;  // the same as for a smaller error
            last = best;
            lines.push_back(fmt::format("for {:g} % error on {} the fastest is {}, {} ({})", 100 * error,
                                        scene, best->method, best->settings, duration_text(best->seconds)));
        }
        if (!last) lines.push_back(fmt::format("on {} no point is within {:g} %", scene, 100 * kErrors[5]));
    }
    return lines;
}

std::vector<std::string> doubts(const std::vector<StudyResult>& results) {
    std::vector<std::string> lines;
    for (const std::string& scene : scenes_of(results)) {
        const StudyResult* least = nullptr;
        for (const StudyResult& result : results) {
            if (result.scene == scene && (!least || result.error2 < least->error2)) least = &result;
        }
        if (!(least->reference_noise2 > 0.25 * least->error2)) continue;
        lines.push_back(fmt::format(
            "the reference of {} has a noise of {:.2g} %, which is in every error; the least is {:.2g} %. It "
            "wants more samples",
            scene, 100 * std::sqrt(least->reference_noise2), 100 * least->error()));
    }
    return lines;
}

std::string study_csv(const std::vector<StudyResult>& results) {
    std::string text =
        "scene,method,settings,seconds,error2,bias2,bias2_error,noise2,noise2_error,reference_noise2,mean_"
        "ratio,flip,best\n";
    const auto number = [](const std::optional<double>& x) { return x ? fmt::format("{:.6g}", *x) : ""; };
    for (const StudyResult& r : results) {
        const Estimate bias2 = r.bias2.value_or(Estimate{}), noise2 = r.noise2.value_or(Estimate{});
        fmt::format_to(std::back_inserter(text), "{},{},{},{:.6g},{:.6g},{},{},{},{},{:.6g},{:.6g},{},{:d}\n",
                       csv_field(r.scene), csv_field(r.method), csv_field(r.settings), r.seconds, r.error2,
                       number(r.bias2 ? std::optional(bias2.value) : std::nullopt), number(bias2.error),
                       number(r.noise2 ? std::optional(noise2.value) : std::nullopt), number(noise2.error),
                       r.reference_noise2, r.mean_ratio, number(r.flip), r.best);
    }
    return text;
}

std::string study_json(const StudyDescription& description, const std::vector<StudyResult>& results,
                       const StudyOrigin& origin) {
    const auto estimate = [](const std::optional<Estimate>& e) {
        if (!e) return Json(nullptr);
        return Json{{"value", e->value}, {"error", e->error ? Json(*e->error) : Json(nullptr)}};
    };
    Json json{{"program", "lucerna"},
              {"version", program_version()},
              {"title", description.title},
              {"seeds", description.seeds},
              {"machines", origin.machines},
              {"threads", origin.threads},
              {"dates", origin.dates},
              {"reference",
               {{"integrator", description.reference.overrides.integrator},
                {"settings", description.reference.settings}}}};
    json["advice"] = advice(results);
    json["points"] = Json::array();
    for (const StudyResult& r : results) {
        json["points"].push_back({{"scene", r.scene},
                                  {"method", r.method},
                                  {"settings", r.settings},
                                  {"image", r.image.filename().string()},
                                  {"seconds", r.seconds},
                                  {"error", r.error()},
                                  {"error2", r.error2},
                                  {"bias2", estimate(r.bias2)},
                                  {"noise2", estimate(r.noise2)},
                                  {"reference_noise2", r.reference_noise2},
                                  {"mean_ratio", r.mean_ratio},
                                  {"flip", r.flip ? Json(*r.flip) : Json(nullptr)},
                                  {"best", r.best}});
    }
    // Names of files need not be UTF-8.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lucerna
