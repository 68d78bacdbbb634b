// A ray file as a light: its rays, emitted as they are. The comparison case for light fields.
//
// A handful of lines in space, however many, meets no point of a surface: nothing but particles can carry
// this light. Photon maps show it; methods that ask a light for its radiance see nothing of it.
#pragma once

#include <filesystem>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "lights/light.h"
#include "lights/ray_set.h"

namespace lucerna {

struct RayLightSettings {
    std::filesystem::path file;
    M44d world_from_light;  // rotation, translation and uniform scale; relative to the scene's origin. The
                            // rays are in metres; their flux does not change with the scale
    float power_scale = 1;  // multiplies the flux
    float power = 0;        // if > 0: the flux the rays are set to, in the file's flux unit
};

// Reads the rays. Throws InputError naming file and cause.
std::unique_ptr<Light> make_ray_light(const RayLightSettings& settings, Monitor& monitor);

// The same from rays in memory; settings.file only names them in messages. Each emission is a ray of the set,
// chosen in proportion to its flux in constant time, and carries the flux of all usable rays.
std::unique_ptr<Light> make_ray_light(RaySet rays, const RayLightSettings& settings);

}  // namespace lucerna
