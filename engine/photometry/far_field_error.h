// The error of photometric files: compares the illuminance by the far fields of lamps, which shine from a
// point or from the luminous opening that a file of the lamp states, with that by their near fields.
#pragma once

#include <string>
#include <vector>

#include "engine/photometry/illuminance.h"

namespace lucerna {

struct FarFieldError {
    std::string surface;
    // (far - near) / near at each point with its interval, NaN where there is no light. The order is that of
    // SurfaceIlluminance::points.
    std::vector<Reading95> points;
    Reading95 mean;             // relative error of the surface's mean illuminance
    double rms = 0;             // over points; the noise that the intervals account for is subtracted
    Reading95 least, greatest;  // of the points
};

// Compares two reports on the same surfaces.
std::vector<FarFieldError> far_field_errors(const IlluminanceReport& near, const IlluminanceReport& far);

// The errors on all surfaces, by where the light begins. Empty: not computed, or no lamp has an opening.
struct FarFieldErrors {
    std::vector<FarFieldError> from_point, from_opening;
    double floor = 0;  // the largest PhotometricInfo::grid_error of the lamps' webs
};

// Returns tables with one line for each surface.
std::string far_field_text(const FarFieldErrors& errors);

}  // namespace lucerna
