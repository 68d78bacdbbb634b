#include "engine/pbrt/tokens.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "engine/base/float_traps.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

bool is_space(char c) {
    return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}
bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
bool starts_number(char c) {
    return is_digit(c) || c == '-' || c == '+' || c == '.';
}
// Tells whether a character may follow a number or word without a blank.
bool ends_token(char c) {
    return is_space(c) || c == '[' || c == ']' || c == '"' || c == '#' || c == ',' || c == ';';
}
bool starts_token(char c) {
    return c == '[' || c == ']' || c == '"' || c == '#' || starts_number(c) || is_letter(c);
}

const char* word_end(const char* at, const char* end) {
    while (at != end && (is_letter(*at) || is_digit(*at))) ++at;
    return at;
}

// Recognises 1.#QNAN, -1.#IND, 1.#INF and the like, numbers as some compilers print them.
bool is_special_number(const char* hash, const char* end) {
    const std::string_view rest(hash, static_cast<std::size_t>(end - hash));
    for (const std::string_view name : {"#QNAN", "#SNAN", "#IND", "#INF"}) {
        if (rest.starts_with(name)) return true;
    }
    return false;
}

const char* number_end(const char* at, const char* end) {
    while (at != end && (!ends_token(*at) || (*at == '#' && is_special_number(at, end)))) ++at;
    return at;
}

// Handles the common case of number_value: no leading '+', in range. Returns null otherwise.
const char* parse_plain(const char* at, const char* end, double& value) {
    const auto [rest, error] = std::from_chars(at, end, value);
    const bool whole = error == std::errc() && (rest == end || (ends_token(*rest) && *rest != '#'));
    return whole && std::isfinite(value) ? rest : nullptr;
}

}  // namespace

Location Source::location(std::size_t offset) const {
    offset = std::min(offset, text_.size());
    if (offset < known_offset_) {
        known_offset_ = known_line_start_ = 0;
        known_line_ = 1;
    }
    for (; known_offset_ < offset; ++known_offset_) {
        const bool lone_return = text_[known_offset_] == '\r' &&
                                 (known_offset_ + 1 == text_.size() || text_[known_offset_ + 1] != '\n');
        if (text_[known_offset_] == '\n' || lone_return) {
            ++known_line_;
            known_line_start_ = known_offset_ + 1;
        }
    }
    return {name_, known_line_, static_cast<int>(offset - known_line_start_) + 1};
}

void Source::note(std::size_t offset, std::string what, std::string_view instead) const {
    const auto same = [&](const Oddity& oddity) { return oddity.what == what && oddity.instead == instead; };
    const auto known = std::ranges::find_if(oddities_, same);
    if (known != oddities_.end()) {
        ++known->times;
    } else if (oddities_.size() < kMostOddities) {
        oddities_.push_back({offset, std::move(what), std::string(instead)});
    }
}

Tokens::Tokens(const Source& source, std::size_t offset)
    : source_(&source),
      begin_(source.text().data()),
      at_(begin_ + offset),
      end_(begin_ + source.text().size()) {
    constexpr std::string_view mark = "\xEF\xBB\xBF";  // UTF-8's byte order mark, which some editors write
    if (offset == 0 && source.text().starts_with(mark)) at_ += mark.size();
    advance();
}

void Tokens::skip_space() {
    while (at_ != end_) {
        if (is_space(*at_)) {
            ++at_;
        } else if (*at_ == '#') {
            while (at_ != end_ && *at_ != '\n' && *at_ != '\r') ++at_;
        } else {
            return;
        }
    }
}

// Skips characters that begin no token, as versions 1 and 2 do with a message.
void Tokens::skip_stray() {
    skip_space();
    while (at_ != end_ && !starts_token(*at_)) {
        const char* const first = at_;
        while (at_ != end_ && !starts_token(*at_) && !is_space(*at_)) ++at_;
        source_->note(
            static_cast<std::size_t>(first - begin_),
            fmt::format("unexpected character '{}'; a directive, string, number or bracket is expected",
                        shown({first, 1})),
            "it is left out");
        skip_space();
    }
}

void Tokens::advance() {
    skip_stray();
    const auto offset = static_cast<std::size_t>(at_ - begin_);
    if (at_ == end_) {
        token_ = {Token::Kind::end, {}, offset};
    } else if (*at_ == '"') {
        token_ = scan_string();
    } else if (*at_ == '[' || *at_ == ']') {
        token_ = {*at_ == '[' ? Token::Kind::open : Token::Kind::close, {at_, 1}, offset};
        ++at_;
    } else {
        const bool word = is_letter(*at_);
        const char* rest = word ? word_end(at_, end_) : number_end(at_, end_);
        // Some compilers print nan(ind).
        const bool names = word && rest != end_ && *rest == '(';
        if (names && names_a_number({at_, static_cast<std::size_t>(rest - at_)}))
            rest = number_end(rest, end_);
        token_ = {word ? Token::Kind::word : Token::Kind::number,
                  {at_, static_cast<std::size_t>(rest - at_)},
                  offset};
        at_ = rest;
    }
}

Token Tokens::scan_string() {
    const auto offset = static_cast<std::size_t>(at_ - begin_);
    const char* first = ++at_;
    for (; at_ != end_ && *at_ != '"' && *at_ != '\n'; ++at_) {
        if (*at_ == '\\' && at_ + 1 != end_ && at_[1] != '\n') ++at_;
    }
    const std::string_view text(first, static_cast<std::size_t>(at_ - first));
    if (at_ == end_ || *at_ == '\n') {
        fail({source_, offset}, "the string \"{}\" has no closing quote on its line", shown(text));
    }
    ++at_;
    return {Token::Kind::string, text, offset};
}

// Avoids copies of a long list that outgrows its memory. The guess assumes that the list ends at the next
// bracket (or later, behind a comment with one) and that its numbers are about as dense as the first ones,
// which are `bytes` long. Reserves at most one number per two bytes, the shortest that numbers can be.
void Tokens::reserve_rest(std::vector<double>& out, std::size_t bytes) const {
    const auto left = static_cast<std::size_t>(end_ - at_);
    const void* bracket = std::memchr(at_, ']', left);
    const std::size_t rest =
        bracket ? static_cast<std::size_t>(static_cast<const char*>(bracket) - at_) : left;
    // bytes > 0, as it spans kSample numbers.
    const double guess =
        1.05 * static_cast<double>(kSample) / static_cast<double>(bytes) * static_cast<double>(rest);
    const std::size_t more = std::min(rest / 2 + 1, static_cast<std::size_t>(guess));
    require_memory(bytes_of(more, sizeof(double)),
                   fmt::format("{}: a list of about {} numbers", to_string(place().location()), more),
                   "use a shorter one");
    out.reserve(out.size() + more);
}

void Tokens::read_numbers(std::vector<double>& out) {
    // Invariant: token_ is the number to take next, and at_ is behind it.
    if (token_.kind != Token::Kind::number) return;
    const char* const first = token_.text.data();
    out.push_back(number_value(token_.text, place()));
    for (std::size_t taken = 1;; ++taken) {
        if (taken == kSample) reserve_rest(out, static_cast<std::size_t>(at_ - first));
        skip_space();
        double value = 0;
        const char* rest = at_ != end_ && starts_number(*at_) ? parse_plain(at_, end_, value) : nullptr;
        if (rest) {
            at_ = rest;
        } else {
            advance();
            if (token_.kind != Token::Kind::number) return;
            value = number_value(token_.text, place());
        }
        out.push_back(value);
    }
}

namespace {

// Reads an irregular number as far as it goes, as version 3 does.
double odd_number_value(std::string_view text, const Place& at) {
    constexpr double kLargest = std::numeric_limits<double>::max();
    const std::string whole(text);
    char* rest = nullptr;
    const FloatTraps none(kNoFaults);  // strtod reports by overflow
    double value = std::strtod(whole.c_str(), &rest);
    if (rest == whole.c_str()) fail(at, "{} is not a number", shown(text));
    const std::string_view behind(rest);
    if (behind.starts_with("#INF")) {
        value = whole.starts_with('-') ? -HUGE_VAL : HUGE_VAL;
    } else if (behind.starts_with('#')) {
        value = NAN;
    } else if (!behind.empty() && !std::isnan(value)) {
        at.source->note(at.offset, fmt::format("{} is not a number", shown(text)),
                        fmt::format("{:g} is used", value));
        return std::clamp(value, -kLargest, kLargest);
    }
    if (std::isfinite(value)) return value;  // at most too small for a double: the nearest one, possibly 0
    const double taken = std::isnan(value) ? 0 : std::copysign(kLargest, value);
    at.source->note(at.offset, fmt::format("{} is not a finite number", shown(text)),
                    fmt::format("{:.2g} is used", taken));
    return taken;
}

}  // namespace

double number_value(std::string_view text, const Place& at) {
    double value = 0;
    const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
    const char* end = digits.data() + digits.size();
    const auto [rest, error] = std::from_chars(digits.data(), end, value);
    const bool two_signs = digits.size() < text.size() && digits.starts_with('-');  // from_chars takes no '+'
    if (error == std::errc() && rest == end && !two_signs && std::isfinite(value)) return value;
    return odd_number_value(text, at);
}

bool names_a_number(std::string_view word) {
    word = word.substr(0, word.find('('));
    return word == "nan" || word == "NaN" || word == "NAN" || word == "inf" || word == "Inf" ||
           word == "INF" || word == "infinity" || word == "Infinity";
}

std::string string_value(const Token& token, const Place& at) {
    std::string value;
    value.reserve(token.text.size());
    for (std::size_t i = 0; i < token.text.size(); ++i) {
        if (token.text[i] != '\\') {
            value += token.text[i];
            continue;
        }
        constexpr std::string_view from = "\"\\'ntrbf", to = "\"\\'\n\t\r\b\f";
        ++i;  // in range, as the scanner takes a backslash together with the next character
        const std::size_t which = i < token.text.size() ? from.find(token.text[i]) : from.npos;
        if (which != from.npos) {
            value += to[which];
            continue;
        }
        at.source->note(
            at.offset + i,
            fmt::format("\\{} is not an escape sequence; expected \\\" \\\\ \\' \\n \\t \\r \\b \\f",
                        shown(token.text.substr(i, 1))),
            "it is read literally");
        value += token.text.substr(i - 1, 2);
    }
    return value;
}

std::string shown(std::string_view text) {
    constexpr std::size_t kMost = 40;
    std::string result;
    for (const char c : text.substr(0, kMost)) {
        result += c >= 0x20 && c < 0x7f ? std::string(1, c)
                                        : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
    return result + (text.size() > kMost ? "..." : "");
}

std::string printable(std::string_view text) {
    std::string result;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        result += byte >= 0x20 && byte != 0x7f ? std::string(1, c) : fmt::format("\\x{:02x}", byte);
    }
    return result;
}

void Leniency::warn_or_refuse(const Place& at, std::string_view what, std::string_view instead,
                              std::string_view lost) {
    if (strict_) throw TextError(at, std::string(what));
    const std::string loss = lost.empty() ? "" : fmt::format("; lost: {}", lost);
    warn(at, fmt::format("{}; {}{}", what, instead, loss));
}

void Leniency::warn(const Place& at, std::string_view message) {
    const auto known = index_.find(message);
    if (known != index_.end()) {
        ++said_[known->second].times;
        return;
    }
    if (said_.size() >= kDistinct) {
        ++unsaid_;
        return;
    }
    index_.emplace(message, said_.size());
    said_.push_back({std::string(message), at});
    monitor_.warn(fmt::format("{}: {}", to_string(at.location()), message));
}

void Leniency::sum_up() {
    for (const Said& said : said_) {
        if (said.times < 2) continue;
        monitor_.warn(fmt::format("{}: {}: and {} more like this", to_string(said.first.location()),
                                  said.text, said.times - 1));
    }
    if (unsaid_ > 0)
        monitor_.warn(fmt::format("{} more warnings about the scene's text are not shown", unsaid_));
    unsaid_ = 0;
    said_.clear();
    index_.clear();
}

}  // namespace lucerna
