// Rays that leave a lamp, as a goniophotometer or a simulation has recorded them.
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
    V3f o;       // where the ray starts, metres in the lamp's frame
    V3f d;       // unit
    float flux;  // >= 0, in the set's unit
};

// The colours of rays that come one by one: CIE XYZ per unit of flux. They are kept one by one only once
// there is a second one; what differs by rounding alone is one.
struct RayTints {
    V3f first{0.0F};        // of all rays, unless there are several; 0 before there are any
    std::vector<V3f> each;  // of every ray, if there are several
    std::size_t rays = 0;

    bool several() const { return !each.empty(); }
    V3f of(std::size_t i) const { return several() ? each[i] : first; }
    // Whether these are one colour with another's first.
    bool like(const V3f& other) const {
        constexpr float kRounding = 1e-5F;  // of many scatterings
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
    // CIE XYZ of each ray's light per unit of its flux, on a scale that makes the mean of Y, weighted by
    // flux, 1: flux · Y adds up to the flux of the set. In lumens each ray's Y is 1; in watts it weighs the
    // rays as the eye does, and rays of no visible light have (0, 0, 0). No component is negative. Empty:
    // all rays have the set's colour.
    std::vector<V3f> tristimulus;
    FluxUnit unit = FluxUnit::watt;
    double flux = 0;                // of the whole lamp: all rays, and the skipped ones
    double skipped_flux = 0;        // of rays that were skipped although their flux is known
    std::uint64_t skipped_nan = 0;  // position, direction or flux not finite, or flux negative
    std::uint64_t skipped_zero_direction = 0;
    double header_lumens = 0, header_watts = 0;  // as the file states them; 0 or NaN: not stated
    V3d xyz = kWhiteXyz;  // CIE XYZ of all rays together, Y = 1; sRGB's gamut does not hold all such colours
    // Luminous efficacy of the radiation of a set in watts [lm/W], where spectra or columns of the file tell
    // it; 0: not known.
    double lumens_per_watt = 0;
    std::string provenance;  // one line: what the file says about itself

    bool coloured() const { return !tristimulus.empty(); }
    // The colour of all rays in linear sRGB: luminance 1, all components >= 0.
    Rgb colour() const { return colour_of_luminance_one(xyz_to_rgb(xyz)); }
    // The same with negative components where it is outside sRGB's gamut.
    Rgb open_colour() const { return xyz_to_rgb(xyz); }
    // Of ray i: tristimulus, or the set's colour.
    V3d xyz_of(std::size_t i) const { return coloured() ? V3d(tristimulus[i]) : xyz; }
    // flux · Y of ray i: what it is of the set's flux.
    double light_of(std::size_t i) const {
        return double{rays[i].flux} * (coloured() ? double{tristimulus[i].y} : 1.0);
    }
    // The rays with their flux of X (0), Y (1) or Z (2), as a set without colours; skipped rays count as the
    // mean of the others.
    RaySet channel(int c) const;
};

// IES TM-25-13 (.tm25ray), Zemax binary and text (.dat, .sdf), LightTools binary (.ray). A header's flux, if
// known and positive, wins over the sum of the rays (a warning when they differ by more than 0.1 %). Throw
// InputError naming file and cause.
RaySet read_tm25(const std::filesystem::path& file, Monitor& monitor);
RaySet read_zemax(const std::filesystem::path& file, Monitor& monitor);
RaySet read_zemax_text(const std::filesystem::path& file, Monitor& monitor);
RaySet read_lighttools(const std::filesystem::path& file, Monitor& monitor);
// Any of them, told by the first bytes, whatever the name.
RaySet read_rays(const std::filesystem::path& file, Monitor& monitor);

// Rays of one of the lamps that shine as one.
struct DrivenRays {
    RaySet set;
    std::string name;  // of its file, for messages
    double drive = 1;  // what its flux is multiplied by: finite, >= 0
};
// The lamps of several ray files, all in one frame, as one lamp. Rays keep their colours, those of a set of
// one colour the set's; a set of drive 0 adds nothing. In watts the sets' luminous efficacies say how bright
// each is beside the others; if none is known, a watt of each is as bright as of any other. Sets in watts
// beside sets in lumens are turned into lumens by their efficacy. Throws InputError naming the file: an
// efficacy that is needed and not known, or known of some only; and if nothing is left.
RaySet join_rays(std::vector<DrivenRays> parts);

// Flux in lumens; each ray's by its own brightness. The efficacy of a set in watts must be known.
void turn_into_lumens(RaySet& set);

// Sets what a file does not say, or says wrongly. Of all rays one colour, CIE XYZ per watt as cie_xyz() and
// spectra have it, its Y > 0; with it the efficacy of a set in watts. Colours of single rays go.
void state_colour(RaySet& set, const V3d& xyz_per_watt);
// Of a set in watts; in (0, kMostLumensPerWatt]. Colours stay.
void state_efficacy(RaySet& set, double lumens_per_watt);

// Rays as files that optics programs read: IES TM-25, Zemax binary, LightTools binary.
//
// A file is written block by block, so that it may be larger than the memory, and replaced as a whole. The
// same rays make the same bytes: no date is written.

struct RayFileInfo {
    std::uint64_t rays = 0;
    FluxUnit unit = FluxUnit::lumen;
    double flux = 0;  // of all rays, in `unit`
    // CIE XYZ, Y = 1, of all rays together. TM-25 keeps colours beside luminous flux, which watts need an
    // efficacy for; the other formats have no place for a colour that is no wavelength.
    V3d xyz = kWhiteXyz;
    double lumens_per_watt = 0;   // as in RaySet
    bool colour_per_ray = false;  // each ray has a colour of its own
    std::string text;             // what the file is of, one line
};

// Rays on their way to a file: positions in metres, unit directions, flux in info.unit.
struct RayBlock {
    std::vector<LampRay> rays;
    std::vector<V3f> tristimulus;  // as in RaySet; as many as rays if info.colour_per_ray, else none
};
// Fills the block with the next rays, all of the file's colour.
using NextRays = std::function<void(std::vector<LampRay>& block)>;
// The same, each ray with its colour.
using NextColouredRays = std::function<void(RayBlock& block)>;

// The format goes by the suffix: .tm25ray, .dat, .ray. `next` is called until info.rays rays have come; a
// block that is empty or holds more than are wanted is our own fault. Throws InputError for another suffix,
// for rays that the format cannot count, or if the file cannot be written.
void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextRays& next);
void write_rays(const std::filesystem::path& file, const RayFileInfo& info, const NextColouredRays& next);
// The usable rays of a set.
void write_rays(const std::filesystem::path& file, const RaySet& set);

// The suffixes, as an error should name them.
inline constexpr const char* kRaySuffixes = ".tm25ray, .dat (Zemax) and .ray (LightTools)";
bool has_ray_suffix(const std::filesystem::path& file);
// Whether a file of that name would tell the colours of these rays.
bool keeps_colour(const std::filesystem::path& file, const RayFileInfo& info);

}  // namespace lucerna
