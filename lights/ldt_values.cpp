#include "lights/ldt_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr std::size_t kTextLines = 12;  // the lines of the head, most of them text

// Tells whether lines 2 to 7 of the format are what they should be, if line 1 is lines[first].
bool is_head(const std::vector<TextLine>& lines, std::ptrdiff_t first) {
    const auto number = [&](int line, double least, double most, bool whole, bool optional) {
        const std::ptrdiff_t i = first + line - 1;
        if (i < 0 || i >= std::ssize(lines)) return false;
        const std::string_view word = trimmed(lines[static_cast<std::size_t>(i)].text);
        if (word.empty()) return optional;
        const auto value = number_of(with_decimal_point(word));
        return value && *value >= least && *value <= most && (!whole || *value == std::floor(*value));
    };
    return number(2, 0, 10, true, true) && number(3, 0, 4, true, false) && number(4, 1, 1e5, true, false) &&
           number(5, 0, 360, false, true) && number(6, 2, 1e5, true, false) && number(7, 0, 180, false, true);
}

// Returns the number of the format's line 1 among the lines; -1 if it is missing, and none for other text.
std::optional<std::ptrdiff_t> head_of(const std::vector<TextLine>& lines) {
    for (const std::ptrdiff_t first : {0, 1, 2, 3, -1}) {
        if (is_head(lines, first)) return first;
    }
    return std::nullopt;
}

// Line ends that were converted twice (CR CR LF) leave every second line empty.
bool are_doubled(const std::vector<TextLine>& lines) {
    constexpr std::size_t kFew = 20;
    for (std::size_t i = 1; i < lines.size(); i += 2) {
        if (!trimmed(lines[i].text).empty()) return false;
    }
    return lines.size() >= kFew;
}

std::vector<TextLine> undoubled(const std::vector<TextLine>& lines) {
    std::vector<TextLine> kept;
    for (std::size_t i = 0; i < lines.size(); i += 2) kept.push_back(lines[i]);
    return kept;
}

}  // namespace

bool looks_like_ldt(std::string_view text) {
    text = without_byte_order_mark(text);
    std::vector<TextLine> lines = lines_of(text.substr(0, 4096));
    if (are_doubled(lines)) lines = undoubled(lines);
    return head_of(lines).has_value();
}

std::vector<TextLine> ldt_lines(std::string_view text, const std::string& file, Monitor& monitor) {
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        input_error({file}, "the text is UTF-16; expected one byte per character, or UTF-8");
    text = without_byte_order_mark(text);
    std::vector<TextLine> lines = lines_of(text);
    if (are_doubled(lines)) {
        lines = undoubled(lines);
        monitor.warn(fmt::format("{}: every second line is empty and is left out", file));
    }
    const std::ptrdiff_t first = head_of(lines).value_or(0);
    if (first > 0) {
        lines.erase(lines.begin(), lines.begin() + first);
        monitor.warn(
            fmt::format("{}: the file begins in line {}; the lines before it are left out", file, first + 1));
    } else if (first < 0) {
        lines.insert(lines.begin(), TextLine{});
        monitor.warn(fmt::format("{}: the first line, the manufacturer, is missing", file));
    }
    return lines;
}

LdtValues::LdtValues(std::vector<TextLine> lines, std::string file)
    : lines_(std::move(lines)), file_(std::move(file)) {
    for (std::size_t i = kTextLines; i < lines_.size() && !points_; ++i) {
        const std::string_view word = trimmed(lines_[i].text);
        points_ = word.find('.') != std::string_view::npos && number_of(word);
    }
}

std::string_view LdtValues::text(std::string_view what) {
    if (next_ == lines_.size()) {
        const int last = lines_.empty() ? 0 : lines_.back().number;
        throw InputError({file_}, fmt::format("the file ends after line {}; expected {}", last, what));
    }
    return trimmed(lines_[next_++].text);
}

double LdtValues::number(std::string_view what, double least, double most, std::optional<double> empty) {
    const std::string_view word = text(what);
    if (word.empty() && empty) return *empty;
    if (points_ && may_separate_thousands(word)) {
        input_error(place(),
                    "{} is \"{}\", whose comma may separate thousands or decimals, as other numbers of "
                    "the file have decimal points; expected a decimal point, or none",
                    what, shown_value(word));
    }
    const auto value = number_of(with_decimal_point(word));
    if (!value) input_error(place(), "{} is \"{}\"; expected a number", what, shown_value(word));
    if (!(*value >= least && *value <= most))
        input_error(place(), "{} is {:g}; expected {:g} to {:g}", what, *value, least, most);
    return *value;
}

int LdtValues::whole(std::string_view what, int least, int most) {
    const double value = number(what, least, most);
    if (value != std::floor(value)) input_error(place(), "{} is {:g}; expected a whole number", what, value);
    return static_cast<int>(value);
}

bool LdtValues::any_left() const {
    return std::any_of(lines_.begin() + static_cast<std::ptrdiff_t>(next_), lines_.end(),
                       [](const TextLine& line) { return trimmed(line.text).size() > 1; });
}

std::optional<LdtValues> LdtValues::words_left() const {
    constexpr std::string_view kSpace = " \t\v\f\x1a";
    LdtValues words({}, file_);
    words.points_ = points_;
    for (std::size_t i = next_; i < lines_.size(); ++i) {
        std::string_view rest = lines_[i].text;
        for (std::size_t at; (at = rest.find_first_not_of(kSpace)) != std::string_view::npos;) {
            rest.remove_prefix(at);
            const std::string_view word = rest.substr(0, rest.find_first_of(kSpace));
            if (!number_of(with_decimal_point(word))) return std::nullopt;
            words.lines_.push_back({word, lines_[i].number});
            rest.remove_prefix(word.size());
        }
    }
    return words;
}

}  // namespace lucerna
