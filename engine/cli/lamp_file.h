// A lamp's file, whatever it holds: told by its name's end.
#pragma once

#include <filesystem>
#include <variant>

#include "engine/base/files.h"
#include "engine/base/monitor.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"

namespace lucerna {

using LampFile = std::variant<LightField, RaySet>;

// .exr is a light field; else rays. Throws InputError naming file and cause.
inline LampFile read_lamp_file(const std::filesystem::path& file, Monitor& monitor) {
    if (suffix_of(file) == ".exr") return read_light_field(file);
    return read_rays(file, monitor);
}

}  // namespace lucerna
