// A lamp's shape, asked by rays.
#pragma once

#include <memory>

#include "engine/scene/mesh.h"
#include "lights/lamp_shape.h"

namespace lucerna {

// The shapes must be those that the scene holds; what they are made of does not matter here. `origin`: that
// of the scene, for the textures that cut holes.
std::unique_ptr<const LampShape> make_traced_shape(Shapes shapes, const V3d& origin = V3d(0.0));

}  // namespace lucerna
