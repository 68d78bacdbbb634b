// Daylight glare at an observer's eye, rated by the daylight glare probability
//     DGP = 5.87e-5 E_v + 9.18e-2 log10(1 + Σ L_s² ω_s / (E_v^1.87 P_s²)) + 0.16
// [Wienold and Christoffersen 2006]. E_v is the illuminance at the eye; L_s, ω_s and P_s are the luminance,
// solid angle and position index of a glare source, such as the sky in a window or a sunlit wall.
//
// Glare sources are found in a picture of the observer's field of view, as evalglare finds them [Wienold and
// Christoffersen 2006, section 5]. Neighbouring pixels above a threshold form one source, and very bright
// ones form a source of their own. The denoised picture selects the pixels, because noise must not choose a
// source; the rendered picture gives their luminance, whose mean over a source is unbiased. It consists of
// two independent halves, and their difference gives the standard error of a source. Distant lights have no
// solid angle and appear in no picture; they are added as discs of the sun's size.
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

// The field of view of an observer as luminances, cd/m², in an angular fisheye image of 180 degrees
// (Camera::Settings::Mapping::fisheye). Rows run from the top; pixels outside the hemisphere are 0.
struct LuminanceView {
    int pixels = 0;  // along each side
    std::vector<float> halves[2], denoised;

    double luminance(std::size_t pixel) const {
        return 0.5 * (double{halves[0][pixel]} + double{halves[1][pixel]});
    }
};
// The direction of a pixel's centre, a unit vector in camera axes (x right, y up, z the line of sight), and
// the pixel's solid angle, which is 0 outside the hemisphere.
struct ViewDirection {
    V3d w;
    double solid_angle = 0;
};
ViewDirection view_direction(int pixels, int x, int y);

struct DaylightSource {
    V3f towards;             // centre weighted with luminance, a unit vector of the world
    double solid_angle = 0;  // sr
    Reading95 luminance;     // mean luminance, cd/m²
    double square = 0;       // unbiased estimate of the squared true mean luminance; noise does not add to it
    double position = 1;     // position index
};

struct DaylightGlare {
    Reading95 dgp;
    std::vector<DaylightSource> sources;
    double mean_luminance = 0;  // of the hemisphere, cd/m²
};

struct DaylightOptions {
    std::uint64_t seed = 0;
    Workers workers;
    double seconds = std::numeric_limits<double>::infinity();
    // The half-width of DGP at which a picture has enough samples.
    double precision = 0.005;
    // Glare sources exceed this multiple of the mean luminance, or if > 100 this luminance, cd/m².
    double threshold = 5;
    int pixels = 400;
};

// Tells whether any light shines from beyond the scene, such as a sky or the sun.
bool has_daylight(const Scene& scene);

// Renders the field of view by path tracing until the DGP of the picture alone is precise enough. Replaces
// the job's camera, film and integrator. Ends early with the samples so far when the monitor says so.
LuminanceView luminance_view(const Observer& observer, Job& job, const DaylightOptions& options,
                             Monitor& monitor);
// Returns an image in cd/m² with R = G = B and the layers denoised.R, .G and .B.
Image view_image(const LuminanceView& view);

// Finds the glare sources, including distant lights that nothing hides. Leaves DGP to daylight_rating().
DaylightGlare daylight_glare(const LuminanceView& view, const Observer& observer, const Scene& scene,
                             double threshold, std::uint64_t seed = 0);
// Returns the DGP of the sources of `glare` and of the illuminance `vertical`, E_v in lx.
Reading95 daylight_rating(const DaylightGlare& glare, const Reading95& vertical);

// Returns the DGP of an illuminance at the eye [lx] and the sum over sources of L² ω / P². Below 1000 lx, in
// rooms too dim for glare, it is scaled by evalglare's factor e^x / (1 + e^x) with x = 0.024 E_v - 4.
double dgp_of(double vertical, double sum);

}  // namespace lucerna
