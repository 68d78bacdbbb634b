#include "engine/text/plain_text.h"

#include <fmt/format.h>

#include <algorithm>

namespace lucerna {
namespace {

unsigned byte_at(std::string_view text, std::size_t at) {
    return static_cast<unsigned char>(text[at]);
}

// Returns the length of a character that begins with this byte, or 0 if none does.
std::size_t length_by(unsigned first) {
    if (first < 0x80) return 1;
    if (first >= 0xc2 && first < 0xe0) return 2;
    if (first >= 0xe0 && first < 0xf0) return 3;
    return first >= 0xf0 && first < 0xf5 ? 4 : 0;
}

// Returns the length of the character at the beginning, or 0 if the bytes there are not UTF-8.
std::size_t length_of(std::string_view text) {
    const std::size_t length = length_by(byte_at(text, 0));
    if (length > text.size()) return 0;
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte_at(text, i) & 0xc0U) != 0x80) return 0;
    }
    // Overlong forms, surrogates and code points beyond U+10FFFF are invalid; decoders treat them
    // differently.
    const unsigned second = length > 2 ? byte_at(text, 1) : 0;
    switch (length > 2 ? byte_at(text, 0) : 0) {
        case 0xe0:
            return second >= 0xa0 ? length : 0;
        case 0xed:
            return second < 0xa0 ? length : 0;
        case 0xf0:
            return second >= 0x90 ? length : 0;
        case 0xf4:
            return second < 0x90 ? length : 0;
        default:
            return length;
    }
}

bool is_obeyed(std::string_view character) {
    const unsigned first = byte_at(character, 0);
    if (character.size() == 1) return (first < 0x20 && first != '\n' && first != '\t') || first == 0x7f;
    return first == 0xc2 && byte_at(character, 1) < 0xa0;
}

}  // namespace

std::string plain_text(std::string_view text) {
    std::string plain;
    plain.reserve(text.size());
    while (!text.empty()) {
        const std::size_t length = length_of(text);
        const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
        if (length == 0 || is_obeyed(character)) {
            for (std::size_t i = 0; i < character.size(); ++i)
                plain += fmt::format("\\x{:02x}", byte_at(character, i));
        } else {
            plain += character;
        }
        text.remove_prefix(character.size());
    }
    return plain;
}

std::size_t unfinished_bytes(std::string_view text) {
    for (std::size_t back = 1; back <= std::min<std::size_t>(3, text.size()); ++back) {
        const unsigned byte = byte_at(text, text.size() - back);
        if ((byte & 0xc0U) == 0x80) continue;
        return length_by(byte) > back ? back : 0;
    }
    return 0;
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"') quoted += c;
        quoted += c;
    }
    return quoted + '"';
}

std::vector<std::string> csv_fields(std::string_view line) {
    std::vector<std::string> fields(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        const bool is_doubled = quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"';
        if (c == '"' && !is_doubled) {
            quoted = !quoted;
        } else if (c == ',' && !quoted) {
            fields.emplace_back();
        } else {
            fields.back() += c;
            i += is_doubled ? 1 : 0;
        }
    }
    for (std::string& field : fields) field = std::string(trimmed(field));
    return fields;
}

std::string one_line(std::string_view text) {
    std::string folded;
    for (const char c : text) {
        if (c == '\n' || c == '\r') {
            if (!folded.empty() && folded.back() != ' ') folded += ' ';
        } else {
            folded += c;
        }
    }
    while (!folded.empty() && folded.back() == ' ') folded.pop_back();
    return folded;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kSpace = " \t\v\f\r\n";
    const std::size_t first = text.find_first_not_of(kSpace);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::string_view without_byte_order_mark(std::string_view text) {
    constexpr std::string_view kMark = "\xef\xbb\xbf";
    return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return lower;
}

}  // namespace lucerna
