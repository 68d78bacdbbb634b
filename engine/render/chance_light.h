// A cross-check of path tracing by light paths.
//
// Light that leaves a lamp and goes over mirrors, lenses or solid glass before it reaches a surface is found
// by no sampling of lights. A path from the eye meets the lamp over such a chain by chance alone: seldom
// where the lamp is small, and never where it is a point or a sun. Such a path tracer's samples agree with
// each other, and their interval says nothing of what none of them met. Paths from the lamps find that light
// easily. Here they estimate how much of it arrives, blurred over a neighbourhood of the places that are
// looked at; beside it stands what the path tracer met by chance (SampleAccount::by_chance).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "engine/scene/receiver.h"

namespace lucerna {

// Luminance, or illuminance, in the scene's units, and the standard error of its estimate.
struct ChanceLight {
    double value = 0, standard_error = 0;
};

// Returns the part of the light brought by light paths that eye paths did not meet: 0 unless it exceeds
// `standard_errors` standard errors of both.
double missing_light(const ChanceLight& by_light_paths, const ChanceLight& met, double standard_errors);

struct ChanceLightWork {
    const Scene& scene;
    std::uint64_t seed;
    int longest;  // bounces of a whole path at the most
    const Workers& workers;
    Monitor& monitor;
};

// Whether a path tracer could miss light there: some light goes over a surface that is specular.
bool has_chance_light(const Scene& scene);

// The illuminance at receivers by paths whose first bounce was specular, each blurred over a ball around the
// receiver.
class ChanceLightAt {
  public:
    struct Mean {
        ChanceLight light;
        ChanceLight seen;            // of it: from lamps over specular surfaces alone
        std::vector<double> groups;  // its parts, by light group of the scene
        double blur = 0;             // by how much the blur may change it: balls of half the radius tell
    };
    // Returns the mean over consecutive receivers.
    Mean mean(std::size_t first, std::size_t count) const;

  private:
    friend ChanceLightAt chance_light_at(std::span<const Receiver>, std::span<const float>,
                                         std::span<const double>, double, const ChanceLightWork&);
    std::size_t groups_ = 0;
    std::vector<std::vector<double>> chunks_;  // each chunk of paths' BallVisitor::sums
};

// Radii of balls are in scene units, > 0. More paths are traced, up to a bound, until each receiver's
// standard error is less than that share of all its light, of which `others` are the rest, or of the mean
// receiver's. All zero where the monitor stopped it.
ChanceLightAt chance_light_at(std::span<const Receiver> receivers, std::span<const float> radii,
                              std::span<const double> others, double share, const ChanceLightWork& work);

// Estimates the mean over a view of such light that surfaces send to the eye, by density estimation at the
// first diffuse surface that a camera ray meets. The job's integrator is a path tracer.
ChanceLight chance_light_in_view(const Job& job, const ChanceLightWork& work);
// The mean luminance of an image's pixels, but for few that stand apart from all others (a lamp in view), and
// the standard error by which they scatter: wide, as it holds what they show.
ChanceLight mean_of(const Image& image);

// Light that its path tracer hardly finds and that a rendered image lacks.
struct MissingInImage {
    double missing = 0;  // in the image's mean; 0: nothing that could be told
    double mean = 0;     // of the image
    double share() const { return missing / (mean + missing); }  // missing > 0
};
// `there`: chance_light_in_view()'s. The result is of a film that tells what chance finds.
MissingInImage missing_in(const Job& job, const RenderResult& result, const ChanceLight& there);

// For a render of the job: chance_light_in_view() of a path tracer, whose film is told to note what it finds
// by chance. None where no light goes over specular surfaces, or only a part of the image is rendered here.
// All ranks call this.
std::optional<ChanceLight> light_that_paths_hardly_find(Job& job, const RenderOptions& options,
                                                        Monitor& monitor);
// Warns of what the result lacks of it; then no error is stated.
void warn_of_missing_light(const Job& job, const ChanceLight& there, RenderResult& result, Monitor& monitor);

}  // namespace lucerna
