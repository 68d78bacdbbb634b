// Converts colours of all spellings to the working space.
//
// Emission differs between pbrt's versions. Version 4 scales a light's spectrum to luminance 1 and takes its
// strength from "scale" or "power"; versions 1 to 3 take the numbers unchanged. Here lists of samples and
// files are unchanged, so that "spectrum L" [400 5 700 5] and "rgb L" [5 5 5] are equally bright. Spectra
// without a scale of their own are scaled to luminance 1: named illuminants, and a blackbody of one number
// (version 4). A blackbody of two numbers is version 3's, and the second is its largest spectral value.
//
// In a photometric scene these luminances are in cd/m² (or cd), except for samples. They are spectral
// radiance, W/(m² sr nm), with a luminance of 683 lm/W ∫ s V dλ.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/colour/rendition.h"
#include "engine/colour/spectrum.h"
#include "engine/pbrt/state.h"
#include "engine/text/spelling.h"
#include "lights/flux_unit.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// Complex refractive indices of Tungsten's table (Bitterli): measured spectra as linear sRGB without white
// balance.
struct Metal {
    std::string_view name;
    Rgb eta, k;
};
const Metal kMetals[] = {
    {"Ag", {0.1552646F, 0.1167232F, 0.1383807F}, {4.8283433F, 3.1222459F, 2.1470504F}},
    {"Al", {1.6574600F, 0.8803689F, 0.5212287F}, {9.2238691F, 6.2695232F, 4.8370012F}},
    {"Au", {0.1431190F, 0.3749570F, 1.4424785F}, {3.9831604F, 2.3857207F, 1.6032152F}},
    {"Cu", {0.2004377F, 0.9240334F, 1.1022120F}, {3.9129485F, 2.4528477F, 2.1421880F}},
};
// The white of those four metals, equal energy by the CIE tables.
const Rgb kTableWhite(1.20479F, 0.94829F, 0.90864F);

// Values that ratio_rgb() computes from the spectra that pbrt-v4 lists.
const Metal kOxides[] = {
    {"MgO", {1.7343714F, 1.7407988F, 1.7540275F}, Rgb(0.0F)},
    {"TiO2", {2.8695823F, 2.9539891F, 3.1950498F}, {0.0001F, 0.0F, 0.0006F}},
};

// Refractive indices at the d line, 587.6 nm, from the makers' data sheets.
struct Glass {
    std::string_view name;
    float eta;
};
constexpr Glass kGlasses[] = {{"glass-BK7", 1.5168F},    {"glass-BAF10", 1.67003F}, {"glass-FK51A", 1.48656F},
                              {"glass-LASF9", 1.85025F}, {"glass-SF5", 1.67271F},   {"glass-SF10", 1.72825F},
                              {"glass-SF11", 1.78472F}};

std::vector<std::string> known_names() {
    std::vector<std::string> names;
    for (const Glass& glass : kGlasses) names.emplace_back(glass.name);
    for (const auto& metals : {std::span<const Metal>(kMetals), std::span<const Metal>(kOxides)}) {
        for (const Metal& metal : metals) {
            names.push_back(fmt::format("metal-{}-eta", metal.name));
            names.push_back(fmt::format("metal-{}-k", metal.name));
        }
    }
    for (const std::string_view name : illuminant_names()) names.push_back(fmt::format("stdillum-{}", name));
    return names;
}

std::optional<Rgb> named_metal(std::string_view name) {
    const auto matches = [name](const Metal& metal, std::string_view part) {
        return name == fmt::format("metal-{}-{}", metal.name, part);
    };
    for (const Metal& metal : kMetals) {
        if (matches(metal, "eta")) return metal.eta / kTableWhite;
        if (matches(metal, "k")) return metal.k / kTableWhite;
    }
    for (const Metal& metal : kOxides) {
        if (matches(metal, "eta")) return metal.eta;
        if (matches(metal, "k")) return metal.k;
    }
    return std::nullopt;
}

Rgb color_of(const WorkingSpace& colours, const V3d& xyz, ColorUse use) {
    return use == ColorUse::ratio ? colours.ratio_of_xyz(xyz) : colours.light_of_xyz(xyz);
}
Rgb color_of(const WorkingSpace& colours, std::span<const SpectralSample> spectrum, ColorUse use) {
    return use == ColorUse::ratio ? colours.ratio_of_spectrum(spectrum) : colours.light_of_spectrum(spectrum);
}

// Keeps the spectrum of a light's colour.
void note_spectrum(Reading& reading, std::span<const SpectralSample> spectrum, ColorUse use) {
    if (use == ColorUse::ratio) return;
    const BandSpectrum bands = banded(spectrum);
    const double lumens = band_lumens(bands);
    if (lumens > 0) reading.light_spectrum = 1 / lumens * bands;
}

// Returns the colour of samples that the text or a file lists.
Rgb color_of_samples(Reading& reading, std::span<const SpectralSample> spectrum, ColorUse use) {
    note_spectrum(reading, spectrum, use);
    const Rgb color = color_of(reading.colours(), spectrum, use);
    const bool absolute = use == ColorUse::emission && reading.draft.unit == FluxUnit::lumen;
    return absolute ? color * static_cast<float>(kMostLumensPerWatt * luminous_width()) : color;
}

std::optional<Rgb> named_illuminant(Reading& reading, std::string_view name, ColorUse use) {
    const WorkingSpace& colours = reading.colours();
    if (const auto spectrum = illuminant_spectrum(name)) note_spectrum(reading, *spectrum, use);
    if (colours.is_srgb()) return illuminant_rgb(name);
    const auto xyz = illuminant_xyz(name);
    return xyz ? std::optional<Rgb>(color_of(colours, *xyz, use)) : std::nullopt;
}

std::optional<Rgb> named_spectrum(Reading& reading, const Param& param, const std::string& name,
                                  ColorUse use) {
    constexpr std::string_view kIlluminant = "stdillum-";
    if (name.starts_with(kIlluminant))
        return named_illuminant(reading, std::string_view(name).substr(kIlluminant.size()), use);
    for (const Glass& glass : kGlasses) {
        if (name != glass.name) continue;
        reading.warn_or_refuse(param.place, fmt::format("{}: dispersion is not supported", name),
                               fmt::format("{} at 587.6 nm is used", glass.eta));
        return Rgb(glass.eta);
    }
    const auto metal = named_metal(name);
    return metal ? std::optional<Rgb>(reading.colours().ratio(*metal)) : std::nullopt;
}

// Reads a spectrum by a name that pbrt knows, or else from a file.
Rgb spectrum_of_name(Reading& reading, const Param& param, ColorUse use) {
    const std::string name = param.strings.size() == 1 ? param.strings.front() : std::string();
    if (name.empty()) fail(param.place, "\"{}\": expected one name or file", shown(param.name));
    if (const auto known = named_spectrum(reading, param, name, use)) return *known;
    const std::filesystem::path file = reading.resolve(name);
    std::error_code status;
    if (!std::filesystem::exists(file, status) && file.extension().empty()) {
        const std::vector<std::string> names = known_names();
        const std::vector<std::string_view> views(names.begin(), names.end());
        fail(param.place, "spectrum \"{}\" is unknown; {}expected a file, or {}", shown(name),
             did_you_mean(name, views), fmt::join(names, ", "));
    }
    try {
        const Spectrum spectrum = read_spd(file);
        for (const SpectralSample& sample : spectrum) {
            if (sample.weight < 0) {
                throw InputError({file.string()},
                                 fmt::format("{:g} at {:g} nm; expected values that are not negative",
                                             sample.weight, sample.nanometres));
            }
        }
        return color_of_samples(reading, spectrum, use);
    } catch (const InputError& error) {
        fail_always(param.place, "{}", printable(error.what()));
    }
}

// Returns a number of a colour clamped to [least, most].
double held(const Params& params, const Param& param, std::size_t index, double least, double most) {
    const double value = param.numbers[index];
    if (value >= least && value <= most) return value;
    const double taken = std::clamp(value, least, most);
    params.warn_or_refuse(param.place_of(index),
                          fmt::format("\"{}\": {:g} is not accepted; expected {:g} to {:g}",
                                      shown(param.name), value, least, most),
                          fmt::format("{:g} is used", taken));
    return taken;
}

std::optional<Rgb> color_of_count(Params& params, const Param& param, std::string_view accepted) {
    params.depart_once(param,
                       fmt::format("\"{}\" has {} numbers; {}", shown(param.name), param.count(), accepted),
                       "it is left out");
    return std::nullopt;
}

std::optional<Rgb> spectrum_of_samples(Reading& reading, Params& params, const Param& param, ColorUse use) {
    const std::size_t count = param.numbers.size();
    constexpr std::string_view accepted = "expected pairs of wavelength (nm) and value";
    if (count < 2 || !param.strings.empty()) return color_of_count(params, param, accepted);
    if (count % 2 != 0) {
        params.depart_once(param,
                           fmt::format("\"{}\" has {} numbers; {}", shown(param.name), count, accepted),
                           "the last one is left out");
    }
    Spectrum spectrum;
    bool rises = true, fits = true;  // reports once, as finding a place scans the text
    for (std::size_t i = 0; i + 1 < count; i += 2) {
        const double nm = param.numbers[i];
        if (rises && !spectrum.empty() && !(nm > spectrum.back().nanometres)) {
            params.warn_or_refuse(param.place_of(i),
                                  fmt::format("wavelength {:g} follows {:g}; expected ascending wavelengths",
                                              nm, spectrum.back().nanometres),
                                  "they are sorted");
            rises = false;
        }
        const double value = std::clamp(param.numbers[i + 1], 0.0, 1e30);
        if (fits && value != param.numbers[i + 1]) {
            fits = false;
            held(params, param, i + 1, 0, 1e30);
        }
        spectrum.push_back({nm, value});
    }
    if (!rises) {
        std::stable_sort(spectrum.begin(), spectrum.end(), [](const auto& one, const auto& other) {
            return one.nanometres < other.nanometres;
        });
        const auto same = [](const auto& one, const auto& other) {
            return one.nanometres == other.nanometres;
        };
        spectrum.erase(std::unique(spectrum.begin(), spectrum.end(), same), spectrum.end());
    }
    return color_of_samples(reading, spectrum, use);
}

std::optional<Rgb> color_of_blackbody(Reading& reading, Params& params, const Param& param, ColorUse use) {
    const std::size_t count = param.numbers.size();
    if (count < 1 || count > 2)
        return color_of_count(params, param,
                              "expected a temperature in kelvins, or a temperature and a scale");
    const WorkingSpace& colours = reading.colours();
    const Spectrum spectrum = blackbody_spectrum(held(params, param, 0, 300, 1e6));
    note_spectrum(reading, spectrum, use);
    const Rgb color = color_of(colours, spectrum, use);
    if (count == 2) return color * static_cast<float>(held(params, param, 1, 0, 1e30));
    if (colours.is_srgb()) return colour_of_luminance_one(color);
    return color / static_cast<float>(emission_xyz(spectrum).y);  // > 0, as a blackbody emits
}

std::optional<Rgb> color_of_xyz(const Reading& reading, Params& params, const Param& param, ColorUse use) {
    if (param.numbers.size() != 3) return color_of_count(params, param, "expected 3");
    return color_of(reading.colours(),
                    V3d(held(params, param, 0, 0, 1e30), held(params, param, 1, 0, 1e30),
                        held(params, param, 2, 0, 1e30)),
                    use);
}

std::optional<Rgb> color_of_rgb(const Reading& reading, Params& params, const Param& param, ColorUse use) {
    if (param.numbers.size() != 3) return color_of_count(params, param, "expected 3");
    const double most = param.space ? 1e30 : 3.4e38;
    return rgb_of_numbers(reading, params, param,
                          V3d(held(params, param, 0, 0, most), held(params, param, 1, 0, most),
                              held(params, param, 2, 0, most)),
                          use);
}

}  // namespace

Rgb rgb_of_numbers(const Reading& reading, const Params& params, const Param& param, const V3d& numbers,
                   ColorUse use) {
    const WorkingSpace& colours = reading.colours();
    const Rgb factor = use == ColorUse::ratio ? Rgb(1) : colours.white();
    const bool grey = numbers.x == numbers.y && numbers.y == numbers.z;  // white is white in every space
    const ColourSpace& space = param.space ? *param.space : colour_spaces().front();
    if (grey || space.name == colours.name()) return Rgb(numbers) * factor;
    const V3d xyz = space.to_xyz(numbers);
    if (!colours.holds(xyz)) {
        params.warn_or_refuse(
            param.place,
            fmt::format("\"{}\": this {} colour is outside the gamut of {}, the colour space of the render",
                        shown(param.name), space.name, colours.is_srgb() ? "sRGB" : colours.name()),
            "it is mixed with grey of the same luminance", "saturation");
    }
    return color_of(colours, xyz, use);
}

std::optional<Rgb> read_spectrum(Reading& reading, Params& params, std::string_view name, ColorUse use) {
    const Param* param = params.find(name, {Type::rgb, Type::spectrum, Type::blackbody, Type::xyz});
    if (!param) return std::nullopt;
    switch (param->type) {
        case Type::spectrum:
            return param->strings.empty() ? spectrum_of_samples(reading, params, *param, use)
                                          : spectrum_of_name(reading, *param, use);
        case Type::blackbody:
            return color_of_blackbody(reading, params, *param, use);
        case Type::xyz:
            return color_of_xyz(reading, params, *param, use);
        default:
            return color_of_rgb(reading, params, *param, use);
    }
}

}  // namespace lucerna
