// What the readers of ray files share: a source that knows what is left of it, what counts as a usable ray,
// what colour the rays add up to, and whose word about the flux is believed.
//
// The binary formats are little-endian floats in rows. Nothing is allocated on a header's word alone.
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

// Reads a file forwards. Its errors are InputErrors that name the file and `what` was being read.
class RaySource {
  public:
    explicit RaySource(const std::filesystem::path& file);
    void read(void* to, std::uint64_t bytes, const char* what);
    void skip(std::uint64_t bytes, const char* what);
    // Throws unless there is at least one ray and the rest of the file holds `rays` rows of `floats` floats.
    // The memory is that of rays with colours of their own if `coloured`.
    void require_rows(std::uint64_t rays, std::size_t floats, bool coloured) const;
    std::uint64_t left() const { return left_; }
    std::uint64_t offset() const { return offset_; }
    const Location& at() const { return at_; }

  private:
    Location at_;
    std::ifstream in_;
    std::uint64_t left_ = 0, offset_ = 0;
};

// Throws InputError unless there is memory for so many rays, with colours of their own if `coloured`.
void require_ray_memory(std::uint64_t rays, bool coloured, const Location& at);

// The lines of a source that are not blank, without their ends.
class RayLines {
  public:
    explicit RayLines(RaySource& source) : source_(source) {}
    // False at the end of the file. The line lives until the next call. Throws InputError for a line that is
    // too long for any row of numbers.
    bool next(std::string_view& line);
    // Of the line that came last.
    Location at() const { return {source_.at().file, number_, 1}; }
    // Bytes that were taken from the source and are behind that line.
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

// A value that a header or a row may leave open; NaN if it does. Unknown values are written as NaN, whose
// bytes some programs write in the wrong order: 0x0100C07F is 2.4e-38. No quantity of a lamp is so small.
inline double stated(float value) {
    // By its bits: a comparison with a NaN is an invalid operation.
    constexpr std::uint32_t kInfinity = 0x7f800000;
    const std::uint32_t size = std::bit_cast<std::uint32_t>(value) & 0x7fffffffU;
    const bool known = size == 0 || (size >= std::bit_cast<std::uint32_t>(1e-30F) && size <= kInfinity);
    return known ? double{value} : NAN;
}

// What a file is that is none of the ray files read here, as the clause of a sentence: "it is a zip archive".
std::string content_of_ray_file(const std::filesystem::path& file);

// Whether the first bytes of a file are those of a Zemax text ray file.
bool is_zemax_text(std::span<const std::byte> first);

// ASCII up to its NUL; what cannot be printed becomes a blank.
std::string ascii_text(std::span<const std::byte> bytes);

// The metres of a unit that a header numbers 0, 1, 2 …, for names[i]. Throws InputError for another number.
struct NamedUnit {
    const char* name;
    float metres;
};
float metres_of_unit(std::int32_t number, std::span<const NamedUnit> units, const Location& at);

// Puts the colours of a set's rays beside them as they are read, and at the end on the set's scale.
class RayColours {
  public:
    explicit RayColours(RaySet& set) : set_(set) {}
    // One colour for all rays: light of CIE XYZ `per_watt` [W^-1]. Nothing visible: white.
    void all(const V3d& per_watt);
    // Of the ray that was taken last, per watt. Luminous flux holds ȳ already: it is divided out.
    void add_per_watt(const V3d& xyz);
    // Of the ray that was taken last, per unit of its flux: for watts Y in lm/W. What is no colour (not
    // finite, negative, X or Z without Y) makes the ray's colour that of all others together.
    void add(const V3d& xyz);
    // At the end. Colours that differ by less than a hundred-thousandth are one.
    void settle();

  private:
    void settle_rays();

    RaySet& set_;
};

// Puts rows into a set, or counts why not.
class RayTaker {
  public:
    RayTaker(RaySet& set, float metres_per_unit) : set_(set), metres_(metres_per_unit) {}
    // row: x y z and direction. False for a ray that is of no use.
    bool take(const float* row, float flux);
    // At the end: lets a finite, positive header flux win over the sum, warns of rays skipped and of bytes
    // left over. Throws InputError if no ray is usable.
    void settle(double header_flux, const RaySource& source, Monitor& monitor);

  private:
    void settle_flux(double header_flux, const Location& at, Monitor& monitor);

    RaySet& set_;
    float metres_;
    double sum_ = 0;
};

// Calls row(const float*) for `rays` rows of `floats` floats, read block by block. require_rows() comes
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
