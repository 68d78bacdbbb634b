// Splits scene text into words, quoted strings, numbers and brackets, each with its place.
//
// It works on the text in memory without copies. A token is a view into its Source, and a place is an offset
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

// One file of scene text. Tokens and places point into it, so it must not move and must outlive them.
class Source {
  public:
    Source(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {}
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;

    const std::string& name() const { return name_; }
    std::string_view text() const { return text_; }
    Location location(std::size_t offset) const;

    // Malformed text that pbrt accepts, in the order met; the reader reports it.
    struct Oddity {
        std::size_t offset;
        std::string what, instead;
        std::uint64_t times = 1;
    };
    void note(std::size_t offset, std::string what, std::string_view instead) const;
    // Returns the oddities since the last call.
    std::vector<Oddity> take_oddities() const { return std::exchange(oddities_, {}); }

  private:
    // Limits the distinct oddities between two calls; further ones are dropped silently.
    static constexpr std::size_t kMostOddities = 64;

    std::string name_, text_;
    // Where the last query ended, so that many warnings in a large file cost one scan of it.
    mutable std::size_t known_offset_ = 0, known_line_start_ = 0;
    mutable int known_line_ = 1;
    mutable std::vector<Oddity> oddities_;
};

// A place in scene text, or none for anything that does not come from a file.
struct Place {
    const Source* source = nullptr;
    std::size_t offset = 0;

    Location location() const { return source ? source->location(offset) : Location{"scene"}; }
};

struct Token {
    enum class Kind : std::uint8_t { end, word, string, number, open, close };
    Kind kind = Kind::end;
    std::string_view text;   // without the quotes of a string
    std::size_t offset = 0;  // of the first character, quotes included
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

    // Appends the numbers that follow, up to the first token that is none. This is the fast path for meshes.
    void read_numbers(std::vector<double>& out);

  private:
    static constexpr std::size_t kSample = 256;  // numbers after which the length of a list is estimated

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

// Returns the value of a number token; throws InputError if it does not begin with one. Drops trailing text
// and makes values finite, each with a note in the source.
double number_value(std::string_view text, const Place& at);
// Tells whether the word stands for a number that is not finite: nan, inf, infinity.
bool names_a_number(std::string_view word);
// Returns a string token's text with \" \\ \' \n \t \r \b and \f resolved; any other \ stays, with a note.
std::string string_value(const Token& token, const Place& at);
// Returns text for a message: on one line, printable, some forty characters at most.
std::string shown(std::string_view text);
// Returns text at full length without control characters, for messages that quote a file's name.
std::string printable(std::string_view text);

// An error in the scene's text. Where pbrt renders the rest of the scene, so does the reader, which catches
// these errors around single directives.
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

// Throws TextError with the message "file:line:column: message".
template <typename... Args>
[[noreturn]] void fail(const Place& at, fmt::format_string<Args...> format, Args&&... args) {
    throw TextError(at, fmt::format(format, std::forward<Args>(args)...));
}

// Throws an error that leniency does not mend: a missing or broken file, or an error in Lucerna's own
// directives.
template <typename... Args>
[[noreturn]] void fail_always(const Place& at, fmt::format_string<Args...> format, Args&&... args) {
    throw InputError(at.location(), fmt::format(format, std::forward<Args>(args)...));
}

// Handles departures from pbrt.
//
// Whatever pbrt renders is rendered. Where this reader is stricter than pbrt or lacks something, the scene is
// rendered all the same, and one warning says where, what is used instead and what is lost; a strict reader
// rejects the text. Warnings that differ only in their place are reported once and counted.

class Leniency {
  public:
    Leniency(Monitor& monitor, bool strict) : monitor_(monitor), strict_(strict) {}

    // Reports that `what` the text says is not supported, that `instead` is done, and what is `lost` (empty:
    // nothing visible). Throws TextError if strict.
    void warn_or_refuse(const Place& at, std::string_view what, std::string_view instead,
                        std::string_view lost = {});
    // Warns of behaviour that pbrt shares and that is no departure from the text.
    void warn(const Place& at, std::string_view message);
    // Reports how often each warning was repeated, and forgets them.
    void sum_up();

    bool strict() const { return strict_; }

  private:
    struct Said {
        std::string text;  // without its place
        Place first;
        std::uint64_t times = 1;
    };
    static constexpr std::size_t kDistinct = 1000;  // further warnings are only counted

    Monitor& monitor_;
    bool strict_;
    std::vector<Said> said_;
    std::uint64_t unsaid_ = 0;
    std::map<std::string, std::size_t, std::less<>> index_;  // indices in said_, by text
};

}  // namespace lucerna
