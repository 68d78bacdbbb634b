// The colour of the light at points of calculation surfaces: colour temperature, colour rendering and the
// melanopic illuminance, from the spectra of the lamps.
//
// Light is linear, so the spectral irradiance at a point is a sum over the lamps' spectra S_g [W/(nm lm)],
//
//     E(λ) = Σ_g S_g(λ) T_g(λ),
//
// in which T_g [lx] is the illuminance by the lights of that spectrum, if the scene reflects all of it as it
// reflects λ. In a scene of grey surfaces T does not depend on λ, and one run with a light group for each
// spectrum is exact. In other scenes T is measured in intervals of wavelengths, three in each run (the
// channels of its colours, WorkingSpace::of_intervals), with the mean reflectance of each interval, and is
// taken as linear between their middles. How much the results change if only every second
// interval is used tells the error.
//
// Intervals of confidence follow from batches of independent sensors by the jackknife [Efron and Stein 1981].
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/colour/rendition.h"
#include "engine/colour/working_space.h"
#include "engine/photometry/illuminance.h"

namespace lucerna {

// Names the quantities, in the order of LightColour.
struct ColourQuantity {
    std::string_view name, unit;
};
inline constexpr std::array<ColourQuantity, 7> kColourQuantities{
    {{"CCT", "K"}, {"Duv", ""}, {"R_a", ""}, {"R_9", ""}, {"R_f", ""}, {"R_g", ""}, {"m-EDI", "lx"}}};
inline constexpr std::size_t kColourCount = kColourQuantities.size();

// Returns the quantities of a spectral irradiance [W/(m² nm)]. All but the melanopic equivalent daylight
// illuminance are NaN for light without a correlated colour temperature.
std::array<double, kColourCount> colour_quantities(const BandSpectrum& irradiance);

struct LightColour {
    std::array<Reading95, kColourCount> values;
    // The bound of each value's error by the intervals of wavelengths; 0 in grey scenes.
    std::array<double, kColourCount> by_intervals{};
};

struct SurfaceColour {
    std::vector<LightColour> points;  // in the order of SurfaceIlluminance::points; NaN where cut off
    LightColour mean;                 // of the mean light of the points
};

struct ColourReport {
    std::vector<SurfaceColour> surfaces;  // empty: not computed
    int intervals = 1;                    // of wavelengths; 1 in grey scenes
    double spectra_error = 0;             // the greatest SpectralBasis::error of the lamps
};

// Reads the scene anew with its lights divided by their spectra, in these colours.
using ReadInIntervals = std::function<Job(const WorkingSpace&)>;

// The limits and the middles [nm] of 3 `runs` intervals.
std::vector<double> interval_limits(int runs);
std::vector<double> interval_middles(int runs);

// Measures the points of `measured`, with as many samples; cut-off points are left out. `seconds` returns the
// time of each run. `fine_runs` times three intervals are used where surfaces have colours. Throws InputError
// for lights in watts. Throws Stopped if a run has no sample in time.
ColourReport colour_on(const IlluminanceReport& measured, const ReadInIntervals& read,
                       const IlluminanceOptions& options, const std::function<double()>& seconds,
                       Monitor& monitor, int fine_runs = 3);

// Returns a row of headings, then one for the mean light of each surface.
std::vector<std::vector<std::string>> colour_rows(const IlluminanceReport& measured,
                                                  const ColourReport& colour);
// Return the heading of these rows, and lines on what limits the numbers.
std::string colour_heading();
std::vector<std::string> colour_lines(const ColourReport& colour);
// Returns heading, rows and lines as one text; empty if nothing was computed.
std::string colour_text(const IlluminanceReport& measured, const ColourReport& colour);

}  // namespace lucerna
