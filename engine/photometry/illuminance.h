// Illuminance on calculation surfaces: the value at each point with its confidence interval, and the summary
// that standards require (EN 12464-1, CIE 97): mean, least, greatest, uniformity.
//
// Path tracing computes it, as it is unbiased and the variance of its samples gives a valid interval.
// Each point has several sensor replicas (Receivers, engine/render/job.h) with independent samples. Their
// means are nearly normal, and Student's t gives the interval of their mean. Few samples do not reveal the
// variance due to lamps that paths seldom meet, over mirrors, lenses and solid glass; light paths estimate
// the light of these lamps.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/stats.h"
#include "engine/render/job.h"
#include "engine/render/stop_rule.h"
#include "engine/scene/calculation_surface.h"

namespace lucerna {

// Half of a normal value's 95 % confidence interval, in standard errors.
inline constexpr double kStandardErrors95 = 1.959963984540054;

// An estimate and the half-width of its 95 % confidence interval (coverage factor k = 2 for many replicas),
// in lx, or in W/m² if lights are radiometric.
struct Reading95 {
    double value = 0, half_width = 0;
};

// The components of the light of one point; direct and indirect add up to `all`. All are NaN where the point
// is cut off from the light (cut_off_points.h) or excluded (CalculationSurface): it does not count in its
// surface's mean, extremes and uniformity.
struct PointIlluminance {
    Reading95 all;
    double direct = 0;   // straight from lamps and sky
    Reading95 indirect;  // all other light
    // The share of indirect light from lamps that are seen over mirrors, lenses or solid glass alone.
    double mirrored = 0;
    std::vector<double> groups;  // by light group of the scene; empty if it has none
    bool is_cut_off() const { return std::isnan(all.value); }
};

struct SurfaceIlluminance {
    CalculationSurface surface;
    std::vector<PointIlluminance> points;  // (x, y) is at y * surface.points.x + x
    Reading95 mean;
    double direct = 0;           // direct light in the mean
    std::vector<double> groups;  // the mean by light group
    Reading95 least, greatest;   // of the points' estimates, with those points' intervals
    Reading95 uniformity;        // U_0, the least value over the mean
    // In the mean: the light over specular surfaces that light paths estimate, as paths from the points
    // hardly meet its lamps (engine/render/chance_light.h), and the share of it that those paths never met.
    double by_light_paths = 0, never_met = 0;
    double blur = 0;  // bound of the error of by_light_paths by blur
    // Returns the number of points that do not count, and how many of these the surface excludes.
    std::size_t cut_off() const {
        return static_cast<std::size_t>(
            std::ranges::count_if(points, [](const PointIlluminance& point) { return point.is_cut_off(); }));
    }
    std::size_t excluded() const {
        return static_cast<std::size_t>(std::ranges::count(surface.excluded, true));
    }
    const PointIlluminance& at(int x, int y) const { return points[surface.index(x, y)]; }
};

struct IlluminanceOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    // Ends when half-widths are within this share of the greater of the point's value and its surface's mean.
    double precision = 0.02;
    bool indirect = false;  // also applies `precision` to indirect illuminance, as a share of that
    int most_samples = 0;   // of each replica; > 0 sets the number whatever the precision
};

// Computes the mean, extremes and uniformity of a surface from its points; 0 if all are cut off.
void sum_up(SurfaceIlluminance& surface);

// A light that has a place in the scene.
struct LuminairePlace {
    std::string kind;
    std::string file;   // of the light field, ray file or photometric file; empty if none
    V3d place;          // centre of its bounds; world, scene units
    V3d axis;           // unit vector along which it shines; 0 where it shines all around or to two sides
    double flux = 0;    // in the scene's unit
    V3d size{0, 0, 0};  // of its bounds
    // The first surface beyond its bounds along the axis; world. None without an axis or a surface.
    std::optional<V3d> aim;
    std::size_t light = 0;  // index in the scene's lights
};
// Returns the lights with a place; the parts of a mesh that do not touch each other are luminaires each.
std::vector<LuminairePlace> luminaires_of(const Scene& scene);

struct IlluminanceReport {
    std::string quantity = "illuminance", symbol = "E";  // or "daylight factor", "D" (daylight_factor.h)
    // The illuminance of an unobstructed horizontal plane, to which a daylight factor is relative [lx, or
    // W/m² if lights are radiometric]; 0 for other quantities.
    double sky_illuminance = 0;
    std::vector<SurfaceIlluminance> surfaces;
    std::vector<std::string> groups;  // the scene's light groups
    std::string unit;                 // "lx", "W/m^2"; "%" of a daylight factor
    std::string flux_unit;            // "lm", "W"
    double precision = 0;             // the largest such share that was reached
    // "precision", "time", "samples", "user", "forecast", or "light paths", which limit the precision.
    std::string ended_by;
    int sensors = 0;  // of each point
    int samples = 0;  // of each replica
    std::uint64_t rays = 0;
    double seconds = 0;
};

// The surface with the greatest share of something, for a warning that names it. `others` ends its sentence
// with the number of other surfaces whose share is above the least, and is empty if there are none.
struct MostAffected {
    const SurfaceIlluminance* surface;
    std::string others;
};
// Returns nothing if no share is above `least`.
std::optional<MostAffected> most_affected(std::span<const SurfaceIlluminance> surfaces,
                                          const std::function<double(const SurfaceIlluminance&)>& share,
                                          double least);

// Replaces the job's receivers and film by sensors at the points of the surfaces, a multiple of 16 at each.
void place_sensors(std::span<const CalculationSurface> surfaces, Job& job);

// Computes illuminance at all points of the surfaces. Replaces the job's integrator, film and receivers.
// Throws InputError if there is no surface, no light, or lights of both units. Ends early with the samples so
// far when the monitor says so.
IlluminanceReport illuminance_on(std::span<const CalculationSurface> surfaces, Job job,
                                 const IlluminanceOptions& options, Monitor& monitor);

// Returns the two-sided 95 % quantile of Student's t with n - 1 degrees of freedom: the half-width of the
// interval of the mean of `n` >= 2 normal values, in standard errors.
double student_95(std::uint64_t n);
// Returns the mean of at least two independent, nearly normal values.
Reading95 reading_95(const RunningStats& values);

}  // namespace lucerna
