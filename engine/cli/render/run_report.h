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

// Sets the job's method to the one with the smallest estimated error within the options' limits, and reports
// it as options that reproduce it, with the estimates of the others. Reduces the error limit to the share of
// noise. Returns nothing, without changes, if no other method gives the same image or the user stopped it.
std::optional<MethodChoice> select_method(Job& job, RenderOptions& options, Monitor& monitor);

// The machine and date of a measured time, without which the time becomes meaningless.

// Returns "AMD EPYC 7763, 2 processors", with the processor's own name if the system states it.
std::string machine_text();

// Returns "2026-11-22", in UTC.
std::string today_text();

}  // namespace lucerna
