#include "engine/cli/run_report.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include "engine/base/version.h"
#include "engine/cli/run.h"
#include "engine/scene/arithmetic.h"

namespace lucerna {
namespace {

using Json = nlohmann::ordered_json;

// Parameters with their own types, not as text.
Json settings_json(IntegratorSettings settings) {
    Json json = Json::object();
    for (const Field& field : fields(settings)) {
        const std::string name(field.name);
        if (!field.choices.empty()) {
            json[name] = field.text();
        } else {
            std::visit([&](const auto* value) { json[name] = *value; }, field.target);
        }
    }
    return json;
}

// The most memory the process has held. Linux counts in KiB.
std::uint64_t peak_memory_bytes() {
    rusage usage{};
    if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

std::string statistics_json(const RunFacts& facts, const Job& job, const RenderReport& report,
                            const std::filesystem::path& image_file) {
    Json json;
    json["program"] = "lucerna";
    json["version"] = program_version();
    json["arithmetic"] = arithmetic();
    json["scene"] = facts.scene.string();
    json["integrator"] = integrator_name(job.integrator);
    json["settings"] = settings_json(job.integrator);
    json["seed"] = facts.seed;
    json["threads"] = facts.threads;
    json["image"] = {{"width", job.film.rendered_size().x},
                     {"height", job.film.rendered_size().y},
                     {"file", image_file.string()}};
    json["samples"] = {{"asked", job.spp == kNoEndOfSamples ? Json() : Json(job.spp)},
                       {"done", report.samples_done}};
    json["complete"] = report.complete;
    Json seconds = {{"read", facts.read_seconds}};
    if (facts.choice) seconds["choose"] = facts.choose_seconds;
    for (const auto& [phase, time] : report.seconds) seconds[phase] = time;
    seconds["total"] = facts.read_seconds + facts.choose_seconds + facts.render_seconds;
    json["seconds"] = std::move(seconds);
    if (facts.choice) {
        json["choice"] = {{"tried", facts.choice->tried},
                          {"expected_error", facts.choice->error},
                          {"expected_seconds", facts.choice->seconds},
                          {"beyond_noise", facts.choice->beyond_noise}};
    }
    json["numbers"] = report.numbers;
    json["notes"] = report.notes;
    json["warnings"] = facts.warnings;
    json["peak_memory_bytes"] = peak_memory_bytes();
    // File names need not be UTF-8; a foreign byte must not cost the statistics.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::map<std::string, std::string> header_attributes(const RunFacts& facts, const Job& job,
                                                     const RenderReport& report) {
    std::map<std::string, std::string> attributes{
        {"lucerna.version", std::string(program_version())},
        {"lucerna.arithmetic", arithmetic()},
        {"lucerna.scene", facts.scene.string()},
        {"lucerna.integrator", std::string(integrator_name(job.integrator))},
        {"lucerna.seed", fmt::format("{}", facts.seed)},
        {"lucerna.spp", fmt::format("{}", report.samples_done)},
        {"lucerna.seconds", fmt::format("{:.3f}", facts.render_seconds)},
    };
    if (!report.complete) attributes["lucerna.stopped"] = fmt::format("{} spp", report.samples_done);
    if (report.passes_done > 0) attributes["lucerna.passes"] = fmt::format("{}", report.passes_done);
    if (facts.choice) attributes["lucerna.tried"] = facts.choice->tried;
    for (const auto& [name, value] : describe(job.integrator)) attributes["lucerna." + name] = value;
    return attributes;
}

}  // namespace lucerna
