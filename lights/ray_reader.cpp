#include "lights/ray_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "engine/system/content.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "lights/photometric_files.h"
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
    const std::uint64_t row_bytes = floats * sizeof(float);  // > 0, as a row has at least a position
    if (rays == 0) throw InputError(at_, "the file states 0 rays");
    if (rays > left_ / row_bytes) {
        input_error(at_, "truncated in the rays: {} rays of {} bytes stated, {} bytes left", rays, row_bytes,
                    left_);
    }
    require_ray_memory(rays, coloured, at_);
}

void require_ray_memory(std::uint64_t rays, bool coloured, const Location& at) {
    const std::size_t ray_bytes = sizeof(LampRay) + (coloured ? sizeof(V3f) : 0);
    require_memory(bytes_of(rays, ray_bytes), fmt::format("{}: {} rays", to_string(at), rays),
                   "use fewer rays");
}

bool RayLines::next(std::string_view& line) {
    constexpr std::size_t kBlock = 1 << 16, kLongest = 4096;
    while (true) {
        std::size_t end = buffer_.find('\n', begin_);
        if (end == buffer_.npos && source_.left() > 0) {
            if (unread() > kLongest)
                input_error({source_.at().file, number_ + 1, 1}, "a line of more than {} characters",
                            kLongest);
            buffer_.erase(0, begin_);
            begin_ = 0;
            const std::size_t kept = buffer_.size();
            buffer_.resize(kept + std::min<std::uint64_t>(kBlock, source_.left()));
            source_.read(buffer_.data() + kept, buffer_.size() - kept, "rays");
            continue;
        }
        if (begin_ == buffer_.size()) return false;
        end = std::min(end, buffer_.size());
        line = std::string_view(buffer_).substr(begin_, end - begin_);
        begin_ = std::min(end + 1, buffer_.size());
        ++number_;
        if (line.ends_with('\r')) line.remove_suffix(1);
        if (line.find_first_not_of(" \t") != line.npos) return true;
    }
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

constexpr double kLumensPerWatt = 683;  // for light of 555 nm, by the definition of the lumen
constexpr V3f kUnknown(-1.0F);          // marks a ray without a colour, until all are read

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

void RayColours::all(const V3d& per_watt) {
    const std::optional<V3d> colour = as_colour(per_watt);
    if (!colour || !(colour->y > 0)) return;
    set_.xyz = *colour / colour->y;
    if (set_.unit == FluxUnit::watt) set_.lumens_per_watt = kLumensPerWatt * colour->y;
}

void RayColours::add_per_watt(const V3d& xyz) {
    if (set_.unit == FluxUnit::watt) return add(kLumensPerWatt * xyz);
    // With lumens, a colour needs Y > 0.
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
        const double mean = sum.y / flux;  // flux > 0 because sum.y > 0
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
    // In double precision, because the squares of directions of length 1e20 overflow a float.
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

// A ray file's first bytes select its reader.

namespace {

// An ASAP file begins with a record length, 247 + 256 times its bytes, of seven to twelve words.
bool is_asap(std::span<const std::byte> first) {
    if (first.size() < 28) return false;
    const auto word = value_at<std::int32_t>(first, 0);
    return word % 1024 == 247 && word / 1024 >= 7 && word / 1024 <= 12;
}

// A SPEOS file has seven floats, then rows of position, direction, wavelength [nm] and energy.
bool is_speos(std::span<const std::byte> first, std::uint64_t bytes) {
    constexpr std::uint64_t kHeader = 28, kRow = 32;
    if (first.size() < kHeader + kRow || (bytes - kHeader) % kRow != 0) return false;
    double length2 = 0;
    for (std::uint64_t at = kHeader + 12; at < kHeader + 24; at += 4)
        length2 += sqr(double{value_at<float>(first, at)});
    const auto wavelength = value_at<float>(first, kHeader + 24);
    return std::fabs(length2 - 1) < 1e-3 && wavelength > 100 && wavelength < 1e5F;
}

// Returns the optics program that a text names, or an empty name.
std::string_view program_named(std::string_view text) {
    for (const std::string_view program :
         {"LightTools", "TracePro", "LucidShape", "SPEOS", "SimuLux", "ASAP", "Photopia", "FRED"}) {
        if (text.find(program) != text.npos) return program;
    }
    return {};
}

struct ReaderFormat {
    std::string_view magic;
    RaySet (*read)(const std::filesystem::path&, Monitor&);
};
constexpr ReaderFormat kReaderFormats[] = {
    {"TM25", read_tm25},
    {"LTRF", read_lighttools},
    {std::string_view("\xf2\x03\x00\x00", 4), read_zemax},  // the number 1010
};

}  // namespace

std::string content_of_ray_file(const std::filesystem::path& file) {
    const std::vector<std::byte> first = first_bytes(file);
    const std::string_view text(reinterpret_cast<const char*>(first.data()), first.size());
    if (is_zemax_text(first)) return "it is a Zemax text ray file";
    if (is_asap(first)) return "it is a ray file of ASAP, which is not read";
    if (is_speos(first, std::filesystem::file_size(file)))
        return "it is a ray file of SPEOS, which is not read";
    if (content_name(first) != kPlainText) return content_of(file);
    const std::string_view program = program_named(text);
    if (!program.empty()) return fmt::format("it is text of {}, which is not read", program);
    const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n"), text.size());
    return fmt::format("it is text that begins with \"{}\"",
                       shown_value(text.substr(begin, text.find_first_of("\r\n", begin) - begin)));
}

RaySet read_rays(const std::filesystem::path& file, Monitor& monitor) {
    const std::vector<std::byte> first = first_bytes(file);
    const std::string_view text(reinterpret_cast<const char*>(first.data()), first.size());
    for (const ReaderFormat& format : kReaderFormats) {
        if (text.starts_with(format.magic)) return format.read(file, monitor);
    }
    if (is_zemax_text(first)) return read_zemax_text(file, monitor);
    input_error({file.string()},
                "not a ray file: {}; expected IES TM-25 (.tm25ray), Zemax binary or text (.dat, .sdf) or "
                "LightTools binary (.ray)",
                content_of_ray_file(file));
}

}  // namespace lucerna
