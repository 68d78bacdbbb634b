// Files: what must be true before a read, and a write that leaves the old file or the new one, never half a
// file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

// Throws InputError with the cause in words (missing, a folder, not permitted, empty) unless `file` can be
// read.
void require_readable(const std::filesystem::path& file);

// The whole file. Throws InputError.
std::vector<std::byte> read_bytes(const std::filesystem::path& file);
std::string read_text(const std::filesystem::path& file);

// Whether the bytes begin as gzip's do.
bool is_gzip(const std::vector<std::byte>& bytes);
// Unpacked, at most `most` bytes. Throws InputError that names `file`: damaged, cut off, or longer.
std::vector<std::byte> gunzip(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                              std::size_t most);
// The whole file, unpacked if it is gzip'd. Throws InputError.
std::vector<std::byte> read_unpacked(const std::filesystem::path& file);

// Calls write(temporary) for a temporary name in the same folder, waits until that is on the disk, then
// renames it over `file`. If write throws (a stream that is told to throw, too), the temporary is removed and
// the error becomes an InputError that names `file` and the system's cause. `write` must close what it wrote
// and see that it could.
void replace_file(const std::filesystem::path& file,
                  const std::function<void(const std::filesystem::path& temporary)>& write);
// The same for bytes that are there: the parts, one after the other.
void replace_file(const std::filesystem::path& file, std::span<const std::span<const std::byte>> parts);

// The end of the name, as ".exr", in lower case whatever the file's.
std::string suffix_of(const std::filesystem::path& file);

// A library's message with its line breaks folded away.
std::string one_line(std::string_view text);

}  // namespace lucerna
