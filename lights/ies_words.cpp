#include "lights/ies_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {
namespace {

// Old files end in Ctrl-Z.
constexpr std::string_view kSpaces{" \t\v\f\x1a\0", 6};

// Returns true for digits, one comma and digits, with a sign and an exponent as in numbers, and no point.
bool is_decimal_comma(std::string_view word) {
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    const std::size_t comma = word.find(',');
    return comma != std::string_view::npos && comma > 0 && comma + 1 < word.size() &&
           digit(word[comma - 1]) && digit(word[comma + 1]) && word.find('.') == std::string_view::npos &&
           number_of(with_decimal_point(word));
}

struct Reading {
    std::vector<IesWord> words;
    bool joined = false;  // commas without a space separate numbers somewhere: 0,45,90
};

// Adds the text between two spaces: one word with a decimal comma, or words that commas separate.
void add_words(const TextLine& line, std::size_t from, std::size_t to, bool decimal_commas,
               Reading& reading) {
    std::vector<IesWord>& words = reading.words;
    // Commas at the ends are always separators.
    while (from < to && line.text[from] == ',') ++from;
    while (from < to && line.text[to - 1] == ',') --to;
    if (from == to) return;
    const bool either = is_decimal_comma(line.text.substr(from, to - from));
    const auto add = [&](std::size_t begin, std::size_t end) {
        words.push_back({std::string(line.text.substr(begin, end - begin)), line.number,
                         static_cast<int>(begin) + 1, either});
    };
    if (either && decimal_commas) {
        add(from, to);
        words.back().text = with_decimal_point(words.back().text);
        return;
    }
    while (from < to) {
        const std::size_t end = std::min(line.text.find(',', from), to);
        add(from, end);
        if (end < to && !either) reading.joined = true;
        from = std::min(line.text.find_first_not_of(',', end), to);
    }
}

Reading reading_of(const std::vector<TextLine>& lines, std::size_t first, bool decimal_commas) {
    Reading reading;
    for (std::size_t i = first; i < lines.size(); ++i) {
        const std::string_view text = lines[i].text;
        std::size_t begin = text.find_first_not_of(kSpaces);
        while (begin != std::string_view::npos) {
            const std::size_t end = std::min(text.find_first_of(kSpaces, begin), text.size());
            add_words(lines[i], begin, end, decimal_commas, reading);
            begin = text.find_first_not_of(kSpaces, end);
        }
    }
    return reading;
}

// Returns the number of words that the file needs by its own counts; none if these are not counts.
std::optional<double> needed_words(const std::vector<IesWord>& words, bool tilt) {
    constexpr std::size_t kHead = 13, kVertical = 3, kHorizontal = 4, kMostPairs = 100'000;
    const auto at = [&words](std::size_t i) {
        return i < words.size() ? number_of(words[i].text) : std::nullopt;
    };
    std::size_t begin = 0;
    if (tilt) {
        const auto pairs = at(1);
        if (!pairs || !(*pairs >= 1 && *pairs <= kMostPairs)) return std::nullopt;
        begin = 2 + 2 * static_cast<std::size_t>(*pairs);
    }
    const auto vertical = at(begin + kVertical), horizontal = at(begin + kHorizontal);
    if (!vertical || !horizontal) return std::nullopt;
    return static_cast<double>(begin + kHead) + *vertical + *horizontal + *vertical * *horizontal;
}

// Returns how many more numbers there are than the file needs, without counting words at the end that are not
// numbers. Returns NaN if the counts are invalid.
double too_many(const std::vector<IesWord>& words, bool tilt) {
    const auto needed = needed_words(words, tilt);
    if (!needed || !(*needed >= 0)) return NAN;
    const auto count = static_cast<double>(words.size());
    if (count <= *needed) return count - *needed;
    const auto end = words.begin() + static_cast<std::ptrdiff_t>(*needed);
    return static_cast<double>(std::count_if(
        end, words.end(), [](const IesWord& word) { return number_of(word.text).has_value(); }));
}

}  // namespace

std::vector<IesWord> ies_words(const std::vector<TextLine>& lines, std::size_t first, bool tilt,
                               const std::string& file, Monitor& monitor) {
    Reading by_spaces_and_commas = reading_of(lines, first, false);
    std::vector<IesWord>& separated = by_spaces_and_commas.words;
    const auto either = [](const IesWord& word) { return word.either; };
    if (std::none_of(separated.begin(), separated.end(), either)) return std::move(separated);
    std::vector<IesWord> decimal = reading_of(lines, first, true).words;
    const auto found = std::find_if(decimal.begin(), decimal.end(), either);
    const Location place{file, found->line, found->column};
    const std::string_view line = lines[static_cast<std::size_t>(found->line) - 1].text;
    const std::string_view rest = line.substr(static_cast<std::size_t>(found->column) - 1);
    const std::string shown = shown_value(rest.substr(0, rest.find_first_of(kSpaces)));
    const double of_separated = too_many(separated, tilt), of_decimal = too_many(decimal, tilt);
    const bool thousands = std::all_of(decimal.begin(), decimal.end(), [](const IesWord& word) {
        if (!word.either) return true;
        std::string text = word.text;
        std::replace(text.begin(), text.end(), '.', ',');
        return may_separate_thousands(text);
    });
    const bool may_be_decimal = of_decimal == 0 && !by_spaces_and_commas.joined;
    if (may_be_decimal && of_separated != 0 && !thousands) {
        monitor.warn(fmt::format("{}: the commas of \"{}\" and the like are read as decimal points",
                                 to_string(place), shown));
        return decimal;
    }
    // Too few numbers and invalid counts lead to errors later.
    if (!may_be_decimal && !(of_separated > 0)) return std::move(separated);
    input_error(
        place,
        "the comma of \"{}\" may separate two numbers, decimals or thousands; expected decimal points, "
        "and numbers separated by spaces",
        shown);
}

}  // namespace lucerna
