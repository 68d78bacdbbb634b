// Compares the facts that determine an image.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lucerna {

// Facts are pairs of name and value: the scene, every setting, the seed, the version. Only renders with equal
// facts can continue each other's sums or contribute to one image.
using Facts = std::vector<std::pair<std::string, std::string>>;

// Returns the text as one line: line breaks and tabs become spaces.
std::string plain_line(std::string_view text);

struct FactDifference {
    std::string name, of_first, of_second;  // each is one line; "nothing" if one of the two lacks it
};
// Returns the first difference in the order of the second's facts, or none if all are equal.
std::optional<FactDifference> first_difference(const Facts& first, const Facts& second);

}  // namespace lucerna
