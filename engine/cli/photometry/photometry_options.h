// What the commands have in common that work out photometric values of a scene, lux and glare.
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

    // Declares the scene and what both write.
    void declare(CommandFiles& files) const;
    // A monitor for progress where it can be redrawn: the output is for the numbers.
    ConsoleSettings console(const CommandContext& context) const {
        return {context.around.terminal, quiet || !context.around.terminal, context.around.stop, {}};
    }
    // In linear sRGB, whose luminance is that of light. Its files are declared, too.
    Job read(const Workers& workers, CommandFiles& files, Monitor& monitor) const;
    // "-" for --json is standard output, which then has nothing else.
    bool prints_json() const { return json == "-"; }
};

// SCENE and -o, of which `each` says what a line is for; --json, which writes `everything`.
void add_photometry_files(CLI::App& app, PhotometryOptions& options, const std::string& each,
                          const std::string& everything);
// --seed, --threads, --unit, --skip-missing, --strict, --quiet
void add_photometry_options(CLI::App& app, PhotometryOptions& options, std::uint64_t& seed, Workers& workers);

}  // namespace lucerna
