// Options that lux and glare, the commands for photometric values, share.
#pragma once

#include <optional>
#include <string>

#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/pbrt/read_scene.h"

namespace lucerna {

struct PhotometryOptions {
    std::string scene, csv, json;
    SceneOverrides overrides;
    bool quiet = false;

    // Declares the scene and the outputs of both commands.
    void declare(CommandFiles& files) const;
    // Returns a monitor that shows progress only where it can be redrawn, as the output is for the numbers.
    ConsoleSettings console(const CommandContext& context) const {
        return {context.process.terminal, quiet || !context.process.terminal, context.process.stop, {}};
    }
    // Reads the scene in linear sRGB, whose luminance is that of light, and declares its files.
    Job read(const Workers& workers, CommandFiles& files, Monitor& monitor) const;
    // "-" for --json prints JSON, and nothing else, to standard output.
    bool prints_json() const { return json == "-"; }
};

// Adds SCENE; -o, with one line per `each`; and --json, which writes `everything`.
void add_photometry_files(CLI::App& app, PhotometryOptions& options, const std::string& each,
                          const std::string& everything);
// Adds --seed, --threads, --unit, --skip-missing, --strict and --quiet.
void add_photometry_options(CLI::App& app, PhotometryOptions& options, std::uint64_t& seed, Workers& workers);

}  // namespace lucerna
