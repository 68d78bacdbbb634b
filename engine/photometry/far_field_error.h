// How wrong a photometric file would be: illuminance by lamps as points with their own far field, against
// that by their near field.
#pragma once

#include <string>
#include <vector>

#include "engine/photometry/illuminance.h"

namespace lucerna {

struct FarFieldError {
    std::string surface;
    // (far - near) / near at each point, with its interval; NaN where there is no light. Rows as
    // SurfaceIlluminance::points.
    std::vector<Reading95> points;
    Reading95 mean;             // of the surface's mean illuminance
    double rms = 0;             // over points, noise taken off as far as the intervals tell
    Reading95 least, greatest;  // of the points
};

// Of two reports on the same surfaces.
std::vector<FarFieldError> far_field_errors(const IlluminanceReport& near, const IlluminanceReport& far);

// A table, a line for each surface. `floor`: of the lamps' webs, the largest PhotometricInfo::grid_error.
std::string far_field_text(const std::vector<FarFieldError>& errors, double floor);

}  // namespace lucerna
