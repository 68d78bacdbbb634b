// Zemax binary source files (.dat): a header of 208 bytes, then rows of seven or eight floats.
//
// The header also holds a place, a rotation and a scale; the program that defines the format reads past them,
// and so does this one.
#include <array>

#include "engine/base/spectrum.h"
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
    double wavelength = 0;  // of all rays, nm; NaN or 0: not stated
    float metres = 1;
    bool per_ray = false;  // a wavelength in each row
    FluxUnit unit = FluxUnit::watt;
};

ZemaxHeader read_zemax_header(RaySource& source) {
    const Location& at = source.at();
    std::array<std::byte, kZemaxHeaderBytes> bytes{};
    source.read(bytes.data(), bytes.size(), "header");
    const auto whole = [&](std::uint64_t offset) { return value_at<std::int32_t>(bytes, offset); };
    const auto real = [&](std::uint64_t offset) { return double{value_at<float>(bytes, offset)}; };
    if (whole(0) != kIdentifier)
        input_error(at, "not a Zemax ray file: it starts with {}, not with {}", whole(0), kIdentifier);
    ZemaxHeader h;
    h.rays = whole(4);
    if (h.rays < 1) input_error(at, "the file states {} rays", h.rays);
    h.text = ascii_text(std::span(bytes).subspan(8, 100));
    // The ray set may be a part of the source; its own flux is what the rays stand for.
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
        colours.add_per_watt(cie_xyz(double{row[kZemaxWavelength]} * kNanometresPerMicrometre));
    });
    colours.settle();
    taker.settle(header.flux, source, monitor);
    return set;
}

}  // namespace lucerna
