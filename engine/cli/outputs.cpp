#include "engine/cli/outputs.h"

#include <span>

#include "engine/base/files.h"

namespace lucerna {

void write_text(const std::filesystem::path& file, std::string_view text) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

}  // namespace lucerna
