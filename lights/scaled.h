// A light with more or less of its flux: what a program does to a lamp that it did not make.
#pragma once

#include <memory>

#include "lights/light.h"

namespace lucerna {

// All that `light` sends, times `factor`, colour by colour. Asserts a light, and factors that are finite and
// not negative.
std::unique_ptr<Light> make_scaled_light(std::unique_ptr<Light> light, const Rgb& factor);

}  // namespace lucerna
