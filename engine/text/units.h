// Reads values that people type on a command line or in a description, strictly: the whole word must be a
// value that is finite and in range, and lengths have a unit.
//
// Every parse function throws InputError "PLACE: "word" is not …; expected …", where the place is the name of
// an option or a line of a file.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/vec.h"

namespace lucerna {

double parse_number(const Location& at, std::string_view word, double least, double most);
std::int64_t parse_whole(const Location& at, std::string_view word, std::int64_t least, std::int64_t most);
std::uint64_t parse_seed(const Location& at, std::string_view word);

// Parses a length greater than 0, in metres: a number with um, mm, cm or m. A bare number is refused.
double parse_length(const Location& at, std::string_view word);
// Parses a position along an axis, in metres, which may be negative or "0".
double parse_place(const Location& at, std::string_view word);
// Parses a length in [least, most], in metres; a number without a unit counts in metres.
double parse_metres(const Location& at, std::string_view word, double least, double most);
// Parses two lengths, "20mmx10mm", in metres.
Imath::V2d parse_length_pair(const Location& at, std::string_view word);

// Parses two whole numbers, "640x480", each in [1, most].
V2i parse_size(const Location& at, std::string_view word, int most);

// Parses a time greater than 0, in seconds: a number with s, min or h. A bare number is refused.
double parse_duration(const Location& at, std::string_view word);

// Parses a share in (0, 1]: "0.99" or "99%".
double parse_share(const Location& at, std::string_view word);

// Parses a linear colour, "1,0.8,0.5", without negative components and not black. Scales it to luminance 1.
Rgb parse_colour(const Location& at, std::string_view word);

// Parses "key=value", where neither is empty.
std::pair<std::string, std::string> parse_assignment(const Location& at, std::string_view word);

// Formats a length for people: "1.27 mm", "39 mm", "1.2 m".
std::string length_text(double metres);
// Formats a time: "<0.01 s", "0.42 s", "12 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);
// Formats a share to two digits or whole percent, without an exponent: "2.3 %", "140 %".
std::string percent_text(double share);
// Formats a number of bytes with three digits: "12.3 MB".
std::string bytes_text(double bytes);

}  // namespace lucerna
