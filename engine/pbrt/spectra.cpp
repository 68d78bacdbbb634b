// Colours of all spellings, brought to linear sRGB.
//
// What emission means differs between pbrt's versions: version 4 scales a light's spectrum to luminance 1 and
// takes its strength from "scale" or "power", versions 1 to 3 take the numbers as they stand. A list of
// samples or a file is taken as it stands here, so that "spectrum L" [400 5 700 5] and "rgb L" [5 5 5] are
// equally bright. What has no scale of its own is scaled to luminance 1: named illuminants, and a blackbody
// of one number (version 4); one of two numbers is version 3's, whose largest spectral value is the second.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/names.h"
#include "engine/base/spectrum.h"
#include "engine/pbrt/state.h"

namespace lucerna {
namespace {

using Type = Param::Type;

// Complex refractive indices as Tungsten's table (Bitterli) has them: measured spectra as linear sRGB,
// without a white of their own.
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
// The white those four lack: that of equal energy by the CIE tables.
const Rgb kTableWhite(1.20479F, 0.94829F, 0.90864F);

// From the spectra that pbrt-v4 lists, by ratio_rgb().
const Metal kOxides[] = {
    {"MgO", {1.7343714F, 1.7407988F, 1.7540275F}, Rgb(0.0F)},
    {"TiO2", {2.8695823F, 2.9539891F, 3.1950498F}, {0.0001F, 0.0F, 0.0006F}},
};

// Refractive indices at the d line, 587.6 nm (the makers' data sheets).
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

std::optional<Rgb> named_spectrum(Reading& reading, const Param& param, const std::string& name) {
    constexpr std::string_view kIlluminant = "stdillum-";
    if (name.starts_with(kIlluminant))
        return illuminant_rgb(std::string_view(name).substr(kIlluminant.size()));
    for (const Glass& glass : kGlasses) {
        if (name != glass.name) continue;
        reading.warn(param.place, fmt::format("{}: no dispersion, {} at 587.6 nm is taken", name, glass.eta));
        return Rgb(glass.eta);
    }
    return named_metal(name);
}

Rgb color_of(std::span<const SpectralSample> spectrum, ColorUse use) {
    return use == ColorUse::ratio ? ratio_rgb(spectrum) : emission_rgb(spectrum);
}

// A name that pbrt knows, or else a file.
Rgb spectrum_of_name(Reading& reading, const Param& param, ColorUse use) {
    const std::string name = param.strings.size() == 1 ? param.strings.front() : std::string();
    if (name.empty()) fail(param.place, "\"{}\": one name or file is accepted", shown(param.name));
    if (const auto known = named_spectrum(reading, param, name)) return *known;
    const std::filesystem::path file = reading.resolve(name);
    std::error_code status;
    if (!std::filesystem::exists(file, status) && file.extension().empty()) {
        const std::vector<std::string> names = known_names();
        const std::vector<std::string_view> views(names.begin(), names.end());
        fail(param.place, "spectrum \"{}\" is unknown; {}a file is accepted, and {}", shown(name),
             did_you_mean(name, views), fmt::join(names, ", "));
    }
    try {
        const Spectrum spectrum = read_spd(file);
        for (const SpectralSample& sample : spectrum) {
            if (sample.weight < 0) {
                throw InputError({file.string()},
                                 fmt::format("{:g} at {:g} nm; values that are not negative are "
                                             "accepted",
                                             sample.weight, sample.nanometres));
            }
        }
        return color_of(spectrum, use);
    } catch (const InputError& error) {
        fail(param.place, "{}", printable(error.what()));
    }
}

Rgb spectrum_of_samples(const Param& param, ColorUse use) {
    if (param.numbers.empty() || param.numbers.size() % 2 != 0 || !param.strings.empty()) {
        fail(param.place, "\"{}\" has {} numbers; pairs of wavelength (nm) and value are accepted",
             shown(param.name), param.numbers.size());
    }
    Spectrum spectrum;
    for (std::size_t i = 0; i < param.numbers.size(); i += 2) {
        const double nm = param.numbers[i], value = param.numbers[i + 1];
        if (!spectrum.empty() && !(nm > spectrum.back().nanometres)) {
            fail(param.place_of(i), "wavelength {:g} does not follow {:g}; rising ones are accepted", nm,
                 spectrum.back().nanometres);
        }
        if (!(value >= 0 && value <= 1e30)) {
            fail(param.place_of(i + 1), "{:g} at {:g} nm is not accepted; 0 to 1e30 is", value, nm);
        }
        spectrum.push_back({nm, value});
    }
    return color_of(spectrum, use);
}

Rgb color_of_blackbody(const Param& param, ColorUse use) {
    const std::vector<double>& n = param.numbers;
    if (n.empty() || n.size() > 2) {
        fail(param.place, "\"{}\" has {} numbers; kelvins are accepted, or kelvins and a scale",
             shown(param.name), n.size());
    }
    if (!(n[0] >= 300 && n[0] <= 1e6)) {
        fail(param.place_of(0), "{:g} K is not accepted; 300 to 1e6 is", n[0]);
    }
    if (n.size() == 2 && !(n[1] >= 0 && n[1] <= 1e30)) {
        fail(param.place_of(1), "{:g} is not accepted; 0 to 1e30 is", n[1]);
    }
    const Rgb color = color_of(blackbody_spectrum(n[0]), use);
    if (n.size() == 2) return color * static_cast<float>(n[1]);
    return colour_of_luminance_one(color);
}

Rgb color_of_xyz(const Param& param) {
    const std::vector<double>& n = param.numbers;
    if (n.size() != 3)
        fail(param.place, "\"{}\" has {} numbers; 3 are accepted", shown(param.name), n.size());
    for (std::size_t i = 0; i < 3; ++i) {
        if (!(n[i] >= 0 && n[i] <= 1e30)) fail(param.place_of(i), "{:g} is not accepted; 0 to 1e30 is", n[i]);
    }
    return xyz_colour({n[0], n[1], n[2]});
}

}  // namespace

std::optional<Rgb> read_spectrum(Reading& reading, Params& params, std::string_view name, ColorUse use) {
    const Param* param = params.find(name, {Type::rgb, Type::spectrum, Type::blackbody, Type::xyz});
    if (!param) return std::nullopt;
    switch (param->type) {
        case Type::spectrum:
            return param->strings.empty() ? spectrum_of_samples(*param, use)
                                          : spectrum_of_name(reading, *param, use);
        case Type::blackbody:
            return color_of_blackbody(*param, use);
        case Type::xyz:
            return color_of_xyz(*param);
        default:
            return to_rgb(*param);
    }
}

}  // namespace lucerna
