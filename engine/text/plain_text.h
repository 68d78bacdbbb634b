// Text for a terminal. Names in scenes, file names and headers of images may hold anything; what a terminal
// would obey instead of showing it is written out.
#pragma once

#include <string>
#include <string_view>

namespace lucerna {

// Control characters, of ASCII but for line breaks and tabs, and of Unicode (U+0080 to U+009F), and bytes
// that are no UTF-8, become \xNN. All else stays as it is.
std::string plain_text(std::string_view text);

// A field of a CSV line (RFC 4180): in quotes where it has to be.
std::string csv_field(const std::string& text);

// A library's message with its line breaks folded away.
std::string one_line(std::string_view text);

// How many bytes at the end of `text` begin a character of UTF-8 that is not all there yet: 0 to 3.
std::size_t unfinished_bytes(std::string_view text);

}  // namespace lucerna
