// Facts of a render, for --stats and for the image's header.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "engine/base/monitor.h"
#include "engine/render/job.h"
#include "engine/render/method_choice.h"
#include "engine/render/render.h"

namespace lucerna {

struct RunFacts {
    std::filesystem::path scene;
    std::uint64_t seed = 0;
    int threads = 1;
    double read_seconds = 0;    // reading the scene file
    double choose_seconds = 0;  // choosing the method
    double render_seconds = 0;  // preparation and image
    std::uint64_t warnings = 0;
    std::optional<MethodChoice> choice = {};  // if the method was chosen by trials
};

// Returns JSON with these stable keys: program, version, scene, integrator, settings, seed, threads, image
// {width, height, file, error (picture_error(), if known)}, samples {asked (null: no end), done}, complete,
// seconds {read, <phase> …, total}, choice {tried, expected_error, expected_seconds, beyond_noise} (if the
// method was chosen), numbers, notes, warnings, peak_memory_bytes; for a parallel job also ranks [{host,
// threads, tiles, rays, seconds {prepare, image}, processor_seconds {the same}, peak_memory_bytes}] and rank
// 0's traffic {<what> {calls, bytes, waited_seconds, seconds}}.
std::string statistics_json(const RunFacts& facts, const Job& job, const RenderReport& report,
                            const std::filesystem::path& image_file);

// Returns the expected error of the picture in the measure of Film::relative_error(): that of the denoised
// image including its blur, otherwise its noise, with the error beyond noise from the trial if the method was
// chosen. Returns nothing while it is unknown.
std::optional<double> picture_error(const RunFacts& facts, const RenderReport& report);

// Returns texts for the EXR header, all named "lucerna.…".
std::map<std::string, std::string> header_attributes(const RunFacts& facts, const Job& job,
                                                     const RenderReport& report);

// Chooses the method for --time and --error.

// Renders by the method with the smallest estimated error within the options' limits (render_choosing()), or
// by the job's own if no other one gives the same image. Reports it as options that reproduce it, with the
// estimates of the others, and records it in `facts`, with the time of the choice. Warns of light that path
// tracing misses.
RenderResult render_by_choice(Job& job, const RenderOptions& options, RunFacts& facts, Monitor& monitor);
// Renders by the job's own method, with the same warning.
RenderResult render_as_asked(Job& job, const RenderOptions& options, Monitor& monitor);

// The machine and date of a measured time, without which the time becomes meaningless.

// Returns "AMD EPYC 7763, 2 processors", with the processor's own name if the system states it.
std::string machine_text();

// Returns "2026-11-22", in UTC.
std::string today_text();

}  // namespace lucerna
