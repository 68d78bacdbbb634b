// Rays that leave a lamp, as recorded by a goniophotometer or a simulation.
//
// A ray file is a Monte Carlo sample of a lamp's light field: each ray carries a share of the flux. It can be
// emitted as it is, or projected onto a light field (ray_projection.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "engine/colour/spectrum.h"
#include "lights/flux_unit.h"

namespace lucerna {

struct LampRay {
    V3f o;       // origin, metres in the lamp's frame
    V3f d;       // unit
    float flux;  // >= 0, in the set's unit
};

// Collects the colours of rays one by one, as CIE XYZ per unit of flux. They are stored individually only
// once a second colour occurs; colours that differ only by rounding are one.
struct RayTints {
    V3f first{0.0F};        // of all rays, unless there are several; 0 before the first
    std::vector<V3f> each;  // one per ray, if there are several
    std::size_t rays = 0;

    bool several() const { return !each.empty(); }
    V3f of(std::size_t i) const { return several() ? each[i] : first; }
    // Returns true if `other` equals the first colour up to rounding.
    bool like(const V3f& other) const {
        constexpr float kRounding = 1e-5F;  // after many scatterings
        const V3f off = other - first;
        return std::max({std::fabs(off.x), std::fabs(off.y), std::fabs(off.z)}) <=
               kRounding * std::max({first.x, first.y, first.z});
    }
    void add(const V3f& tint) {
        if (rays == 0) first = tint;
        if (!several() && !like(tint)) each.assign(rays, first);
        if (several()) each.push_back(tint);
        ++rays;
    }
    void add(const RayTints& more);
};

struct RaySet {
    std::vector<LampRay> rays;
    // CIE XYZ of each ray's light per unit of its flux, scaled such that the flux-weighted mean of Y is 1:
    // flux · Y adds up to the flux of the set. In lumens each ray's Y is 1. In watts Y weights rays by
    // visibility, and invisible rays have (0, 0, 0). No component is negative. If empty, all rays have the
    // set's colour.
    std::vector<V3f> tristimulus;
    // The spectra of the light, as far as they are known, and the number of each ray's among them,
    // kNoSpectrum where it is unknown. Without numbers, all rays have the first spectrum. Rays whose
    // wavelength is stated have lines, in steps of 1 nm.
    std::vector<Spectrum> spectra;
    std::vector<std::uint16_t> spectrum;
    static constexpr std::uint16_t kNoSpectrum = 0xffff;
    FluxUnit unit = FluxUnit::watt;
    double flux = 0;                // of the whole lamp: all rays, including skipped ones
    double skipped_flux = 0;        // of skipped rays whose flux is known
    std::uint64_t skipped_nan = 0;  // position, direction or flux not finite, or flux negative
    std::uint64_t skipped_zero_direction = 0;
    double header_lumens = 0, header_watts = 0;  // as stated in the file; 0 or NaN: not stated
    V3d xyz = kWhiteXyz;                         // of all rays together, Y = 1; may be outside sRGB's gamut
    // Luminous efficacy of the radiation of a set in watts [lm/W], from spectra or columns of the file; 0 if
    // not known.
    double lumens_per_watt = 0;
    std::string provenance;  // one line: the file, and what it states about itself
    std::string text;        // one line: only the latter, which is written again

    bool coloured() const { return !tristimulus.empty(); }
    // Returns the colour of all rays in linear sRGB: luminance 1, all components >= 0.
    Rgb colour() const { return colour_of_luminance_one(xyz_to_rgb(xyz)); }
    // As above, with negative components where the colour is outside sRGB's gamut.
    Rgb open_colour() const { return xyz_to_rgb(xyz); }
    // Returns tristimulus of ray i, or the set's colour.
    V3d xyz_of(std::size_t i) const { return coloured() ? V3d(tristimulus[i]) : xyz; }
    // Returns flux · Y of ray i, its contribution to the set's flux.
    double light_of(std::size_t i) const {
        return double{rays[i].flux} * (coloured() ? double{tristimulus[i].y} : 1.0);
    }
    // Adds ray i of a set with the same spectra. Its flux does not count in the totals.
    void take(const RaySet& from, std::size_t i) {
        rays.push_back(from.rays[i]);
        if (from.coloured()) tristimulus.push_back(from.tristimulus[i]);
        if (!from.spectrum.empty()) spectrum.push_back(from.spectrum[i]);
    }
    // Returns the rays with their flux of X (0), Y (1) or Z (2), as a set without colours. Skipped rays count
    // as the mean of the others.
    RaySet channel(int c) const;
};

// Reads a ray file of any of these formats, recognised by the first bytes regardless of the name. A header's
// flux, if known and positive, overrides the sum of the rays, with a warning when they differ by more than
// 0.1 % though both are absolute. A file that gzip packed, or the only ray file in a zip archive, is unpacked
// while it is read. Throws InputError naming file and cause.
RaySet read_rays(const std::filesystem::path& file, Monitor& monitor);
// Returns true if the file is in one of these formats, packed or not. Throws InputError if it cannot be read,
// and for a zip archive without a ray file or with several.
bool is_ray_file(const std::filesystem::path& file);
// Names the formats in errors and help.
inline constexpr const char* kReadRayFormats =
    "IES TM-25 (.tm25ray), Zemax binary or text (.dat, .sdf), LightTools binary or text (.ray, .txt), SPEOS "
    "(.ray), ASAP (.dis) or a table with named columns (.txt, .csv), each also packed (.gz, .zip)";

// Rays of one of several lamps that are joined to one.
struct DrivenRays {
    RaySet set;
    std::string name;  // of the file, for messages
    double drive = 1;  // factor on the flux, finite, >= 0
};
// Joins the lamps of several ray files, all in one frame, to one lamp. Rays keep their colours; in a set of
// one colour they get the set's. A set of drive 0 adds nothing. In watts, the luminous efficacies give the
// relative brightness of the sets; if none is known, all watts are equally bright. Sets in watts beside sets
// in lumens are converted to lumens by their efficacy. Throws InputError naming the file if a required
// efficacy is unknown or if only some are known, and if no flux is left.
RaySet join_rays(std::vector<DrivenRays> parts);

// Converts the flux to lumens, each ray's by its own brightness. Requires the efficacy of a set in watts.
void turn_into_lumens(RaySet& set);

// Override what a file does not state or states wrongly. state_spectrum() gives all rays one spectrum, which
// must have visible light, and its colour, and sets the efficacy of a set in watts. Colours of single rays
// are dropped.
void state_spectrum(RaySet& set, Spectrum spectrum);
// Sets the efficacy of a set in watts, in (0, kMostLumensPerWatt]. Colours stay.
void state_efficacy(RaySet& set, double lumens_per_watt);

// Writes rays for optics programs: IES TM-25, Zemax binary, LightTools binary, SPEOS.
//
// A file is written block by block, so that it may exceed the memory, and replaced atomically. Equal rays
// give equal bytes: no date is written. A file that is read and written again has the same bytes.

struct RayFileInfo {
    std::uint64_t rays = 0;
    FluxUnit unit = FluxUnit::lumen;
    double flux = 0;  // of all rays, in `unit`
    // CIE XYZ, Y = 1, of all rays together. TM-25 stores colours with luminous flux, for which watts need an
    // efficacy. SPEOS stores watts and a wavelength: that of the light if it has the colour of one, and else
    // 555 nm. The other formats cannot store a colour.
    V3d xyz = kWhiteXyz;
    double lumens_per_watt = 0;   // as in RaySet
    double lumens = 0;            // of all rays, if they are in W; 0: as lumens_per_watt gives
    bool colour_per_ray = false;  // each ray has its own colour
    std::string text;             // description of the content, one line
};

// A block of rays to be written: positions in metres, unit directions, flux in info.unit.
struct RayBlock {
    std::vector<LampRay> rays;
    std::vector<V3f> tristimulus;  // as in RaySet; one per ray if info.colour_per_ray, else empty
};
// Fills the block with the next rays, all of the file's colour.
using NextRays = std::function<void(std::vector<LampRay>& block)>;
// Fills the block with the next rays, each with its colour.
using NextColouredRays = std::function<void(RayBlock& block)>;

// The suffix selects the format: .tm25ray, .dat, .ray, or .speos.ray. `next` is called until info.rays rays
// have come; an empty block or one with too many rays is a programming error. Throws InputError for another
// suffix, for too many rays for the format, for watts of unknown light in SPEOS's format, or if the file
// cannot be written.
void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextRays& next);
void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextColouredRays& next);
// Writes the usable rays of a set.
void write_rays(const std::filesystem::path& file, const RaySet& set);

// Names the suffixes in errors.
inline constexpr const char* kRaySuffixes =
    ".tm25ray, .dat (Zemax), .ray (LightTools) and .speos.ray (SPEOS)";
bool has_ray_suffix(const std::filesystem::path& file);
// Returns true if a file of that name would store the colours of these rays.
bool keeps_colour(const std::filesystem::path& file, const RayFileInfo& info);

}  // namespace lucerna
