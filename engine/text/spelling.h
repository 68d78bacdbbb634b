// Suggestions for mistyped names.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace lucerna {

// Insertions, deletions, substitutions and swaps of neighbours that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b);

// "did you mean \"radius\"? " for the nearest of `known`, or nothing if none is near.
// Words of more than 64 letters are not looked at: a hint must not take longer than the work.
std::string did_you_mean(std::string_view name, std::span<const std::string_view> known);

}  // namespace lucerna
