// Text files that a command writes.
#pragma once

#include <filesystem>
#include <string_view>

#include "engine/cli/command_files.h"

namespace lucerna {

// Writes text by replace_file: the old file or the new one, never half of one.
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace lucerna
