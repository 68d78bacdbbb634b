// Recognises a file's format by its first bytes, for the messages of readers that expected another format.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

// Returns the name of a format, for example "a PNG picture", kPlainText for text of no known format, or ""
// for other bytes. `first` holds at least the first 262 bytes, if the file has as many.
inline constexpr std::string_view kPlainText = "text";
std::string_view content_name(std::span<const std::byte> first);

// Returns the first kFirstBytes of the file, more than content_name() needs, or all if there are fewer. Throws
// InputError.
inline constexpr std::size_t kFirstBytes = 4096;
std::vector<std::byte> first_bytes(const std::filesystem::path& file);

// Describes the file as a clause, for example "it is a PNG picture". Throws InputError.
std::string content_of(const std::filesystem::path& file);

}  // namespace lucerna
