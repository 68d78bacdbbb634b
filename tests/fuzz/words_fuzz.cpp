// libFuzzer's entry to typed words: each line is a word of a command line, read as a number, length, time,
// size, colour, viewer address and setting. It gives a value in its range or an InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>

#include "engine/integrators/settings.h"
#include "engine/render/display/connection.h"
#include "engine/text/units.h"
#include "tests/fuzz/input.h"

using namespace lucerna;
using lucerna::testing::require;
using lucerna::testing::require_one_line;

namespace {

const Location kHere{"--option"};
constexpr double kMost = std::numeric_limits<double>::max();

template <typename Parse>
void try_word(Parse&& parse) {
    try {
        parse();
    } catch (const InputError& error) {
        require_one_line(error);
    }
}

void read_numbers(const std::string& word) {
    try_word([&] {
        const double value = parse_number(kHere, word, -60, 60);
        require(value >= -60 && value <= 60, "a number out of range");
    });
    try_word([&] {
        const std::int64_t value = parse_whole(kHere, word, 1, 1 << 24);
        require(value >= 1 && value <= 1 << 24, "a whole number out of range");
    });
    try_word([&] { parse_seed(kHere, word); });
    try_word([&] {
        const double value = parse_share(kHere, word);
        require(value > 0 && value <= 1, "no share");
    });
}

void read_measures(const std::string& word) {
    try_word([&] {
        const double value = parse_length(kHere, word);
        require(value > 0 && value <= kMost, "no length");
    });
    try_word([&] { require(std::isfinite(parse_place(kHere, word)), "no place"); });
    try_word([&] { require(parse_length_pair(kHere, word).x > 0, "no pair of lengths"); });
    try_word([&] {
        const double value = parse_duration(kHere, word);
        require(value > 0 && value <= kMost, "no time");
    });
    try_word([&] {
        const V2i size = parse_size(kHere, word, 65536);
        require(size.x >= 1 && size.y >= 1 && size.x <= 65536 && size.y <= 65536, "no size");
    });
    try_word([&] { require(is_finite(parse_colour(kHere, word)), "no colour"); });
}

void read_others(const std::string& word) {
    try_word([&] {
        const Endpoint to = parse_endpoint(kHere, word, 14158);
        require(to.port > 0 && to.port <= 65535, "no port");
    });
    try_word([&] {
        const auto [key, value] = parse_assignment(kHere, word);
        require(!key.empty() && !value.empty(), "half an assignment");
        for (const std::string_view name : integrator_names()) {
            try_word([&, &key = key, &value = value] {
                IntegratorSettings settings = make_settings(name, kHere);
                set_parameter(settings, key, parse_setting(value), kHere);
            });
        }
    });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
    for (std::string word; std::getline(lines, word);) {
        read_numbers(word);
        read_measures(word);
        read_others(word);
    }
    return 0;
}
