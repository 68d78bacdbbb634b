#include "lights/ray_set.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "engine/base/error.h"
#include "engine/colour/spectrum.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little, "ray files are written as they lie in memory");

constexpr double kMillimetresPerMetre = 1000;

// A header of zeros, into which values are put.
class Bytes {
  public:
    explicit Bytes(std::size_t size) : bytes_(size, '\0') {}
    template <typename T>
    void put(std::size_t at, const T& value) {
        assert(at + sizeof value <= bytes_.size());
        std::memcpy(&bytes_[at], &value, sizeof value);
    }
    void put_text(std::size_t at, std::string_view text, std::size_t most) {
        text.substr(0, most).copy(&bytes_[at], most);
    }
    // Puts UTF-32, one character each; characters outside ASCII become '?'.
    void put_utf32(std::size_t at, std::string_view text, std::size_t most) {
        for (std::size_t i = 0; i < std::min(text.size(), most); ++i) {
            const char c = text[i];
            put(at + 4 * i, static_cast<std::uint32_t>(c >= ' ' && c <= '~' ? c : '?'));
        }
    }
    const std::string& all() const { return bytes_; }

  private:
    std::string bytes_;
};

// --- headers -----------------------------------------------------------------------------------------------

bool is_coloured(const RayFileInfo& info) {
    constexpr double kWhite = 1e-5;
    return info.colour_per_ray || (info.xyz - kWhiteXyz).length() > kWhite;
}

// Returns true if a TM-25 file keeps the colours. It stores tristimulus X and Z beside luminous flux, which
// is Y.
bool has_tristimulus(const RayFileInfo& info) {
    return is_coloured(info) && (info.unit == FluxUnit::lumen || info.lumens_per_watt > 0);
}

std::string tm25_header(const RayFileInfo& info) {
    Bytes b(36288);
    b.put_text(0, "TM25", 4);
    b.put(4, std::int32_t{2013});
    const bool luminous = info.unit == FluxUnit::lumen;
    const bool radiant = !luminous, tristimulus = has_tristimulus(info);
    const double lumens = luminous ? info.flux : tristimulus ? info.flux * info.lumens_per_watt : NAN;
    b.put(12, static_cast<float>(lumens));
    b.put(16, radiant ? static_cast<float>(info.flux) : NAN);
    b.put(20, info.rays);
    b.put(64, NAN), b.put(68, NAN), b.put(72, NAN);  // wavelengths: none
    const std::int32_t flags[8] = {1, 1, radiant, 0, luminous || tristimulus, 0, tristimulus, 0};
    b.put(256, flags);
    b.put_utf32(288, info.text, 999);
    return b.all();
}

std::string zemax_header(const RayFileInfo& info) {
    Bytes b(208);
    b.put(0, std::int32_t{1010});
    b.put(4, static_cast<std::int32_t>(info.rays));
    b.put_text(8, info.text, 99);
    b.put(108, static_cast<float>(info.flux)), b.put(112, static_cast<float>(info.flux));
    b.put(136, std::int32_t{4});                                      // mm
    for (const std::size_t at : {164U, 168U, 172U}) b.put(at, 1.0F);  // scale
    b.put(196, std::int32_t{info.unit == FluxUnit::lumen ? 1 : 0});
    return b.all();
}

std::string lighttools_header(const RayFileInfo& info) {
    Bytes b(44);
    b.put_text(0, "LTRF", 4);
    b.put(4, std::int32_t{2});
    b.put(12, std::int32_t{info.unit == FluxUnit::lumen ? 1 : 0});
    b.put(24, std::int32_t{1});  // mm
    b.put(40, static_cast<float>(info.flux));
    return b.all();
}

// --- formats -----------------------------------------------------------------------------------------------

struct WriterFormat {
    std::string_view suffix;
    std::string (*header)(const RayFileInfo&);
    std::uint64_t most_rays;
    bool tristimulus;  // X and Z follow the flux of coloured rays
    std::string_view end_mark;
};
constexpr WriterFormat kWriterFormats[] = {
    {".tm25ray", tm25_header, std::numeric_limits<std::uint64_t>::max(), true, ""},
    {".dat", zemax_header, std::numeric_limits<std::int32_t>::max(), false, ""},
    {".ray", lighttools_header, std::numeric_limits<std::uint64_t>::max(), false, "LTRFEND"},
};

const WriterFormat* format_of(const std::filesystem::path& file) {
    const std::string suffix = suffix_of(file);
    for (const WriterFormat& format : kWriterFormats) {
        if (suffix == format.suffix) return &format;
    }
    return nullptr;
}

// Converts rays to rows of floats.
class Rows {
  public:
    Rows(const WriterFormat& format, const RayFileInfo& info)
        : tristimulus_(format.tristimulus && has_tristimulus(info)),
          radiant_(info.unit == FluxUnit::watt),
          xyz_(info.xyz),
          lumens_(radiant_ ? info.lumens_per_watt : 1) {}
    const std::vector<float>& of(const RayBlock& block) {
        row_.clear();
        for (std::size_t i = 0; i < block.rays.size(); ++i) {
            const LampRay& ray = block.rays[i];
            for (int a = 0; a < 3; ++a)
                row_.push_back(static_cast<float>(double{ray.o[a]} * kMillimetresPerMetre));
            for (int a = 0; a < 3; ++a) row_.push_back(ray.d[a]);
            row_.push_back(ray.flux);
            if (!tristimulus_) continue;
            const V3d xyz =
                lumens_ * double{ray.flux} * (block.tristimulus.empty() ? xyz_ : V3d(block.tristimulus[i]));
            if (radiant_) row_.push_back(static_cast<float>(xyz.y));
            row_.push_back(static_cast<float>(xyz.x));
            row_.push_back(static_cast<float>(xyz.z));
        }
        return row_;
    }

  private:
    bool tristimulus_, radiant_;
    V3d xyz_;
    double lumens_;  // per unit of flux
    std::vector<float> row_;
};

}  // namespace

bool has_ray_suffix(const std::filesystem::path& file) {
    return format_of(file) != nullptr;
}

bool keeps_colour(const std::filesystem::path& file, const RayFileInfo& info) {
    const WriterFormat* format = format_of(file);
    return !is_coloured(info) || (format && format->tristimulus && has_tristimulus(info));
}

void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextRays& next) {
    assert(!info.colour_per_ray);
    write_rays(file, info, [&next](RayBlock& block) { next(block.rays); });
}

void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextColouredRays& next) {
    const WriterFormat* format = format_of(file);
    if (!format)
        input_error({file.string()}, "the format of a ray file is chosen by its suffix; expected {}",
                    kRaySuffixes);
    if (info.rays > format->most_rays) {
        input_error({file.string()}, "{} rays; {} can hold at most {}", info.rays, format->suffix,
                    format->most_rays);
    }
    replace_file(file, [&](const std::filesystem::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out.exceptions(std::ios::badbit | std::ios::failbit);
        const auto put = [&out](const void* from, std::size_t bytes) {
            out.write(static_cast<const char*>(from), static_cast<std::streamsize>(bytes));
        };
        const std::string header = format->header(info);
        put(header.data(), header.size());
        Rows rows(*format, info);
        RayBlock block;
        for (std::uint64_t done = 0; done < info.rays; done += block.rays.size()) {
            next(block);
            assert(!block.rays.empty() && block.rays.size() <= info.rays - done);
            assert(block.tristimulus.size() == (info.colour_per_ray ? block.rays.size() : 0));
            const std::vector<float>& floats = rows.of(block);
            put(floats.data(), floats.size() * sizeof(float));
        }
        put(format->end_mark.data(), format->end_mark.size());
        out.close();
    });
}

void write_rays(const std::filesystem::path& file, const RaySet& set) {
    RayFileInfo info;
    info.rays = set.rays.size();
    info.unit = set.unit;
    for (const LampRay& ray : set.rays) info.flux += double{ray.flux};
    info.xyz = set.xyz;
    info.lumens_per_watt = set.lumens_per_watt;
    info.colour_per_ray = set.coloured();
    info.text = set.provenance;
    write_rays(file, info, [&set](RayBlock& block) { block = {set.rays, set.tristimulus}; });
}

}  // namespace lucerna
