#include "engine/cli/study_runs.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/monitor.h"
#include "engine/cli/checkpointing.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/run_report.h"
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

// Whether a file's name is one that name_of() gives to a render or to its notes.
bool is_run(const std::string& file) {
    const std::filesystem::path name(file);
    const std::string hash = name.stem().string();
    return (name.extension() == ".exr" || name.extension() == ".json") && hash.size() == 16 &&
           hash.find_first_not_of("0123456789abcdef") == hash.npos;
}

// The notes are written last: where they are, so is the image.
std::optional<StudyRun> noted(const std::filesystem::path& notes, const std::filesystem::path& image) {
    std::error_code status;
    if (!std::filesystem::exists(notes, status) || !std::filesystem::exists(image, status)) return {};
    std::ifstream in = open_to_read(notes);
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

StudyRuns::StudyRuns(std::filesystem::path folder, const Command& command)
    : folder_(std::move(folder)), command_(command) {
    std::error_code status;
    std::filesystem::create_directories(folder_, status);
    if (status) throw InputError({folder_.string()}, "cannot be made: " + status.message());
    command_.files.writes_into(folder_, "study", is_run);
}

std::optional<StudyRun> StudyRuns::run(const StudyScene& scene, const StudyPoint& point, std::uint64_t seed,
                                       Monitor& monitor) {
    SceneOverrides overrides = point.overrides;
    overrides.resolution = scene.resolution;
    overrides.strict = command_.strict;
    RunFacts facts{scene.file, seed, command_.workers.threads, 0, 0, 0};
    const Stopwatch reading;
    const Job job = read_scene(scene.file, overrides, command_.workers, monitor);
    if (scenes_.insert(scene.file).second) {
        command_.files.reads(job.files);
        command_.files.reads(job.caches);
    }
    facts.read_seconds = reading.seconds();

    const std::string name = name_of(job, seed);
    const std::filesystem::path image = folder_ / (name + ".exr"), notes = folder_ / (name + ".json");
    if (const auto run = noted(notes, image)) return run;

    const Listening listening(command_.around);
    const Stopwatch rendering;
    RenderResult result = render(job, {seed, command_.workers}, monitor);
    facts.render_seconds = rendering.seconds();
    if (!result.report.complete || monitor.stopped()) return {};
    result.image.attributes.merge(header_attributes(facts, job, result.report));
    write_exr(image, result.image);
    const StudyRun run{image,        facts.read_seconds + facts.render_seconds,
                       false,        machine_text(),
                       today_text(), command_.workers.threads};
    write_text(notes, notes_text(statistics_json(facts, job, result.report, image), run));
    return run;
}

}  // namespace lucerna
