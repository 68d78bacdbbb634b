// A look at a PNG's chunks before a library reads them: libpng would say what is wrong with them on standard
// error, too, beside the error that names the file.
#pragma once

#include <filesystem>

namespace lucerna {

// Throws InputError (without the file's name) for a header that PNG does not know [PNG 11.2.2], a chunk that
// the picture needs and that is cut off, damaged or unknown, and where one is missing. What passes may still
// be damaged inside its compressed data.
void check_png_chunks(const std::filesystem::path& file);

}  // namespace lucerna
