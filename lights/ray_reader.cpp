#include "lights/ray_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/base/memory.h"
#include "engine/base/spectrum.h"
#include "lights/ray_set.h"

namespace lucerna {

RaySource::RaySource(const std::filesystem::path& file) : at_{file.string()}, in_(open_to_read(file)) {
    in_.seekg(0, std::ios::end);
    const std::streamoff size = in_.tellg();
    if (size < 0) throw InputError(at_, "its size cannot be determined");
    left_ = static_cast<std::uint64_t>(size);
    in_.seekg(0);
}

void RaySource::read(void* to, std::uint64_t bytes, const char* what) {
    if (bytes > left_) {
        input_error(at_, "truncated in the {}: {} bytes expected, {} left", what, bytes, left_);
    }
    in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
    if (!in_) input_error(at_, "reading failed in the {}", what);
    left_ -= bytes;
    offset_ += bytes;
}

void RaySource::skip(std::uint64_t bytes, const char* what) {
    if (bytes > left_) {
        input_error(at_, "truncated in the {}: {} bytes expected, {} left", what, bytes, left_);
    }
    in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
    left_ -= bytes;
    offset_ += bytes;
}

void RaySource::require_rows(std::uint64_t rays, std::size_t floats, bool coloured) const {
    const std::uint64_t row_bytes = floats * sizeof(float);  // > 0: a row has a position at least
    if (rays == 0) throw InputError(at_, "the file states 0 rays");
    if (rays > left_ / row_bytes) {
        input_error(at_, "truncated in the rays: {} rays of {} bytes stated, {} bytes left", rays, row_bytes,
                    left_);
    }
    const std::size_t ray_bytes = sizeof(LampRay) + (coloured ? sizeof(V3f) : 0);
    require_memory(bytes_of(rays, ray_bytes), fmt::format("{}: {} rays", to_string(at_), rays),
                   "use fewer rays");
}

std::string ascii_text(std::span<const std::byte> bytes) {
    std::string text;
    for (const std::byte b : bytes) {
        if (b == std::byte{0}) break;
        const char c = static_cast<char>(b);
        text += c >= ' ' && c <= '~' ? c : ' ';
    }
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

float metres_of_unit(std::int32_t number, std::span<const NamedUnit> units, const Location& at) {
    if (number >= 0 && static_cast<std::size_t>(number) < units.size()) {
        return units[static_cast<std::size_t>(number)].metres;
    }
    std::string accepted;
    for (std::size_t i = 0; i < units.size(); ++i) {
        accepted += fmt::format("{}{} ({})", i == 0 ? "" : ", ", i, units[i].name);
    }
    input_error(at, "length unit {}; expected {}", number, accepted);
}

namespace {

constexpr double kLumensPerWatt = 683;  // of light of 555 nm: the definition of the lumen
constexpr V3f kUnknown(-1.0F);          // of a ray without a colour, until all are read

// Without what measuring noise makes negative. None: no light has this colour. Of all wavelengths 360 nm has
// the most Z for its Y, 155 times as much.
std::optional<V3d> as_colour(const V3d& xyz) {
    constexpr double kMostPerY = 1e4, kMostY = 1e30;
    if (!std::isfinite(xyz.x) || !std::isfinite(xyz.y) || !std::isfinite(xyz.z)) return {};
    if (xyz.y < 0 || xyz.y > kMostY) return {};
    if (std::max(xyz.x, xyz.z) > kMostPerY * xyz.y) return {};
    return V3d(std::max(0.0, xyz.x), xyz.y, std::max(0.0, xyz.z));
}

}  // namespace

void RayColours::all(const V3d& per_watt) {
    const std::optional<V3d> colour = as_colour(per_watt);
    if (!colour || !(colour->y > 0)) return;
    set_.xyz = *colour / colour->y;
    if (set_.unit == FluxUnit::watt) set_.lumens_per_watt = kLumensPerWatt * colour->y;
}

void RayColours::add_per_watt(const V3d& xyz) {
    if (set_.unit == FluxUnit::watt) return add(kLumensPerWatt * xyz);
    // Beside lumens there is no colour without Y.
    const bool seen = std::isfinite(xyz.y) && xyz.y > 0;
    add(seen ? xyz / xyz.y : V3d(-1));
}

void RayColours::add(const V3d& xyz) {
    const std::optional<V3d> colour = as_colour(xyz);
    set_.tristimulus.push_back(colour ? V3f(*colour) : kUnknown);
}

void RayColours::settle() {
    if (set_.coloured()) settle_rays();
    const auto stated = [](double flux) { return std::isfinite(flux) && flux > 0; };
    if (set_.unit != FluxUnit::watt || set_.lumens_per_watt > 0) return;
    if (!stated(set_.header_lumens) || !stated(set_.header_watts)) return;
    // A header may state anything: no more than could be.
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
        const double mean = sum.y / flux;  // flux > 0 as sum.y is
        if (set_.unit == FluxUnit::watt) set_.lumens_per_watt = mean;
        constexpr double kAlike = 1e-5, kMost = 1e30;
        for (V3f& ray : set_.tristimulus) {
            const V3d colour = ray == kUnknown ? set_.xyz : V3d(ray) / mean;
            for (int c = 0; c < 3; ++c) {
                alike = alike && std::fabs(colour[c] - set_.xyz[c]) <= kAlike * std::max(1.0, set_.xyz[c]);
                ray[c] = static_cast<float>(std::min(colour[c], kMost));
            }
        }
    }
    if (alike) set_.tristimulus = {};
}

bool RayTaker::take(const float* row, float flux) {
    const V3f o = metres_ * V3f(row[0], row[1], row[2]);
    const V3d d(double{row[3]}, double{row[4]}, double{row[5]});
    const bool has_flux = std::isfinite(flux) && flux >= 0;
    if (has_flux) sum_ += double{flux};
    // In double: the squares of directions as long as 1e20 would overflow a float.
    const double length = std::sqrt(sqr(d.x) + sqr(d.y) + sqr(d.z));
    if (!has_flux || !is_finite(o) || !std::isfinite(length)) {
        ++set_.skipped_nan;
    } else if (length < 1e-6) {
        ++set_.skipped_zero_direction;
    } else {
        set_.rays.push_back({o, V3f(d / length), flux});
        return true;
    }
    if (has_flux) set_.skipped_flux += double{flux};
    return false;
}

void RayTaker::settle(double header_flux, const RaySource& source, Monitor& monitor) {
    const std::string file = to_string(source.at());
    if (set_.rays.empty())
        throw InputError(source.at(), "no ray is usable: all have an invalid position, direction or flux");
    if (set_.skipped_nan + set_.skipped_zero_direction > 0) {
        monitor.warn(
            fmt::format("{}: {} rays skipped because of a value that is not finite or a negative flux, {} "
                        "because of a direction of length 0",
                        file, set_.skipped_nan, set_.skipped_zero_direction));
    }
    if (source.left() > 0) {
        monitor.warn(fmt::format("{}: {} bytes after the last ray are ignored", file, source.left()));
    }
    settle_flux(header_flux, source.at(), monitor);
}

void RayTaker::settle_flux(double header_flux, const Location& at, Monitor& monitor) {
    set_.flux = sum_;
    if (!std::isfinite(header_flux) || !(header_flux > 0)) return;
    if (!(sum_ > 0)) {
        input_error(at, "the header states {} {}, but the rays have no flux", header_flux,
                    flux_unit_name(set_.unit));
    }
    if (std::fabs(header_flux - sum_) > 1e-3 * header_flux) {
        monitor.warn(fmt::format(
            "{}: the header states {:.6g} {}, the rays add up to {:.6g}; the header's flux is used",
            to_string(at), header_flux, flux_unit_name(set_.unit), sum_));
    }
    const double factor = header_flux / sum_;
    for (LampRay& ray : set_.rays) ray.flux = static_cast<float>(double{ray.flux} * factor);
    set_.skipped_flux *= factor;
    set_.flux = header_flux;
}

// Which reader a ray file is for: its first bytes say; where they are of no format known, its name does.

namespace {

struct ReaderFormat {
    std::string_view magic, suffix;
    RaySet (*read)(const std::filesystem::path&, Monitor&);
};
constexpr ReaderFormat kReaderFormats[] = {
    {"TM25", ".tm25ray", read_tm25},
    {"LTRF", ".ray", read_lighttools},
    {std::string_view("\xf2\x03\x00\x00", 4), ".dat", read_zemax},  // the number 1010
};

}  // namespace

RaySet read_rays(const std::filesystem::path& file, Monitor& monitor) {
    std::array<char, 4> first{};
    open_to_read(file).read(first.data(), first.size());
    for (const ReaderFormat& format : kReaderFormats) {
        if (std::equal(first.begin(), first.end(), format.magic.begin(), format.magic.end()))
            return format.read(file, monitor);
    }
    // Its own reader says best what is wrong with it.
    for (const ReaderFormat& format : kReaderFormats) {
        if (suffix_of(file) == format.suffix) return format.read(file, monitor);
    }
    throw InputError(
        {file.string()},
        "not a ray file; expected IES TM-25 (.tm25ray), Zemax binary (.dat) or LightTools binary (.ray)");
}

}  // namespace lucerna
