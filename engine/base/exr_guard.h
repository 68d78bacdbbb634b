// A look at an OpenEXR file's header before a library reads it: what the library allocates on the header's
// word alone must be something that the file can hold.
#pragma once

#include <cstdint>
#include <filesystem>

namespace lucerna {

// What is accepted: any OpenEXR file (tiles, several parts, attributes of any type), or what light fields are
// in, scan lines of a single part with attributes of the types that they have.
enum class ExrKind : std::uint8_t { any, light_field };

// Throws InputError (without the file's name) for what is no OpenEXR file of that kind, and for attributes,
// tiles or a data window larger than the file can hold. What passes may still be damaged.
void check_exr_header(const std::filesystem::path& file, ExrKind kind);

}  // namespace lucerna
