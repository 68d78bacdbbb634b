// The uncertainty of illuminance due to the finite number of rays in the lamps' measurements.
//
// The same points are computed once with the lamps and once with each of B bootstrap replicates of them
// (imports of resampled rays in which all choices are made anew: lights/measurement/ray_bootstrap.h). The
// results E_b of the replicates scatter because of the lamps' measurement and of the Monte Carlo noise of
// their own runs, which is known from their sensor replicas:
//
//     Var_lamp = max(0, s²(E_b) - mean of the runs' Monte Carlo variances),   U = 2 √Var_lamp
//
// s² is the sample variance, so U is the expanded uncertainty for the coverage factor k = 2 [JCGM 100:2008,
// 6.2]. If the lamps added no variance, (B - 1) s² over the Monte Carlo variance would follow chi-square with
// B - 1 degrees of freedom. A value below its 95 % quantile does not differ significantly from noise, and U
// is then an upper bound of 95 % confidence.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/photometry/illuminance.h"
#include "lights/light_field.h"

namespace lucerna {

// The uncertainty of one number due to the lamps alone.
struct LampUncertainty {
    double expanded = 0;       // U for k = 2, in the number's unit, >= 0
    bool upper_bound = false;  // set if s² does not differ significantly from Monte Carlo noise
    // Standard uncertainty of U over U: 1 / √(2 (B - 1)) without Monte Carlo noise, 0 for an upper bound.
    double relative = 0;
};

struct SurfaceUncertainty {
    std::string surface;
    std::vector<LampUncertainty> points;  // in the order of SurfaceIlluminance::points
    LampUncertainty mean, least, uniformity;
    double rms = 0;                // over points, of U over illuminance; Monte Carlo noise is subtracted
    std::size_t upper_bounds = 0;  // number of points that have only an upper bound
};

// The relative error of the irradiance of a lamp's field including bias, root mean square over a plane, from
// held-out rays of its import (PlaneError). Errors that all replicates share are in this number and not in U.
struct FieldError {
    std::string lamp;  // file of the lamp
    bool known = false;
    double by_direction = 0;  // in the far field; the greatest of several slabs
    double greatest = 0;      // of all planes and slabs
};
FieldError field_error(std::string lamp, std::span<const LightField* const> slabs);

struct MeasurementUncertainty {
    int replicates = 0;  // B; 0 if the uncertainty was not computed
    std::vector<SurfaceUncertainty> surfaces;
    std::vector<FieldError> fields;  // of the lamps
};

// Returns the uncertainty from a number's values for at least two independent replicates, each with its Monte
// Carlo interval from `sensors` independent sensors.
LampUncertainty lamp_uncertainty(std::span<const Reading95> by_replicate, int sensors);

// Compares `whole`, by the lamps themselves, with reports on the same surfaces by replicates.
MeasurementUncertainty measurement_uncertainty(const IlluminanceReport& whole,
                                               std::span<const IlluminanceReport> by_replicate);

// Returns the half-width due to Monte Carlo noise and lamps together, which are independent.
double combined(const Reading95& monte_carlo, const LampUncertainty& lamps);

// Returns the chi-square quantile, with `n` degrees of freedom, at the probability that the standard normal
// distribution has below z [Wilson and Hilferty 1931]. It is accurate to 4 % for n >= 4 and |z| <= 1.65, and
// to 0.2 % for n >= 19.
double chi_square_quantile(double z, int n);

// Returns a row of headings, then for each surface the mean, the least value and U_0, each with its
// half-widths by Monte Carlo noise, by the lamps ("± 2.1", or "< 3.4" for an upper bound), and by both.
std::vector<std::vector<std::string>> uncertainty_rows(const IlluminanceReport& whole,
                                                       const MeasurementUncertainty& lamps);
// Returns the heading that explains the numbers of these rows.
std::string uncertainty_heading(const MeasurementUncertainty& lamps);
// Returns a line on the points of each surface and one on the field of each lamp.
std::vector<std::string> uncertainty_lines(const MeasurementUncertainty& lamps);
// Returns heading, rows and lines as one text.
std::string uncertainty_text(const IlluminanceReport& whole, const MeasurementUncertainty& lamps);

}  // namespace lucerna
