#include "engine/colour/rendition.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

// Melanopic efficacy of luminous radiation of D65 [W/lm] [CIE S 026:2018, table 3].
constexpr double kMelanopicDaylight = 1.3262e-3;
constexpr double kLumensPerWatt = 683;
constexpr double kMostReference = 25000;  // K; the end of CIE daylight

double hat(double nanometres, std::size_t band) {
    return std::max(0.0, 1 - std::fabs(nanometres - BandSpectrum::nanometres(band)) / kBandWidth);
}

// Adds the part of a linear piece between two samples. The integrand is quadratic within each band, where
// Simpson's rule is exact.
void add_piece(const SpectralSample& a, const SpectralSample& b, BandSpectrum& to) {
    const double width = b.nanometres - a.nanometres;
    const double first = std::max(a.nanometres, kFirstBand - kBandWidth);
    const double last = std::min(b.nanometres, BandSpectrum::nanometres(kBands - 1) + kBandWidth);
    const auto weight = [&](double nm) {
        return a.weight + (nm - a.nanometres) / width * (b.weight - a.weight);
    };
    for (double from = first; from < last;) {
        const double step = std::floor((from - kFirstBand) / kBandWidth);
        const double end = std::min(kFirstBand + (step + 1) * kBandWidth, last), middle = 0.5 * (from + end);
        for (int side = 0; side < 2; ++side) {
            const double band = step + side;
            if (band < 0 || band >= double{kBands}) continue;
            const auto i = static_cast<std::size_t>(band);
            to.at[i] += (end - from) / 6 / kBandWidth *
                        (hat(from, i) * weight(from) + 4 * hat(middle, i) * weight(middle) +
                         hat(end, i) * weight(end));
        }
        from = end;
    }
}

bool is_coarse(std::span<const SpectralSample> samples) {
    constexpr double kRounding = 1e-6;
    for (std::size_t i = 1; i < samples.size(); ++i) {
        if (samples[i].nanometres - samples[i - 1].nanometres < kBandWidth - kRounding) return false;
    }
    return samples.size() > 1;
}

BandSpectrum interpolated(std::span<const SpectralSample> samples) {
    BandSpectrum spectrum;
    std::size_t next = 0;
    for (std::size_t i = 0; i < kBands; ++i) {
        const double nm = BandSpectrum::nanometres(i);
        while (next < samples.size() && samples[next].nanometres < nm) ++next;
        if (next == samples.size()) break;
        const SpectralSample& b = samples[next];
        if (b.nanometres == nm)
            spectrum.at[i] = b.weight;
        else if (next > 0)
            spectrum.at[i] = std::lerp(
                samples[next - 1].weight, b.weight,
                (nm - samples[next - 1].nanometres) / (b.nanometres - samples[next - 1].nanometres));
    }
    return spectrum;
}

// Samples are weighted by a spectrum; the result is for a light of luminance 100.
template <typename Observer>
V3d tristimulus(const BandSpectrum& light, const Observer& observer,
                const std::array<double, kBands>* sample) {
    V3d sum(0, 0, 0);
    double white = 0;
    for (std::size_t i = 0; i < kBands; ++i) {
        const V3d bar = observer(i);
        sum += light.at[i] * (sample ? (*sample)[i] : 1.0) * bar;
        white += light.at[i] * bar.y;
    }
    return 100 / white * sum;
}
V3d observer_2(std::size_t i) {
    return cie_xyz(BandSpectrum::nanometres(i));
}
V3d observer_10(std::size_t i) {
    return cie_xyz_10()[i];
}

// Returns Planck's law at the wavelengths of the bands.
BandSpectrum black_body(double kelvin) {
    BandSpectrum spectrum;
    for (const SpectralSample& sample : blackbody_spectrum(kelvin)) {
        const double band = (sample.nanometres - kFirstBand) / kBandWidth;
        if (band >= 0 && band < double{kBands} && band == std::floor(band))
            spectrum.at[static_cast<std::size_t>(band)] = sample.weight;
    }
    return spectrum;
}

// Returns a black body or daylight with ∫ s ȳ dλ = 1.
BandSpectrum reference(double kelvin, bool daylight) {
    const BandSpectrum spectrum = daylight ? banded(daylight_spectrum(kelvin)) : black_body(kelvin);
    return 1 / band_xyz(spectrum).y * spectrum;
}

// --- CIE 13.3 ----------------------------------------------------------------------------------------------

struct Ucs1960 {  // CIE 1960
    double u, v;
    // The terms of the adaptation [CIE 13.3-1995, 5.7].
    double c() const { return (4 - u - 10 * v) / v; }
    double d() const { return (1.708 * v + 0.404 - 1.481 * u) / v; }
};
Ucs1960 ucs_of(const V3d& xyz) {
    const Chromaticity c = chromaticity(xyz);
    return {c.u, c.v * 2 / 3};
}

// Returns the colour of a sample in CIE 1964 U*V*W*, adapted from the light to the reference.
V3d uvw_of(const V3d& sample, const Ucs1960& light, const Ucs1960& reference) {
    const Ucs1960 at = ucs_of(sample);
    const double c = reference.c() / light.c() * at.c(), d = reference.d() / light.d() * at.d();
    const double below = 16.518 + 1.481 * c - d;
    const Ucs1960 adapted{(10.872 + 0.404 * c - 4 * d) / below, 5.520 / below};
    const double w = 25 * cbrt(sample.y) - 17;
    return {13 * w * (adapted.u - reference.u), 13 * w * (adapted.v - reference.v), w};
}

void compute_rendering(const BandSpectrum& light, const BandSpectrum& reference, ColourRendition& result) {
    const Ucs1960 under = ucs_of(tristimulus(light, observer_2, nullptr));
    const Ucs1960 at = ucs_of(tristimulus(reference, observer_2, nullptr));
    result.general = 0;
    for (std::size_t i = 0; i < result.special.size(); ++i) {
        const std::array<double, kBands> sample = rendering_sample(i);
        const V3d one = uvw_of(tristimulus(light, observer_2, &sample), under, at);
        const V3d other = uvw_of(tristimulus(reference, observer_2, &sample), at, at);
        result.special[i] = 100 - 4.6 * (one - other).length();
        if (i < 8) result.general += result.special[i] / 8;
    }
}

// --- TM-30 -------------------------------------------------------------------------------------------------

// Return the maps from XYZ to CIECAM02's sensors of adaptation and to the Hunt-Pointer-Estevez cones, for row
// vectors [CIE 159:2004].
Imath::M33d to_sensors() {
    return Imath::M33d(0.7328, 0.4296, -0.1624, -0.7036, 1.6975, 0.0061, 0.0030, 0.0136, 0.9834).transposed();
}
Imath::M33d to_cones() {
    return Imath::M33d(0.38971, 0.68898, -0.07868, -0.22981, 1.18340, 0.04641, 0, 0, 1).transposed();
}

struct UcsColour {
    double j, a, b;  // J', a', b'
    double hue;      // h of CIECAM02, radians, 0 to 2π
};

// Computes CAM02-UCS [Luo et al. 2006] by CIECAM02 [CIE 159:2004] with the viewing conditions of CIE 224:
// average surround, complete adaptation, L_A = 100 cd/m², Y_b = 20.
class Appearance {
  public:
    explicit Appearance(const V3d& white) : sensors_(to_sensors()), cones_(sensors_.inverse() * to_cones()) {
        const V3d sensors = white * sensors_;
        for (int c = 0; c < 3; ++c) gain_[c] = white.y / sensors[c];
        white_ = achromatic(response(white));
    }
    UcsColour of(const V3d& xyz) const {
        const V3d r = response(xyz);
        const double a = r.x - 12 * r.y / 11 + r.z / 11, b = (r.x + r.y - 2 * r.z) / 9;
        const double turn = atan2(b, a), hue = turn < 0 ? turn + 2 * kPiD : turn;
        const double lightness =
            100 * pow(achromatic(r) / white_, kSurround * (1.48 + std::sqrt(kBackground)));
        const double eccentricity = 0.25 * (cos(hue + 2) + 3.8);
        const double t = 50000.0 / 13 * kInduction * eccentricity * hypot(a, b) / (r.x + r.y + 1.05 * r.z);
        const double chroma =
            pow(t, 0.9) * std::sqrt(lightness / 100) * pow(1.64 - pow(0.29, kBackground), 0.73);
        const double m = log1p(0.0228 * chroma * pow(kLuminance, 0.25)) / 0.0228;
        return {1.7 * lightness / (1 + 0.007 * lightness), m * cos(hue), m * sin(hue), hue};
    }

  private:
    static constexpr double kSurround = 0.69, kBackground = 0.2;
    // N_bb = N_cb = 0.725 (Y_w / Y_b)^0.2, and F_L for 5 L_A = 500 cd/m².
    static constexpr double kInduction = 1.0003040045593807, kLuminance = 0.7937005275461673;

    V3d response(const V3d& xyz) const {
        const V3d cone = gain_ * (xyz * sensors_) * cones_;
        V3d r;
        for (int c = 0; c < 3; ++c) {
            const double power = pow(std::fabs(kLuminance * cone[c] / 100), 0.42);
            r[c] = std::copysign(400 * power / (27.13 + power), cone[c]) + 0.1;
        }
        return r;
    }
    static double achromatic(const V3d& r) { return (2 * r.x + r.y + r.z / 20 - 0.305) * kInduction; }

    Imath::M33d sensors_, cones_;
    V3d gain_;
    double white_ = 0;
};

constexpr std::size_t kSampleCount = 99, kHueBins = 16;
using UcsColours = std::array<UcsColour, kSampleCount>;

UcsColours colours_under(const BandSpectrum& light) {
    const Appearance appearance(tristimulus(light, observer_10, nullptr));
    UcsColours colours;
    for (std::size_t i = 0; i < colours.size(); ++i) {
        const std::array<double, kBands> sample = fidelity_sample(i);
        colours[i] = appearance.of(tristimulus(light, observer_10, &sample));
    }
    return colours;
}

// Returns the area of the polygon of the mean colours in the bins of hue, in which the samples are under the
// reference.
double gamut_area(const UcsColours& colours, const UcsColours& reference) {
    std::array<std::array<double, 3>, kHueBins> bins{};  // sums of a', b' and 1
    for (std::size_t i = 0; i < colours.size(); ++i) {
        const auto bin = static_cast<std::size_t>(reference[i].hue / (2 * kPiD) * double{kHueBins});
        auto& sum = bins[std::min(bin, kHueBins - 1)];
        sum[0] += colours[i].a, sum[1] += colours[i].b, sum[2] += 1;
    }
    // A bin without samples is no corner.
    const auto last = std::remove_if(bins.begin(), bins.end(), [](const auto& bin) { return bin[2] == 0; });
    double area = 0;
    for (auto bin = bins.begin(); bin != last; ++bin) {
        const auto& next = bin + 1 == last ? bins.front() : *(bin + 1);
        area += 0.5 * ((*bin)[0] * next[1] - (*bin)[1] * next[0]) / ((*bin)[2] * next[2]);
    }
    return area;
}

void compute_fidelity(const BandSpectrum& light, const BandSpectrum& reference, ColourRendition& result) {
    const UcsColours under = colours_under(light), at = colours_under(reference);
    double difference = 0;
    for (std::size_t i = 0; i < under.size(); ++i) {
        difference +=
            std::sqrt(sqr(under[i].j - at[i].j) + sqr(under[i].a - at[i].a) + sqr(under[i].b - at[i].b)) /
            double{kSampleCount};
    }
    result.fidelity = 10 * log1p(exp((100 - 6.73 * difference) / 10));
    result.gamut = 100 * gamut_area(under, at) / gamut_area(at, at);
}

// Returns the reference of TM-30, which goes over from a black body to daylight between 4000 and 5000 K.
BandSpectrum fidelity_reference(double kelvin) {
    const double share = std::clamp((kelvin - 4000) / 1000, 0.0, 1.0);
    BandSpectrum mixed;
    if (share < 1) mixed += (1 - share) * reference(kelvin, false);
    if (share > 0) mixed += share * reference(kelvin, true);
    return mixed;
}

}  // namespace

double BandSpectrum::integral() const {
    double sum = 0;
    for (const double value : at) sum += kBandWidth * value;
    return sum;
}

BandSpectrum banded(std::span<const SpectralSample> samples) {
    if (is_coarse(samples)) return interpolated(samples);
    BandSpectrum spectrum;
    if (samples.size() == 1) {
        for (std::size_t i = 0; i < kBands; ++i)
            spectrum.at[i] = samples[0].weight * hat(samples[0].nanometres, i) / kBandWidth;
    }
    for (std::size_t i = 1; i < samples.size(); ++i) add_piece(samples[i - 1], samples[i], spectrum);
    return spectrum;
}

V3d band_xyz(const BandSpectrum& spectrum) {
    V3d sum(0, 0, 0);
    for (std::size_t i = 0; i < kBands; ++i) sum += kBandWidth * spectrum.at[i] * observer_2(i);
    return sum;
}

double band_lumens(const BandSpectrum& spectrum) {
    return kLumensPerWatt * band_xyz(spectrum).y;
}

double melanopic_edi(const BandSpectrum& spectrum) {
    double sum = 0;
    for (std::size_t i = 0; i < kBands; ++i) sum += kBandWidth * spectrum.at[i] * melanopic_action()[i];
    return sum / kMelanopicDaylight;
}

std::optional<ColourRendition> colour_rendition(const BandSpectrum& spectrum) {
    const auto temperature = colour_temperature(band_xyz(spectrum));
    if (!temperature || temperature->kelvin > kMostReference) return std::nullopt;
    ColourRendition result{*temperature, {}, 0, 0, 0};
    constexpr double kDaylightFrom = 5000;  // K [CIE 13.3-1995, 5.3]
    const double kelvin = temperature->kelvin;
    compute_rendering(spectrum, reference(kelvin, kelvin >= kDaylightFrom), result);
    compute_fidelity(spectrum, fidelity_reference(kelvin), result);
    return result;
}

}  // namespace lucerna
