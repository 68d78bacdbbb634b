#include "tests/mutations/mutation.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

namespace lucerna::testing {
namespace {

using Random = std::mt19937_64;  // its numbers are standardised, unlike those of std's distributions

std::size_t below(Random& random, std::size_t count) {
    return count == 0 ? 0 : static_cast<std::size_t>(random() % count);
}

// Returns a random range [begin, begin + length) of the text, of at most `most` characters.
std::pair<std::size_t, std::size_t> stretch(Random& random, const std::string& text, std::size_t most) {
    const std::size_t begin = below(random, text.size() + 1);
    return {begin, below(random, std::min(most, text.size() - begin) + 1)};
}

void flip_bits(Random& random, std::string& text) {
    for (std::size_t i = 0, flips = 1 + below(random, 8); i < flips && !text.empty(); ++i) {
        char& c = text[below(random, text.size())];
        c = static_cast<char>(static_cast<unsigned char>(c) ^ (1U << below(random, 8)));
    }
}

void overwrite_bytes(Random& random, std::string& text) {
    constexpr std::array<unsigned char, 8> kOdd{0, 1, '\n', '"', 0x7F, 0x80, 0xFE, 0xFF};
    const auto [begin, length] = stretch(random, text, 16);
    for (std::size_t i = begin; i < begin + length; ++i) {
        const bool odd = below(random, 2) == 0;
        text[i] = static_cast<char>(odd ? kOdd[below(random, kOdd.size())] : below(random, 256));
    }
}

void cut_off(Random& random, std::string& text) {
    text.resize(below(random, text.size() + 1));
}

void insert_bytes(Random& random, std::string& text) {
    std::string more(1 + below(random, 64), '\0');
    for (char& c : more) c = static_cast<char>(below(random, 256));
    text.insert(below(random, text.size() + 1), more);
}

void remove_bytes(Random& random, std::string& text) {
    const auto [begin, length] = stretch(random, text, 64);
    text.erase(begin, length);
}

void duplicate_bytes(Random& random, std::string& text) {
    const auto [begin, length] = stretch(random, text, 256);
    text.insert(below(random, text.size() + 1), text.substr(begin, length));
}

// Overwrites a binary count, offset or number with an extreme value.
void overwrite_word(Random& random, std::string& text) {
    static const std::array<std::uint64_t, 12> kWords{0,
                                                      1,
                                                      0x7F,
                                                      0xFFFF,
                                                      0x7FFFFFFF,
                                                      0x80000000,
                                                      0xFFFFFFFF,
                                                      0x7FFFFFFFFFFFFFFF,
                                                      0xFFFFFFFFFFFFFFFF,
                                                      0x7FC00000,           // a float32 NaN
                                                      0x7F800000,           // infinity
                                                      0x7FF0000000000000};  // of double
    const std::size_t bytes = std::size_t{2} << below(random, 3);
    if (text.size() < bytes) return;
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), &kWords[below(random, kWords.size())], 8);
    if (below(random, 2) == 0) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(bytes));
    // Most words are aligned to their size.
    std::size_t at = below(random, text.size() - bytes + 1);
    if (below(random, 2) == 0) at -= at % bytes;
    std::copy_n(raw.begin(), bytes, text.begin() + static_cast<std::ptrdiff_t>(at));
}

constexpr std::size_t kDeepest =
    50'000;  // levels, of which each takes some hundred bytes of a stack of 8 MiB

bool in_number(char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '+';
}

// Replaces a decimal number by another one or by an invalid one.
void substitute_number(Random& random, std::string& text) {
    static constexpr std::array<std::string_view, 24> kNumbers{"0",
                                                               "-0",
                                                               "-1",
                                                               "1",
                                                               "2147483647",
                                                               "2147483648",
                                                               "4294967295",
                                                               "4294967296",
                                                               "-2147483649",
                                                               "1e38",
                                                               "1e39",
                                                               "-1e308",
                                                               "1e400",
                                                               "-1e400",
                                                               "1e-400",
                                                               "nan",
                                                               "inf",
                                                               "-inf",
                                                               "",
                                                               "--5",
                                                               "0x10",
                                                               "1e",
                                                               "99999999999999999999999",
                                                               "1000000"};
    std::size_t at = below(random, text.size() + 1);
    while (at < text.size() && !in_number(text[at])) ++at;
    while (at > 0 && at < text.size() && in_number(text[at - 1])) --at;
    std::size_t end = at;
    while (end < text.size() && in_number(text[end])) ++end;
    if (end > at) text.replace(at, end - at, kNumbers[below(random, kNumbers.size())]);
}

// Repeats one line many times, which tests nesting and uniqueness.
void repeat_line(Random& random, std::string& text) {
    const std::size_t at = below(random, text.size() + 1);
    const std::size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
    const std::size_t begin = before == std::string::npos ? 0 : before + 1;
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string line = text.substr(begin, std::min<std::size_t>(end - begin, 512)) + "\n";
    // Some repeat so often that recursion once per line overflows the stack.
    const std::size_t most = below(random, 8) == 0 ? kDeepest : 200;
    std::string more;
    for (std::size_t i = 0, times = 1 + below(random, most); i < times; ++i) more += line;
    text.insert(begin, more);
}

// Repeats an opening bracket, and sometimes its closing one, deeper than any stack.
void nest(Random& random, std::string& text) {
    constexpr std::string_view kOpening = "[{(.\"'";
    std::size_t at = below(random, text.size() + 1);
    at = text.find_first_of(kOpening, at);
    if (at == std::string::npos) at = text.find_first_of(kOpening);
    if (at == std::string::npos) return;
    // The repeated piece runs from a few letters before the bracket to a few behind it: "a.", "[", "{\"a\":".
    const std::size_t begin = at - std::min(at, below(random, 3));
    const std::string piece = text.substr(begin, at - begin + 1 + below(random, 6));
    std::string more;
    for (std::size_t i = 0, times = 1 + below(random, kDeepest); i < times; ++i) more += piece;
    text.insert(begin, more);
}

void swap_stretches(Random& random, std::string& text) {
    const auto [a, first] = stretch(random, text, 64);
    const auto [b, second] = stretch(random, text, 64);
    for (std::size_t i = 0; i < std::min(first, second); ++i) std::swap(text[a + i], text[b + i]);
}

struct Kind {
    const char* name;
    void (*mutate)(Random&, std::string&);
};
constexpr std::array<Kind, 11> kKinds{{{"bits flipped", flip_bits},
                                       {"bytes overwritten", overwrite_bytes},
                                       {"cut off", cut_off},
                                       {"bytes put in", insert_bytes},
                                       {"bytes taken out", remove_bytes},
                                       {"bytes doubled", duplicate_bytes},
                                       {"a word overwritten", overwrite_word},
                                       {"a number replaced", substitute_number},
                                       {"a line repeated", repeat_line},
                                       {"stretches swapped", swap_stretches},
                                       {"nested deep", nest}}};
constexpr std::size_t kSplice = kKinds.size();       // the head of one file and the tail of another
constexpr std::size_t kSeveral = kKinds.size() + 1;  // of the above
constexpr std::size_t kAll = kKinds.size() + 2;

}  // namespace

Mutation::Mutation(std::vector<std::string> whole, std::uint64_t seed)
    : whole_(std::move(whole)), seed_(seed) {}

std::string Mutation::name(std::uint64_t number) {
    const std::size_t kind = number % kAll;
    return kind < kKinds.size() ? kKinds[kind].name : kind == kSplice ? "two files spliced" : "several";
}

std::string Mutation::input(std::uint64_t number) const {
    Random random(seed_ * 0x9E3779B97F4A7C15U + number);
    const std::size_t kind = number % kAll;
    // Every kind is applied to every file.
    std::string text = whole_[number / kAll % whole_.size()];
    if (kind == kSplice) {
        const std::string& other = whole_[below(random, whole_.size())];
        const std::size_t at = below(random, std::min(text.size(), other.size()) + 1);
        // Half of the tails keep their offset; the others start anywhere.
        const std::size_t from = below(random, 2) == 0 ? at : below(random, other.size() + 1);
        return text.substr(0, at) + other.substr(from);
    }
    const std::size_t times = kind == kSeveral ? 2 + below(random, 6) : 1;
    for (std::size_t i = 0; i < times; ++i) {
        const Kind& one = kKinds[kind == kSeveral ? below(random, kKinds.size()) : kind];
        one.mutate(random, text);
    }
    return text;
}

}  // namespace lucerna::testing
