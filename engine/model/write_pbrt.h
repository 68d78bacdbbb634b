// Writes a glTF model as a pbrt scene (version 4): editable scene text, with its meshes and pictures in a
// folder beside it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/model/model.h"

namespace lucerna {

struct WrittenScene {
    std::size_t shapes = 0, triangles = 0, materials = 0, lights = 0, files = 0;
    // Sentences on what the scene added because the model lacked it; the scene's header repeats them.
    std::vector<std::string> notes;
};

// Returns the folder of meshes and pictures, "room-parts" beside "room.pbrt".
std::filesystem::path parts_folder(const std::filesystem::path& scene);

// Tells whether files in that folder may get this name.
bool is_part_name(const std::string& file);

// Writes `scene` and its parts folder, which is created if missing. `source` names the model in the header.
// Throws InputError if a file cannot be written.
WrittenScene write_pbrt(const Model& model, const std::filesystem::path& scene, const std::string& source,
                        Monitor& monitor);

// The functions below return the scene text of a model's cameras, materials, lights and shapes.

// Makes a name safe between quotes.
std::string quotable(const std::string& name);

// Extent of all placed meshes, metres.
struct Extent {
    V3d centre{0, 0, 0};
    double radius = 1;  // > 0
};
Extent extent_of(const Model& model);

// Return camera and film. The default camera sees the whole model from the front, its right and a little
// above.
std::string camera_text(const ModelCamera& camera, const std::string& image_name);
std::string default_camera_text(const Extent& extent, const std::string& image_name);

// Returns the name of material `index`; -1 is glTF's default material.
std::string material_name(const Model& model, int index);
// Returns a material and its textures. `image_file` returns the file of an image, relative to the scene.
std::string material_text(const Model& model, int index,
                          const std::function<std::string(int image)>& image_file);
// Return the texture and the parameters of a shape with a partly transparent material. `cutout_file` is empty
// if it has no cutout.
std::string cutout_texture_text(const Model& model, int index, const std::string& cutout_file);
std::string alpha_text(const Model& model, int index);
// Returns the text before a shape that emits.
std::string emission_text(const ModelMaterial& material);

// `profile_file` is the file of its IES profile, relative to the scene, or empty.
std::string light_text(const ModelLight& light, const std::string& profile_file);
std::string default_light_text();

// Returns "Transform [ ... ]".
std::string transform_text(const M44d& matrix);

}  // namespace lucerna
