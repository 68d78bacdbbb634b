#include "lights/ray_reader.h"

#include <algorithm>

#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

constexpr V3f kUnknown(-1.0F);  // marks a ray without a colour, until all are read

// Returns the colour with components that noise makes negative set to 0; none if no light has this colour.
// Among all wavelengths 360 nm has the most Z for its Y, 155 times as much.
std::optional<V3d> as_colour(const V3d& xyz) {
    constexpr double kMostPerY = 1e4, kMostY = 1e30;
    if (!std::isfinite(xyz.x) || !std::isfinite(xyz.y) || !std::isfinite(xyz.z)) return {};
    if (xyz.y < 0 || xyz.y > kMostY) return {};
    if (std::max(xyz.x, xyz.z) > kMostPerY * xyz.y) return {};
    return V3d(std::max(0.0, xyz.x), xyz.y, std::max(0.0, xyz.z));
}

}  // namespace

// --- colours -----------------------------------------------------------------------------------------------

void RayColours::all(Spectrum spectrum) {
    const std::optional<V3d> colour = as_colour(xyz_per_watt(spectrum));
    if (!colour || !(colour->y > 0)) return;
    set_.spectra = {std::move(spectrum)};
    set_.xyz = *colour / colour->y;
    if (set_.unit == FluxUnit::watt) set_.lumens_per_watt = kLumensPerWatt * colour->y;
}

void RayColours::add_per_watt(const V3d& xyz) {
    if (set_.unit == FluxUnit::watt) return add(kLumensPerWatt * xyz);
    // With lumens, a colour needs Y > 0.
    const bool seen = std::isfinite(xyz.y) && xyz.y > 0;
    add(seen ? xyz / xyz.y : V3d(-1));
}

void RayColours::list(std::vector<Spectrum> spectra) {
    for (const Spectrum& spectrum : spectra) per_watt_.push_back(xyz_per_watt(spectrum));
    if (spectra.size() < RaySet::kNoSpectrum) set_.spectra = std::move(spectra);
}

void RayColours::add_spectrum(std::size_t number) {
    add_per_watt(per_watt_[number]);
    if (!set_.spectra.empty()) set_.spectrum.push_back(static_cast<std::uint16_t>(number));
}

void RayColours::add_wavelength(double nanometres) {
    const V3d xyz = nanometres > 0 ? cie_xyz(nanometres) : V3d(NAN);
    const double scale = set_.unit == FluxUnit::watt ? kLumensPerWatt : xyz.y > 0 ? 1 / xyz.y : 0;
    set_.tristimulus.push_back(scale * xyz.y >= 0 && scale > 0 ? V3f(scale * xyz) : kUnknown);
    const double line = std::round(nanometres) - kFirstVisible;
    if (!(line >= 0 && line <= kLastVisible - kFirstVisible)) {
        set_.spectrum.push_back(RaySet::kNoSpectrum);
        return;
    }
    line_of_.resize(kLastVisible - kFirstVisible + 1, RaySet::kNoSpectrum);
    std::uint16_t& number = line_of_[static_cast<std::size_t>(line)];
    if (number == RaySet::kNoSpectrum) {
        number = static_cast<std::uint16_t>(set_.spectra.size());
        set_.spectra.push_back({{kFirstVisible + line, 1}});
    }
    set_.spectrum.push_back(number);
}

void RayColours::add(const V3d& xyz) {
    const std::optional<V3d> colour = as_colour(xyz);
    set_.tristimulus.push_back(colour ? V3f(*colour) : kUnknown);
}

void RayColours::settle() {
    if (set_.coloured()) settle_rays();
    settle_spectra();
    const auto stated = [](double flux) { return std::isfinite(flux) && flux > 0; };
    if (set_.unit != FluxUnit::watt || set_.lumens_per_watt > 0) return;
    if (!stated(set_.header_lumens) || !stated(set_.header_watts)) return;
    // The header is used only up to the greatest possible efficacy.
    if (set_.header_lumens <= kLumensPerWatt * set_.header_watts)
        set_.lumens_per_watt = set_.header_lumens / set_.header_watts;
}

void RayColours::settle_rays() {
    V3d sum(0, 0, 0);
    double flux = 0;  // of rays with a colour
    for (std::size_t i = 0; i < set_.rays.size(); ++i) {
        if (set_.tristimulus[i] == kUnknown) continue;
        sum += double{set_.rays[i].flux} * V3d(set_.tristimulus[i]);
        flux += double{set_.rays[i].flux};
    }
    bool alike = true;
    if (sum.y > 0) {
        set_.xyz = sum / sum.y;
        const double mean = sum.y / flux, per_mean = 1 / mean;  // flux > 0 because sum.y > 0
        if (set_.unit == FluxUnit::watt) set_.lumens_per_watt = mean;
        constexpr double kAlike = 1e-5, kMost = 1e30;
        for (V3f& ray : set_.tristimulus) {
            const V3d colour = ray == kUnknown ? set_.xyz : per_mean * V3d(ray);
            for (int c = 0; c < 3; ++c) {
                alike = alike && std::fabs(colour[c] - set_.xyz[c]) <= kAlike * std::max(1.0, set_.xyz[c]);
                ray[c] = static_cast<float>(std::min(colour[c], kMost));
            }
        }
    }
    if (alike) set_.tristimulus = {};
}

void RayColours::settle_spectra() {
    if (set_.spectrum.empty()) return;
    const bool alike = std::ranges::all_of(set_.spectrum, [this](auto i) { return i == set_.spectrum[0]; });
    if (!alike) return;
    const std::uint16_t first = set_.spectrum[0];
    if (first == RaySet::kNoSpectrum)
        set_.spectra = {};
    else
        set_.spectra = std::vector<Spectrum>(1, Spectrum(set_.spectra[first]));
    set_.spectrum = {};
}

// --- rays --------------------------------------------------------------------------------------------------

void RayTaker::refuse(const float* row, float flux, std::uint64_t at) {
    const bool has_flux = std::isfinite(flux) && flux >= 0;
    const double length = std::sqrt(sqr(double{row[3]}) + sqr(double{row[4]}) + sqr(double{row[5]}));
    const bool zero = has_flux && length < 1e-6 && is_finite(V3f(row[0], row[1], row[2]));
    ++(zero ? set_.skipped_zero_direction : set_.skipped_nan);
    if (has_flux) set_.skipped_flux += double{flux};
    if (!first_refused_.empty()) return;
    first_refused_ = has_flux ? fmt::format(
                                    "the first, at {} {}, has the position ({:g}, {:g}, {:g}) and the "
                                    "direction ({:g}, {:g}, {:g})",
                                    place_, at, row[0], row[1], row[2], row[3], row[4], row[5])
                              : fmt::format("the first, at {} {}, has the flux {:g}", place_, at, flux);
    first_refused_ += "; expected finite numbers, a direction that is not 0 and a flux of 0 or more";
}

void RayTaker::settle(double header_flux, Header header, const RaySource& source, Monitor& monitor) {
    const std::uint64_t refused = set_.skipped_nan + set_.skipped_zero_direction;
    if (set_.rays.empty()) input_error(source.at(), "no ray is usable: {}", first_refused_);
    if (refused > 0) {
        monitor.warn(fmt::format("{}: {} of {} rays are skipped: {}", to_string(source.at()), refused,
                                 refused + set_.rays.size(), first_refused_));
    }
    if (source.left() > 0) {
        monitor.warn(fmt::format("{}: {} bytes after the last ray are ignored", to_string(source.at()),
                                 source.left()));
    }
    settle_flux(header_flux, header, source.at(), monitor);
}

void RayTaker::settle_flux(double header_flux, Header header, const Location& at, Monitor& monitor) {
    set_.flux = sum_;
    if (!std::isfinite(header_flux) || !(header_flux > 0)) return;
    if (!(sum_ > 0)) {
        input_error(at, "the header states {} {}, but the rays have no flux", header_flux,
                    flux_unit_name(set_.unit));
    }
    const double difference = std::fabs(header_flux - sum_);
    set_.flux = header_flux;
    // The rays of a file that was written from the same numbers differ from the header by rounding. They stay
    // as they are, so that writing them again gives the same bytes.
    constexpr double kRounding = 1e-6;
    if (difference <= kRounding * header_flux) return;
    if (header == Header::absolute && difference > 1e-3 * header_flux) {
        monitor.warn(fmt::format(
            "{}: the header states {:.6g} {}, the rays add up to {:.6g}; the header's flux is used",
            to_string(at), header_flux, flux_unit_name(set_.unit), sum_));
    }
    const double factor = header_flux / sum_;
    for (LampRay& ray : set_.rays) ray.flux = static_cast<float>(double{ray.flux} * factor);
    set_.skipped_flux *= factor;
}

// --- rows --------------------------------------------------------------------------------------------------

RowTaker::RowTaker(RaySet& set, const RayColumns& columns, std::uint64_t rays)
    : set_(set), columns_(columns), colours_(set), rays_(set, columns.metres, columns.place) {
    set.rays.reserve(rays);
    if (columns.wavelength) set.tristimulus.reserve(rays);
}

void RowTaker::all(double nanometres) {
    colours_.all({{nanometres, 1}});
}

void RowTaker::add_wavelength(float wavelength) {
    const double nanometres = stated(wavelength) * columns_.nanometres;
    if (nanometres > 0 && (nanometres < kFirstVisible || nanometres > kLastVisible)) {
        if (invisible_ == 0) first_invisible_ = nanometres;
        ++invisible_;
    }
    colours_.add_wavelength(nanometres);
}

void RowTaker::settle(double header_flux, RayTaker::Header header, const RaySource& source,
                      Monitor& monitor) {
    if (invisible_ > 0) {
        monitor.warn(
            fmt::format("{}: {} of {} rays are of wavelengths outside {} to {} nm, which are not "
                        "visible, the first of {:g} nm",
                        to_string(source.at()), invisible_, set_.rays.size(), kFirstVisible, kLastVisible,
                        first_invisible_));
    }
    colours_.settle();
    rays_.settle(header_flux, header, source, monitor);
}

RowTaker take_rows(RaySource& source, std::uint64_t rays, const RayColumns& columns, RaySet& set,
                   Monitor& monitor) {
    source.require_rows(rays, columns.floats, columns.wavelength.has_value());
    RowTaker taker(set, columns, rays);
    read_rows(source, rays, columns.floats, monitor,
              [&taker](const float* row, std::uint64_t at) { taker.take(row, at); });
    return taker;
}

std::uint64_t rows_left(const RaySource& source, std::uint64_t row_bytes, std::uint64_t end) {
    if (source.left() < end || (source.left() - end) % row_bytes != 0) {
        input_error(source.at(),
                    "truncated or damaged: the {} bytes after the header, from byte {}, are not a number of "
                    "rows of {} bytes{}",
                    source.left(), source.offset(), row_bytes,
                    end > 0 ? fmt::format(" and an end mark of {}", end) : "");
    }
    return (source.left() - end) / row_bytes;
}

void refuse_big_endian(const Location& at) {
    throw InputError(at, "its numbers are big-endian; expected little-endian ones");
}

}  // namespace lucerna
