// Ways into a light field: a lamp described by a formula, measured by a virtual rig; and a lamp known by its
// rays.
//
// Both do what the optical bench does: weigh the light with the dual bell Φ̃ over each filter position of S
// and with the box of each pixel on M [LF 2]. For a formula the weighing is an integral, done numerically;
// for rays it is a sum, because rays are a Monte Carlo sample of that integral.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"

namespace lucerna {

// --- a lamp described by a formula
// --------------------------------------------------------------------------------

// A flat emitter on a plane parallel to S, centred on the axis. Nothing leaves outside its outline.
struct EmitterModel {
    enum class Outline : std::uint8_t { disc, rectangle } outline = Outline::disc;
    V2d half_size{0, 0};  // metres; of a disc, x is the radius
    double setback = 0;   // metres by which the emitter lies behind S, >= 0
    // Radiance in flux unit / (m² sr) at a point of the emitter (metres from its centre) along a unit
    // direction with d.z > 0. Should be smooth within the outline: edges are integrated over only where the
    // outline has them.
    std::function<double(const V2d& position, const V3d& direction)> radiance;
    double flux = 0;      // in total, flux unit
    LightFieldInfo info;  // colour, unit and provenance to pass on
};

// Intensity ∝ cos^exponent θ, that is radiance ∝ cos^(exponent - 1) θ: 1 is Lambertian, larger is narrower;
// >= 1. `pattern`, if given, multiplies the radiance over the emitter: a function >= 0 on [-1, 1]²,
// normalised so that the emitter's flux is `flux`. Throws InputError for sizes, flux or exponents out of
// range.
EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux,
                            double exponent = 1, std::function<double(const V2d&)> pattern = {});

struct AcquireOptions {
    int s_nodes = 3;  // Gauss nodes per half filter spacing on S, 1 to 5
    int m_nodes =
        3;  // Gauss nodes per pixel and axis on M, 1 to 5; more than 1 also smooths the emitter's pattern
};

// The light field that the rig would measure: E to about 1e-4 of its largest value for smooth radiance.
// captured + missed = the emitter's flux. Throws InputError for a rig that is none, and when the user stops
// it.
LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options = {});

// --- a lamp known by its rays
// -------------------------------------------------------------------------------------

// Where a ray set's flux went; in its unit. The sum of all but `captured` is what the field does not hold.
struct FluxAccount {
    double total = 0;
    double captured = 0;  // the field's flux()
    double skipped = 0;   // rays whose data were unusable
    double backward = 0;  // rays that do not leave towards +z
    double beside_s = 0;  // rays that pass S where no filter weighs them
    double beside_m = 0;  // rays that pass M outside a view's image
    double not_in_basis =
        0;  // signed: the duals over a point add up to 1 only on average, and to less at the border
    double missed() const { return total - captured; }
    double explained() const {
        return skipped + backward + beside_s + beside_m + not_in_basis;
    }  // = missed()
};

struct Projection {
    LightField field;
    FluxAccount account;
};

// The field of `rays` on given planes (rig.centre in the frame of the rays). Throws InputError for a rig that
// is none.
Projection project_rays(const RaySet& rays, const Rig& rig, const Workers& workers, Monitor& monitor);

// How to lay the planes; what is 0 or absent is chosen from the rays (choose_rig says how).
struct FitOptions {
    V2i views{0, 0};        // filter positions per side
    V2i pixels{0, 0};       // pixels per side of a view's image
    double distance = 0;    // from S to M, metres
    double capture = 0.98;  // share of the flux leaving towards +z that S and M should let through, in (0, 1)
    std::optional<double> z;  // height of S in the rays' frame, metres
};

// Lays the planes for a ray set, as in Setup B (the screen stands still, σ = 0):
//   S      at the height where the median ray starts, weighed by flux; its box holds all positions but a tail
//   of a
//          sixteenth of the permitted loss on each of its four sides; one filter stands outside the box on
//          every side, so that no point of the box lacks one of its 4 x 4 duals.
//   D      five times the larger side of that box: far enough that a pixel is a bundle of directions [Ashdown
//   1995]. M      the least box about the axis, in the proportion of the lobe's own widths, that reaches the
//   share. views, pixels: about kRaysPerCoefficient rays per coefficient that has light, counted by 1 / Σ p²
//   over S and M, with
//          3 views to 4 pixels among those. 100,000 rays of a wide LED give about 12 x 12 views; the pixels
//          of a wide lobe are many, because most of a plane that catches 82° lies at grazing angles.
// Throws InputError if no ray leaves towards +z, or an option is out of range.
Rig choose_rig(const RaySet& rays, const FitOptions& options);
inline constexpr double kRaysPerCoefficient = 8;

// choose_rig, then project_rays.
Projection fit_light_field(const RaySet& rays, const FitOptions& options, const Workers& workers,
                           Monitor& monitor);

}  // namespace lucerna
