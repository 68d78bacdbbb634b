// The one way from the commands to standard output: whatever they print is plain text there.
#pragma once

#include <exception>
#include <ostream>
#include <streambuf>
#include <string>

#include "engine/base/plain_text.h"

namespace lucerna {

class PlainBuffer : public std::streambuf {
  public:
    explicit PlainBuffer(std::ostream& to) : to_(to) {}
    ~PlainBuffer() override {
        if (held_.empty()) return;
        try {
            to_ << plain_text(held_);
        } catch (const std::exception&) {  // half a character, on a stream that failed: nothing is lost
        }
    }
    PlainBuffer(const PlainBuffer&) = delete;
    PlainBuffer& operator=(const PlainBuffer&) = delete;

  private:
    int_type overflow(int_type c) override {
        if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
        const char one = traits_type::to_char_type(c);
        return xsputn(&one, 1) == 1 ? c : traits_type::eof();
    }
    std::streamsize xsputn(const char* text, std::streamsize count) override {
        held_.append(text, static_cast<std::size_t>(count));
        // A character may come in pieces.
        const std::size_t whole = held_.size() - unfinished_bytes(held_);
        to_ << plain_text(std::string_view(held_).substr(0, whole));
        held_.erase(0, whole);
        return to_ ? count : 0;
    }
    int sync() override { return to_.flush() ? 0 : -1; }

    std::ostream& to_;
    std::string held_;
};

// Writes to another stream, which outlives it, what plain_text() makes of what it is given.
class PlainStream : public std::ostream {
  public:
    explicit PlainStream(std::ostream& to) : std::ostream(nullptr), buffer_(to) {
        rdbuf(&buffer_);
        exceptions(to.exceptions());
    }

  private:
    PlainBuffer buffer_;
};

}  // namespace lucerna
