#include "engine/app/study_runs.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/app/checkpointing.h"
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
std::optional<double> noted_seconds(const std::filesystem::path& notes, const std::filesystem::path& image) {
    std::error_code status;
    if (!std::filesystem::exists(notes, status) || !std::filesystem::exists(image, status)) return {};
    std::ifstream in(notes);
    const nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
    if (!json.is_object() || !json.contains("seconds") || !json["seconds"].contains("total") ||
        !json["seconds"]["total"].is_number()) {
        throw InputError({notes.string()}, "is not what a study wrote; remove it, and it is made anew");
    }
    return json["seconds"]["total"].get<double>();
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
    if (const auto seconds = noted_seconds(notes, image)) return StudyRun{image, *seconds, true};

    const Stopwatch rendering;
    RenderResult result = render(job, {seed, workers_}, monitor);
    facts.render_seconds = rendering.seconds();
    if (!result.report.complete || monitor.stopped()) return {};
    result.image.attributes.merge(header_attributes(facts, job, result.report));
    write_exr(image, result.image);
    write_text(notes, statistics_json(facts, job, result.report, image));
    return StudyRun{image, facts.read_seconds + facts.render_seconds, false};
}

}  // namespace lucerna
