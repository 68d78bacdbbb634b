// IES TM-25-13 ray files: little-endian, packed, millimetres.
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>

#include "engine/base/cie.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "lights/ray_set.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little, "TM-25 is read as it lies in the file");

constexpr std::uint64_t kHeaderBytes = 36288;
constexpr std::uint64_t kTextStart = 288, kTextBytes = 4000, kTexts = 9;
constexpr std::uint64_t kFlagStart = 256;
constexpr std::uint64_t kColumnNameBytes = 512;
constexpr float kMetresPerMillimetre = 1e-3F;

// Spectral id of the header.
enum class Spectral : std::int32_t { none = 0, single = 1, per_ray = 2, tables = 3, index_per_ray = 4 };

struct Flags {
    bool radiant, wavelength, luminous, stokes, tristimulus, spectrum;
};

struct Header {
    double lumens = 0, watts = 0;
    std::uint64_t rays = 0;
    Spectral spectral = Spectral::none;
    float wavelength = 0;  // nm
    std::int32_t tables = 0, extra_columns = 0, text_bytes = 0;
    Flags has{};
    std::string date, text;
};

// Columns of one row of floats; -1: not there.
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

// Reads a file forwards and knows what is left of it, so that nothing is allocated that is not there.
class Source {
  public:
    explicit Source(const std::filesystem::path& file) : at_{file.string()} {
        require_readable(file);
        in_.open(file, std::ios::binary | std::ios::ate);
        const std::streamoff size = in_.tellg();
        if (size < 0) throw InputError(at_, "its size cannot be told");
        left_ = static_cast<std::uint64_t>(size);
        in_.seekg(0);
    }
    void read(void* to, std::uint64_t bytes, const char* what) {
        if (bytes > left_) {
            input_error(at_, "truncated in the {}: {} bytes wanted, {} left", what, bytes, left_);
        }
        in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
        if (!in_) input_error(at_, "reading stopped in the {}", what);
        left_ -= bytes;
        offset_ += bytes;
    }
    void skip(std::uint64_t bytes, const char* what) {
        if (bytes > left_) {
            input_error(at_, "truncated in the {}: {} bytes wanted, {} left", what, bytes, left_);
        }
        in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
        left_ -= bytes;
        offset_ += bytes;
    }
    std::uint64_t left() const { return left_; }
    std::uint64_t offset() const { return offset_; }
    const Location& at() const { return at_; }

  private:
    Location at_;
    std::ifstream in_;
    std::uint64_t left_ = 0, offset_ = 0;
};

template <typename T>
T value_at(std::span<const std::byte> bytes, std::uint64_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

// UTF-32 up to its NUL as UTF-8; control characters become blanks, what is no character ends the text.
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
            input_error(at, "the flag for {} is {}; 0 and 1 are accepted", kNames[i], value);
        flag[i] = value == 1;
    }
    if (!flag[0] || !flag[1])
        throw InputError(at, "the rays have no position or no direction; both are needed");
    if (!flag[2] && !flag[4]) throw InputError(at, "the rays have neither radiant nor luminous flux");
    return {flag[2], flag[3], flag[4], flag[5], flag[6], flag[7]};
}

Header read_header(Source& source) {
    const Location& at = source.at();
    std::vector<std::byte> bytes(kHeaderBytes);
    source.read(bytes.data(), 4, "signature");
    if (std::memcmp(bytes.data(), "TM25", 4) != 0)
        throw InputError(at, "no TM-25 ray file: it does not start with TM25");
    source.read(bytes.data() + 4, kHeaderBytes - 4, "header");
    const auto version = value_at<std::int32_t>(bytes, 4);
    if (version != 2013) input_error(at, "TM-25 version {}; 2013 is accepted", version);

    Header h;
    h.lumens = double{value_at<float>(bytes, 12)};
    h.watts = double{value_at<float>(bytes, 16)};
    h.rays = value_at<std::uint64_t>(bytes, 20);
    const auto spectral = value_at<std::int32_t>(bytes, 60);
    if (spectral < 0 || spectral > 4)
        input_error(at, "spectral identifier {}; 0 to 4 are accepted", spectral);
    h.spectral = static_cast<Spectral>(spectral);
    h.wavelength = value_at<float>(bytes, 64);
    h.tables = value_at<std::int32_t>(bytes, 76);
    h.extra_columns = value_at<std::int32_t>(bytes, 80);
    h.text_bytes = value_at<std::int32_t>(bytes, 84);
    if (h.tables < 0) input_error(at, "{} spectral tables", h.tables);
    if (h.extra_columns < 0 || h.extra_columns > 100000)
        input_error(at, "{} additional items per ray", h.extra_columns);
    if (h.text_bytes < 0) input_error(at, "{} bytes of additional text", h.text_bytes);
    h.has = read_flags(bytes, at);

    for (std::size_t i = 28; i < 56 && bytes[i] != std::byte{0}; ++i) {
        const char c = static_cast<char>(bytes[i]);
        h.date += c >= ' ' && c <= '~' ? c : ' ';
    }
    for (std::uint64_t i = 0; i < kTexts; ++i) {
        const std::string text = utf8(std::span(bytes).subspan(kTextStart + i * kTextBytes, kTextBytes));
        if (!text.empty()) h.text += (h.text.empty() ? "" : "; ") + text;
    }
    return h;
}

std::vector<V3d> read_tables(Source& source, const Header& h) {
    std::vector<V3d> xyz;
    for (std::int32_t i = 0; i < h.tables; ++i) {
        std::int32_t n = 0;
        source.read(&n, sizeof n, "spectral tables");
        if (n < 1 || static_cast<std::uint64_t>(n) > source.left() / 8) {
            input_error(source.at(),
                        "spectral table {} claims {} pairs; the rest of the file holds at most {}", i, n,
                        source.left() / 8);
        }
        std::vector<float> pairs(static_cast<std::size_t>(n) * 2);
        source.read(pairs.data(), pairs.size() * sizeof(float), "spectral tables");
        std::vector<SpectralSample> samples;
        for (std::size_t k = 0; k < pairs.size(); k += 2) {
            if (!std::isfinite(pairs[k]) || !std::isfinite(pairs[k + 1])) {
                input_error(source.at(), "spectral table {} is not finite in pair {}", i, k / 2);
            }
            samples.push_back({double{pairs[k]}, double{pairs[k + 1]}});
        }
        xyz.push_back(spectrum_to_xyz(samples));
    }
    source.skip((32 - source.offset() % 32) % 32, "spectral tables");
    return xyz;
}

// Sums the rays' colours, each of luminance 1 times flux.
class ColourSum {
  public:
    ColourSum(const Header& h, const Columns& columns, FluxUnit unit, std::vector<V3d> tables)
        : spectral_(h.spectral), columns_(columns), unit_(unit), tables_(std::move(tables)) {
        if (spectral_ == Spectral::single) tables_ = {cie_xyz(double{h.wavelength})};
        if (columns_.tristimulus >= 0)
            mode_ = columns_.luminous >= 0 ? Mode::tristimulus : Mode::constant;
        else if (spectral_ == Spectral::per_ray && columns_.wavelength >= 0)
            mode_ = Mode::wavelength;
        else if (spectral_ == Spectral::index_per_ray && columns_.spectrum >= 0)
            mode_ = Mode::index;
    }
    void add(const float* row, double flux) {
        if (mode_ == Mode::tristimulus) {
            const double y = double{row[columns_.luminous]};
            add_if_finite({double{row[columns_.tristimulus]}, y, double{row[columns_.tristimulus + 1]}});
        } else if (mode_ == Mode::wavelength) {
            add_scaled(cie_xyz(double{row[columns_.wavelength]}), flux);
        } else if (mode_ == Mode::index) {
            const float index = row[columns_.spectrum];
            if (index >= 0 && index < static_cast<float>(tables_.size())) {
                add_scaled(tables_[static_cast<std::size_t>(index)], flux);
            }
        }
    }
    Rgb colour() const {
        const V3d xyz = mode_ == Mode::constant && !tables_.empty() ? tables_[0] : sum_;
        return colour_of_luminance_one(xyz_to_rgb(xyz));
    }
    bool several_unused() const { return mode_ == Mode::constant && tables_.size() > 1; }

  private:
    enum class Mode : std::uint8_t { constant, tristimulus, wavelength, index };

    // Luminous flux already holds ȳ: divide it out. Radiant flux does not.
    void add_scaled(const V3d& xyz, double flux) {
        if (unit_ == FluxUnit::watt)
            add_if_finite(flux * xyz);
        else if (xyz.y > 0)
            add_if_finite(flux / xyz.y * xyz);
    }
    void add_if_finite(const V3d& xyz) {
        if (std::isfinite(xyz.x) && std::isfinite(xyz.y) && std::isfinite(xyz.z)) sum_ += xyz;
    }

    Spectral spectral_;
    Columns columns_;
    FluxUnit unit_;
    std::vector<V3d> tables_;
    Mode mode_ = Mode::constant;
    V3d sum_{0, 0, 0};
};

// Adds one row to the set, or counts why not. Returns the flux that the row stands for.
double take_ray(const float* row, float flux, RaySet& set) {
    const V3f o(row[0], row[1], row[2]);
    const V3f d(row[3], row[4], row[5]);
    const bool has_flux = std::isfinite(flux) && flux >= 0;
    // The squares of directions as long as 1e20 would overflow a float.
    const double length = std::sqrt(sqr(double{d.x}) + sqr(double{d.y}) + sqr(double{d.z}));
    if (!has_flux || !is_finite(o) || !std::isfinite(length)) {
        ++set.skipped_nan;
    } else if (length < 1e-6) {
        ++set.skipped_zero_direction;
    } else {
        const V3f unit(static_cast<float>(double{d.x} / length), static_cast<float>(double{d.y} / length),
                       static_cast<float>(double{d.z} / length));
        set.rays.push_back({kMetresPerMillimetre * o, unit, flux});
        return double{flux};
    }
    if (has_flux) set.skipped_flux += double{flux};
    return has_flux ? double{flux} : 0.0;
}

// Lets a finite, positive header flux win over the sum.
void settle_flux(RaySet& set, double sum, const Location& at, Monitor& monitor) {
    const double header = set.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts;
    set.flux = sum;
    if (!std::isfinite(header) || !(header > 0)) return;
    if (!(sum > 0)) {
        input_error(at, "the header states {} {}, but the rays carry nothing", header,
                    flux_unit_name(set.unit));
    }
    if (std::fabs(header - sum) > 1e-3 * header) {
        monitor.warn(
            fmt::format("{}: the header states {:.6g} {}, the rays add up to {:.6g}; the header is believed",
                        to_string(at), header, flux_unit_name(set.unit), sum));
    }
    const double factor = header / sum;
    for (LampRay& ray : set.rays) ray.flux = static_cast<float>(double{ray.flux} * factor);
    set.skipped_flux *= factor;
    set.flux = header;
}

}  // namespace

RaySet read_tm25(const std::filesystem::path& file, Monitor& monitor) {
    Source source(file);
    const Header header = read_header(source);
    std::vector<V3d> tables = read_tables(source, header);
    source.skip(static_cast<std::uint64_t>(header.extra_columns) * kColumnNameBytes, "column names");
    source.skip(static_cast<std::uint64_t>(header.text_bytes), "additional text");

    const Columns columns(header.has, header.extra_columns);
    const std::uint64_t row_bytes = static_cast<std::uint64_t>(columns.count) * sizeof(float);
    if (header.rays == 0) throw InputError(source.at(), "the file states 0 rays");
    if (header.rays > source.left() / row_bytes) {
        input_error(source.at(), "truncated in the rays: {} rays of {} bytes stated, {} bytes left",
                    header.rays, row_bytes, source.left());
    }

    RaySet set;
    set.unit = header.has.radiant ? FluxUnit::watt : FluxUnit::lumen;
    set.header_lumens = header.lumens;
    set.header_watts = header.watts;
    set.provenance = fmt::format("TM-25 ray file {}, {} rays{}{}{}{}", file.filename().string(), header.rays,
                                 header.date.empty() ? "" : ", ", header.date,
                                 header.text.empty() ? "" : "; ", header.text);
    set.rays.reserve(header.rays);
    ColourSum colour(header, columns, set.unit, std::move(tables));
    if (colour.several_unused()) {
        monitor.warn(fmt::format("{}: several spectra and no index per ray; the first one gives the colour",
                                 to_string(source.at())));
    }

    // Read block by block: a row is passed through once.
    constexpr std::uint64_t kBlock = 1 << 14;
    Phase phase(monitor, "reading rays", header.rays);
    const auto width = static_cast<std::size_t>(columns.count);
    std::vector<float> block;
    double sum = 0;
    for (std::uint64_t done = 0; done < header.rays;) {
        const std::uint64_t n = std::min(kBlock, header.rays - done);
        block.resize(n * width);
        source.read(block.data(), n * row_bytes, "rays");
        for (std::uint64_t i = 0; i < n; ++i) {
            const float* row = &block[i * width];
            const float flux = row[header.has.radiant ? columns.radiant : columns.luminous];
            const std::size_t before = set.rays.size();
            sum += take_ray(row, flux, set);
            if (set.rays.size() > before) colour.add(row, double{flux});
        }
        done += n;
        phase.advance(n);
    }

    set.colour = colour.colour();
    if (set.rays.empty())
        throw InputError(source.at(), "no ray is usable: all have a bad position, direction or flux");
    if (set.skipped_nan + set.skipped_zero_direction > 0) {
        monitor.warn(
            fmt::format("{}: {} rays skipped for a number that is not finite or a negative flux, {} for a "
                        "direction of length 0",
                        to_string(source.at()), set.skipped_nan, set.skipped_zero_direction));
    }
    if (source.left() > 0) {
        monitor.warn(fmt::format("{}: {} bytes after the last ray are ignored", to_string(source.at()),
                                 source.left()));
    }
    settle_flux(set, sum, source.at(), monitor);
    return set;
}

}  // namespace lucerna
