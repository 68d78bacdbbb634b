// Discomfort glare at an observer's eye: the unified glare rating, UGR = 8 log10(0.25 / L_b Σ L_s² ω / p²)
// [CIE 117:1995], L_b the luminance of the background, L_s that of the luminaires and ω their solid angles,
// p Guth's position index. Where there is daylight, also the daylight glare probability (daylight_glare.h).
//
// Luminaires are taken as they are seen: the sum is the integral of L² / p² over all directions, with the
// luminance that the lamp's light field has for this very eye, through the panes and media in between. For an
// even luminaire that is CIE 117's own sum. An uneven one is seen by an eye of limited acuity: CIE 232:2019
// filters luminance by a Gaussian of 12 mm full width at half maximum on the luminaire. The integral of a
// filtered luminance squared is that of L(w) L(w') over pairs of directions whose distance is normally
// distributed with twice the Gaussian's variance, and is estimated so, without an image and its pixels.
//
// Not modelled: CIE 232's threshold, which leaves out what is below 500 cd/m² of a luminaire, and CIE 147's
// changes for sources that are small, large or many; `small`, `large` tell where those would apply.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/photometry/daylight_glare.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/observer.h"

namespace lucerna {

// One luminaire, as a term of the sum.
struct GlareSource {
    std::uint32_t light = 0;
    std::string kind;        // the light's
    double solid_angle = 0;  // sr: of its luminous part, the smallest with 90 % of its light, over 0.9
    double luminance = 0;    // cd/m²: its mean there
    double position = 1;     // index, its mean weighted with luminance
    Reading95 even;          // luminance² solid angle / p²: CIE 117 with its mean luminance
    Reading95 seen;          // its integral as it is seen
};

struct GlareReport {
    Observer observer;
    std::vector<GlareSource> sources;
    Reading95 background;  // cd/m²
    Reading95 vertical;    // lx, at the eye, across the line of sight
    // -infinite where no luminaire is seen; NaN, undefined, where one is seen before a background that is not
    // told from 0.
    Reading95 ugr_even;  // by mean luminances
    Reading95 ugr;       // as luminaires are seen
    // Where there is a sky or a sun.
    std::optional<DaylightGlare> daylight;
};

struct GlareOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    double precision = 0.02;  // of the background and of E_v; of DGP a quarter of it, absolute
    int samples = 1 << 16;    // of each luminaire
    double blur = 0.012;      // m: full width at half maximum, on the luminaire; 0: none
    double threshold = 5;     // DaylightOptions::threshold
    int view_pixels = 400;    // of a view, along each side
    // Gets what each observer sees; then it is also rendered where there is no daylight.
    std::function<void(std::size_t observer, const LuminanceView&)> view = {};
};

// Throws InputError: lights that do not count in lm, a line of sight without an upward direction. Warns of
// lights that have an intensity but no extent, and so no luminance: they are not rated. Far fields of files
// are taken as evenly bright over the luminous opening that the file states.
std::vector<GlareReport> glare_at(std::span<const Observer> observers, Job job, const GlareOptions& options,
                                  Monitor& monitor);

}  // namespace lucerna
