#include "engine/text/spelling.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace lucerna {
namespace {

// Longer words get no hint, and only the first names are compared, so that a hint takes at most some
// hundredths of a second, whatever the input.
constexpr std::size_t kLongestName = 64, kMostNames = 4096;

// Names of a scene may contain anything, but a message is one line of plain text.
bool is_plain(std::string_view name) {
    return std::all_of(name.begin(), name.end(), [](char c) { return c >= 0x20 && c < 0x7f; });
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
    // Keeps three rows of the table of optimal string alignment.
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                row[j] = std::min(row[j], before[j - 2] + 1);
            }
        }
        before.swap(last);
        last.swap(row);
    }
    return last[b.size()];
}

std::string did_you_mean(std::string_view name, std::span<const std::string_view> known) {
    if (name.size() > kLongestName) return {};
    std::string_view nearest;
    std::size_t least = std::max<std::size_t>(2, name.size() / 2);
    for (const std::string_view candidate : known.first(std::min(known.size(), kMostNames))) {
        // The difference of the lengths is a lower bound of the distance.
        const std::size_t apart =
            std::max(name.size(), candidate.size()) - std::min(name.size(), candidate.size());
        if (candidate.size() > kLongestName || apart >= least || !is_plain(candidate)) continue;
        const std::size_t distance = edit_distance(name, candidate);
        if (distance < least) {
            least = distance;
            nearest = candidate;
        }
    }
    return nearest.empty() ? std::string() : fmt::format("did you mean \"{}\"? ", nearest);
}

}  // namespace lucerna
