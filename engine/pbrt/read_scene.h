// Scene files: pbrt's text, version 4's syntax and version 3's names, into a Job that can be rendered.
//
// What the reader knows it does exactly as pbrt; what it does not know it refuses, by file, line and column.
// A parameter without effect is a warning. docs/scene-files.md lists directives and parameters.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/render/job.h"

namespace lucerna {

// What the command line puts in the place of the scene's own choice.
struct SceneOverrides {
    std::string integrator;  // empty: as the scene says, path if it says nothing
    std::vector<std::pair<std::string, std::string>> set;  // parameters of the integrator, name and value
    int spp = 0;                                           // camera samples per pixel; 0: as the scene says
    std::string output;                                    // image file; empty: as the scene says
    V2i resolution{0, 0};                                  // pixels; 0: as the scene says
    bool skip_missing = false;  // meshes and textures whose file does not exist are left out, with a warning
};

// Throws InputError, whose message is one line. Relative names within the scene (Include, meshes, textures,
// lamps) start from the folder of `file`, also in included files.
Job read_scene(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
               Monitor& monitor);

// The same for text in memory that stands for `pretended_file`.
Job read_scene_text(std::string text, const std::filesystem::path& pretended_file,
                    const SceneOverrides& overrides, const Workers& workers, Monitor& monitor);

}  // namespace lucerna
