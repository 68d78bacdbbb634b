// Shared by the readers of ray files: the test for usable rays, the choice of the rays' total colour and
// flux, and the formats that read_rays() tells apart.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "lights/ray_set.h"
#include "lights/ray_source.h"

namespace lucerna {

inline constexpr double kMetresPerMillimetre = 1e-3;

// Collects the colours of a set's rays as they are read, and brings them to the set's scale at the end.
class RayColours {
  public:
    explicit RayColours(RaySet& set) : set_(set) {}
    // Gives all rays one spectrum; white if nothing is visible.
    void all(Spectrum spectrum);
    // Sets the spectra of add_spectrum().
    void list(std::vector<Spectrum> spectra);
    // Adds the spectrum of the last ray taken, by its number in the list.
    void add_spectrum(std::size_t number);
    // Adds the colour of the last ray taken, per unit of its flux; for watts Y is in lm/W. An invalid colour
    // (not finite, negative, X or Z without Y) is replaced by the mean colour of all other rays.
    void add(const V3d& xyz);
    // Adds the wavelength [nm] of the last ray taken; NaN if it is unknown.
    void add_wavelength(double nanometres);
    // Ends the collection. Colours that differ by less than a hundred-thousandth count as one.
    void settle();

  private:
    // Adds the colour of the last ray taken, per watt. Luminous flux already contains ȳ, so it is divided
    // out.
    void add_per_watt(const V3d& xyz);
    void settle_rays();
    void settle_spectra();

    RaySet& set_;
    std::vector<V3d> per_watt_;           // of listed spectra
    std::vector<std::uint16_t> line_of_;  // the line's number for each nm from kFirstVisible on
};

// Adds rows to a set, or counts why they are unusable.
class RayTaker {
  public:
    // `place` is what rays are found by in messages: "byte" or "line".
    RayTaker(RaySet& set, double metres_per_unit, const char* place)
        : set_(set), metres_(metres_per_unit), place_(place) {}
    // `row` is x y z and a direction; `at` is the number of its byte or line. Returns false for an unusable
    // ray. Inline, because files have millions of rays.
    bool take(const float* row, float flux, std::uint64_t at) {
        const V3d o(double{row[0]}, double{row[1]}, double{row[2]});
        // In double precision, because the squares of directions of length 1e20 overflow a float.
        const V3d d(double{row[3]}, double{row[4]}, double{row[5]});
        const double length2 = sqr(d.x) + sqr(d.y) + sqr(d.z);
        const bool has_flux = std::isfinite(flux) && flux >= 0;
        if (has_flux) sum_ += double{flux};
        const V3f metres(metres_ * o);
        constexpr double kLeast2 = 1e-12;
        if (!has_flux || !is_finite(metres) || !std::isfinite(length2) || length2 < kLeast2) {
            refuse(row, flux, at);
            return false;
        }
        // Directions of unit length up to rounding stay as they are, so that files that are read and written
        // again do not change.
        constexpr double kRounding = 1e-6;
        const bool unit = std::fabs(length2 - 1) <= kRounding;
        set_.rays.push_back({metres, V3f(unit ? d : d / std::sqrt(length2)), flux});
        return true;
    }
    // Tells how a header's flux relates to the rays'. `absolute`: both are in the set's unit, and may
    // disagree. `relative`: only the header's is.
    enum class Header : std::uint8_t { absolute, relative };
    // Ends the reading: lets a finite, positive header flux override the sum, and warns of rays skipped and
    // of bytes left over. Throws InputError if no ray is usable.
    void settle(double header_flux, Header header, const RaySource& source, Monitor& monitor);

  private:
    void refuse(const float* row, float flux, std::uint64_t at);
    void settle_flux(double header_flux, Header header, const Location& at, Monitor& monitor);

    RaySet& set_;
    double metres_;
    const char* place_;
    std::string first_refused_;
    double sum_ = 0;
};

// Tells where rows have a ray's values that follow x y z and a direction.
struct RayColumns {
    std::size_t floats = 7;
    std::size_t flux = 6;
    std::optional<std::size_t> wavelength;
    double metres = kMetresPerMillimetre;  // per unit of length
    double nanometres = 1;                 // per unit of wavelength
    const char* place = "byte";            // as in RayTaker
};

// Adds rows to a set whose rays may have wavelengths: what is common to all formats but TM-25.
class RowTaker {
  public:
    // Reserves memory for that many rays, which is known to be there.
    RowTaker(RaySet& set, const RayColumns& columns, std::uint64_t rays);
    // Gives all rays one wavelength [nm]; NaN if it is unknown.
    void all(double nanometres);
    void take(const float* row, std::uint64_t at) {
        if (rays_.take(row, row[columns_.flux], at) && columns_.wavelength)
            add_wavelength(row[*columns_.wavelength]);
    }
    // Ends the reading as RayTaker does, and warns of wavelengths that are not visible.
    void settle(double header_flux, RayTaker::Header header, const RaySource& source, Monitor& monitor);

  private:
    void add_wavelength(float wavelength);

    RaySet& set_;
    RayColumns columns_;
    RayColours colours_;
    RayTaker rays_;
    std::uint64_t invisible_ = 0;
    double first_invisible_ = 0;  // nm
};

// Reads that many rows of a binary file into the set. Throws InputError if they do not fit into the file or
// the memory.
RowTaker take_rows(RaySource& source, std::uint64_t rays, const RayColumns& columns, RaySet& set,
                   Monitor& monitor);

// Returns the number of rows of that many bytes in the rest of the file, behind which `end` bytes follow.
// Throws InputError if the size does not fit.
std::uint64_t rows_left(const RaySource& source, std::uint64_t row_bytes, std::uint64_t end);

// The formats. Each is told by the first bytes of a file, as in RaySource::first(), and read by its function,
// which throws InputError.
bool is_tm25(std::span<const std::byte> first);
RaySet read_tm25(RaySource& source, Monitor& monitor);
bool is_zemax(std::span<const std::byte> first);
RaySet read_zemax(RaySource& source, Monitor& monitor);
bool is_zemax_text(std::span<const std::byte> first);
RaySet read_zemax_text(RaySource& source, Monitor& monitor);
bool is_lighttools(std::span<const std::byte> first);
RaySet read_lighttools(RaySource& source, Monitor& monitor);
// Rows of 32 bytes, or of 52 if the rays are polarised, which is refused.
bool is_speos(std::span<const std::byte> first);
RaySet read_speos(RaySource& source, Monitor& monitor);
// Text with LightTools's header of keywords.
bool is_lighttools_text(std::span<const std::byte> first);
RaySet read_lighttools_text(RaySource& source, Monitor& monitor);
// Text whose header names a position's columns.
bool is_ray_table(std::span<const std::byte> first);
RaySet read_ray_table(RaySource& source, Monitor& monitor);
bool is_asap(std::span<const std::byte> first);
RaySet read_asap(RaySource& source, Monitor& monitor);

// Throws InputError: the numbers of the file are big-endian.
[[noreturn]] void refuse_big_endian(const Location& at);

}  // namespace lucerna
