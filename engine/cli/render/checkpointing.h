// --checkpoint and --resume: when the file is written and read, and what must be the same.
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

// Facts of a picture that follow from --denoise and --layers; kNoLayers is the value without them.
constexpr std::string_view kHalvesFact = "sets of samples", kPartsFact = "separation of light",
                           kNoLayers = "none";

struct CheckpointOptions {
    std::filesystem::path save;    // empty: nothing is kept, unless a render is resumed
    std::filesystem::path resume;  // empty: from the start
    double every = 30;             // seconds

    // The file that is written; empty: none. What is resumed is kept up to date.
    const std::filesystem::path& kept() const { return save.empty() ? resume : save; }
};

// What must be the same for an image to go on: program, files, seed, integrator and its settings, film. Reads
// all files of the scene. Throws InputError.
Facts picture_facts(const Job& job, std::uint64_t seed);
// The same of what all parts of a picture show (FilmSettings::is_part()), whichever of them the job renders.
Facts whole_picture_facts(const Job& job, std::uint64_t seed);

class Checkpointing {
  public:
    // Reads the checkpoint that is to be resumed. None is there, and it is the one that will be written: the
    // render begins anew. Throws InputError.
    Checkpointing(const CheckpointOptions& options, Monitor& monitor);

    // Has `render` resume and keep. Refers to this object. Throws InputError if the checkpoint is of another
    // render.
    void attach(const Job& job, RenderOptions& render);
    double earlier_seconds() const { return resumed_ ? resumed_->seconds : 0; }

    // After the image is safe: throws InputError if the last checkpoint could not be written.
    void finish() const;

  private:
    void keep(Checkpoint checkpoint);

    CheckpointOptions options_;
    Monitor& monitor_;
    std::optional<Checkpoint> resumed_;
    Facts facts_;
    std::exception_ptr failed_;  // the last attempt
};

}  // namespace lucerna
