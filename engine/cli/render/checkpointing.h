// --checkpoint and --resume: writes and reads the file, and checks that it belongs to the render.
#pragma once

#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "engine/base/monitor.h"
#include "engine/render/checkpoint.h"
#include "engine/render/job.h"
#include "engine/render/render.h"

namespace lucerna {

// Facts of an image that follow from --denoise and --layers; kNoLayers is the value without them.
constexpr std::string_view kHalvesFact = "sets of samples", kPartsFact = "separation of light",
                           kNoLayers = "none";

struct CheckpointOptions {
    std::filesystem::path save;    // empty: none, unless a render is resumed
    std::filesystem::path resume;  // empty: from scratch
    double every = 30;             // seconds

    // Returns the file that is written, or an empty path. A resumed file is kept up to date.
    const std::filesystem::path& kept() const { return save.empty() ? resume : save; }
};

// Returns the facts that must agree to continue an image: program, files, seed, integrator and its settings,
// film. Reads all files of the scene. Throws InputError.
Facts picture_facts(const Job& job, std::uint64_t seed);
// Returns the facts of the whole image whichever part of it (FilmSettings::is_part()) the job renders.
Facts whole_picture_facts(const Job& job, std::uint64_t seed);

class Checkpointing {
  public:
    // Reads the checkpoint to resume. If it does not exist and is also the one to write, the render starts
    // from scratch. Throws InputError.
    Checkpointing(const CheckpointOptions& options, Monitor& monitor);

    // Makes `render` resume and save checkpoints; refers to this object. Throws InputError if the checkpoint
    // belongs to another render.
    void attach(const Job& job, RenderOptions& render);
    double earlier_seconds() const { return resumed_ ? resumed_->seconds : 0; }

    // Throws InputError if the last checkpoint could not be written. Call it once the image is safe.
    void finish() const;

  private:
    void keep(Checkpoint checkpoint);

    CheckpointOptions options_;
    Monitor& monitor_;
    std::optional<Checkpoint> resumed_;
    Facts facts_;
    std::exception_ptr failed_;  // from the last attempt
};

}  // namespace lucerna
