// Errors of a user's input state what is needed to correct them: file, line, column, value, accepted values.
//
// There are three classes of errors (docs/development/architecture.md): `assert` for internal errors, these
// exceptions for input and environment, and `optional` for a missing sample. No library ends the process.
#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace lucerna {

// Holds a place in an input file. Line 0 means the file as a whole.
struct Location {
    std::string file;
    int line = 0;
    int column = 0;
};

inline std::string to_string(const Location& at) {
    if (at.line == 0) return at.file;
    return fmt::format("{}:{}:{}", at.file, at.line, at.column);
}

// Reports invalid input or an unsuitable environment (exit code 1). what() is one line that states place,
// cause and what is accepted.
class InputError : public std::runtime_error {
  public:
    explicit InputError(const std::string& message) : std::runtime_error(message) {}
    InputError(const Location& at, const std::string& message)
        : std::runtime_error(to_string(at) + ": " + message) {}
};

template <typename... Args>
[[noreturn]] void input_error(const Location& at, fmt::format_string<Args...> format, Args&&... args) {
    throw InputError(at, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace lucerna
