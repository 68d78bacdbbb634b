// SPEOS ray files (.ray): a header of seven floats, then rows of eight.
//
// The header begins with the flux in W and ends with it in lm, 0 if it is not known. The five numbers between
// are not described publicly and are ignored. A row is x y z in mm, direction, wavelength in nm and energy.
// Energies are relative: together they are the header's watts. The number of rows follows from the size of
// the file. As the format has no signature, it is recognised by its rows.
#include <array>
#include <cmath>

#include "lights/ray_reader.h"

namespace lucerna {
namespace {

constexpr std::size_t kSpeosHeaderBytes = 28, kSpeosRowBytes = 32, kPolarisedRowBytes = 52;

// Returns the share of rows at the beginning of a file, if they have that size, whose direction has length 1
// and whose wavelength is one of optics, 100 nm to 100 µm.
double share_of_rays(std::span<const std::byte> first, std::size_t row_bytes, bool big_endian) {
    if (first.size() < kSpeosHeaderBytes + row_bytes) return 0;
    const auto real = [&](std::size_t at) {
        const auto word = value_at<std::uint32_t>(first, at);
        return stated(std::bit_cast<float>(big_endian ? byte_swapped(word) : word));
    };
    std::size_t rows = 0, rays = 0;
    for (std::size_t at = kSpeosHeaderBytes; at + row_bytes <= first.size(); at += row_bytes) {
        ++rows;
        const double length2 = sqr(real(at + 12)) + sqr(real(at + 16)) + sqr(real(at + 20));
        const double wavelength = real(at + 24);
        if (std::isnan(length2) || std::isnan(wavelength)) continue;
        if (std::fabs(length2 - 1) < 1e-3 && wavelength > 100 && wavelength < 1e5) ++rays;
    }
    return static_cast<double>(rays) / static_cast<double>(rows);
}

constexpr double kMostAreRays = 0.5;

// Takes the luminous efficacy of a file that states lumens beside watts. A single wavelength that does not
// have it stands for a spectrum that the file does not hold.
void take_stated_efficacy(RaySet& set, const Location& at, Monitor& monitor) {
    if (!(set.header_watts > 0) || !(set.header_lumens > 0)) return;
    const double efficacy = set.header_lumens / set.header_watts;
    if (efficacy > kMostLumensPerWatt) return;  // programs round V(λ) up, too
    constexpr double kTolerance = 0.05;
    if (!set.coloured() && std::fabs(efficacy - set.lumens_per_watt) > kTolerance * efficacy) {
        monitor.warn(fmt::format(
            "{}: all rays have one wavelength, whose light has {:.4g} lm/W, but the header states "
            "{:.4g} lm and {:.4g} W; the wavelength is ignored and the light is taken as white",
            to_string(at), set.lumens_per_watt, set.header_lumens, set.header_watts));
        set.xyz = kWhiteXyz;
    }
    set.lumens_per_watt = efficacy;
}

}  // namespace

bool is_speos(std::span<const std::byte> first) {
    for (const std::size_t row_bytes : {kSpeosRowBytes, kPolarisedRowBytes}) {
        for (const bool big_endian : {false, true}) {
            if (share_of_rays(first, row_bytes, big_endian) >= kMostAreRays) return true;
        }
    }
    return false;
}

RaySet read_speos(RaySource& source, Monitor& monitor) {
    if (share_of_rays(source.first(), kSpeosRowBytes, false) < kMostAreRays) {
        if (share_of_rays(source.first(), kPolarisedRowBytes, false) >= kMostAreRays) {
            input_error(source.at(),
                        "rows of {} bytes, of polarised rays; expected {} bytes, of rays without "
                        "polarisation",
                        kPolarisedRowBytes, kSpeosRowBytes);
        }
        refuse_big_endian(source.at());
    }
    std::array<float, kSpeosHeaderBytes / sizeof(float)> header{};
    source.read(header.data(), sizeof header, "header");
    const std::uint64_t rays = rows_left(source, kSpeosRowBytes, 0);
    RaySet set;
    set.unit = FluxUnit::watt;
    set.header_watts = stated(header.front());
    set.header_lumens = stated(header.back());
    set.provenance = fmt::format("SPEOS ray file {}, {} rays", source.name(), rays);
    RayColumns columns;
    columns.floats = 8;
    columns.wavelength = 6;
    columns.flux = 7;
    RowTaker rows = take_rows(source, rays, columns, set, monitor);
    if (!(set.header_watts > 0)) {
        monitor.warn(
            fmt::format("{}: the header states a flux of {:g} W; the energies of the rays are taken as "
                        "watts",
                        to_string(source.at()), header.front()));
    }
    rows.settle(set.header_watts, RayTaker::Header::relative, source, monitor);
    take_stated_efficacy(set, source.at(), monitor);
    return set;
}

}  // namespace lucerna
