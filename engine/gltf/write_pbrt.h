// A glTF model as a pbrt scene (version 4): scene text that a person can go on writing, with its meshes and
// pictures in a folder beside it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/gltf/model.h"

namespace lucerna {

struct WrittenScene {
    std::size_t shapes = 0, triangles = 0, materials = 0, lights = 0, files = 0;
    // What the model lacked and the scene got, in sentences; they stand in the scene's header too.
    std::vector<std::string> notes;
};

// "room-parts" beside "room.pbrt": where the meshes and pictures go.
std::filesystem::path parts_folder(const std::filesystem::path& scene);

// Whether files in that folder may get this name.
bool is_part_name(const std::string& file);

// Writes `scene` and its parts folder, which is made if there is none; `source` names the model in the
// header. Throws InputError if a file cannot be written.
WrittenScene write_pbrt(const GltfModel& model, const std::filesystem::path& scene, const std::string& source,
                        Monitor& monitor);

// The words of a pbrt scene: cameras, materials, lights and shapes of a model, each as the text that stands
// for it.

// A name as it may stand between quotes.
std::string quotable(const std::string& name);

// Extent of everything placed, metres.
struct Extent {
    V3d centre{0, 0, 0};
    double radius = 1;  // > 0
};
Extent extent_of(const GltfModel& model);

// Camera and film. The second looks at all of the model from the front, its right and a little above.
std::string camera_text(const GltfCamera& camera, const std::string& image_name);
std::string default_camera_text(const Extent& extent, const std::string& image_name);

// The name under which material `index` is made; -1 is glTF's default material.
std::string material_name(const GltfModel& model, int index);
// Its textures and itself. `image_file` gives the file of an image, relative to the scene.
std::string material_text(const GltfModel& model, int index,
                          const std::function<std::string(int image)>& image_file);
// The parameters of a shape whose material lets some of it through; `cutout_file` is empty if it has no
// cutout.
std::string cutout_texture_text(const GltfModel& model, int index, const std::string& cutout_file);
std::string alpha_text(const GltfModel& model, int index);
// Before a shape that shines.
std::string emission_text(const GltfMaterial& material);

// `profile_file` is the file of its IES profile, relative to the scene; "" if it has none.
std::string light_text(const GltfLight& light, const std::string& profile_file);
std::string default_light_text();

// "Transform [ ... ]"
std::string transform_text(const M44d& matrix);

}  // namespace lucerna
