// A light whose flux is scaled, for programs that adjust a lamp they did not create.
#pragma once

#include <memory>

#include "lights/light.h"

namespace lucerna {

// Returns `light` with all emission multiplied by `factor` per colour channel. Asserts that there is a light
// and that the factors are finite and not negative.
std::unique_ptr<Light> make_scaled_light(std::unique_ptr<Light> light, const Rgb& factor);

}  // namespace lucerna
