// Files that a command will write: checked before the work, not after it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace lucerna {

// Throws InputError, naming the file and the cause, unless `file` ends in `suffix` (in any case; empty: any),
// its folder exists and takes new files, `file` is not a folder itself, and what writes pictures can be
// loaded if it is one. Leaves nothing behind.
void require_writable(const std::filesystem::path& file, std::string_view suffix);

// Writes text by replace_file: the old file or the new one, never half of one.
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace lucerna
