// Unpacks files that gzip compressed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace lucerna {

// Whether the bytes begin as gzip's do.
bool is_gzip(const std::vector<std::byte>& bytes);
// Unpacked, at most `most` bytes. Throws InputError that names `file`: damaged, cut off, longer than that
// or than memory, or 400 times as long as it was and more than 64 MiB.
std::vector<std::byte> gunzip(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                              std::size_t most);
std::string gunzip_text(const std::vector<std::byte>& packed, const std::filesystem::path& file,
                        std::size_t most);

}  // namespace lucerna
