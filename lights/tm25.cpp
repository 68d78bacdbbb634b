// IES TM-25-13 ray files: little-endian, packed, millimetres.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kTm25HeaderBytes = 36288;
constexpr std::uint64_t kTextStart = 288, kTextBytes = 4000, kTexts = 9;
constexpr std::uint64_t kFlagStart = 256;
constexpr std::uint64_t kColumnNameBytes = 512;

// The header's spectral identifier.
enum class Spectral : std::int32_t { none = 0, single = 1, per_ray = 2, tables = 3, index_per_ray = 4 };

struct Flags {
    bool radiant, wavelength, luminous, stokes, tristimulus, spectrum;
};

struct Tm25Header {
    double lumens = NAN, watts = NAN;  // NaN: unknown
    std::uint64_t rays = 0;
    Spectral spectral = Spectral::none;
    double wavelength = NAN;  // of all rays [nm]; NaN: unknown
    std::int32_t tables = 0, extra_columns = 0, text_bytes = 0;
    Flags has{};
    std::string date, text;
};

// The columns of one row of floats; -1 if absent.
struct Columns {
    int count = 6;
    int radiant = -1, wavelength = -1, luminous = -1, tristimulus = -1, spectrum = -1;

    Columns(const Flags& has, int extra) {
        const auto take = [this](bool there, int floats) {
            if (!there) return -1;
            count += floats;
            return count - floats;
        };
        radiant = take(has.radiant, 1);
        wavelength = take(has.wavelength, 1);
        luminous = take(has.luminous, 1);
        take(has.stokes, 6);
        tristimulus = take(has.tristimulus, 2);
        spectrum = take(has.spectrum, 1);
        take(true, extra);
    }
};

// Converts UTF-32 up to its NUL to UTF-8. Control characters become blanks; an invalid character ends the
// text.
std::string utf8(std::span<const std::byte> utf32) {
    std::string text;
    for (std::size_t i = 0; i + 4 <= utf32.size(); i += 4) {
        const auto c = value_at<std::uint32_t>(utf32, i);
        if (c == 0 || c > 0x10ffff || (c >= 0xd800 && c < 0xe000)) break;
        const auto put = [&text](std::uint32_t byte) { text += static_cast<char>(byte); };
        if (c < 0x20 || c == 0x7f) {
            put(' ');
        } else if (c < 0x80) {
            put(c);
        } else if (c < 0x800) {
            put(0xc0 | c >> 6), put(0x80 | (c & 0x3f));
        } else if (c < 0x10000) {
            put(0xe0 | c >> 12), put(0x80 | (c >> 6 & 0x3f)), put(0x80 | (c & 0x3f));
        } else {
            put(0xf0 | c >> 18), put(0x80 | (c >> 12 & 0x3f)), put(0x80 | (c >> 6 & 0x3f)),
                put(0x80 | (c & 0x3f));
        }
    }
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

Flags read_flags(std::span<const std::byte> bytes, const Location& at) {
    static constexpr const char* kNames[8] = {"position",      "direction", "radiant flux", "wavelength",
                                              "luminous flux", "Stokes",    "tristimulus",  "spectrum index"};
    bool flag[8];
    for (std::size_t i = 0; i < 8; ++i) {
        const auto value = value_at<std::int32_t>(bytes, kFlagStart + 4 * i);
        if (value != 0 && value != 1)
            input_error(at, "the flag for {} is {}; expected 0 or 1", kNames[i], value);
        flag[i] = value == 1;
    }
    if (!flag[0] || !flag[1])
        throw InputError(at, "the rays have no position or no direction; both are needed");
    if (!flag[2] && !flag[4]) throw InputError(at, "the rays have neither radiant nor luminous flux");
    return {flag[2], flag[3], flag[4], flag[5], flag[6], flag[7]};
}

Tm25Header read_tm25_header(RaySource& source) {
    const Location& at = source.at();
    std::vector<std::byte> bytes(kTm25HeaderBytes);
    source.read(bytes.data(), kTm25HeaderBytes, "header");
    const auto version = value_at<std::int32_t>(bytes, 4);
    if (byte_swapped(version) == 2013) refuse_big_endian(at);
    if (version != 2013) {
        input_error(at, "TM-25 version {}{}; expected 2013", version,
                    version == 2020 ? " (ANSI/IES TM-25-20, whose layout is not public)" : "");
    }

    Tm25Header h;
    h.lumens = stated(value_at<float>(bytes, 12));
    h.watts = stated(value_at<float>(bytes, 16));
    h.rays = value_at<std::uint64_t>(bytes, 20);
    const auto spectral = value_at<std::int32_t>(bytes, 60);
    if (spectral < 0 || spectral > 4) input_error(at, "spectral identifier {}; expected 0 to 4", spectral);
    h.spectral = static_cast<Spectral>(spectral);
    h.wavelength = stated(value_at<float>(bytes, 64));
    h.tables = value_at<std::int32_t>(bytes, 76);
    h.extra_columns = value_at<std::int32_t>(bytes, 80);
    h.text_bytes = value_at<std::int32_t>(bytes, 84);
    if (h.tables < 0) input_error(at, "{} spectral tables", h.tables);
    if (h.extra_columns < 0 || h.extra_columns > 100000)
        input_error(at, "{} additional items per ray", h.extra_columns);
    if (h.text_bytes < 0) input_error(at, "{} bytes of additional text", h.text_bytes);
    h.has = read_flags(bytes, at);

    h.date = ascii_text(std::span(bytes).subspan(28, 28));
    for (std::uint64_t i = 0; i < kTexts; ++i) {
        const std::string text = utf8(std::span(bytes).subspan(kTextStart + i * kTextBytes, kTextBytes));
        if (!text.empty()) h.text += (h.text.empty() ? "" : "; ") + text;
    }
    return h;
}

std::vector<Spectrum> read_tables(RaySource& source, const Tm25Header& h) {
    std::vector<Spectrum> tables;
    for (std::int32_t i = 0; i < h.tables; ++i) {
        std::int32_t n = 0;
        source.read(&n, sizeof n, "spectral tables");
        if (n < 1 || static_cast<std::uint64_t>(n) > source.left() / 8) {
            input_error(source.at(),
                        "spectral table {} of {} claims {} pairs; the rest of the file holds at most {}",
                        i + 1, h.tables, n, source.left() / 8);
        }
        std::vector<float> pairs(static_cast<std::size_t>(n) * 2);
        source.read(pairs.data(), pairs.size() * sizeof(float), "spectral tables");
        Spectrum& samples = tables.emplace_back();
        for (std::size_t k = 0; k < pairs.size(); k += 2) {
            if (!std::isfinite(pairs[k]) || !std::isfinite(pairs[k + 1])) {
                input_error(source.at(), "spectral table {} is not finite in pair {}", i + 1, k / 2 + 1);
            }
            samples.push_back({double{pairs[k]}, double{pairs[k + 1]}});
        }
    }
    source.skip((32 - source.offset() % 32) % 32, "spectral tables");
    return tables;
}

// Collects the rays' spectrum indices, which are 1 to N for N spectral tables [TM-25-13, 4.7.4]. Some
// programs count from 0; their files are recognised by an index 0 where no ray has index N.
class SpectrumIndices {
  public:
    SpectrumIndices(std::size_t tables, const Location& at) : tables_(tables), at_(at) {}

    // Adds ray `number` of the file, from 1. Throws InputError for an index that is invalid in both ways of
    // counting.
    void add(std::uint64_t number, float index) {
        if (!(index >= 0 && index <= static_cast<float>(tables_)) || index != std::floor(index))
            refuse(number, index);
        const auto whole = static_cast<std::uint32_t>(index);
        if (whole == 0 && first_zero_ == 0) first_zero_ = number;
        has_last_ = has_last_ || whole == tables_;
        indices_.push_back(whole);
    }
    // Returns the table of every ray added, from 0. Throws InputError if the file has both 0 and N.
    const std::vector<std::uint32_t>& settle(Monitor& monitor) {
        if (first_zero_ == 0) {
            for (std::uint32_t& index : indices_) --index;
        } else if (has_last_) {
            refuse(first_zero_, 0);
        } else {
            monitor.warn(
                fmt::format("{}: ray {} has the spectrum index 0 and no ray has {}; the indices are read as "
                            "counted from 0, though IES TM-25 counts from 1",
                            to_string(at_), first_zero_, tables_));
        }
        return indices_;
    }

  private:
    [[noreturn]] void refuse(std::uint64_t number, float index) const {
        input_error(at_,
                    "ray {} has the spectrum index {}; expected a whole number from 1 to {}, the number of "
                    "spectral tables",
                    number, index, tables_);
    }

    std::size_t tables_;
    Location at_;
    std::uint64_t first_zero_ = 0;  // number of the first ray with index 0; 0: none
    bool has_last_ = false;         // a ray has index N
    std::vector<std::uint32_t> indices_;
};

// Reads a ray's colour from the columns of its row.
class RowColour {
  public:
    RowColour(const Tm25Header& h, const Columns& columns, RaySet& set, std::vector<Spectrum> tables,
              const Location& at)
        : columns_(columns), indices_(tables.size(), at), colours_(set) {
        if (h.spectral == Spectral::single) tables = {{{h.wavelength, 1}}};
        if (columns_.tristimulus >= 0 && columns_.luminous >= 0)
            mode_ = Mode::tristimulus;
        else if (columns_.tristimulus >= 0)
            mode_ = Mode::constant;
        else if (h.spectral == Spectral::per_ray && columns_.wavelength >= 0)
            mode_ = Mode::wavelength;
        else if (h.spectral == Spectral::index_per_ray && columns_.spectrum >= 0)
            mode_ = Mode::index;
        if (mode_ == Mode::index && tables.empty())
            throw InputError(at, "the rays have spectrum indices, but the file has no spectral table");
        several_ = tables.size() > 1;
        if (mode_ == Mode::index)
            colours_.list(std::move(tables));
        else if (!per_ray() && !tables.empty())
            colours_.all(std::move(tables[0]));
    }
    bool per_ray() const { return mode_ != Mode::constant; }
    bool several_unused() const { return mode_ == Mode::constant && several_; }
    // Adds the colour of the last ray taken, which is ray `number` of the file, from 1.
    void add(std::uint64_t number, const float* row, double flux) {
        if (mode_ == Mode::tristimulus) {
            const double x = stated(row[columns_.tristimulus]), z = stated(row[columns_.tristimulus + 1]);
            colours_.add(V3d(x, double{row[columns_.luminous]}, z) / flux);
        } else if (mode_ == Mode::wavelength) {
            colours_.add_wavelength(stated(row[columns_.wavelength]));
        } else if (mode_ == Mode::index) {
            indices_.add(number, row[columns_.spectrum]);
        }
    }
    void settle(Monitor& monitor) {
        if (mode_ == Mode::index) {
            for (const std::uint32_t table : indices_.settle(monitor)) colours_.add_spectrum(table);
        }
        colours_.settle();
    }

  private:
    enum class Mode : std::uint8_t { constant, tristimulus, wavelength, index };

    Columns columns_;
    Mode mode_ = Mode::constant;
    bool several_ = false;  // spectral tables
    SpectrumIndices indices_;
    RayColours colours_;
};

}  // namespace

bool is_tm25(std::span<const std::byte> first) {
    return text_of(first).starts_with("TM25");
}

RaySet read_tm25(RaySource& source, Monitor& monitor) {
    const Tm25Header header = read_tm25_header(source);
    std::vector<Spectrum> tables = read_tables(source, header);
    source.skip(static_cast<std::uint64_t>(header.extra_columns) * kColumnNameBytes, "column names");
    source.skip(static_cast<std::uint64_t>(header.text_bytes), "additional text");

    const Columns columns(header.has, header.extra_columns);
    RaySet set;
    set.unit = header.has.radiant ? FluxUnit::watt : FluxUnit::lumen;
    set.header_lumens = header.lumens;
    set.header_watts = header.watts;
    set.text = header.text;
    set.provenance = fmt::format("TM-25 ray file {}, {} rays{}{}{}{}", source.name(), header.rays,
                                 header.date.empty() ? "" : ", ", header.date,
                                 header.text.empty() ? "" : "; ", header.text);
    RowColour colour(header, columns, set, std::move(tables), source.at());
    source.require_rows(header.rays, static_cast<std::size_t>(columns.count), colour.per_ray());
    if (colour.several_unused()) {
        monitor.warn(
            fmt::format("{}: several spectra but no index per ray; the first spectrum is used for all rays",
                        to_string(source.at())));
    }
    const int flux_column = header.has.radiant ? columns.radiant : columns.luminous;
    set.rays.reserve(header.rays);
    if (colour.per_ray()) set.tristimulus.reserve(header.rays);
    RayTaker taker(set, kMetresPerMillimetre, "byte");
    std::uint64_t number = 0;
    read_rows(source, header.rays, static_cast<std::size_t>(columns.count), monitor,
              [&](const float* row, std::uint64_t at) {
                  ++number;
                  if (taker.take(row, row[flux_column], at))
                      colour.add(number, row, double{row[flux_column]});
              });
    colour.settle(monitor);
    taker.settle(header.has.radiant ? header.watts : header.lumens, RayTaker::Header::absolute, source,
                 monitor);
    return set;
}

}  // namespace lucerna
