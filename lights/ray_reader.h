// Shared by the readers of ray files: a bounded source, the test for usable rays, and the choice of the rays'
// total colour and flux.
//
// The binary formats are little-endian floats in rows. No allocation relies on a header alone.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "lights/ray_set.h"

namespace lucerna {

static_assert(std::endian::native == std::endian::little, "ray files are read as they lie on the disk");

inline constexpr float kMetresPerMillimetre = 1e-3F;

// Reads a file sequentially. Its errors are InputErrors that name the file and `what` was being read.
class RaySource {
  public:
    explicit RaySource(const std::filesystem::path& file);
    void read(void* to, std::uint64_t bytes, const char* what);
    void skip(std::uint64_t bytes, const char* what);
    // Throws unless there is at least one ray and the rest of the file holds `rays` rows of `floats` floats,
    // and unless there is memory for them, with individual colours if `coloured`.
    void require_rows(std::uint64_t rays, std::size_t floats, bool coloured) const;
    std::uint64_t left() const { return left_; }
    std::uint64_t offset() const { return offset_; }
    const Location& at() const { return at_; }

  private:
    Location at_;
    std::ifstream in_;
    std::uint64_t left_ = 0, offset_ = 0;
};

// Throws InputError unless there is memory for that many rays, with individual colours if `coloured`.
void require_ray_memory(std::uint64_t rays, bool coloured, const Location& at);

// Gives the lines of a source that are not blank, without their ends.
class RayLines {
  public:
    explicit RayLines(RaySource& source) : source_(source) {}
    // Returns false at the end of the file. The line is valid until the next call. Throws InputError for a
    // line that is too long for a row of numbers.
    bool next(std::string_view& line);
    // Returns the location of the last line.
    Location at() const { return {source_.at().file, number_, 1}; }
    // Returns the number of bytes that were taken from the source and lie behind the last line.
    std::uint64_t unread() const { return buffer_.size() - begin_; }

  private:
    RaySource& source_;
    std::string buffer_;
    std::size_t begin_ = 0;
    int number_ = 0;
};

template <typename T>
T value_at(std::span<const std::byte> bytes, std::uint64_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

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

// Describes a file that is in none of the supported formats, as a clause: "it is a zip archive".
std::string content_of_ray_file(const std::filesystem::path& file);

// Returns true if the first bytes of a file are those of a Zemax text ray file.
bool is_zemax_text(std::span<const std::byte> first);

// Returns the ASCII text up to its NUL, with unprintable characters replaced by blanks.
std::string ascii_text(std::span<const std::byte> bytes);

// Returns the metres of the unit that a header numbers 0, 1, 2 …, for names[i]. Throws InputError for any
// other number.
struct NamedUnit {
    const char* name;
    float metres;
};
float metres_of_unit(std::int32_t number, std::span<const NamedUnit> units, const Location& at);

// Collects the colours of a set's rays as they are read, and brings them to the set's scale at the end.
class RayColours {
  public:
    explicit RayColours(RaySet& set) : set_(set) {}
    // Gives all rays one colour, CIE XYZ `per_watt` [W^-1]; white if nothing is visible.
    void all(const V3d& per_watt);
    // Adds the colour of the last ray taken, per watt. Luminous flux already contains ȳ, so it is divided
    // out.
    void add_per_watt(const V3d& xyz);
    // Adds the colour of the last ray taken, per unit of its flux; for watts Y is in lm/W. An invalid colour
    // (not finite, negative, X or Z without Y) is replaced by the mean colour of all other rays.
    void add(const V3d& xyz);
    // Ends the collection. Colours that differ by less than a hundred-thousandth count as one.
    void settle();

  private:
    void settle_rays();

    RaySet& set_;
};

// Adds rows to a set, or counts why they are unusable.
class RayTaker {
  public:
    RayTaker(RaySet& set, float metres_per_unit) : set_(set), metres_(metres_per_unit) {}
    // `row` is x y z and a direction. Returns false for an unusable ray.
    bool take(const float* row, float flux);
    // Ends the reading: lets a finite, positive header flux override the sum, and warns of rays skipped and
    // of bytes left over. Throws InputError if no ray is usable.
    void settle(double header_flux, const RaySource& source, Monitor& monitor);

  private:
    void settle_flux(double header_flux, const Location& at, Monitor& monitor);

    RaySet& set_;
    float metres_;
    double sum_ = 0;
};

// Calls row(const float*) for `rays` rows of `floats` floats, reading block by block. Call require_rows()
// first.
template <typename Row>
void read_rows(RaySource& source, std::uint64_t rays, std::size_t floats, Monitor& monitor, Row&& row) {
    constexpr std::uint64_t kBlock = 1 << 14;
    Phase phase(monitor, "reading rays", rays);
    std::vector<float> block;
    for (std::uint64_t done = 0; done < rays;) {
        const std::uint64_t n = std::min(kBlock, rays - done);
        block.resize(n * floats);
        source.read(block.data(), n * floats * sizeof(float), "rays");
        for (std::uint64_t i = 0; i < n; ++i) row(&block[i * floats]);
        done += n;
        phase.advance(n);
    }
}

}  // namespace lucerna
