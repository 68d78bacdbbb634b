// libFuzzer's entry to pictures of every format, as textures, lights and photographs read them: bytes give
// finite numbers or an InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/image/photograph.h"
#include "engine/scene/texture_image.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

void read_as_texture(const std::filesystem::path& file) {
    const auto image = lucerna::read_texture_image(file);
    require(image && image->width > 0 && image->height > 0, "a texture without pixels");
    for (const float v : image->data) require(std::isfinite(v) && v >= 0, "a texture's value is none");
}

void read_as_photograph(const std::filesystem::path& file) {
    const lucerna::Photograph photograph = lucerna::read_photograph(file);
    const std::size_t pixels =
        static_cast<std::size_t>(photograph.size.x) * static_cast<std::size_t>(photograph.size.y);
    require(pixels > 0 && photograph.counts.size() == pixels, "counts are missing");
    for (const float count : photograph.counts) require(std::isfinite(count), "a count is no number");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // The library detects the format by content, not by name.
    const std::filesystem::path file = file_of_input(data, size, ".png");
    for (const auto read : {read_as_texture, read_as_photograph}) {
        try {
            read(file);
        } catch (const lucerna::InputError& error) {
            require_one_line(error);
        }
    }
    return 0;
}
