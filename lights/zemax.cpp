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

#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::int32_t kIdentifier = 1010;
constexpr std::uint64_t kZemaxHeaderBytes = 208;
constexpr double kNanometresPerMicrometre = 1000;
constexpr NamedUnit kZemaxUnits[] = {{"m", 1}, {"in", 0.0254}, {"cm", 0.01}, {"ft", 0.3048}, {"mm", 1e-3}};

struct ZemaxHeader {
    std::int32_t rays = 0;
    std::string text;
    double flux = 0;        // of the ray set, in `unit`
    double wavelength = 0;  // of all rays [nm]; NaN or 0: not stated
    double metres = 1;
    bool per_ray = false;  // each row has a wavelength
    FluxUnit unit = FluxUnit::watt;
};

ZemaxHeader read_zemax_header(RaySource& source) {
    const Location& at = source.at();
    std::array<std::byte, kZemaxHeaderBytes> bytes{};
    source.read(bytes.data(), bytes.size(), "header");
    const auto whole = [&](std::uint64_t offset) { return value_at<std::int32_t>(bytes, offset); };
    const auto real = [&](std::uint64_t offset) { return stated(value_at<float>(bytes, offset)); };
    if (whole(0) != kIdentifier) refuse_big_endian(at);
    ZemaxHeader h;
    h.rays = whole(4);
    if (h.rays < 1) input_error(at, "the file states {} rays; expected at least one", h.rays);
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
constexpr std::string_view kRowOfText = "x y z, direction, flux and perhaps a wavelength";

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

// Returns where rows of seven or eight numbers have their values.
RayColumns zemax_columns(std::size_t floats, double metres, const char* place) {
    RayColumns columns;
    columns.floats = floats;
    if (floats == 8) columns.wavelength = 7;
    columns.metres = metres;
    columns.nanometres = kNanometresPerMicrometre;
    columns.place = place;
    return columns;
}

}  // namespace

bool is_zemax(std::span<const std::byte> first) {
    if (first.size() < 4) return false;
    const auto word = value_at<std::int32_t>(first, 0);
    return word == kIdentifier || byte_swapped(word) == kIdentifier;
}

RaySet read_zemax(RaySource& source, Monitor& monitor) {
    const ZemaxHeader header = read_zemax_header(source);
    const auto rays = static_cast<std::uint64_t>(header.rays);
    RaySet set;
    set.unit = header.unit;
    (header.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts) = header.flux;
    set.text = header.text;
    set.provenance = fmt::format("Zemax ray file {}, {} rays{}{}", source.name(), rays,
                                 header.text.empty() ? "" : "; ", header.text);
    RowTaker rows =
        take_rows(source, rays, zemax_columns(header.per_ray ? 8 : 7, header.metres, "byte"), set, monitor);
    if (!header.per_ray) rows.all(header.wavelength);
    rows.settle(header.flux, RayTaker::Header::absolute, source, monitor);
    return set;
}

bool is_zemax_text(std::span<const std::byte> first) {
    std::string_view text = text_of(first);
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    return whole_numbers(text.substr(0, text.find_first_of("\r\n"))).has_value();
}

RaySet read_zemax_text(RaySource& source, Monitor& monitor) {
    RayLines lines(source);
    std::string_view line;
    const auto header = lines.next(line) ? whole_numbers(line) : std::nullopt;
    if (!header)
        input_error(lines.at(), "the first line is not a number of rays and the number of a unit of length");
    const auto [rays, unit] = *header;
    const double metres = metres_of_unit(unit, kZemaxUnits, lines.at());
    const std::uint64_t most = (lines.left() + 1) / kShortestRow;
    if (rays < 1) input_error(lines.at(), "the file states {} rays; expected at least one", rays);
    if (static_cast<std::uint64_t>(rays) > most)
        input_error(lines.at(), "truncated in the rays: {} rays stated, the file has room for at most {}",
                    rays, most);

    RaySet set;
    set.unit = FluxUnit::watt;
    set.provenance = fmt::format("Zemax text ray file {}, {} rays", source.name(), rays);
    std::optional<RowTaker> rows;
    Phase phase(monitor, "reading rays", static_cast<std::uint64_t>(rays));
    std::size_t columns = 0;  // in all rows, as in the first
    for (std::int64_t i = 0; i < rays; ++i) {
        if (!lines.next(line))
            input_error(source.at(), "truncated in the rays: {} rays stated, {} there", rays, i);
        std::array<float, 8> row{};
        const std::size_t count = read_numbers(line, " \t", row, lines.at(), kRowOfText);
        if (i == 0) {
            if (count < 7 || count > 8)
                input_error(lines.at(), "{} numbers; expected 7 or 8: {}", count, kRowOfText);
            columns = count;
            require_ray_memory(static_cast<std::uint64_t>(rays), columns == 8, source.at());
            rows.emplace(set, zemax_columns(columns, metres, "line"), static_cast<std::uint64_t>(rays));
        }
        if (count != columns)
            input_error(lines.at(), "{} numbers; expected {}, as the first ray has", count, columns);
        phase.advance(1);
        rows->take(row.data(), static_cast<std::uint64_t>(lines.number()));
    }
    std::uint64_t more = 0;
    while (lines.next(line)) ++more;
    if (more > 0)
        monitor.warn(
            fmt::format("{}: {} lines after the last ray are ignored", to_string(source.at()), more));
    monitor.warn(fmt::format("{}: Zemax's text form does not tell watts from lumens; watts are assumed",
                             to_string(source.at())));
    rows->settle(NAN, RayTaker::Header::absolute, source, monitor);
    return set;
}

}  // namespace lucerna
