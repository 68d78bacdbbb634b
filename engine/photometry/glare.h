// Discomfort glare at an observer's eye: the unified glare rating, UGR = 8 log10(0.25 / L_b Σ L_s² ω / p²)
// [CIE 117:1995], L_b the luminance of the background, L_s that of the luminaires and ω their solid angles,
// p Guth's position index.
//
// Luminaires are taken as they are seen: the sum is the integral of L² / p² over all directions, with the
// luminance that the lamp's light field has for this very eye. For an even luminaire that is CIE 117's own
// sum. An uneven one is seen by an eye of limited acuity: CIE 232:2019 filters luminance by a Gaussian of 12
// mm full width at half maximum on the luminaire. The integral of a filtered luminance squared is that of
// L(w) L(w') over pairs of directions whose distance is normally distributed with twice the Gaussian's
// variance, and is estimated so, without an image and its pixels.
//
// Not modelled: CIE 232's threshold, which leaves out what is below 500 cd/m² of a luminaire, and CIE 147's
// changes for sources that are small, large or many; `small`, `large` tell where those would apply.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/photometry/illuminance.h"

namespace lucerna {

struct Observer {
    std::string name;
    V3d eye;   // world, scene units (metres)
    V3f view;  // unit: the line of sight
    V3f up;    // unit, not along `view`
};

// Guth's position index of a direction, >= 1: above the line of sight by the fit of [Levin 1975], below it by
// that of [Iwata and Tokura 1997]. `from_vertical`: the angle between the upright plane through the line of
// sight and the plane of both directions; `from_view`: between the two; both degrees.
double position_index(double from_vertical, double from_view);
// The same of a direction `w` in front of the observer (unit). Behind: infinite, nothing of it is seen.
double position_index(const Observer& observer, const V3f& w);

// One luminaire, as a term of the sum.
struct GlareSource {
    std::uint32_t light = 0;
    std::string kind;        // the light's
    double solid_angle = 0;  // sr: where it shines towards the eye
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
    // -infinite where no luminaire is seen.
    Reading95 ugr_even;  // by mean luminances
    Reading95 ugr;       // as luminaires are seen
};

struct GlareOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    double precision = 0.02;  // of the background
    int samples = 1 << 16;    // of each luminaire
    double blur = 0.012;      // m: full width at half maximum, on the luminaire; 0: none
};

// Throws InputError: lights that do not count in lm, a line of sight without an upward direction. Warns of
// lights that have an intensity but no extent, and so no luminance: they are not rated. Far fields of files
// are taken as evenly bright over the luminous opening that the file states.
std::vector<GlareReport> glare_at(std::span<const Observer> observers, Job job, const GlareOptions& options,
                                  Monitor& monitor);

}  // namespace lucerna
