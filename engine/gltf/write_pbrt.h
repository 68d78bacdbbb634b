// A glTF model as a pbrt scene (version 4): scene text that a person can go on writing, with its meshes and
// pictures in a folder beside it.
#pragma once

#include <cstddef>
#include <filesystem>
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

}  // namespace lucerna
