// What the fuzzers share: their input as a file, and how a finding is reported.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

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

// The input in a file of this process, for readers that take no bytes; `suffix` as ".ply".
inline std::filesystem::path file_of_input(const std::uint8_t* data, std::size_t size,
                                           const std::string& suffix) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("lucerna-fuzz-" + std::to_string(getpid()) + suffix);
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    return file;
}

}  // namespace lucerna::testing
