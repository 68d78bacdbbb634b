// Makes text safe for a terminal. Names in scenes, file names and headers of images may contain anything, and
// a terminal would obey control characters instead of showing them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

// Replaces control characters of ASCII except line breaks and tabs, those of Unicode (U+0080 to U+009F), and
// bytes that are not UTF-8, by \xNN.
std::string plain_text(std::string_view text);

// Returns a field of a CSV line (RFC 4180), in quotes where they are necessary.
std::string csv_field(const std::string& text);
// Returns the fields of a CSV line (RFC 4180) without line breaks in fields, each without white space at its
// ends.
std::vector<std::string> csv_fields(std::string_view line);

// Returns a library's message with spaces in place of line breaks.
std::string one_line(std::string_view text);

// Returns the text without white space at both ends.
std::string_view trimmed(std::string_view text);

// Returns the text without the byte order mark of UTF-8 with which some editors begin a file.
std::string_view without_byte_order_mark(std::string_view text);

// Returns the text with its ASCII letters in lower case.
std::string lower_case(std::string_view text);

// Returns the number of bytes, 0 to 3, at the end of `text` that begin an incomplete character of UTF-8.
std::size_t unfinished_bytes(std::string_view text);

}  // namespace lucerna
