#include "lights/ray_set.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/colour/chromaticity.h"
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
    // Puts text in characters of type Char. Characters outside ASCII become '?', and blanks at the end are
    // left out, as readers leave them out.
    template <typename Char>
    void put_text(std::size_t at, std::string_view text, std::size_t most) {
        text = text.substr(0, most);
        text = text.substr(0, text.find_last_not_of(' ') + 1);
        for (std::size_t i = 0; i < text.size(); ++i) {
            const char c = text[i];
            put(at + sizeof(Char) * i, static_cast<Char>(c >= ' ' && c <= '~' ? c : '?'));
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

// Returns the luminous flux of rays in W.
double lumens_of_watts(const RayFileInfo& info) {
    return info.lumens > 0 ? info.lumens : info.flux * info.lumens_per_watt;
}

std::string tm25_header(const RayFileInfo& info) {
    Bytes b(36288);
    b.put_text<char>(0, "TM25", 4);
    b.put(4, std::int32_t{2013});
    const bool luminous = info.unit == FluxUnit::lumen;
    const bool radiant = !luminous, tristimulus = has_tristimulus(info);
    const double lumens = luminous ? info.flux : tristimulus ? lumens_of_watts(info) : NAN;
    b.put(12, static_cast<float>(lumens));
    b.put(16, radiant ? static_cast<float>(info.flux) : NAN);
    b.put(20, info.rays);
    b.put(64, NAN), b.put(68, NAN), b.put(72, NAN);  // wavelengths: none
    const std::int32_t flags[8] = {1, 1, radiant, 0, luminous || tristimulus, 0, tristimulus, 0};
    b.put(256, flags);
    b.put_text<char32_t>(288, info.text, 999);
    return b.all();
}

std::string zemax_header(const RayFileInfo& info) {
    Bytes b(208);
    b.put(0, std::int32_t{1010});
    b.put(4, static_cast<std::int32_t>(info.rays));
    b.put_text<char>(8, info.text, 99);
    b.put(108, static_cast<float>(info.flux)), b.put(112, static_cast<float>(info.flux));
    b.put(136, std::int32_t{4});                                      // mm
    for (const std::size_t at : {164U, 168U, 172U}) b.put(at, 1.0F);  // scale
    b.put(196, std::int32_t{info.unit == FluxUnit::lumen ? 1 : 0});
    return b.all();
}

std::string lighttools_header(const RayFileInfo& info) {
    Bytes b(44);
    b.put_text<char>(0, "LTRF", 4);
    b.put(4, std::int32_t{2});
    b.put(12, std::int32_t{info.unit == FluxUnit::lumen ? 1 : 0});
    b.put(24, std::int32_t{1});  // mm
    b.put(40, static_cast<float>(info.flux));
    return b.all();
}

// --- SPEOS -------------------------------------------------------------------------------------------------

constexpr double kMostVisibleWavelength = 555;  // nm

// Returns the wavelength, in steps of 0.1 nm, whose light has the colour of all rays; none if no light of one
// wavelength has it. Where the colours of neighbours are alike, at both ends of the spectrum, the efficacy of
// a lamp in watts decides.
std::optional<double> wavelength_of(const RayFileInfo& info) {
    if (info.colour_per_ray) return {};
    constexpr double kFarthest = 1e-3, kEfficacyWeight = 1e-6;
    const Chromaticity lamp = chromaticity(info.xyz);
    double least = kFarthest;
    std::optional<double> found;
    for (int step = 10 * kFirstVisible; step <= 10 * kLastVisible; ++step) {
        const double nanometres = 0.1 * step;
        const V3d xyz = cie_xyz(nanometres);
        const Chromaticity light = chromaticity(xyz);
        double distance = hypot(light.x - lamp.x, light.y - lamp.y);
        if (info.lumens_per_watt > 0) {
            const double efficacy = kLumensPerWatt * xyz.y;
            distance += kEfficacyWeight * std::fabs(log(info.lumens_per_watt / efficacy));
        }
        if (distance >= least) continue;
        least = distance;
        found = nanometres;
    }
    return found;
}

double speos_wavelength(const RayFileInfo& info) {
    return wavelength_of(info).value_or(kMostVisibleWavelength);
}

// Returns the watts that one unit of the rays' flux has in a SPEOS file.
double speos_watts(const RayFileInfo& info) {
    return info.unit == FluxUnit::watt ? 1 : 1 / (kLumensPerWatt * cie_xyz(speos_wavelength(info)).y);
}

std::string speos_header(const RayFileInfo& info) {
    Bytes b(28);
    b.put(0, static_cast<float>(info.flux * speos_watts(info)));
    // Ansys's own converter writes 2 where it does not know more.
    for (const std::size_t at : {4U, 8U, 12U, 16U, 20U}) b.put(at, 2.0F);
    const bool luminous = info.unit == FluxUnit::lumen;
    b.put(24, static_cast<float>(luminous ? info.flux : lumens_of_watts(info)));
    return b.all();
}

// --- formats -----------------------------------------------------------------------------------------------

struct WriterFormat {
    std::string_view suffix;
    std::string (*header)(const RayFileInfo&);
    std::uint64_t most_rays;
    // How rows tell the colour: not at all, by X and Z behind the flux of coloured rays, or by a wavelength
    // before the flux, which is in W.
    enum class Colour : std::uint8_t { none, tristimulus, wavelength } colour;
    std::string_view end_mark;
};
constexpr std::uint64_t kAnyNumber = std::numeric_limits<std::uint64_t>::max();
// LightTools and SPEOS share .ray; the longer suffix comes first.
constexpr WriterFormat kWriterFormats[] = {
    {".tm25ray", tm25_header, kAnyNumber, WriterFormat::Colour::tristimulus, ""},
    {".dat", zemax_header, std::numeric_limits<std::int32_t>::max(), WriterFormat::Colour::none, ""},
    {".speos.ray", speos_header, kAnyNumber, WriterFormat::Colour::wavelength, ""},
    {".ray", lighttools_header, kAnyNumber, WriterFormat::Colour::none, "LTRFEND"},
};

const WriterFormat* format_of(const std::filesystem::path& file) {
    const std::string suffixes = suffix_of(file.stem()) + suffix_of(file);
    for (const WriterFormat& format : kWriterFormats) {
        if (suffixes.ends_with(format.suffix)) return &format;
    }
    return nullptr;
}

// Rounds to 20 significant bits, 1e-6: colours that are computed from a file's numbers come out as they went
// in, so that writing them again gives the same bytes.
double rounded_colour(double value) {
    constexpr std::uint32_t kDropped = 16;  // values of the last four bits of a float
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    return double{std::bit_cast<float>((bits + kDropped / 2) & ~(kDropped - 1))};
}

// Converts rays to rows of floats.
class Rows {
  public:
    Rows(const WriterFormat& format, const RayFileInfo& info)
        : tristimulus_(format.colour == WriterFormat::Colour::tristimulus && has_tristimulus(info)),
          radiant_(info.unit == FluxUnit::watt),
          xyz_(info.xyz),
          lumens_(radiant_ ? info.lumens_per_watt : 1) {
        if (format.colour != WriterFormat::Colour::wavelength) return;
        wavelength_ = static_cast<float>(speos_wavelength(info));
        watts_ = speos_watts(info);
    }
    const std::vector<float>& of(const RayBlock& block) {
        row_.clear();
        for (std::size_t i = 0; i < block.rays.size(); ++i) {
            const LampRay& ray = block.rays[i];
            for (int a = 0; a < 3; ++a)
                row_.push_back(static_cast<float>(double{ray.o[a]} * kMillimetresPerMetre));
            for (int a = 0; a < 3; ++a) row_.push_back(ray.d[a]);
            if (wavelength_ > 0) row_.push_back(wavelength_);
            row_.push_back(static_cast<float>(watts_ * double{ray.flux}));
            if (tristimulus_)
                put_tristimulus(ray.flux, block.tristimulus.empty() ? xyz_ : V3d(block.tristimulus[i]));
        }
        return row_;
    }

  private:
    void put_tristimulus(float flux, const V3d& xyz) {
        const auto put = [&](double value) {
            row_.push_back(static_cast<float>(rounded_colour(lumens_ * value) * double{flux}));
        };
        if (radiant_) put(xyz.y);
        put(xyz.x);
        put(xyz.z);
    }

    bool tristimulus_, radiant_;
    V3d xyz_;
    double lumens_;         // per unit of flux
    float wavelength_ = 0;  // nm; 0: rows have none
    double watts_ = 1;      // factor on the flux
    std::vector<float> row_;
};

// Returns the value that a file stated if the sum over the rays is the same up to rounding, else the sum.
double stated_or_sum(double stated, double sum) {
    constexpr double kRounding = 1e-5;
    return std::fabs(stated - sum) <= kRounding * sum ? stated : sum;
}

}  // namespace

bool has_ray_suffix(const std::filesystem::path& file) {
    return format_of(file) != nullptr;
}

bool keeps_colour(const std::filesystem::path& file, const RayFileInfo& info) {
    const WriterFormat* format = format_of(file);
    if (format && format->colour == WriterFormat::Colour::wavelength) return wavelength_of(info).has_value();
    return !is_coloured(info) ||
           (format && format->colour == WriterFormat::Colour::tristimulus && has_tristimulus(info));
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
    if (format->colour == WriterFormat::Colour::wavelength && info.unit == FluxUnit::watt &&
        !(info.lumens_per_watt > 0)) {
        throw InputError({file.string()},
                         "SPEOS's format states a wavelength and lumens, which are not known of this lamp in "
                         "watts; expected a lamp in lumens, or one imported with --colours or --efficacy");
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
    info.flux = stated_or_sum(set.flux - set.skipped_flux, info.flux);
    info.xyz = set.xyz;
    info.lumens_per_watt = set.lumens_per_watt;
    if (set.unit == FluxUnit::watt)
        info.lumens = stated_or_sum(set.header_lumens, info.flux * set.lumens_per_watt);
    info.colour_per_ray = set.coloured();
    info.text = set.text;
    write_rays(file, info, [&set](RayBlock& block) { block = {set.rays, set.tristimulus}; });
}

}  // namespace lucerna
