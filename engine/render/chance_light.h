// Cross-checks path tracing by light paths.
//
// Light that goes from a lamp over mirrors, lenses or solid glass to a surface cannot be found by sampling
// lights. A path from the eye meets the lamp over such a chain by chance alone: rarely if the lamp is small,
// and never if it is a point or a sun. The samples of such a path tracer agree with each other, and their
// confidence interval does not include the light that none of them met. Paths from the lamps find that light
// easily. They are used here to estimate how much of it arrives, blurred over a neighbourhood of the
// receivers or visible surfaces, for comparison with the light that the path tracer met by chance or by a
// search near photons of such paths, which knows only some of the chains (SampleAccount::by_chance).
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
    int longest;  // largest number of bounces of a complete path
    const Workers& workers;
    Monitor& monitor;
};

// Returns whether a path tracer could miss light in the scene, because some surfaces are specular.
bool has_chance_light(const Scene& scene);

// Estimates the mean over a view of such light that surfaces send to the eye, by density estimation at the
// first diffuse surface that a camera ray meets. The job's integrator must be a path tracer.
ChanceLight chance_light_in_view(const Job& job, const ChanceLightWork& work);
// Returns the mean luminance of an image's pixels without a few outliers (a lamp in view), and its standard
// error from their scatter, which is large because it includes the variation of the image itself.
ChanceLight mean_of(const Image& image);

// Light that an image lacks because its path tracer hardly finds it.
struct MissingInImage {
    double missing = 0;  // in the image's mean; 0: none that is significant
    double mean = 0;     // of the image
    double share() const { return missing / (mean + missing); }  // missing > 0
};
// `there` is from chance_light_in_view(). The result must be of a film with chance light.
MissingInImage missing_in(const Job& job, const RenderResult& result, const ChanceLight& there);

// Sets a path tracer's film to record chance light, if light goes over specular surfaces and not only a part
// of a picture is rendered; other jobs' films not to.
void record_chance_light(Job& job);
// Calls record_chance_light() and returns chance_light_in_view(); none if the film records none, or if it
// would take more than a share of options.limits.seconds. Collective over ranks.
std::optional<ChanceLight> light_that_paths_hardly_find(Job& job, const RenderOptions& options,
                                                        Monitor& monitor);
// Warns of the light that the result lacks, and then removes its stated errors.
void warn_of_missing_light(const Job& job, const ChanceLight& there, RenderResult& result, Monitor& monitor);

}  // namespace lucerna
