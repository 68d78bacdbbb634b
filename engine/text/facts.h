// What makes an image what it is, and whether that of two is the same.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lucerna {

// Name and value: the scene, every setting, the seed, the version. Only renders of which all of this is the
// same can go on with each other's sums, or make parts of one picture.
using Facts = std::vector<std::pair<std::string, std::string>>;

// In one line: what would end it, or part it, is a space.
std::string plain_line(std::string_view text);

struct FactDifference {
    std::string name, of_first, of_second;  // each in one line; "nothing" where one of them lacks it
};
// The first in the order of the second's facts; none where all are the same.
std::optional<FactDifference> first_difference(const Facts& first, const Facts& second);

}  // namespace lucerna
