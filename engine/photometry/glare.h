// Discomfort glare at an observer's eye, rated by UGR = 8 log10(0.25 / L_b Σ L_s² ω / p²) [CIE 117:1995]. L_b
// is the luminance of the background, L_s and ω are the luminances and solid angles of the luminaires, and p
// is Guth's position index. Scenes with daylight also get the daylight glare probability (daylight_glare.h).
//
// The sum is the integral of L² / p² over all directions, with the luminance that the lamp's light field has
// for this eye, through the panes and media in between. For a luminaire of uniform luminance this is the sum
// of CIE 117. Others are seen by an eye of limited acuity: CIE 232:2019 filters luminance by a Gaussian of 12
// mm full width at half maximum on the luminaire. The integral of a squared filtered luminance is that of
// L(w) L(w') over pairs of directions whose distance is normally distributed with twice the Gaussian's
// variance. It is estimated in this form, without an image and its pixels. CIE 232 itself takes the mean of
// the filtered luminance above 500 cd/m² (effective_part.h), which is less where luminance varies above that.
//
// The corrections of CIE 147 for small, large or many sources are not modelled.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/photometry/daylight_glare.h"
#include "engine/photometry/effective_part.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/observer.h"

namespace lucerna {

// One luminaire, a term of the UGR sum.
struct GlareSource {
    std::uint32_t light = 0;
    std::string kind;         // kind of the light
    double solid_angle = 0;   // sr, of the smallest part with 90 % of the light, over 0.9
    double luminance = 0;     // cd/m², mean over the luminous part
    double position = 1;      // position index, mean weighted with luminance
    Reading95 even;           // luminance² solid angle / p², the term of CIE 117 with the mean luminance
    Reading95 seen;           // integral of L² / p² of the filtered luminance
    EffectivePart effective;  // without a filter there is none
};

struct GlareReport {
    Observer observer;
    std::vector<GlareSource> sources;
    Reading95 background;  // cd/m²
    Reading95 vertical;    // lx, at the eye, on a plane across the line of sight
    // Ratings are -infinity where no luminaire is seen, and NaN (undefined) where one is seen before a
    // background that does not differ significantly from 0.
    Reading95 ugr_even;       // from mean luminances
    Reading95 ugr;            // from filtered luminances
    Reading95 ugr_effective;  // from the means of effective parts; -infinity without a filter
    // Set if there is a sky or a sun.
    std::optional<DaylightGlare> daylight;
};

struct GlareOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    double precision = 0.02;  // relative, of the background and of E_v; DGP gets a quarter of it, absolute
    int samples = 1 << 16;    // of each luminaire
    double blur = 0.012;      // m, full width at half maximum on the luminaire; 0 disables the filter
    double threshold = 5;     // DaylightOptions::threshold
    int view_pixels = 400;    // along each side of a view
    // Receives each observer's field of view. If it is set, views are rendered without daylight, too.
    std::function<void(std::size_t observer, const LuminanceView&)> view = {};
};

// Rates glare at each observer. Throws InputError if lights are not photometric (lm) or if a line of sight is
// vertical. Warns of lights that have an intensity but no extent, hence no luminance, and leaves them out.
std::vector<GlareReport> glare_at(std::span<const Observer> observers, Job job, const GlareOptions& options,
                                  Monitor& monitor);

}  // namespace lucerna
