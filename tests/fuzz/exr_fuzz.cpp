// libFuzzer's entry to the reader of the project's images (OpenEXR), as used by compare and study: bytes give
// a consistent image or an InputError.
#include <cstddef>
#include <cstdint>

#include "engine/image/image.h"
#include "tests/fuzz/input.h"

using lucerna::testing::file_of_input;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::filesystem::path file = file_of_input(data, size, ".exr");
    try {
        const lucerna::Image image = lucerna::read_exr(file);
        require(image.width > 0 && image.height > 0 && !image.channels.empty(), "an image without pixels");
        const std::size_t pixels =
            static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
        require(image.data.size() == pixels * image.channels.size(), "pixels are missing");
    } catch (const lucerna::InputError& error) {
        require_one_line(error);
    }
    return 0;
}
