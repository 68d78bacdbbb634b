// Declares what the PLY readers (ply*.cpp) share: the header's contents, and the bytes with a read position.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

enum class PlyScalar : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };
inline std::size_t size_of(PlyScalar type) {  // bytes
    constexpr std::size_t kSize[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return kSize[static_cast<std::size_t>(type)];
}
inline bool is_whole(PlyScalar type) {
    return type < PlyScalar::f32;
}

struct PlyProperty {
    std::string name;
    PlyScalar type = PlyScalar::f32;
    std::optional<PlyScalar> count;  // type of a list's length; none for a scalar
};

struct PlyElement {
    std::string name;
    std::uint64_t rows = 0;
    std::vector<PlyProperty> properties;

    // Returns the index of the first property of that name.
    std::optional<std::size_t> find(std::string_view wanted) const {
        for (std::size_t i = 0; i < properties.size(); ++i) {
            if (properties[i].name == wanted) return i;
        }
        return std::nullopt;
    }
    bool has_lists() const {
        for (const PlyProperty& property : properties) {
            if (property.count) return true;
        }
        return false;
    }
};

enum class PlyEncoding : std::uint8_t { ascii, little, big };

// Holds the file's bytes and the read position. Every read checks that enough bytes are left.
class PlyCursor {
  public:
    PlyCursor(const std::filesystem::path& file, const std::vector<std::byte>& bytes)
        : file_(file.string()), text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

    const std::string& file() const { return file_; }

    PlyEncoding encoding = PlyEncoding::ascii;

    std::size_t left() const { return text_.size() - at_; }
    const char* here() const { return text_.data() + at_; }
    void skip(std::size_t bytes) { at_ += bytes; }

    // Returns the next line of the header without its line end (any of the three conventions).
    std::string_view line() {
        const std::size_t end = text_.find_first_of("\r\n", at_);
        if (end == std::string_view::npos) fail("the header has no end_header line");
        const std::string_view result = text_.substr(at_, end - at_);
        at_ = end + 1;
        if (text_[end] == '\r' && at_ < text_.size() && text_[at_] == '\n') ++at_;
        ++line_;
        return result;
    }

    double number(PlyScalar type) {
        if (encoding == PlyEncoding::ascii) return word(type);
        const std::size_t size = size_of(type);
        if (left() < size) fail("the file ends within its data");
        const double value = decode(here(), type);
        at_ += size;
        return value;
    }

    double decode(const char* from, PlyScalar type) const {
        switch (type) {
            case PlyScalar::i8:
                return load<std::int8_t>(from);
            case PlyScalar::u8:
                return load<std::uint8_t>(from);
            case PlyScalar::i16:
                return load<std::int16_t>(from);
            case PlyScalar::u16:
                return load<std::uint16_t>(from);
            case PlyScalar::i32:
                return load<std::int32_t>(from);
            case PlyScalar::u32:
                return load<std::uint32_t>(from);
            case PlyScalar::f32:
                return static_cast<double>(load<float>(from));
            case PlyScalar::f64:
                return load<double>(from);
        }
        return 0;
    }

    // Throws InputError, with a line number in text; binary data have no lines.
    template <typename... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        Location at{file_};
        if (in_header_) {
            at = {file_, line_, 1};
        } else if (encoding == PlyEncoding::ascii) {
            at = {file_, 1, 1};
            for (std::size_t i = 0; i < at_; ++i) at.line += text_[i] == '\n' ? 1 : 0;
        }
        throw InputError(at, fmt::format(format, std::forward<Args>(args)...));
    }
    void end_header() { in_header_ = false; }

  private:
    template <typename T>
    T load(const char* from) const {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), from, sizeof(T));
        const bool swap = (encoding == PlyEncoding::big) != (std::endian::native == std::endian::big);
        if (swap) std::reverse(bytes.begin(), bytes.end());
        return std::bit_cast<T>(bytes);
    }

    double word(PlyScalar type) {
        constexpr std::string_view kSpace = " \t\r\n\v\f";
        at_ = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
        const std::size_t end = std::min(text_.find_first_of(kSpace, at_), text_.size());
        if (at_ == end) fail("the file ends within its data");
        const char* first = text_.data() + at_ + (text_[at_] == '+' ? 1 : 0);
        double value = 0;
        const auto [stop, error] = std::from_chars(first, text_.data() + end, value);
        const bool range = error == std::errc::result_out_of_range;  // value keeps 0: too small or too large
        if (stop != text_.data() + end || (error != std::errc() && !range)) {
            fail("'{}' is not a number", printable(text_.substr(at_, end - at_)));
        }
        if (range) fail("'{}' is out of range", printable(text_.substr(at_, end - at_)));
        if (is_whole(type) && value != std::floor(value)) fail("{} is not a whole number", value);
        at_ = end;
        return value;
    }

  public:
    // Returns a part of the file in a form that fits one line of a message.
    static std::string printable(std::string_view text) {
        std::string result;
        for (const char c : text.substr(0, 40)) result += c >= 32 && c < 127 ? c : '?';
        return result;
    }

  private:
    std::string file_;
    std::string_view text_;
    std::size_t at_ = 0;
    int line_ = 0;
    bool in_header_ = true;
};

// Reads from the first line to end_header, and sets the cursor's encoding. Throws InputError.
std::vector<PlyElement> read_ply_header(PlyCursor& in);

}  // namespace lucerna
