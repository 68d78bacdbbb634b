// Scene text in pieces: words, quoted strings, numbers and brackets, each with its place.
//
// Works on the text in memory and copies nothing: a token is a view into its Source, and a place is an offset
// that becomes file:line:column only when a message needs it. Lines and columns count from 1, columns in
// bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

// One file of scene text. Tokens and places point into it: it must neither move nor die before them.
class Source {
  public:
    Source(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {}
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;

    const std::string& name() const { return name_; }
    std::string_view text() const { return text_; }
    Location location(std::size_t offset) const;

  private:
    std::string name_, text_;
    // Where the last question ended, so that many warnings in a large file cost one walk through it.
    mutable std::size_t known_offset_ = 0, known_line_start_ = 0;
    mutable int known_line_ = 1;
};

// A place in scene text, or none (for what does not come from a file).
struct Place {
    const Source* source = nullptr;
    std::size_t offset = 0;

    Location location() const { return source ? source->location(offset) : Location{"scene"}; }
};

struct Token {
    enum class Kind : std::uint8_t { end, word, string, number, open, close };
    Kind kind = Kind::end;
    std::string_view text;   // without the quotes of a string
    std::size_t offset = 0;  // of its first character, quotes included
};

class Tokens {
  public:
    // Starts at `offset`, which is 0 or that of a token.
    explicit Tokens(const Source& source, std::size_t offset = 0);

    const Token& peek() const { return token_; }
    Token next() {
        Token token = token_;
        advance();
        return token;
    }
    Place place(const Token& token) const { return {source_, token.offset}; }
    Place place() const { return place(token_); }

    // Appends the numbers that follow, up to the first token that is none. This is the fast way through a
    // mesh.
    void read_numbers(std::vector<double>& out);

  private:
    static constexpr std::size_t kSample = 256;  // numbers after which the rest of a list is guessed

    void skip_space();
    void advance();
    void reserve_rest(std::vector<double>& out, std::size_t bytes) const;
    Token scan_string();

    const Source* source_;
    const char* begin_;
    const char* at_;
    const char* end_;
    Token token_;
};

// The value of a number token; throws InputError for one that is malformed or too large for a double.
double number_value(std::string_view text, const Place& at);
// A string token's text with \" \\ \n \t and \r resolved.
std::string string_value(const Token& token, const Place& at);
// Text fit for a message: in one line, printable, no longer than some forty characters.
std::string shown(std::string_view text);
// At full length, without control characters: for messages that quote a file's name.
std::string printable(std::string_view text);

// "file:line:column: message".
template <typename... Args>
[[noreturn]] void fail(const Place& at, fmt::format_string<Args...> format, Args&&... args) {
    throw InputError(at.location(), fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace lucerna
