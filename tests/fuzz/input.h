// Shared by the fuzzers: the input as a file, and the report of a finding.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace lucerna::testing {

inline void require(bool good, const char* what) {
    if (good) return;
    std::fprintf(stderr, "%s\n", what);
    std::abort();
}

inline void require_one_line(const InputError& error) {
    const std::string message = error.what();
    require(!message.empty() && message.find('\n') == message.npos, "an error is not one line");
}

// Returns the input as mutable bytes, so that a checksum can be corrected.
inline std::vector<std::byte> bytes_of_input(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
    return {bytes.begin(), bytes.end()};
}

// Writes the input to a file of this process, for readers that do not accept bytes; `suffix` is like ".ply".
inline std::filesystem::path file_of_bytes(std::span<const std::byte> bytes, const std::string& suffix) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("lucerna-fuzz-" + std::to_string(getpid()) + suffix);
    // Removes the file first: some file systems wait for the disk when a file is overwritten.
    std::filesystem::remove(file);
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return file;
}
inline std::filesystem::path file_of_input(const std::uint8_t* data, std::size_t size,
                                           const std::string& suffix) {
    return file_of_bytes(std::as_bytes(std::span(data, size)), suffix);
}

}  // namespace lucerna::testing
