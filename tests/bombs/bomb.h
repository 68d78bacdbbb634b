// Inputs that are small, or merely deep, and ask for more than any machine has: of memory, of time, or of the
// stack. Each is made on the fly.
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
        rendered,  // it is only dangerous to a reader that does more work than it must
    };
    std::string name;
    // Makes the files in this folder, which the command is started in.
    std::function<void(const std::filesystem::path& folder)> make;
    std::vector<std::string> words;     // of the command
    std::vector<std::string> mentions;  // in its one line: the place, what is too much, what is accepted
    End end = End::refused;
};

// For gtest, which would print its bytes.
inline void PrintTo(const Bomb& bomb, std::ostream* out) {
    *out << bomb.name;
}

// What recurses once for each level of its input [B.3].
std::vector<Bomb> deep_bombs();
// What makes more of its input at every level, or for every line [B.4].
std::vector<Bomb> growing_bombs();
// What claims sizes that its bytes do not bear out [B.7].
std::vector<Bomb> lying_bombs();

}  // namespace lucerna::testing
