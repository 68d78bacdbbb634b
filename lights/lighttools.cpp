// LightTools binary ray files (.ray): a header of 44 bytes, rows of seven or eight floats, an end mark. In
// version 3 the header has one more word, which says whether the rays are polarised.
//
// The header states no number of rays: they extend to the end mark, which must be at the end of the file.
#include <array>

#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kLightToolsHeaderBytes = 44;
constexpr std::int32_t kLightToolsVersion = 2, kPolarisedVersion = 3;
constexpr char kEndMark[] = "LTRFEND";
constexpr std::uint64_t kEndBytes = sizeof kEndMark - 1;
// Unit 0 is the length unit of the model that the file came from, which the file does not name.
constexpr NamedUnit kLightToolsUnits[] = {{"the model's, assumed to be mm", 1e-3},
                                          {"mm", 1e-3},
                                          {"cm", 0.01},
                                          {"m", 1},
                                          {"in", 0.0254},
                                          {"ft", 0.3048},
                                          {"um", 1e-6},
                                          {"nm", 1e-9}};

struct LightToolsHeader {
    double flux = 0;
    double metres = 1;
    bool per_ray = false;  // each row has a wavelength
    FluxUnit unit = FluxUnit::watt;
};

LightToolsHeader read_lighttools_header(RaySource& source, Monitor& monitor) {
    const Location& at = source.at();
    std::array<std::byte, kLightToolsHeaderBytes> bytes{};
    source.read(bytes.data(), bytes.size(), "header");
    const auto word = [&](std::uint64_t offset) { return value_at<std::int32_t>(bytes, offset); };
    const auto require = [&](std::uint64_t offset, const char* what, std::int32_t accepted, const char* why) {
        if (word(offset) == accepted) return;
        input_error(at, "{} {}; expected {} ({})", what, word(offset), accepted, why);
    };
    const std::int32_t version = word(4), swapped = byte_swapped(version);
    if (swapped == kLightToolsVersion || swapped == kPolarisedVersion) refuse_big_endian(at);
    if (version != kLightToolsVersion && version != kPolarisedVersion)
        input_error(at, "version {}; expected {} or {}", version, kLightToolsVersion, kPolarisedVersion);
    require(16, "far-field mark", 0, "rays with positions");
    LightToolsHeader h;
    const std::int32_t data = word(12);
    if (data != 0 && data != 1) input_error(at, "data type {}; expected 0 (W) or 1 (lm)", data);
    h.unit = data == 1 ? FluxUnit::lumen : FluxUnit::watt;
    const std::int32_t colour = word(20);
    if (colour != 0 && colour != 2) {
        input_error(at, "colour information {}{}; expected 0 (none) or 2 (wavelengths)", colour,
                    colour == 1 ? " (CIE tristimulus values)" : "");
    }
    h.per_ray = colour == 2;
    h.metres = metres_of_unit(word(24), kLightToolsUnits, at);
    if (word(24) == 0) {
        monitor.warn(
            fmt::format("{}: lengths are in the unit of the original model; mm is assumed", to_string(at)));
    }
    h.flux = stated(value_at<float>(bytes, 40));
    if (version == kPolarisedVersion) {
        std::int32_t polarisation = 0;
        source.read(&polarisation, sizeof polarisation, "header");
        if (polarisation != 0)
            input_error(at, "polarisation {}; expected 0 (rays without polarisation)", polarisation);
    }
    return h;
}

}  // namespace

bool is_lighttools(std::span<const std::byte> first) {
    return text_of(first).starts_with("LTRF");
}

RaySet read_lighttools(RaySource& source, Monitor& monitor) {
    const LightToolsHeader header = read_lighttools_header(source, monitor);
    RayColumns columns;
    columns.floats = header.per_ray ? 8 : 7;
    if (header.per_ray) columns.wavelength = 7;
    columns.metres = header.metres;
    const std::uint64_t rays = rows_left(source, columns.floats * sizeof(float), kEndBytes);

    RaySet set;
    set.unit = header.unit;
    (header.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts) = header.flux;
    set.provenance = fmt::format("LightTools ray file {}, {} rays", source.name(), rays);
    RowTaker rows = take_rows(source, rays, columns, set, monitor);
    char mark[kEndBytes];
    source.read(mark, kEndBytes, "end mark");
    if (std::memcmp(mark, kEndMark, kEndBytes) != 0)
        throw InputError(source.at(), "the end mark LTRFEND is missing: the file is truncated or damaged");
    rows.settle(header.flux, RayTaker::Header::absolute, source, monitor);
    return set;
}

}  // namespace lucerna
