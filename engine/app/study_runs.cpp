#include "engine/app/study_runs.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/app/checkpointing.h"
#include "engine/app/machine.h"
#include "engine/app/outputs.h"
#include "engine/app/run_report.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/render/render.h"

namespace lucerna {
namespace {

std::string name_of(const Job& job, std::uint64_t seed) {
    WordHash hash;
    for (const auto& [name, value] : picture_facts(job, seed)) {
        hash.add(std::string_view(name));
        hash.add(std::string_view(value));
    }
    hash.add(job.spp);
    return fmt::format("{:016x}", hash.value());
}

// The notes are written last: where they are, so is the image.
std::optional<StudyRun> noted(const std::filesystem::path& notes, const std::filesystem::path& image) {
    std::error_code status;
    if (!std::filesystem::exists(notes, status) || !std::filesystem::exists(image, status)) return {};
    std::ifstream in(notes);
    try {
        const nlohmann::json json = nlohmann::json::parse(in);
        return StudyRun{image,
                        json.at("seconds").at("total").get<double>(),
                        true,
                        json.value("machine", ""),
                        json.value("date", ""),
                        json.at("threads").get<int>()};
    } catch (const nlohmann::json::exception&) {
        throw InputError({notes.string()}, "is not what a study wrote; remove it, and it is made anew");
    }
}

// What the render says of itself, and where and when it was made.
std::string notes_text(const std::string& statistics, const StudyRun& run) {
    auto json = nlohmann::ordered_json::parse(statistics);
    json["machine"] = run.machine;
    json["date"] = run.date;
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

StudyRuns::StudyRuns(std::filesystem::path folder, const Workers& workers)
    : folder_(std::move(folder)), workers_(workers) {
    std::error_code status;
    std::filesystem::create_directories(folder_, status);
    if (status) throw InputError({folder_.string()}, "cannot be made: " + status.message());
}

std::optional<StudyRun> StudyRuns::run(const StudyScene& scene, const StudyPoint& point, std::uint64_t seed,
                                       Monitor& monitor) const {
    SceneOverrides overrides = point.overrides;
    overrides.resolution = scene.resolution;
    RunFacts facts{scene.file, seed, workers_.threads, 0, 0, 0};
    const Stopwatch reading;
    const Job job = read_scene(scene.file, overrides, workers_, monitor);
    facts.read_seconds = reading.seconds();

    const std::string name = name_of(job, seed);
    const std::filesystem::path image = folder_ / (name + ".exr"), notes = folder_ / (name + ".json");
    if (const auto run = noted(notes, image)) return run;

    const Stopwatch rendering;
    RenderResult result = render(job, {seed, workers_}, monitor);
    facts.render_seconds = rendering.seconds();
    if (!result.report.complete || monitor.stopped()) return {};
    result.image.attributes.merge(header_attributes(facts, job, result.report));
    write_exr(image, result.image);
    const StudyRun run{image,        facts.read_seconds + facts.render_seconds,
                       false,        machine_text(),
                       today_text(), workers_.threads};
    write_text(notes, notes_text(statistics_json(facts, job, result.report, image), run));
    return run;
}

}  // namespace lucerna
