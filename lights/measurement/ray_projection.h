// Makes a light field of a lamp that is known by its rays.
//
// Rays are a Monte Carlo sample of the integrals that the optical bench measures [Goesele 2003, 3.1]: a ray
// of flux φ through (u, v) of S and (s, t) of M adds φ Φ̃_m(u) Φ̃_n(v) / (w_M h_M) to pixel (k, l) of each of
// the 4 x 4 filters over it.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/ranks/shared_work.h"
#include "lights/light_field.h"
#include "lights/measurement/opacity.h"
#include "lights/ray_set.h"

namespace lucerna {

// Accounts for a ray set's flux, in its unit. All but `total` and `captured` add up to missed().
struct FluxAccount {
    double total = 0;
    double captured = 0;  // the field's flux()
    double skipped = 0;   // rays whose data were unusable
    double backward = 0;  // rays that do not leave towards +z
    double beside_s = 0;  // rays that pass S where no filter weighs them
    double beside_m = 0;  // rays that pass M outside a view's image
    // Signed. The duals over a point well within S and M add up to 1; towards the edges, where some of those
    // that reach a point are missing, they do not.
    double not_in_basis = 0;
    double missed() const { return total - captured; }
    double explained() const {
        return skipped + backward + beside_s + beside_m + not_in_basis;
    }  // = missed()
};

// The weights of a ray: on each plane the given share of the dual basis, and the rest of the basis itself.
// The dual alone gives unbiased coefficients with all the noise of few rays. The basis function alone has
// positive weights, but blurs the field by its own width. Both add up to 1 over a point, so the flux is the
// same. On M a box is its own dual.
struct RayWeights {
    double dual_s = 1, dual_m = 1;  // in [0, 1]
};

struct Projection {
    LightField field;
    FluxAccount account;
    double noise = 0;  // rms of the coefficients' noise over the rms of the coefficients without it
};

// Projects `rays` on given planes (rig.centre is in the frame of the rays). Throws InputError for an invalid
// rig.
Projection project_rays(const RaySet& rays, const Rig& rig, const Workers& workers, Monitor& monitor,
                        const RayWeights& weights = {});

// Options for the planes; those that are 0 or absent are chosen from the rays (see choose_planes).
struct FitOptions {
    V2i views{0, 0};          // filter positions per side
    V2i pixels{0, 0};         // pixels per side of a view's image
    double distance = 0;      // from S to M, metres
    double capture = 0.993;   // share of the flux towards +z that S and M should pass, in (0, 1)
    std::optional<double> z;  // height of S in the rays' frame, metres
    // The box in which light begins, in the rays' frame, if that is known better than from where rays start.
    std::optional<Box3d> begin;
};

class HeldOutRays;

// The planes for a ray set, and the weights of its rays.
struct RayPlanes {
    Rig rig;
    RayWeights weights;
    // Errors of the field that all rays make there, estimated from rays that took part in no choice
    // (choose_resolution), and these rays, if there are any.
    std::vector<PlaneError> errors;
    std::shared_ptr<const HeldOutRays> judge;
};

// Chooses the planes for a ray set, as in Setup B (the screen stands still, σ = 0), with hats on M:
//   S      at the waist, where the rays' lines are closest together (waist_of), but not behind where they
//          start. Its box holds all positions but a tail of a sixteenth of the permitted loss on each of its
//          four sides. It extends at most kWidestS times as far as the rays' starts, because the lines of
//          rays that leave sideways pass S far off. If the box where light begins is known, it extends as far
//          as lines of slope kWidestS from that box pass S.
//   D      five times the larger side of that box: far enough that a pixel is a bundle of directions
//          [Ashdown 1995].
//   M      the smallest box about the axis, in the proportion of the lobe's own widths, that holds the share,
//          but its half size is at most kWidestM times D (85°).
//   coordinates, views, pixels, weights: of those tried, the ones with the least error of irradiance over
//          planes from contact to the far field, judged by rays that the field does not know (held_out.h).
//          An estimate from the rays that choose is biased, so a quarter of the rays is held out from all
//          choices, and the stated error is estimated from them. A choice must hold the light that passes
//          the two boxes, up to as much loss as the boxes may have; one that holds less is taken only if no
//          other one that was tried holds more.
// A uniform S covers its box, with one filter outside on every side, so that no point lacks one of its 4 x 4
// duals; a compressed one covers the plane. Throws InputError if no ray leaves towards +z, or an option is
// out of range.
RayPlanes choose_planes(const RaySet& rays, const FitOptions& options, const Workers& workers,
                        Monitor& monitor);
inline constexpr double kWidestS = 4;
inline constexpr double kWidestM = 11.5;

// The height z at which the rays' lines are closest together, where Σ flux cos²θ |p(z) - mean|² is least over
// rays towards +z. The cosine turns it into the distance across the lines, lest grazing ones decide alone.
// For parallel lines it is the mean height at which they start.
struct Waist {
    double z;       // metres
    double spread;  // root mean square distance there, metres
};
Waist waist_of(const RaySet& rays);

// Returns `set` itself if it has no more than `most` rays. Otherwise puts at most that many of its rays into
// `few`, each drawn at random from a run of equal length, and returns that. Their flux is not scaled, and the
// totals of `few` are not set.
const RaySet& few_of(const RaySet& set, std::size_t most, RaySet& few);

// Calls choose_planes(), project_rays() and rounded_to_rays(); the field's info has the errors.
Projection fit_light_field(const RaySet& rays, const FitOptions& options, const Workers& workers,
                           Monitor& monitor);

// Sums rays behind the two opacities of a measuring filter, block by block.
//
// A real rig measures every filter position twice: behind the opacity of Φ̃⊗Φ̃'s positive part and behind
// that of its negative part [Goesele 2003, 4.1]. Rays do the same here: each adds its flux, times the
// opacities over it, to the pixels that see it, with separate sums for the two signs. Blocks of rays may be
// added one after the other. The sums do not depend on the number of threads.

struct FilterSums {
    Rig rig;
    // Σ φ max(0, ±Φ̃⊗Φ̃) for every pixel of every view, with Φ̃ in units of the filter spacing, laid out by
    // Rig::index. The sums are in double precision, because they have billions of terms.
    std::vector<double> positive, negative;
    double squares = 0;  // Σ (φ Φ̃⊗Φ̃)² over all rays and pixels, for the noise
    // Rays of one colour, CIE XYZ per unit of flux, need only the sums above. From the second colour on,
    // those are of Y = 1, and these are of X and Z.
    V3f tint{0.0F};
    struct Signed {
        std::vector<double> positive, negative;
    };
    Signed x, z;
    bool coloured() const { return !x.positive.empty(); }
    // Makes sums of X and Z from the existing ones.
    void separate_colours();
    FluxAccount account;  // of the rays: backward, beside_s, beside_m, not_in_basis

    // Starts with empty sums. Throws InputError for an invalid rig.
    explicit FilterSums(const Rig& of);

    // On ranks that add the same rays, the sums of a row of filters are those of the rank that owns the row,
    // while squares and account are those of all ranks. These calls are collective.

    // Copies rank 0's sums, which come from a file, to all ranks.
    void copy_from_rank_0(Ranks& ranks);
    // Copies all rows to rank 0.
    void gather(Ranks& ranks);

    // Packs and unpacks the sums of a row.
    template <typename Archive>
    void fields_of_row(int n, Archive& archive) {
        const std::size_t pixels =
            static_cast<std::size_t>(rig.pixels.x) * static_cast<std::size_t>(rig.pixels.y);
        for (std::vector<double>* sum :
             {&positive, &negative, &x.positive, &x.negative, &z.positive, &z.negative}) {
            for (int m = 0; m < rig.views.x && !sum->empty(); ++m) {
                auto view = std::span(*sum).subspan(rig.index(m, n, 0, 0), pixels);
                archive(view);
            }
        }
    }
    auto fields() {
        return [this](std::int64_t n, auto& archive) { fields_of_row(static_cast<int>(n), archive); };
    }
};

// Adds rays in the lamp's frame, in which the rig's centre is. Those that do not leave towards +z are only
// accounted for. Each has Y = 1 per unit of flux; `tints`, if there are any, are their colours. Ranks share
// the rows of filters. Returns false if the user stopped the ranks before anything was added. Throws
// InputError if sums of several colours exceed the memory.
bool add_rays(FilterSums& sums, std::span<const LampRay> rays, const Workers& workers,
              const RayTints& tints = {});

// Returns the images that the rig records: irradiance, with each ray's flux times `share` (1 / light paths).
FilterImages images_of(const FilterSums& sums, double share, const LightFieldInfo& info);

// The noise of the coefficients that is due to the finite number of rays.
struct SamplingNoise {
    double rms = 0;       // root mean square of the coefficients' standard deviations, flux unit / m⁴
    double relative = 0;  // √(Σ variance / Σ E²) over all coefficients, without the noise's own part of E²
};
// Assumes independent rays; stratified ones have less noise. `field` is made of the same sums and share.
SamplingNoise sampling_noise(const FilterSums& sums, double share, const LightField& field);

// The boxes where the light of a ray set may pass the planes; choose_resolution() works within them.
struct PlaneBoxes {
    V2d centre_s, half_s;  // metres
    V2d half_m;
    double held = 0;       // share of the light of the given rays that must be held
    V2i views, pixels;     // 0: chosen
    std::size_t rays = 0;  // rays of the set that leave towards +z, of which the field is made
};

// Three quarters of the given rays, which choose the resolution, and the rest, which estimate the error of
// the choice. Rays are assigned at random.
struct HeldOutParts {
    std::vector<std::size_t> choosing, judging;
};
HeldOutParts held_out_parts(std::span<const std::size_t> rays);

// Sets the part of `planes` that depends on the resolution; planes.rig already has centre and distance.
// `rays` are all or some of those that leave towards +z.
void choose_resolution(const RaySet& set, std::span<const std::size_t> rays, const PlaneBoxes& boxes,
                       RayPlanes& planes, const Workers& workers, Monitor& monitor);

}  // namespace lucerna
