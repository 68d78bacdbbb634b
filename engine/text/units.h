// What people type on a command line or into a description, read strictly: the whole word must be a value, in
// range, and finite; lengths carry their unit.
//
// Every function throws InputError "PLACE: "word" is not …; what is", where the place is an option's name or
// a line of a file.
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

// A length, greater than 0, in metres: a number and um, mm, cm or m. A bare number is refused: 40 of what?
double parse_length(const Location& at, std::string_view word);
// The same, with a sign and 0 allowed: a place along an axis.
double parse_place(const Location& at, std::string_view word);
// Parses a length in [least, most], in metres; a number without a unit counts in metres.
double parse_metres(const Location& at, std::string_view word, double least, double most);
// Two lengths, "20mmx10mm", in metres.
Imath::V2d parse_length_pair(const Location& at, std::string_view word);

// "640x480": two whole numbers, each in [1, most].
V2i parse_size(const Location& at, std::string_view word, int most);

// A length of time, greater than 0, in seconds: a number and s, min or h. A bare number is refused.
double parse_duration(const Location& at, std::string_view word);

// A share of 1: "0.99" or "99%". In (0, 1].
double parse_share(const Location& at, std::string_view word);

// "1,0.8,0.5": a linear colour, no part negative, not black; scaled to luminance 1.
Rgb parse_colour(const Location& at, std::string_view word);

// "key=value", both not empty.
std::pair<std::string, std::string> parse_assignment(const Location& at, std::string_view word);

// "1.27 mm", "39 mm", "1.2 m": for people.
std::string length_text(double metres);
// "<0.01 s", "0.42 s", "12 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);
// "2.3 %", "140 %": two digits, and never an exponent.
std::string percent_text(double share);
// "12.3 MB"
std::string bytes_text(double bytes);

}  // namespace lucerna
