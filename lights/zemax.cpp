// Zemax source files (.dat, .sdf), binary and text.
//
// The binary form has a header of 208 bytes, then rows of seven or eight floats. The header also holds a
// position, a rotation and a scale, which the program that defines the format ignores, as we do. The text
// form has a line with the number of rays and the length unit, then a line for each ray: x y z, direction,
// flux and, in an optional eighth column, the wavelength in micrometres.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "engine/colour/spectrum.h"
#include "lights/photometric_files.h"
#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::int32_t kIdentifier = 1010;
constexpr std::uint64_t kZemaxHeaderBytes = 208;
constexpr std::size_t kZemaxFlux = 6, kZemaxWavelength = 7;
constexpr double kNanometresPerMicrometre = 1000;
constexpr NamedUnit kZemaxUnits[] = {
    {"m", 1}, {"in", 0.0254F}, {"cm", 0.01F}, {"ft", 0.3048F}, {"mm", 1e-3F}};

struct ZemaxHeader {
    std::int32_t rays = 0;
    std::string text;
    double flux = 0;        // of the ray set, in `unit`
    double wavelength = 0;  // of all rays [nm]; NaN or 0: not stated
    float metres = 1;
    bool per_ray = false;  // each row has a wavelength
    FluxUnit unit = FluxUnit::watt;
};

// Returns CIE XYZ per watt of the light of a wavelength in micrometres, or NaN if it is unknown.
V3d xyz_of_micrometres(float wavelength) {
    const double known = stated(wavelength);
    return known > 0 ? cie_xyz(known * kNanometresPerMicrometre) : V3d(NAN);
}

ZemaxHeader read_zemax_header(RaySource& source) {
    const Location& at = source.at();
    std::array<std::byte, kZemaxHeaderBytes> bytes{};
    source.read(bytes.data(), bytes.size(), "header");
    const auto whole = [&](std::uint64_t offset) { return value_at<std::int32_t>(bytes, offset); };
    const auto real = [&](std::uint64_t offset) { return stated(value_at<float>(bytes, offset)); };
    if (whole(0) != kIdentifier)
        input_error(at, "not a binary Zemax ray file: {}", content_of_ray_file(at.file));
    ZemaxHeader h;
    h.rays = whole(4);
    if (h.rays < 1) input_error(at, "the file states {} rays", h.rays);
    h.text = ascii_text(std::span(bytes).subspan(8, 100));
    // The ray set may be a subset of the source; the rays represent the flux of the set.
    h.flux = real(112) > 0 ? real(112) : real(108);
    h.wavelength = real(116) * kNanometresPerMicrometre;
    h.metres = metres_of_unit(whole(136), kZemaxUnits, at);
    const std::int32_t format = whole(192);
    if (format != 0 && format != 2)
        input_error(at, "ray format {}; expected 0 (flux) or 2 (flux and wavelength)", format);
    h.per_ray = format == 2;
    const std::int32_t flux_type = whole(196);
    if (flux_type != 0 && flux_type != 1)
        input_error(at, "flux type {}; expected 0 (W) or 1 (lm)", flux_type);
    h.unit = flux_type == 1 ? FluxUnit::lumen : FluxUnit::watt;
    return h;
}

// --- the text form -----------------------------------------------------------------------------------------

constexpr std::uint64_t kShortestRow = 14;  // bytes of "0 0 0 0 0 1 1" and the end of its line

// Returns the two integers that make up the line; none for any other line.
std::optional<std::pair<std::int64_t, std::int32_t>> whole_numbers(std::string_view line) {
    std::pair<std::int64_t, std::int32_t> two{};
    const auto take = [&line](auto& number) {
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
        if (error != std::errc()) return false;
        line.remove_prefix(static_cast<std::size_t>(end - line.data()));
        return line.empty() || line[0] == ' ' || line[0] == '\t';
    };
    if (!take(two.first) || !take(two.second)) return std::nullopt;
    if (line.find_first_not_of(" \t") != line.npos) return std::nullopt;
    return two;
}

// Returns the number of values on the line, and stores the first ones in `row`.
std::size_t read_row(std::string_view line, std::span<float> row, const Location& at) {
    std::size_t count = 0;
    for (std::size_t begin = line.find_first_not_of(" \t"); begin != line.npos;
         begin = line.find_first_not_of(" \t", begin)) {
        const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
        std::string_view word = line.substr(begin, end - begin);
        begin = end;
        if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
        double value = 0;
        const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error == std::errc::invalid_argument || rest != word.data() + word.size())
            input_error(at,
                        "\"{}\" is not a number; expected x y z, direction, flux and perhaps a wavelength",
                        shown_value(word));
        // Values outside double's range become 0 or infinity.
        if (count < row.size()) row[count] = static_cast<float>(value);
        ++count;
    }
    return count;
}

}  // namespace

RaySet read_zemax(const std::filesystem::path& file, Monitor& monitor) {
    RaySource source(file);
    const ZemaxHeader header = read_zemax_header(source);
    const auto rays = static_cast<std::uint64_t>(header.rays);
    const std::size_t floats = header.per_ray ? 8 : 7;
    source.require_rows(rays, floats, header.per_ray);

    RaySet set;
    set.unit = header.unit;
    (header.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts) = header.flux;
    set.provenance = fmt::format("Zemax ray file {}, {} rays{}{}", file.filename().string(), rays,
                                 header.text.empty() ? "" : "; ", header.text);
    RayColours colours(set);
    if (!header.per_ray) colours.all(cie_xyz(header.wavelength));
    set.rays.reserve(rays);
    if (header.per_ray) set.tristimulus.reserve(rays);
    RayTaker taker(set, header.metres);
    read_rows(source, rays, floats, monitor, [&](const float* row) {
        if (!taker.take(row, row[kZemaxFlux]) || !header.per_ray) return;
        colours.add_per_watt(xyz_of_micrometres(row[kZemaxWavelength]));
    });
    colours.settle();
    taker.settle(header.flux, source, monitor);
    return set;
}

bool is_zemax_text(std::span<const std::byte> first) {
    std::string_view text(reinterpret_cast<const char*>(first.data()), first.size());
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    return whole_numbers(text.substr(0, text.find_first_of("\r\n"))).has_value();
}

RaySet read_zemax_text(const std::filesystem::path& file, Monitor& monitor) {
    RaySource source(file);
    RayLines lines(source);
    std::string_view line;
    const auto header = lines.next(line) ? whole_numbers(line) : std::nullopt;
    if (!header)
        input_error(source.at(),
                    "not a Zemax text ray file: the first line is not a number of rays and a unit");
    const auto [rays, unit] = *header;
    const float metres = metres_of_unit(unit, kZemaxUnits, lines.at());
    const std::uint64_t most = (source.left() + lines.unread() + 1) / kShortestRow;
    if (rays < 1) input_error(lines.at(), "the file states {} rays", rays);
    if (static_cast<std::uint64_t>(rays) > most)
        input_error(lines.at(), "truncated in the rays: {} rays stated, the file has room for at most {}",
                    rays, most);

    RaySet set;
    set.unit = FluxUnit::watt;
    set.provenance = fmt::format("Zemax text ray file {}, {} rays", file.filename().string(), rays);
    RayColours colours(set);
    RayTaker taker(set, metres);
    Phase phase(monitor, "reading rays", static_cast<std::uint64_t>(rays));
    std::size_t columns = 0;  // in all rows, as in the first
    for (std::int64_t i = 0; i < rays; ++i) {
        if (!lines.next(line))
            input_error(source.at(), "truncated in the rays: {} rays stated, {} there", rays, i);
        std::array<float, 8> row{};
        const std::size_t count = read_row(line, row, lines.at());
        if (i == 0) {
            if (count < 7 || count > 8)
                input_error(lines.at(),
                            "{} numbers; expected 7 or 8: x y z, direction, flux and perhaps a wavelength",
                            count);
            columns = count;
            require_ray_memory(static_cast<std::uint64_t>(rays), columns == 8, source.at());
            set.rays.reserve(static_cast<std::size_t>(rays));
        }
        if (count != columns)
            input_error(lines.at(), "{} numbers; expected {}, as the first ray has", count, columns);
        phase.advance(1);
        if (taker.take(row.data(), row[kZemaxFlux]) && columns == 8)
            colours.add_per_watt(xyz_of_micrometres(row[kZemaxWavelength]));
    }
    std::uint64_t more = 0;
    while (lines.next(line)) ++more;
    if (more > 0)
        monitor.warn(
            fmt::format("{}: {} lines after the last ray are ignored", to_string(source.at()), more));
    monitor.warn(fmt::format("{}: Zemax's text form does not tell watts from lumens; watts are assumed",
                             to_string(source.at())));
    colours.settle();
    taker.settle(NAN, source, monitor);
    return set;
}

}  // namespace lucerna
