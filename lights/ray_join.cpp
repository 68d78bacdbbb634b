#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/system/memory.h"
#include "lights/ray_set.h"

namespace lucerna {
namespace {

void check_parts(const std::vector<DrivenRays>& parts) {
    if (parts.empty()) throw InputError("no ray files to join");
    const DrivenRays& first = parts.front();
    const auto in_lumens = std::find_if(
        parts.begin(), parts.end(), [](const DrivenRays& part) { return part.set.unit == FluxUnit::lumen; });
    const bool any_lumens = in_lumens != parts.end();
    const auto known = [](const DrivenRays& part) { return part.set.lumens_per_watt > 0; };
    for (const DrivenRays& part : parts) {
        const Location at{part.name};
        if (!std::isfinite(part.drive) || part.drive < 0)
            input_error(at, "drive {}; finite and not negative", part.drive);
        if (part.set.unit == FluxUnit::watt && any_lumens && !known(part)) {
            input_error(at,
                        "its flux is in W, that of {} in lm, and the file has no data for the conversion "
                        "(wavelengths, spectra, or lumens as well as watts); give an efficacy in lm/W or a "
                        "wavelength (--efficacy, --colours)",
                        in_lumens->name);
        }
        if (!any_lumens && known(part) != known(first)) {
            input_error(known(part) ? Location{first.name} : at,
                        "the file has no data to convert its watts (wavelengths, spectra, or lumens as well "
                        "as watts), but {} does; either all files or none must have it; give an efficacy in "
                        "lm/W or a wavelength (--efficacy, --colours)",
                        known(part) ? part.name : first.name);
        }
    }
    const auto lit = [](const DrivenRays& part) { return part.drive > 0; };
    if (std::none_of(parts.begin(), parts.end(), lit)) throw InputError("all drives are 0");
}

// Returns true if all parts have one colour, up to rounding.
bool alike(const std::vector<DrivenRays>& parts) {
    const auto one = [&](const DrivenRays& part) {
        return !part.set.coloured() && (part.set.xyz - parts.front().set.xyz).length() < 1e-6 &&
               part.set.lumens_per_watt == parts.front().set.lumens_per_watt;
    };
    return std::all_of(parts.begin(), parts.end(), one);
}

double flux_of_rays(const RaySet& set) {
    double flux = 0;
    for (const LampRay& ray : set.rays) flux += double{ray.flux};
    return flux;
}

// Sets the colour of all parts together. Returns Y per unit of each part's flux, relative to the mean.
std::vector<double> brightness(const std::vector<DrivenRays>& parts, RaySet& joined) {
    std::vector<double> scales;
    V3d sum(0, 0, 0);
    double flux = 0, watts_lumens = 0;
    for (const DrivenRays& part : parts) {
        const double efficacy = part.set.lumens_per_watt > 0 ? part.set.lumens_per_watt : 1;
        const double scale = part.set.unit == FluxUnit::watt ? efficacy : 1;
        const double share = part.drive * flux_of_rays(part.set);
        scales.push_back(scale);
        sum += scale * share * part.set.xyz;
        flux += share;
        watts_lumens += share * part.set.lumens_per_watt;
    }
    if (!(sum.y > 0)) return std::vector<double>(parts.size(), 1);
    joined.xyz = sum / sum.y;
    joined.lumens_per_watt = watts_lumens / flux;  // flux > 0 because sum.y > 0
    for (double& scale : scales) scale *= flux / sum.y;
    return scales;
}

// Joins the spectra of parts, if all of them have some. Equal spectra become one.
class JoinedSpectra {
  public:
    JoinedSpectra(const std::vector<DrivenRays>& parts, RaySet& joined) : joined_(joined) {
        for (const DrivenRays& part : parts) {
            if (part.set.spectra.empty()) {
                forget();
                return;
            }
            by_ray_ = by_ray_ || !part.set.spectrum.empty();
            std::vector<std::uint16_t>& numbers = number_.emplace_back();
            for (const Spectrum& spectrum : part.set.spectra) {
                const auto found = std::ranges::find(joined_.spectra, spectrum);
                numbers.push_back(static_cast<std::uint16_t>(found - joined_.spectra.begin()));
                if (found == joined_.spectra.end()) joined_.spectra.push_back(spectrum);
                if (joined_.spectra.size() == RaySet::kNoSpectrum) {
                    forget();
                    return;
                }
            }
        }
        by_ray_ = by_ray_ || joined_.spectra.size() > 1;
    }
    // Adds ray i of a part.
    void add(std::size_t part, const RaySet& set, std::size_t i) {
        if (!by_ray_) return;
        const std::uint16_t number = set.spectrum.empty() ? std::uint16_t{0} : set.spectrum[i];
        joined_.spectrum.push_back(number == RaySet::kNoSpectrum ? number : number_[part][number]);
    }

  private:
    void forget() {
        joined_.spectra = {};
        by_ray_ = false;
    }

    RaySet& joined_;
    bool by_ray_ = false;
    std::vector<std::vector<std::uint16_t>> number_;  // in the joined set, of each part's spectra
};

// Returns 0 unless every part states the value.
double stated_by(const std::vector<DrivenRays>& parts, double RaySet::*header) {
    double sum = 0;
    for (const DrivenRays& part : parts) {
        const double value = part.set.*header;
        if (!std::isfinite(value) || !(value > 0)) return 0;
        sum += part.drive * value;
    }
    return sum;
}

}  // namespace

RaySet RaySet::channel(int c) const {
    RaySet of;
    of.unit = unit;
    of.provenance = provenance;
    of.rays = rays;
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        of.rays[i].flux = static_cast<float>(double{rays[i].flux} * xyz_of(i)[c]);
        sum += double{of.rays[i].flux};
        all += double{rays[i].flux};
    }
    of.flux = all > 0 ? sum * flux / all : sum;
    return of;
}

void turn_into_lumens(RaySet& set) {
    if (set.unit == FluxUnit::lumen) return;
    const double efficacy = set.lumens_per_watt;  // > 0, as the caller requires
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        // A ray's Y is relative to the mean of all.
        const double y = set.coloured() ? double{set.tristimulus[i].y} : 1.0;
        set.rays[i].flux = static_cast<float>(efficacy * y * double{set.rays[i].flux});
        if (set.coloured()) set.tristimulus[i] = y > 0 ? V3f(V3d(set.tristimulus[i]) / y) : V3f(0.0F);
    }
    set.flux *= efficacy;
    set.skipped_flux *= efficacy;
    set.unit = FluxUnit::lumen;
    set.lumens_per_watt = 0;
}

void state_spectrum(RaySet& set, Spectrum spectrum) {
    const V3d per_watt = xyz_per_watt(spectrum);
    set.xyz = per_watt / per_watt.y;
    set.tristimulus = {};
    set.spectrum = {};
    set.spectra = {std::move(spectrum)};
    if (set.unit == FluxUnit::watt) state_efficacy(set, std::min(kMostLumensPerWatt, 683 * per_watt.y));
}

void state_efficacy(RaySet& set, double lumens_per_watt) {
    set.lumens_per_watt = lumens_per_watt;
}

void RayTints::add(const RayTints& more) {
    if (more.rays == 0) return;
    if (rays == 0) first = more.first;
    if (!several() && (more.several() || !like(more.first))) each.assign(rays, first);
    if (several() || more.several()) {
        each.reserve(rays + more.rays);
        for (std::size_t i = 0; i < more.rays; ++i) each.push_back(more.of(i));
    }
    rays += more.rays;
}

RaySet join_rays(std::vector<DrivenRays> parts) {
    check_parts(parts);
    std::erase_if(parts, [](const DrivenRays& part) { return !(part.drive > 0); });
    const bool one_unit = std::all_of(parts.begin(), parts.end(), [&](const DrivenRays& part) {
        return part.set.unit == parts.front().set.unit;
    });
    if (!one_unit) {
        for (DrivenRays& part : parts) turn_into_lumens(part.set);
    }
    RaySet joined;
    joined.unit = parts.front().set.unit;
    const bool coloured = !alike(parts);
    JoinedSpectra spectra(parts, joined);
    const std::vector<double> scales = brightness(parts, joined);
    std::size_t rays = 0;
    for (const DrivenRays& part : parts) rays += part.set.rays.size();
    require_memory(bytes_of(rays, sizeof(LampRay) + (coloured ? sizeof(V3f) : 0)),
                   fmt::format("{} rays of {} files", rays, parts.size()), "use fewer rays");
    joined.rays.reserve(rays);
    if (coloured) joined.tristimulus.reserve(rays);
    joined.header_lumens = stated_by(parts, &RaySet::header_lumens);
    joined.header_watts = stated_by(parts, &RaySet::header_watts);
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const RaySet& set = parts[p].set;
        const double drive = parts[p].drive;
        for (std::size_t i = 0; i < set.rays.size(); ++i) {
            const LampRay& ray = set.rays[i];
            joined.rays.push_back({ray.o, ray.d, static_cast<float>(drive * double{ray.flux})});
            if (coloured) joined.tristimulus.push_back(V3f(scales[p] * set.xyz_of(i)));
            spectra.add(p, set, i);
        }
        joined.flux += drive * set.flux;
        joined.skipped_flux += drive * set.skipped_flux;
        joined.skipped_nan += set.skipped_nan;
        joined.skipped_zero_direction += set.skipped_zero_direction;
        joined.provenance += fmt::format("{}{:g} x {}", p == 0 ? "" : " + ", drive, set.provenance);
        parts[p].set = {};  // frees memory that the joined set needs
    }
    return joined;
}

}  // namespace lucerna
