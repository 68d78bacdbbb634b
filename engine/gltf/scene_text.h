// The words of a pbrt scene: cameras, materials, lights and shapes of a model, each as the text that stands
// for it.
#pragma once

#include <functional>
#include <string>

#include "engine/gltf/model.h"

namespace lucerna {

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

std::string light_text(const GltfLight& light);
std::string default_light_text();

// "Transform [ ... ]"
std::string transform_text(const M44d& matrix);

}  // namespace lucerna
