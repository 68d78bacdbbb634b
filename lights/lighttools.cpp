// LightTools binary ray files (.ray): a header of 44 bytes, rows of seven or eight floats, an end mark.
//
// The header states no number of rays: they extend to the end mark, which must be at the end of the file.
#include <array>

#include "engine/colour/spectrum.h"
#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kLightToolsHeaderBytes = 44;
constexpr char kEndMark[] = "LTRFEND";
constexpr std::uint64_t kEndBytes = sizeof kEndMark - 1;
constexpr std::size_t kLightToolsFlux = 6, kLightToolsWavelength = 7;
// Unit 0 is the length unit of the model that the file came from, which the file does not name.
constexpr NamedUnit kLightToolsUnits[] = {{"the model's, assumed to be mm", 1e-3F},
                                          {"mm", 1e-3F},
                                          {"cm", 0.01F},
                                          {"m", 1},
                                          {"in", 0.0254F},
                                          {"ft", 0.3048F},
                                          {"um", 1e-6F},
                                          {"nm", 1e-9F}};

struct LightToolsHeader {
    double flux = 0;
    float metres = 1;
    bool per_ray = false;  // each row has a wavelength
    FluxUnit unit = FluxUnit::watt;
};

LightToolsHeader read_lighttools_header(RaySource& source, Monitor& monitor) {
    const Location& at = source.at();
    std::array<std::byte, kLightToolsHeaderBytes> bytes{};
    source.read(bytes.data(), bytes.size(), "header");
    if (std::memcmp(bytes.data(), "LTRF", 4) != 0)
        input_error(at, "not a LightTools ray file: {}", content_of_ray_file(at.file));
    const auto word = [&](std::uint64_t offset) { return value_at<std::int32_t>(bytes, offset); };
    const auto require = [&](std::uint64_t offset, const char* what, std::int32_t accepted, const char* why) {
        if (word(offset) == accepted) return;
        input_error(at, "{} {}; expected {} ({})", what, word(offset), accepted, why);
    };
    require(4, "version", 2, "no polarisation");
    require(16, "far-field mark", 0, "rays with positions");
    LightToolsHeader h;
    const std::int32_t data = word(12);
    if (data != 0 && data != 1) input_error(at, "data type {}; expected 0 (W) or 1 (lm)", data);
    h.unit = data == 1 ? FluxUnit::lumen : FluxUnit::watt;
    const std::int32_t colour = word(20);
    if (colour != 0 && colour != 2)
        input_error(at, "colour information {}; expected 0 (none) or 2 (wavelengths)", colour);
    h.per_ray = colour == 2;
    h.metres = metres_of_unit(word(24), kLightToolsUnits, at);
    if (word(24) == 0) {
        monitor.warn(
            fmt::format("{}: lengths are in the unit of the original model; mm is assumed", to_string(at)));
    }
    h.flux = stated(value_at<float>(bytes, 40));
    return h;
}

// Returns the number of rows between the header and the end mark.
std::uint64_t count_rows(const RaySource& source, std::size_t floats) {
    const std::uint64_t row_bytes = floats * sizeof(float);
    if (source.left() < kEndBytes || (source.left() - kEndBytes) % row_bytes != 0) {
        input_error(source.at(),
                    "truncated: {} bytes after the header are not a number of rows of {} bytes plus an end "
                    "mark of {}",
                    source.left(), row_bytes, kEndBytes);
    }
    return (source.left() - kEndBytes) / row_bytes;
}

}  // namespace

RaySet read_lighttools(const std::filesystem::path& file, Monitor& monitor) {
    RaySource source(file);
    const LightToolsHeader header = read_lighttools_header(source, monitor);
    const std::size_t floats = header.per_ray ? 8 : 7;
    const std::uint64_t rays = count_rows(source, floats);
    source.require_rows(rays, floats, header.per_ray);

    RaySet set;
    set.unit = header.unit;
    (header.unit == FluxUnit::lumen ? set.header_lumens : set.header_watts) = header.flux;
    set.provenance = fmt::format("LightTools ray file {}, {} rays", file.filename().string(), rays);
    RayColours colours(set);
    set.rays.reserve(rays);
    if (header.per_ray) set.tristimulus.reserve(rays);
    RayTaker taker(set, header.metres);
    read_rows(source, rays, floats, monitor, [&](const float* row) {
        if (!taker.take(row, row[kLightToolsFlux]) || !header.per_ray) return;
        colours.add_per_watt(cie_xyz(double{row[kLightToolsWavelength]}));
    });
    char mark[kEndBytes];
    source.read(mark, kEndBytes, "end mark");
    if (std::memcmp(mark, kEndMark, kEndBytes) != 0)
        throw InputError(source.at(), "the end mark LTRFEND is missing: the file is truncated or damaged");
    colours.settle();
    taker.settle(header.flux, source, monitor);
    return set;
}

}  // namespace lucerna
