// Illuminants A and D and the chromaticities of the F series are from CIE 15:2004, "Colorimetry", Planck's
// constants from Wyszecki and Stiles, "Color Science".
#include "engine/colour/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/float_traps.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr double kFirst = kFirstVisible, kLast = kLastVisible;

// Integrates over the visible range, with constant values beyond the ends.
V3d visible_xyz(std::span<const SpectralSample> spectrum) {
    Spectrum full(spectrum.begin(), spectrum.end());
    if (full.front().nanometres > kFirst) full.insert(full.begin(), {kFirst, full.front().weight});
    if (full.back().nanometres < kLast) full.push_back({kLast, full.back().weight});
    return spectrum_to_xyz(full);
}

V3d equal_energy() {
    const SpectralSample one[] = {{kFirst, 1}, {kLast, 1}};
    return spectrum_to_xyz(one);
}

// Tabulates S0, S1, S2 of CIE daylight, every 10 nm from 300 to 830.
constexpr double kDaylight[][3] = {
    {0.04, 0.02, 0.0},   {6.0, 4.5, 2.0},     {29.6, 22.4, 4.0},   {55.3, 42.0, 8.5},   {57.3, 40.6, 7.8},
    {61.8, 41.6, 6.7},   {61.5, 38.0, 5.3},   {68.8, 42.4, 6.1},   {63.4, 38.5, 3.0},   {65.8, 35.0, 1.2},
    {94.8, 43.4, -1.1},  {104.8, 46.3, -0.5}, {105.9, 43.9, -0.7}, {96.8, 37.1, -1.2},  {113.9, 36.7, -2.6},
    {125.6, 35.9, -2.9}, {125.5, 32.6, -2.8}, {121.3, 27.9, -2.6}, {121.3, 24.3, -2.6}, {113.5, 20.1, -1.8},
    {113.1, 16.2, -1.5}, {110.8, 13.2, -1.3}, {106.5, 8.6, -1.2},  {108.8, 6.1, -1.0},  {105.3, 4.2, -0.5},
    {104.4, 1.9, -0.3},  {100.0, 0.0, 0.0},   {96.0, -1.6, 0.2},   {95.1, -3.5, 0.5},   {89.1, -3.5, 2.1},
    {90.5, -5.8, 3.2},   {90.3, -7.2, 4.1},   {88.4, -8.6, 4.7},   {84.0, -9.5, 5.1},   {85.1, -10.9, 6.7},
    {81.9, -10.7, 7.3},  {82.6, -12.0, 8.6},  {84.9, -14.0, 9.8},  {81.3, -13.6, 10.2}, {71.9, -12.0, 8.3},
    {74.3, -13.3, 9.6},  {76.4, -12.9, 8.5},  {63.3, -10.6, 7.0},  {71.7, -11.6, 7.6},  {77.0, -12.2, 8.0},
    {65.2, -10.2, 6.7},  {47.7, -7.8, 5.2},   {68.6, -11.2, 7.4},  {65.0, -10.4, 6.8},  {66.0, -10.6, 7.0},
    {61.0, -9.7, 6.4},   {53.3, -8.3, 5.5},   {58.9, -9.3, 6.1},   {61.9, -9.8, 6.5}};

Spectrum illuminant_a() {
    Spectrum result;
    for (double nm = kFirst; nm <= kLast; ++nm) {
        const double at_560 = expm1(1.435e7 / (2848 * 560.0)), here = expm1(1.435e7 / (2848 * nm));
        result.push_back({nm, 100 * pow(560 / nm, 5) * at_560 / here});
    }
    return result;
}

// Tabulates x and y of F1 to F12, CIE 1931 observer.
constexpr double kFluorescent[12][2] = {{0.3131, 0.3371}, {0.3721, 0.3751}, {0.4091, 0.3941},
                                        {0.4402, 0.4031}, {0.3138, 0.3452}, {0.3779, 0.3882},
                                        {0.3129, 0.3292}, {0.3458, 0.3586}, {0.3741, 0.3727},
                                        {0.3458, 0.3588}, {0.3805, 0.3769}, {0.4370, 0.4042}};

constexpr std::array<std::string_view, 15> kIlluminants = {"A",  "D50", "D65", "F1", "F2",  "F3",  "F4", "F5",
                                                           "F6", "F7",  "F8",  "F9", "F10", "F11", "F12"};

double number_at(const std::string& word, const Location& at) {
    std::size_t used = 0;
    double value = NAN;
    try {
        const FloatTraps none(kNoFaults);  // std::stod reports large numbers by overflow
        value = std::stod(word, &used);
    } catch (const std::exception&) {
        used = 0;
    }
    if (used != word.size() || !std::isfinite(value)) {
        throw InputError(at,
                         fmt::format("\"{}\" is not a number; expected wavelengths in nm and values", word));
    }
    return value;
}

}  // namespace

Rgb xyz_colour(const V3d& xyz) {
    const Rgb rgb = xyz_to_rgb(xyz);
    if (rgb.x >= 0 && rgb.y >= 0 && rgb.z >= 0) return rgb;
    // A colour without luminance becomes black.
    const auto y = static_cast<float>(xyz.y);
    return y > 0 ? colour_of_luminance_one(rgb) * luminance(rgb) : Rgb(0.0F);
}

double luminous_width() {
    return equal_energy().y;
}

V3d emission_xyz(std::span<const SpectralSample> spectrum) {
    return visible_xyz(spectrum) / equal_energy().y;
}

Rgb emission_rgb(std::span<const SpectralSample> spectrum) {
    return xyz_colour(emission_xyz(spectrum));
}

Rgb equal_energy_rgb() {
    const V3d white = equal_energy();
    return xyz_to_rgb(white / white.y);
}

Rgb ratio_rgb(std::span<const SpectralSample> spectrum) {
    const Rgb rgb = xyz_to_rgb(visible_xyz(spectrum) / equal_energy().y);
    const Rgb white = equal_energy_rgb();  // no component is near 0
    const auto [least, most] = std::minmax_element(
        spectrum.begin(), spectrum.end(), [](const auto& a, const auto& b) { return a.weight < b.weight; });
    Rgb result;
    for (int c = 0; c < 3; ++c) {
        result[c] = std::clamp(rgb[c] / white[c], std::max(0.0F, static_cast<float>(least->weight)),
                               std::max(0.0F, static_cast<float>(most->weight)));
    }
    return result;
}

Spectrum blackbody_spectrum(double kelvin) {
    constexpr double kC2 = 1.438777e7;        // nm K
    constexpr double kWien = 2897771.955;     // nm K
    const auto shape = [kelvin](double nm) {  // relative to (kWien/T)^-5, so that nothing overflows
        return pow(kWien / (kelvin * nm), 5) / expm1(kC2 / (nm * kelvin));
    };
    const double peak = shape(kWien / kelvin);
    Spectrum result;
    for (double nm = kFirst; nm <= kLast; ++nm) result.push_back({nm, shape(nm) / peak});
    return result;
}

Spectrum daylight_spectrum(double kelvin) {
    const double t = kelvin;
    const double x = t <= 7000 ? 0.244063 + 0.09911e3 / t + 2.9678e6 / (t * t) - 4.6070e9 / (t * t * t)
                               : 0.237040 + 0.24748e3 / t + 1.9018e6 / (t * t) - 2.0064e9 / (t * t * t);
    const double y = -3 * x * x + 2.87 * x - 0.275;
    const double m = 0.0241 + 0.2562 * x - 0.7341 * y;  // about -0.15 for daylight
    const double m1 = (-1.3515 - 1.7703 * x + 5.9114 * y) / m;
    const double m2 = (0.0300 - 31.4424 * x + 30.0717 * y) / m;
    Spectrum result;
    double nm = 300;
    for (const auto& s : kDaylight) {
        result.push_back({nm, s[0] + m1 * s[1] + m2 * s[2]});
        nm += 10;
    }
    return result;
}

std::span<const std::string_view> illuminant_names() {
    return kIlluminants;
}

namespace {

// Returns a spectrum that is not normalised to luminance 1, for one of the first three illuminants.
Spectrum spectrum_of_illuminant(std::string_view name) {
    // D50 and D65 are defined by an older value of the radiation constant c2, hence 1.4388/1.4380.
    return name == "A" ? illuminant_a() : daylight_spectrum((name == "D50" ? 5000 : 6500) * 1.4388 / 1.4380);
}

V3d xyz_of_fluorescent(std::ptrdiff_t index) {
    const double x = kFluorescent[index][0], y = kFluorescent[index][1];
    return {x / y, 1, (1 - x - y) / y};
}

}  // namespace

std::optional<Spectrum> illuminant_spectrum(std::string_view name) {
    const auto known = std::span(kIlluminants).first(3);
    if (std::ranges::find(known, name) == known.end()) return std::nullopt;
    return spectrum_of_illuminant(name);
}

std::optional<V3d> illuminant_xyz(std::string_view name) {
    const auto found = std::find(kIlluminants.begin(), kIlluminants.end(), name);
    if (found == kIlluminants.end()) return std::nullopt;
    const auto index = found - kIlluminants.begin();
    if (index >= 3) return xyz_of_fluorescent(index - 3);
    const V3d xyz = emission_xyz(spectrum_of_illuminant(name));
    return xyz / xyz.y;
}

std::optional<Rgb> illuminant_rgb(std::string_view name) {
    const auto found = std::find(kIlluminants.begin(), kIlluminants.end(), name);
    if (found == kIlluminants.end()) return std::nullopt;
    const auto index = found - kIlluminants.begin();
    if (index >= 3) return xyz_colour(xyz_of_fluorescent(index - 3));
    const Rgb rgb = emission_rgb(spectrum_of_illuminant(name));
    return rgb / luminance(rgb);
}

Spectrum read_spd(const std::filesystem::path& file) {
    require_readable(file);
    std::istringstream text(read_text(file));
    Spectrum result;
    std::vector<double> numbers;
    int line = 0;
    for (std::string content; std::getline(text, content);) {
        ++line;
        content.resize(std::min(content.find('#'), content.size()));
        std::ranges::replace_if(
            content, [](char c) { return c == ',' || c == ';'; }, ' ');
        std::istringstream words(content);
        for (std::string word; words >> word;) {
            const Location at{file.string(), line, 1};
            numbers.push_back(number_at(word, at));
            if (numbers.size() % 2 != 0) continue;
            const double nm = numbers[numbers.size() - 2];
            if (!result.empty() && !(nm > result.back().nanometres)) {
                throw InputError(
                    at, fmt::format("wavelength {:g} follows {:g}; expected ascending wavelengths", nm,
                                    result.back().nanometres));
            }
            result.push_back({nm, numbers.back()});
        }
    }
    if (result.empty() || numbers.size() % 2 != 0) {
        throw InputError(
            {file.string()},
            fmt::format("holds {} numbers; expected pairs of wavelength and value", numbers.size()));
    }
    return result;
}

namespace {

// Returns ∫ weight (x̄, ȳ, z̄) dλ between two neighbouring samples. Between whole nanometres, weight and
// table are both linear, and Simpson's rule is exact for their product.
V3d between_samples(const SpectralSample& a, const SpectralSample& b) {
    const double width = b.nanometres - a.nanometres;
    const double first = std::max(a.nanometres, double{kFirstVisible});
    const double last = std::min(b.nanometres, double{kLastVisible});
    const auto at = [&](double nm) {
        return (a.weight + (nm - a.nanometres) / width * (b.weight - a.weight)) * cie_xyz(nm);
    };
    V3d sum(0, 0, 0);
    for (double from = first; from < last;) {
        const double to = std::min(std::floor(from) + 1, last);
        sum += (to - from) / 6 * (at(from) + 4.0 * at(0.5 * (from + to)) + at(to));
        from = to;
    }
    return sum;
}

}  // namespace

V3d spectrum_to_xyz(std::span<const SpectralSample> samples) {
    if (samples.size() == 1) return samples[0].weight * cie_xyz(samples[0].nanometres);
    V3d sum(0, 0, 0);
    for (std::size_t i = 1; i < samples.size(); ++i) sum += between_samples(samples[i - 1], samples[i]);
    return sum;
}

double spectrum_watts(std::span<const SpectralSample> samples) {
    if (samples.size() == 1) return samples[0].weight;
    double watts = 0;
    for (std::size_t i = 1; i < samples.size(); ++i) {
        const double width = samples[i].nanometres - samples[i - 1].nanometres;
        watts += 0.5 * std::max(0.0, width) * (samples[i].weight + samples[i - 1].weight);
    }
    return watts;
}

V3d xyz_per_watt(std::span<const SpectralSample> samples) {
    if (samples.size() == 1) return cie_xyz(samples[0].nanometres);
    const double watts = spectrum_watts(samples);
    return watts > 0 ? spectrum_to_xyz(samples) / watts : V3d(0, 0, 0);
}

Rgb xyz_to_rgb(const V3d& c) {
    // This is the inverse of rgb_to_xyz()'s matrix.
    return {
        static_cast<float>(3.2404813432005266 * c.x - 1.5371515162713185 * c.y - 0.49853632616888793 * c.z),
        static_cast<float>(-0.9692549499965684 * c.x + 1.8759900014898907 * c.y + 0.04155592655829283 * c.z),
        static_cast<float>(0.05564663913517716 * c.x - 0.20404133836651125 * c.y + 1.0573110696453445 * c.z)};
}

V3d rgb_to_xyz(const Rgb& c) {
    const double r = double{c.x}, g = double{c.y}, b = double{c.z};
    return {0.412453 * r + 0.357580 * g + 0.180423 * b, 0.212671 * r + 0.715160 * g + 0.072169 * b,
            0.019334 * r + 0.119193 * g + 0.950227 * b};
}

Rgb colour_of_luminance_one(const Rgb& c) {
    const float y = luminance(c);
    if (!is_finite(c) || !(y > 0)) return Rgb(1);
    Rgb unit = c / y;
    if (!is_finite(unit)) return Rgb(1);
    const float least = std::min({unit.x, unit.y, unit.z});
    if (least < 0) unit = Rgb(1) + (unit - Rgb(1)) / (1 - least);  // the least component becomes 0
    unit = {std::max(0.0F, unit.x), std::max(0.0F, unit.y), std::max(0.0F, unit.z)};
    return unit / luminance(unit);  // already about 1; removes the rounding error
}

}  // namespace lucerna
