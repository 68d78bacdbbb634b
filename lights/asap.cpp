// ASAP ray distribution files (.dis): records of seven words, five for the header and then one for each ray.
//
// The records of the header, by word:
//
//     0     247 + 1024 times the words of a record     six words without meaning
//     1     title, 24 characters                       a number
//     2     "Tot Flux"       total flux                "XYZABCF MM", 16 characters
//     3     "Ray number", 16 characters    1           number of rays    its negative, a whole number
//     4     "Wavelength", 16 characters    wavelength  wavelength        1
//
// The letters say what a ray's words are: x y z, direction and flux. Behind them stands the unit of length.
// Neither the unit of the flux nor that of the wavelength is stated.
#include <array>

#include "lights/photometric_files.h"
#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::int32_t kAsapCode = 247, kCodePerWord = 1024, kAsapWords = 7, kMostAsapWords = 12;
constexpr std::size_t kAsapRecord = 28, kAsapHeaderBytes = 5 * kAsapRecord;
constexpr std::string_view kAsapColumns = "XYZABCF";
constexpr NamedUnit kAsapUnits[] = {{"MM", 1e-3}, {"CM", 0.01}, {"M", 1}, {"INCH", 0.0254}};

// Returns the number of words of a record, which the file's first word states; 0 if it is not one of ASAP's.
std::int32_t words_of_record(std::int32_t code) {
    const bool asap = code % kCodePerWord == kAsapCode && code / kCodePerWord >= kAsapWords &&
                      code / kCodePerWord <= kMostAsapWords;
    return asap ? code / kCodePerWord : 0;
}

// Returns the metres of the unit behind the columns' letters.
double metres_of_label(const std::string& label, const Location& at, Monitor& monitor) {
    if (!label.starts_with(kAsapColumns))
        input_error(at, "columns \"{}\"; expected \"{}\" and a unit of length", label, kAsapColumns);
    const std::string unit =
        label.substr(std::min(label.find_first_not_of(" _", kAsapColumns.size()), label.size()));
    if (unit.empty()) {
        monitor.warn(fmt::format("{}: states no unit of length; mm is assumed", to_string(at)));
        return kMetresPerMillimetre;
    }
    for (const NamedUnit& known : kAsapUnits) {
        if (unit == known.name) return known.metres;
    }
    input_error(at, "length unit \"{}\"; expected MM, CM, M or INCH", unit);
}

}  // namespace

bool is_asap(std::span<const std::byte> first) {
    if (first.size() < 4) return false;
    const auto code = value_at<std::int32_t>(first, 0);
    return words_of_record(code) > 0 || words_of_record(byte_swapped(code)) > 0;
}

RaySet read_asap(RaySource& source, Monitor& monitor) {
    const Location& at = source.at();
    const std::int32_t words = words_of_record(value_at<std::int32_t>(source.first(), 0));
    if (words == 0) refuse_big_endian(at);
    if (words != kAsapWords)
        input_error(at, "records of {} words; expected {}: position, direction and flux", words, kAsapWords);
    std::array<std::byte, kAsapHeaderBytes> bytes{};
    source.read(bytes.data(), bytes.size(), "header");
    const auto text = [&](std::size_t record, std::size_t offset, std::size_t size) {
        return ascii_text(std::span(bytes).subspan(record * kAsapRecord + offset, size));
    };
    const auto real = [&](std::size_t record, std::size_t offset) {
        return stated(value_at<float>(bytes, record * kAsapRecord + offset));
    };
    const double flux = real(2, 8), wavelength = real(4, 16);
    const std::int64_t rays = -std::int64_t{value_at<std::int32_t>(bytes, 3 * kAsapRecord + 24)};
    if (rays < 1) input_error(at, "the file states {} rays; expected at least one", rays);

    RaySet set;
    set.unit = FluxUnit::watt;
    set.header_watts = flux;
    set.text = text(1, 0, 24);
    set.provenance = fmt::format("ASAP ray file {}, {} rays{}{}", source.name(), rays,
                                 set.text.empty() ? "" : "; ", set.text);
    RayColumns columns;
    columns.metres = metres_of_label(text(2, 12, 16), at, monitor);
    RowTaker rows = take_rows(source, static_cast<std::uint64_t>(rays), columns, set, monitor);
    monitor.warn(
        fmt::format("{}: ASAP's format does not tell watts from lumens; watts are assumed", to_string(at)));
    if (wavelength > 0) {
        monitor.warn(
            fmt::format("{}: the wavelength {:g} is ignored, because its unit is not stated; --colours of "
                        "light import gives one",
                        to_string(at), wavelength));
    }
    rows.settle(flux, RayTaker::Header::absolute, source, monitor);
    return set;
}

}  // namespace lucerna
