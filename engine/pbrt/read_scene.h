// Scene files: pbrt's text, version 4's syntax and version 3's names, into a Job that can be rendered.
//
// What the reader knows it does exactly as pbrt. What pbrt renders and the reader does not know is rendered
// with something in its place, and a warning by file, line and column; under `strict` it is refused
// (tokens.h). docs/reference/scene-files.md lists directives and parameters.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/pbrt/object_mesh.h"
#include "engine/render/job.h"
#include "lights/measured.h"
#include "lights/photometric.h"

namespace lucerna {

// What the command line, or a program that uses the library, puts in the place of the scene's own choice.
struct SceneOverrides {
    std::string integrator;  // empty: as the scene says, path if it says nothing
    std::vector<std::pair<std::string, std::string>> set;  // parameters of the integrator, name and value
    int spp = 0;                                           // camera samples per pixel; 0: as the scene says
    std::string output;                                    // image file; empty: as the scene says
    V2i resolution{0, 0};                                  // pixels; 0: as the scene says
    std::optional<WorkingSpace> colours;                   // of the render; none: as the scene says
    std::optional<FluxUnit> unit;                          // of all light; none: as the scene says
    bool skip_missing = false;  // meshes and textures whose file does not exist are left out, with a warning
    bool strict = false;        // what the reader would replace or leave out with a warning is an error
    NamedMeshes meshes = {};    // for the text's Shape "arraymesh"
    // Measured lamps (light fields and ray files) become points with the intensities that this makes of their
    // files: the same light at a point, as a photometric file has it. None: they are as they are.
    FarFieldOf far_field = {};
    // The file that is read in the place of a light field's, as the scene names it: a replicate of the lamp,
    // for example. None: its own.
    LampFileOf lamp_file = {};
    // Changes the parts of every frame before its Scene is made of them: scales or replaces lights, whose
    // order is that of the text, or materials. Positions are relative to `origin`. A light on a surface
    // (Mesh::light and its like) is replaced only by one of the same surface. Where there are light groups,
    // `of_light` has one for each light. None: nothing is changed.
    std::function<void(SceneParts&)> edit = {};
};

// The frames of a scene file, one after the other: what stands after a WorldEnd is another picture, whose
// camera, film and methods are the last one's until it names its own. Only one is in memory at a time.
class SceneFrames {
  public:
    // Arguments as of read_scene; they must outlive this.
    SceneFrames(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
                Monitor& monitor);
    SceneFrames(std::string text, const std::filesystem::path& pretended_file,
                const SceneOverrides& overrides, const Workers& workers, Monitor& monitor);
    ~SceneFrames();

    // None after the last one. Throws InputError, whose message is one line.
    std::optional<Job> next();
    // False after the last one; where text is left that makes no frame, true.
    bool more() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

// The first frame; that there are others is a warning. Throws InputError, whose message is one line.
// Relative names within the scene (Include, meshes, textures, lamps) start from the folder of `file`, also in
// included files.
Job read_scene(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
               Monitor& monitor);

// The same for text in memory that stands for `pretended_file`.
Job read_scene_text(std::string text, const std::filesystem::path& pretended_file,
                    const SceneOverrides& overrides, const Workers& workers, Monitor& monitor);

}  // namespace lucerna
