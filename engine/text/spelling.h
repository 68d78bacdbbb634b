// Suggests corrections of mistyped names.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace lucerna {

// Returns the number of insertions, deletions, substitutions and swaps of neighbours that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b);

// Returns "did you mean \"radius\"? " for the most similar of `known`, or nothing if none is similar. Words
// of more than 64 letters are ignored, because a hint must not take longer than the work.
std::string did_you_mean(std::string_view name, std::span<const std::string_view> known);

}  // namespace lucerna
