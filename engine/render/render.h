// From a job to an image: the loop over passes, tiles and samples.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/denoise/denoise.h"
#include "engine/image/image.h"
#include "engine/integrators/statistics.h"
#include "engine/render/checkpoint.h"
#include "engine/render/finishing.h"
#include "engine/render/job.h"
#include "engine/render/stop_rule.h"
#include "photon/build_maps.h"

namespace lucerna {

// A job's number of samples where only time or error ends a render; the most there can be.
inline constexpr int kNoEndOfSamples = 1 << 24;

struct RenderResult;

struct RenderOptions {
    std::uint64_t seed = 0;
    Workers workers;
    Limits limits = {};    // beside the job's number of samples
    LaterWork later = {};  // of the caller; its time is part of limits.seconds
    // Shows what there is, whole rounds only, no more often than that; by the thread that renders.
    double show_every = std::numeric_limits<double>::infinity();  // seconds
    std::function<void(const RenderResult&)> show = {};
    MapFiles maps = {};  // of photonmap alone

    // Shows the image as it is, also between two tiles, and at the end; by the thread that renders.
    double watch_every = std::numeric_limits<double>::infinity();  // seconds
    std::function<void(const RenderResult&)> watch = {};
    // Gets what another render needs to go on from here, likewise. Its facts are the caller's to fill in.
    double keep_every = std::numeric_limits<double>::infinity();  // seconds
    std::function<void(Checkpoint)> keep = {};
    // Checkpoint to continue from; null: from the start. Limits are then those of all renders together.
    const Checkpoint* resume = nullptr;
};

struct RenderResult {
    // R G B, and variance.R variance.G variance.B of the pixel's mean. The attribute "lucerna.unit" tells
    // what the numbers count: "cd/m^2", "W/(m^2 sr)", "lx", "W/m^2".
    Image image;
    RenderReport report;
    // Both halves of a film of two halves, with features; and the denoised image, R G B.
    std::optional<DenoiserInput> denoiser_input = {};
    std::optional<Image> denoised = {};
    // LayerFilms::develop()'s, and Features::variance and ::ids, if the job's film asks for parts.
    std::optional<Image> parts = {};
    // LayerFilms::develop_chance()'s, if the job's film asks for it.
    std::optional<Image> chance = {};
};

// Throws InputError for settings that cannot be met, or a checkpoint that does not fit. Stops early, with
// what there is, when the monitor says so.
RenderResult render(const Job& job, const RenderOptions& options, Monitor& monitor);

// States the time and error that are left when a method is chosen.
struct ChoiceLimits {
    Limits limits;          // of the rest; seconds for preparation and samples
    double head_start = 0;  // seconds that the first of methods_like() has rendered already
};
// Sets the job's method to one of methods_like(), or leaves it, and returns the limit of error that is left
// for noise. Called on all ranks; rank 0's answer counts.
using ChooseMethod = std::function<double(const ChoiceLimits&)>;
// Renders with the method that `choose` sets. With a limit of time, one sample per pixel by the simplest of
// the methods, which needs no preparation, comes first: it is kept if that method is chosen, and it is the
// result if the chosen one does not get as far. The job has the method of the result at the end.
RenderResult render_choosing(Job& job, const RenderOptions& options, Monitor& monitor,
                             const ChooseMethod& choose);

}  // namespace lucerna
