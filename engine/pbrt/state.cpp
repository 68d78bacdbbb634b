#include "engine/pbrt/state.h"

#include <fmt/format.h>

namespace lucerna {
namespace {

// A name as other systems write it, with a backslash between folders; some of these have become escapes.
std::string with_slashes(const std::string& name) {
    constexpr std::string_view control = "\n\t\r\b\f", letter = "ntrbf";
    std::string result;
    for (const char c : name) {
        const std::size_t escape = control.find(c);
        if (escape != control.npos) {
            result += '/';
            result += letter[escape];
        } else {
            result += c == '\\' ? '/' : c;
        }
    }
    return result;
}

}  // namespace

std::filesystem::path Reading::resolve(const std::string& name) {
    const auto in_folder = [&](const std::filesystem::path& file) {
        return file.is_absolute() ? file : folder / file;
    };
    std::filesystem::path file = in_folder(name);
    const std::string other = with_slashes(name);
    std::error_code status;
    if (other != name && !std::filesystem::exists(file, status) &&
        std::filesystem::exists(in_folder(other), status)) {
        depart(place, fmt::format("{}: no such file", printable(file.string())),
               fmt::format("{} is taken", printable(other)));
        file = in_folder(other);
    }
    if (!name.empty()) draft.files.push_back(file);
    return file;
}

}  // namespace lucerna
