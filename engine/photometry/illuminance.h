// Illuminance on calculation surfaces: at each point with its confidence interval, and what standards ask of
// the whole (EN 12464-1, CIE 97): mean, least, greatest, uniformity.
//
// By the path tracer: it has no bias, so that an interval from how its samples scatter holds what it says.
// Each point has heads of its own (Receivers, engine/render/job.h), whose samples do not depend on each
// other; their means are nearly normal, and an interval is Student's for the mean of them. Only lamps that
// paths meet seldom, over mirrors, lenses and solid glass, make them scatter in a way that few samples do not
// tell: their light is taken from light paths, which know it better.
#pragma once

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

// Standard errors in half of a normal value's 95 % confidence interval.
inline constexpr double kStandardErrors95 = 1.959963984540054;

// An estimate and the half-width of its 95 % confidence interval (coverage factor k = 2 for many heads); lx,
// or W/m² if lights count in W.
struct Reading95 {
    double value = 0, half_width = 0;
};

// What the light of one point is made of; they add up to it.
struct PointParts {
    Reading95 all;
    double direct = 0;   // from lamps and sky in a straight line
    Reading95 indirect;  // all else
    // Of that, from lamps that are seen over mirrors, lenses or solid glass alone.
    double mirrored = 0;
    std::vector<double> groups;  // by light group of the scene; empty if it has none
};

struct SurfaceIlluminance {
    CalculationSurface surface;
    std::vector<PointParts> points;  // row by row: of (x, y) at y surface.points.x + x
    Reading95 mean;
    double direct = 0;           // of the mean
    std::vector<double> groups;  // of the mean
    Reading95 least, greatest;   // of the points' estimates, with those points' intervals
    Reading95 uniformity;        // U_0 = least over mean
    // Of the mean: light over specular surfaces that is estimated by light paths, as paths from the points
    // hardly meet its lamps (engine/render/chance_light.h); and how much of it they never met.
    double by_light_paths = 0, never_met = 0;
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(surface.points.x) +
               static_cast<std::size_t>(x);
    }
    const PointParts& at(int x, int y) const { return points[index(x, y)]; }
};

struct IlluminanceOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    // Ends when no point's half-width is more than that share of its illuminance, or of its surface's mean
    // where that is more.
    double precision = 0.02;
    bool indirect = false;  // the same holds for indirect illuminance, as a share of that
    int most_samples = 0;   // of each head; > 0: so many, whatever the precision
};

// A light that has a place.
struct LuminairePlace {
    std::string kind;
    std::string file;  // name of the light field, ray file or photometric file; empty: none
    V3d place;         // world, scene units: the middle of its bounds
    V3d axis;          // unit: which way it shines; 0 where it shines all around, or to two sides
    double flux = 0;   // in the scene's unit
};
std::vector<LuminairePlace> luminaires_of(const Scene& scene);

struct IlluminanceReport {
    std::vector<SurfaceIlluminance> surfaces;
    std::vector<LuminairePlace> lamps;
    std::vector<std::string> groups;  // the scene's light groups
    std::string unit;                 // "lx", "W/m^2"
    std::string flux_unit;            // "lm", "W"
    double precision = 0;             // reached: the largest such share
    // "precision", "time", "samples", "user", "forecast", "light paths" (which know less than asked for).
    std::string ended_by;
    int heads = 0;    // of each point
    int samples = 0;  // of each head
    std::uint64_t rays = 0;
    double seconds = 0;
};

// One warning names the surface with the greatest share of something; `others` ends its sentence with how
// many more have a share above the least, and is empty where none has.
struct MostAffected {
    const SurfaceIlluminance* surface;
    std::string others;
};
// None where no share is above `least`.
std::optional<MostAffected> most_affected(std::span<const SurfaceIlluminance> surfaces,
                                          const std::function<double(const SurfaceIlluminance&)>& share,
                                          double least);

// The job's integrator, film and receivers are replaced. Throws InputError: no surface, no light, lights of
// both units. Ends early, with what there is, when the monitor says so.
IlluminanceReport illuminance_on(std::span<const CalculationSurface> surfaces, Job job,
                                 const IlluminanceOptions& options, Monitor& monitor);

// Of the mean of `n` >= 2 normal values, over its standard error: the two-sided 95 % quantile of Student's t
// with n - 1 degrees of freedom.
double student_95(std::uint64_t n);
// The mean of at least two values that are nearly normal and do not depend on each other.
Reading95 reading_95(const RunningStats& values);

}  // namespace lucerna
