// How uncertain illuminance is because its lamps were measured with a finite number of rays.
//
// The same points are computed once by the lamps, and once by each of B bootstrap replicates of them (imports
// of rays drawn anew, with all choices made anew: lights/measurement/ray_bootstrap.h). The numbers E_b of the
// replicates scatter by the lamps' measurement and by the Monte Carlo noise of their own runs, which is known
// from their heads:
//
//     Var_lamp = max(0, s²(E_b) - mean of the runs' Monte Carlo variances),   U = 2 √Var_lamp
//
// with the sample variance s², so that U is the expanded uncertainty for the coverage factor k = 2 [JCGM
// 100:2008, 6.2]. If the lamps added nothing, (B - 1) s² over the Monte Carlo variance would follow
// chi-square with B - 1 degrees of freedom: what is not above its 95 % quantile is not told from noise, and U
// is then an upper bound of 95 % confidence instead.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/photometry/illuminance.h"
#include "lights/light_field.h"

namespace lucerna {

// Of one number, by its lamps alone.
struct LampUncertainty {
    double expanded = 0;       // U, k = 2, in the number's unit; >= 0
    bool upper_bound = false;  // not told from Monte Carlo noise: U is less than that
    // The standard uncertainty of U itself over U; 1 / √(2 (B - 1)) where there is no Monte Carlo noise. 0 of
    // an upper bound.
    double relative = 0;
};

struct SurfaceUncertainty {
    std::string surface;
    std::vector<LampUncertainty> points;  // rows as SurfaceIlluminance::points
    LampUncertainty mean, least, uniformity;
    double rms = 0;                // over points, of U over illuminance; Monte Carlo noise taken off
    std::size_t upper_bounds = 0;  // how many points have no more than that
};

// How far the irradiance of a lamp's field is from the lamp's, bias included, by held-out rays of its import
// (PlaneError): what all replicates have in common is in this error and not in U. Relative, root mean square
// over a plane.
struct FieldError {
    std::string lamp;  // its file
    bool known = false;
    double by_direction = 0;  // in the far field; of several slabs the greatest
    double greatest = 0;      // of all planes and slabs
};
FieldError field_error(std::string lamp, std::span<const LightField* const> slabs);

struct MeasurementUncertainty {
    int replicates = 0;  // B, that it was computed from; 0: it was not
    std::vector<SurfaceUncertainty> surfaces;
    std::vector<FieldError> fields;  // of the lamps
};

// From a number's values by the replicates, at least two, which do not depend on each other; each with its
// Monte Carlo interval from so many heads.
LampUncertainty lamp_uncertainty(std::span<const Reading95> by_replicate, int heads);

// `whole` by the lamps themselves, the others by their replicates: reports on the same surfaces.
MeasurementUncertainty measurement_uncertainty(const IlluminanceReport& whole,
                                               std::span<const IlluminanceReport> by_replicate);

// The half-width of Monte Carlo and lamps together, which do not depend on each other.
double combined(const Reading95& monte_carlo, const LampUncertainty& lamps);

// The value that a chi-square variable with `n` degrees of freedom is below as often as a standard normal one
// is below z [Wilson and Hilferty 1931]: for n >= 4 and |z| <= 1.65 to within 4 %, for n >= 19 to 0.2 %.
double chi_square_quantile(double z, int n);

// For people: the mean, the least value and U_0 of each surface under a line of headings, each with its half
// widths by Monte Carlo, by the lamps ("± 2.1", or "< 3.4" of an upper bound), and by both.
std::vector<std::vector<std::string>> uncertainty_rows(const IlluminanceReport& whole,
                                                       const MeasurementUncertainty& lamps);
// What the numbers of these rows are.
std::string uncertainty_heading(const MeasurementUncertainty& lamps);
// A line on the points of each surface, and one on the field of each lamp.
std::vector<std::string> uncertainty_lines(const MeasurementUncertainty& lamps);
// All of these.
std::string uncertainty_text(const IlluminanceReport& whole, const MeasurementUncertainty& lamps);

}  // namespace lucerna
