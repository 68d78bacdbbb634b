// Reads scene files, pbrt's text with version 4's syntax and version 3's names, into a Job that can be
// rendered.
//
// Supported directives behave exactly as in pbrt. Whatever pbrt renders and the reader does not support is
// replaced, with a warning by file, line and column, or rejected under `strict` (tokens.h).
// docs/reference/scene-files.md lists directives and parameters.
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

// Choices of the command line, or of a program that uses the library, that replace the scene's own.
struct SceneOverrides {
    std::string integrator;                                // empty: the scene's, or path by default
    std::vector<std::pair<std::string, std::string>> set;  // names and values of integrator parameters
    int spp = 0;                                           // camera samples per pixel; 0: the scene's
    std::string output;                                    // image file; empty: the scene's
    V2i resolution{0, 0};                                  // pixels; 0: the scene's
    std::optional<WorkingSpace> colours;                   // of the render; none: the scene's
    std::optional<FluxUnit> unit;                          // of all light; none: the scene's
    bool skip_missing = false;  // leaves out meshes and textures whose file does not exist, with a warning
    bool strict = false;        // turns warnings about replaced or omitted parts into errors
    NamedMeshes meshes = {};    // for Shape "arraymesh" of the text
    // Replaces measured lamps (light fields and ray files) by point lights with the intensities that this
    // function derives from their files, as in a photometric file. None: lamps keep their near field.
    FarFieldOf far_field = {};
    // Returns the file to read in place of a light field's file as the scene names it, such as a replicate of
    // the lamp. None: its own.
    LampFileOf lamp_file = {};
    bool without_sun = false;  // leaves out the sun of skies, and its light on their ground
    // Edits the parts of every frame before its Scene is made, for example scales or replaces lights (in the
    // order of the text) or materials. Positions are relative to `origin`. A light on a surface (Mesh::light
    // and its like) must be replaced by one of the same surface. With light groups, `of_light` has one entry
    // for each light. None: nothing is changed.
    std::function<void(SceneParts&)> edit = {};
};

// The frames of a scene file in order. Text after a WorldEnd describes another image, which keeps the camera,
// film and methods of the previous one until it sets its own. Only one frame is in memory at a time.
class SceneFrames {
  public:
    // Takes the arguments of read_scene, which must outlive this object.
    SceneFrames(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
                Monitor& monitor);
    SceneFrames(std::string text, const std::filesystem::path& pretended_file,
                const SceneOverrides& overrides, const Workers& workers, Monitor& monitor);
    ~SceneFrames();

    // Returns nothing after the last frame. Throws InputError with a one-line message.
    std::optional<Job> next();
    // Returns false after the last frame, but true if text is left that makes no frame.
    bool more() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

// Reads the first frame and warns if there are others. Throws InputError with a one-line message. Relative
// names within the scene (Include, meshes, textures, lamps) start from the folder of `file`, also in included
// files.
Job read_scene(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
               Monitor& monitor);

// Reads text in memory in place of `pretended_file`.
Job read_scene_text(std::string text, const std::filesystem::path& pretended_file,
                    const SceneOverrides& overrides, const Workers& workers, Monitor& monitor);

}  // namespace lucerna
