// The error of photometric files: compares the illuminance by lamps as point sources of their far field with
// that by their near field.
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

// Returns a table with one line for each surface. `floor` is the largest PhotometricInfo::grid_error of the
// lamps' webs.
std::string far_field_text(const std::vector<FarFieldError>& errors, double floor);

}  // namespace lucerna
