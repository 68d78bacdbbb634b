// A look at an OpenEXR file's header before the library reads it: what the library allocates on the header's
// word alone must be something that the file can hold.
#pragma once

#include <filesystem>

namespace lucerna {

// Throws InputError (without the file's name) for a file that is no single-part scan-line OpenEXR file, and
// for attributes or a data window larger than the file can hold. What passes may still be damaged.
void check_exr_header(const std::filesystem::path& file);

}  // namespace lucerna
