#include "engine/text/facts.h"

#include <map>

namespace lucerna {

std::string plain_line(std::string_view text) {
    std::string line(text);
    for (char& c : line) {
        if (c == '\n' || c == '\t' || c == '\r') c = ' ';
    }
    return line;
}

std::optional<FactDifference> first_difference(const Facts& first, const Facts& second) {
    const std::map<std::string, std::string> before(first.begin(), first.end());
    const std::map<std::string, std::string> now(second.begin(), second.end());
    const auto value = [](const auto& from, const std::string& name) {
        const auto found = from.find(name);
        return found == from.end() ? std::string("nothing") : plain_line(found->second);
    };
    Facts all = second;  // its order has the general facts first
    all.insert(all.end(), first.begin(), first.end());
    for (const auto& [name, ignored] : all) {
        FactDifference difference{plain_line(name), value(before, name), value(now, name)};
        if (difference.of_first != difference.of_second) return difference;
    }
    return std::nullopt;
}

}  // namespace lucerna
