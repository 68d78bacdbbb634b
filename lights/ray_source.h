// The bytes of a ray file, read from its start to its end, and the lines of one that is text. gzip or zip may
// have packed it.
//
// The binary formats are little-endian floats in rows. No allocation relies on a header alone.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/system/unpacked_file.h"

namespace lucerna {

static_assert(std::endian::native == std::endian::little, "ray files are read as they lie on the disk");

// Reads a file sequentially. Its errors are InputErrors that name the file, the offset and `what` was being
// read.
class RaySource {
  public:
    // Takes a file of which nothing has been read.
    explicit RaySource(UnpackedFile file);
    // Returns the first 4096 bytes, or all if there are fewer. Does not count as reading.
    std::span<const std::byte> first() const { return file_.first(); }
    void read(void* to, std::uint64_t bytes, const char* what);
    void skip(std::uint64_t bytes, const char* what);
    // Throws unless there is at least one ray and the rest of the file holds `rays` rows of `floats` floats,
    // and unless there is memory for them, with individual colours if `coloured`.
    void require_rows(std::uint64_t rays, std::size_t floats, bool coloured) const;
    std::uint64_t left() const { return left_; }
    std::uint64_t offset() const { return offset_; }
    const Location& at() const { return at_; }
    // Returns the file's name without its folder.
    std::string name() const;

  private:
    void require_left(std::uint64_t bytes, const char* what) const;

    UnpackedFile file_;
    Location at_;
    std::uint64_t left_ = 0, offset_ = 0;
};

// Throws InputError unless there is memory for that many rays, with individual colours if `coloured`.
void require_ray_memory(std::uint64_t rays, bool coloured, const Location& at);

template <typename T>
T value_at(std::span<const std::byte> bytes, std::uint64_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

// Returns the value whose bytes are in the opposite order.
template <typename T>
T byte_swapped(T value) {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
    std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
}

// Returns the first bytes as text.
inline std::string_view text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Returns the ASCII text up to its NUL, with unprintable characters replaced by blanks.
std::string ascii_text(std::span<const std::byte> bytes);

// Returns a value that a header or a row may leave open, or NaN if it is open. Unknown values are written as
// NaN, whose bytes some programs write in the wrong order: 0x0100C07F is 2.4e-38. No quantity of a lamp is
// that small.
inline double stated(float value) {
    // Bits are compared because comparing a NaN is an invalid operation.
    constexpr std::uint32_t kInfinity = 0x7f800000;
    const std::uint32_t size = std::bit_cast<std::uint32_t>(value) & 0x7fffffffU;
    const bool known = size == 0 || (size >= std::bit_cast<std::uint32_t>(1e-30F) && size <= kInfinity);
    return known ? double{value} : NAN;
}

// Calls row(const float*, offset of the row in the file) for `rays` rows of `floats` floats, reading block by
// block. Call require_rows() first.
template <typename Row>
void read_rows(RaySource& source, std::uint64_t rays, std::size_t floats, Monitor& monitor, Row&& row) {
    constexpr std::uint64_t kBlock = 1 << 14;
    Phase phase(monitor, "reading rays", rays);
    std::vector<float> block;
    for (std::uint64_t done = 0; done < rays;) {
        const std::uint64_t n = std::min(kBlock, rays - done), begin = source.offset();
        block.resize(n * floats);
        source.read(block.data(), n * floats * sizeof(float), "rays");
        for (std::uint64_t i = 0; i < n; ++i) row(&block[i * floats], begin + i * floats * sizeof(float));
        done += n;
        phase.advance(n);
    }
}

// Gives the lines of a source that are not blank, without their ends.
class RayLines {
  public:
    explicit RayLines(RaySource& source) : source_(source) {}
    // Returns false at the end of the file. The line is valid until the next call. Throws InputError for a
    // line that is too long for a row of numbers.
    bool next(std::string_view& line);
    // Returns the location of the last line.
    Location at() const { return {source_.at().file, number_, 1}; }
    int number() const { return number_; }
    // Returns the number of bytes that lie behind the last line.
    std::uint64_t left() const { return source_.left() + buffer_.size() - begin_; }

  private:
    RaySource& source_;
    std::string buffer_;
    std::size_t begin_ = 0;
    int number_ = 0;
};

// Stores the first numbers of a line in `row` and returns how many the line has. `separators` lie between
// them, and blanks around them. Values outside a float's range become 0 or infinity. Throws InputError for a
// word that is not a number, with `expected` in its message.
std::size_t read_numbers(std::string_view line, std::string_view separators, std::span<float> row,
                         const Location& at, std::string_view expected);

// Returns the metres of the unit that a header numbers 0, 1, 2 …, for units[i]. Throws InputError for any
// other number.
struct NamedUnit {
    const char* name;
    double metres;
};
double metres_of_unit(std::int32_t number, std::span<const NamedUnit> units, const Location& at);

}  // namespace lucerna
