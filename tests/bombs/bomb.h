// Inputs that are small or merely deep, and require more memory, time or stack than any machine has. Each is
// generated when it is needed.
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

namespace lucerna::testing {

struct Bomb {
    enum class End : std::uint8_t {
        refused,   // one line of error
        rendered,  // harmless, unless the reader does unnecessary work
    };
    std::string name;
    // Writes the files to this folder, in which the command is started.
    std::function<void(const std::filesystem::path& folder)> make;
    std::vector<std::string> words;  // of the command
    std::vector<std::string>
        mentions;  // in the one line of the error: the place, what exceeds a limit, what is accepted
    End end = End::refused;
};

// Prints the name for gtest, which would otherwise print the object's bytes.
inline void PrintTo(const Bomb& bomb, std::ostream* out) {
    *out << bomb.name;
}

// Returns inputs on which a reader recurses once for each level [B.3].
std::vector<Bomb> deep_bombs();
// Returns inputs that expand at every level or for every line [B.4].
std::vector<Bomb> growing_bombs();
// Returns inputs that claim sizes larger than their bytes support [B.7].
std::vector<Bomb> lying_bombs();

}  // namespace lucerna::testing
