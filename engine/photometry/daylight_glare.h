// Daylight glare at an observer's eye: the daylight glare probability,
//     DGP = 5.87e-5 E_v + 9.18e-2 log10(1 + Σ L_s² ω_s / (E_v^1.87 P_s²)) + 0.16
// [Wienold and Christoffersen 2006], E_v the illuminance at the eye, L_s, ω_s and P_s luminance, solid angle
// and position index of what glares: the sky through a window as much as a wall in the sun.
//
// What glares is found in a picture of all that the eye sees, as evalglare does [Wienold and Christoffersen
// 2006, section 5]: pixels above a threshold, those that lie together made one source, and very bright ones a
// source of their own. Which pixels are so bright is told by the denoised picture, as noise must not choose
// what glares; how bright they are, by the measured one, whose mean over a source has no bias. It is of two
// halves that do not depend on each other, and how far they differ tells a source's error. The discs of
// distant lights, which no picture shows, are added as the sun's.
#pragma once

#include <limits>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/image/image.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/observer.h"
#include "engine/render/job.h"

namespace lucerna {

// All that an observer sees, as an angular fisheye of 180 degrees (Camera::Settings::Mapping::fisheye), row
// by row from the top; 0 outside the hemisphere. Luminances, cd/m².
struct LuminanceView {
    int pixels = 0;  // along each side
    std::vector<float> halves[2], denoised;

    double luminance(std::size_t pixel) const {
        return 0.5 * (double{halves[0][pixel]} + double{halves[1][pixel]});
    }
};
// Of a pixel's middle, unit, camera axes: x right, y up, z the line of sight; and its solid angle, 0 outside
// the hemisphere.
struct ViewDirection {
    V3d w;
    double solid_angle = 0;
};
ViewDirection view_direction(int pixels, int x, int y);

struct DaylightSource {
    V3f towards;             // world, unit: its middle, weighted with luminance
    double solid_angle = 0;  // sr
    Reading95 luminance;     // cd/m²: its mean
    double square = 0;       // of its true mean, estimated without bias: noise does not add to it
    double position = 1;     // index
};

struct DaylightGlare {
    Reading95 dgp;
    std::vector<DaylightSource> sources;
    double mean_luminance = 0;  // cd/m², of the hemisphere
};

struct DaylightOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    // Of DGP: its half-width at which a picture has enough samples.
    double precision = 0.005;
    // What glares is brighter than so many times the mean luminance; more than 100: than that, cd/m².
    double threshold = 5;
    int pixels = 400;
};

// Whether any light shines from beyond the scene: a sky, the sun.
bool has_daylight(const Scene& scene);

// By path tracing, until the DGP that follows from the picture alone is precise enough. The job's camera,
// film and integrator are replaced. Ends early, with what there is, when the monitor says so.
LuminanceView luminance_view(const Observer& observer, Job& job, const DaylightOptions& options,
                             Monitor& monitor);
// As an image in cd/m²: R = G = B, and denoised.R, .G and .B.
Image view_image(const LuminanceView& view);

// Its sources, the scene's distant lights among them where nothing hides them; DGP is left to:
DaylightGlare daylight_glare(const LuminanceView& view, const Observer& observer, const Scene& scene,
                             double threshold, std::uint64_t seed = 0);
// DGP of its sources and of `vertical`, E_v [lx].
Reading95 daylight_rating(const DaylightGlare& glare, const Reading95& vertical);

// DGP of an illuminance at the eye [lx] and the sum over sources of L² ω / P²; below 1000 lx scaled down by
// evalglare's factor e^x / (1 + e^x), x = 0.024 E_v - 4, for rooms too dim to be glaring.
double dgp_of(double vertical, double sum);

}  // namespace lucerna
