// What a render was and did, as --stats writes it and as the image's header carries it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "engine/render/job.h"
#include "engine/render/method_choice.h"
#include "engine/render/render.h"

namespace lucerna {

struct RunFacts {
    std::filesystem::path scene;
    std::uint64_t seed = 0;
    int threads = 1;
    double read_seconds = 0;    // the scene file
    double choose_seconds = 0;  // the method
    double render_seconds = 0;  // preparation and image
    std::uint64_t warnings = 0;
    std::optional<MethodChoice> choice = {};  // if the method was chosen for its trade
};

// JSON. Keys, stable: program, version, scene, integrator, settings, seed, threads, image {width, height,
// file}, samples {asked (null: no end), done}, complete, seconds {read, <phase> …, total}, choice
// {tried, expected_error, expected_seconds, beyond_noise} (if it was made), numbers, notes,
// warnings, peak_memory_bytes.
std::string statistics_json(const RunFacts& facts, const Job& job, const RenderReport& report,
                            const std::filesystem::path& image_file);

// Texts for the EXR header, all named "lucerna.…".
std::map<std::string, std::string> header_attributes(const RunFacts& facts, const Job& job,
                                                     const RenderReport& report);

}  // namespace lucerna
