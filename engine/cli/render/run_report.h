// What a render was and did, as --stats writes it and as the image's header carries it.
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
    double read_seconds = 0;    // the scene file
    double choose_seconds = 0;  // the method
    double render_seconds = 0;  // preparation and image
    std::uint64_t warnings = 0;
    std::optional<MethodChoice> choice = {};  // if the method was chosen for its trade
};

// JSON. Keys, stable: program, version, scene, integrator, settings, seed, threads, image {width, height,
// file, error (picture_error(), if known)}, samples {asked (null: no end), done}, complete, seconds {read,
// <phase> …, total}, choice {tried, expected_error, expected_seconds, beyond_noise} (if it was made),
// numbers, notes, warnings, peak_memory_bytes; of a parallel job also ranks [{host, threads, tiles, rays,
// seconds {prepare, image}, processor_seconds {the same}, peak_memory_bytes}] and rank 0's traffic {<what>
// {calls, bytes, waited_seconds, seconds}}.
std::string statistics_json(const RunFacts& facts, const Job& job, const RenderReport& report,
                            const std::filesystem::path& image_file);

// The expected error of the picture, as Film::relative_error() counts it: of a denoised one with its blur;
// else its noise, and where the method was chosen what its trial found beyond noise. None while it is not
// known.
std::optional<double> picture_error(const RunFacts& facts, const RenderReport& report);

// Texts for the EXR header, all named "lucerna.…".
std::map<std::string, std::string> header_attributes(const RunFacts& facts, const Job& job,
                                                     const RenderReport& report);

// What --time and --error without a method stand for.

// Puts the method whose estimated error is least within the options' limits into the job, and says which it
// is, as options that give it again, and the estimates of the others; leaves the part of the error that is
// noise's as its limit. None, and nothing changed, where no other method shows the same picture or the user
// stopped it.
std::optional<MethodChoice> select_method(Job& job, RenderOptions& options, Monitor& monitor);

// What a time was measured on, and when: a time without them says nothing a year later.

// "AMD EPYC 7763, 2 processors": the processor's own name where the system tells it.
std::string machine_text();

// "2026-11-22", of UTC.
std::string today_text();

}  // namespace lucerna
