// Scene text in pieces: words, quoted strings, numbers and brackets, each with its place.
//
// Works on the text in memory and copies nothing: a token is a view into its Source, and a place is an offset
// that becomes file:line:column only when a message needs it. Lines and columns count from 1, columns in
// bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"

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

    // What pbrt takes although it is not well formed, as it was met: the reader says it.
    struct Oddity {
        std::size_t offset;
        std::string what, instead;
        std::uint64_t times = 1;
    };
    void note(std::size_t offset, std::string what, std::string_view instead) const;
    // Those since the last question.
    std::vector<Oddity> take_oddities() const { return std::exchange(oddities_, {}); }

  private:
    // Different ones between two questions; others are passed over in silence.
    static constexpr std::size_t kMostOddities = 64;

    std::string name_, text_;
    // Where the last question ended, so that many warnings in a large file cost one walk through it.
    mutable std::size_t known_offset_ = 0, known_line_start_ = 0;
    mutable int known_line_ = 1;
    mutable std::vector<Oddity> oddities_;
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
    void skip_stray();
    void advance();
    void reserve_rest(std::vector<double>& out, std::size_t bytes) const;
    Token scan_string();

    const Source* source_;
    const char* begin_;
    const char* at_;
    const char* end_;
    Token token_;
};

// The value of a number token; throws InputError for what does not begin with one. What stands behind the
// number is left out, and what is not finite becomes so, each with a note in the source.
double number_value(std::string_view text, const Place& at);
// Whether the word is one of those that stand for what is no finite number: nan, inf, infinity.
bool names_a_number(std::string_view word);
// A string token's text with \" \\ \' \n \t \r \b and \f resolved; any other \ stays, with a note.
std::string string_value(const Token& token, const Place& at);
// Text fit for a message: in one line, printable, no longer than some forty characters.
std::string shown(std::string_view text);
// At full length, without control characters: for messages that quote a file's name.
std::string printable(std::string_view text);

// What the scene's text says cannot be taken. Where pbrt renders the rest of the scene, so does the reader
//, which catches these around single directives.
class TextError : public InputError {
  public:
    TextError(const Place& at, const std::string& message)
        : InputError(at.location(), message), place_(at), message_(message) {}
    const Place& place() const { return place_; }
    const std::string& message() const { return message_; }  // without the place

  private:
    Place place_;
    std::string message_;
};

// "file:line:column: message".
template <typename... Args>
[[noreturn]] void fail(const Place& at, fmt::format_string<Args...> format, Args&&... args) {
    throw TextError(at, fmt::format(format, std::forward<Args>(args)...));
}

// The same for what no leniency mends: a file that is missing or broken, and what is none of pbrt's.
template <typename... Args>
[[noreturn]] void fail_always(const Place& at, fmt::format_string<Args...> format, Args&&... args) {
    throw InputError(at.location(), fmt::format(format, std::forward<Args>(args)...));
}

// How strictly scene text is taken.
//
// What pbrt renders is rendered. Where this reader is stricter than pbrt, or lacks something, the scene is
// rendered all the same, and one warning says where, what is taken instead and what is lost; a strict reader
// refuses instead. Warnings that differ in nothing but their place are said once and counted.

class Leniency {
  public:
    Leniency(Monitor& monitor, bool strict) : monitor_(monitor), strict_(strict) {}

    // The text says `what`, which is not to be had here; `instead` is done, and `lost` by that (empty:
    // nothing that shows). Throws TextError if strict.
    void depart(const Place& at, std::string_view what, std::string_view instead, std::string_view lost = {});
    // What is no departure from the text: pbrt does the same.
    void warn(const Place& at, std::string_view message);
    // How often each warning came again; forgets them.
    void sum_up();

    bool strict() const { return strict_; }

  private:
    struct Said {
        std::string text;  // without its place
        Place first;
        std::uint64_t times = 1;
    };
    static constexpr std::size_t kDistinct = 1000;  // said; a flood of others is only counted

    Monitor& monitor_;
    bool strict_;
    std::vector<Said> said_;
    std::uint64_t unsaid_ = 0;
    std::map<std::string, std::size_t, std::less<>> index_;  // in said_, by text
};

}  // namespace lucerna
