// A way into a light field: a lamp known by its rays.
//
// Rays are a Monte Carlo sample of the integrals by which the optical bench measures [Goesele 2003, 3.1]: a
// ray of flux φ through (u, v) of S and (s, t) of M adds φ Φ̃_m(u) Φ̃_n(v) / (w_M h_M) to pixel (k, l) of each
// of the 4 x 4 filters over it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/ranks/ranks.h"
#include "lights/light_field.h"
#include "lights/measurement/opacity.h"
#include "lights/ray_set.h"

namespace lucerna {

// Where a ray set's flux went; in its unit. The sum of all but `captured` is what the field does not hold.
struct FluxAccount {
    double total = 0;
    double captured = 0;  // the field's flux()
    double skipped = 0;   // rays whose data were unusable
    double backward = 0;  // rays that do not leave towards +z
    double beside_s = 0;  // rays that pass S where no filter weighs them
    double beside_m = 0;  // rays that pass M outside a view's image
    // Signed. Over a point well within S and M the duals add up to 1; towards the borders, where some of
    // those that reach a point are missing, they do not.
    double not_in_basis = 0;
    double missed() const { return total - captured; }
    double explained() const {
        return skipped + backward + beside_s + beside_m + not_in_basis;
    }  // = missed()
};

// By what a ray is weighed: on each plane the given share of the dual basis, and for the rest the basis
// itself. The dual alone gives coefficients without bias, and all noise of few rays; the basis function alone
// blurs the field by its own width, and its weights are positive. Both add up to 1 over a point, so the flux
// is the same. On M a box is its own dual.
struct RayWeights {
    double dual_s = 1, dual_m = 1;  // in [0, 1]
};

struct Projection {
    LightField field;
    FluxAccount account;
    double noise = 0;  // rms of a coefficient's noise over the rms of the coefficients without it
};

// The field of `rays` on given planes (rig.centre in the frame of the rays). Throws InputError for a rig that
// is none.
Projection project_rays(const RaySet& rays, const Rig& rig, const Workers& workers, Monitor& monitor,
                        const RayWeights& weights = {});

// How to lay the planes; what is 0 or absent is chosen from the rays (choose_planes says how).
struct FitOptions {
    V2i views{0, 0};      // filter positions per side
    V2i pixels{0, 0};     // pixels per side of a view's image
    double distance = 0;  // from S to M, metres
    double capture =
        0.993;  // share of the flux leaving towards +z that S and M should let through, in (0, 1)
    std::optional<double> z;  // height of S in the rays' frame, metres
    // Where the light begins, in the rays' frame, if that is known better than from where rays start.
    std::optional<Box3d> begin;
};

// The planes for a ray set, and what to weigh its rays by.
struct RayPlanes {
    Rig rig;
    RayWeights weights;
    // Of the field that all rays make there before its light is clamped, by rays that no choice was made by
    // (choose_resolution).
    std::vector<PlaneError> errors;
};

// Lays the planes for a ray set, as in Setup B (the screen stands still, σ = 0), with hats on M:
//   S      at the waist, where the rays' lines are closest together (waist_height), but not behind what they
//          start from. Its box holds all positions but a tail of a sixteenth of the permitted loss on each of
//          its four sides, and reaches at most kWidestS times as far as where rays start: the lines of rays
//          that leave sideways pass S far off. Of light that begins in a box known before: as far as lines of
//          that slope from the box pass S.
//   D      five times the larger side of that box: far enough that a pixel is a bundle of directions
//          [Ashdown 1995].
//   M      the least box about the axis, in the proportion of the lobe's own widths, that reaches the share,
//          but at most kWidestM times as far as D (85°).
//   coordinates, views, pixels, weights: of those tried the ones of least error of irradiance, over planes
//          from contact to the far field, in rays that the field does not know (held_out.h). An
//          estimate by the rays that choose is biased: a quarter of the rays is held out from all choices,
//          and the error that is stated is estimated from them. Light that passes the two boxes must be
//          held, but for as much again as the boxes may lose: what holds less is taken only where nothing
//          that was tried holds more.
// An even S covers its box, with one filter outside on every side, so that no point lacks one of its 4 x 4
// duals; a compressed one covers the plane. Throws InputError if no ray leaves towards +z, or an option is
// out of range.
RayPlanes choose_planes(const RaySet& rays, const FitOptions& options, const Workers& workers,
                        Monitor& monitor);
inline constexpr double kWidestS = 4;
inline constexpr double kWidestM = 11.5;

// The height at which the rays' lines are closest together: Σ flux cos²θ |p(z) - mean|² is least. The cosine
// makes it the distance across the lines, which grazing ones would else decide alone. Where all lines are
// parallel: the mean height at which they start. Of the rays towards +z.
struct Waist {
    double z;       // metres
    double spread;  // the root of the mean square there, metres
};
Waist waist_of(const RaySet& rays);

// choose_planes, then project_rays; the field's info has the errors.
Projection fit_light_field(const RaySet& rays, const FitOptions& options, const Workers& workers,
                           Monitor& monitor);

// Rays behind the two opacities of a measuring filter, gathered as they come.
//
// A real rig measures every filter position twice: behind the opacity of Φ̃⊗Φ̃'s positive part and behind that
// of its negative part [Goesele 2003, 4.1]. Rays do the same here: each adds its flux, times the opacities
// over it, to the pixels that see it, the two signs apart. Blocks of rays may come one after the other; the
// sums are the same for any number of threads.

struct FilterSums {
    Rig rig;
    // Σ φ max(0, ±Φ̃⊗Φ̃) of every pixel of every view, Φ̃ in units of the filter spacing; laid out as
    // Rig::index. In double: thousands of millions of terms are added.
    std::vector<double> positive, negative;
    double squares = 0;  // Σ (φ Φ̃⊗Φ̃)² over all rays and pixels: the noise
    // Rays of one colour, CIE XYZ per unit of flux, have no more than that; once there is another the sums
    // above are of Y = 1, and these of X and Z.
    V3f tint{0.0F};
    struct Signed {
        std::vector<double> positive, negative;
    };
    Signed x, z;
    bool coloured() const { return !x.positive.empty(); }
    // Makes sums of X and Z of those that there are.
    void separate_colours();
    FluxAccount account;  // of the rays: backward, beside_s, beside_m, not_in_basis

    // Nothing yet. Throws InputError for a rig that is none.
    explicit FilterSums(const Rig& of);

    // Of ranks that add the same rays, each has the newest sums of some rows of filters alone: who works on a
    // row has it. squares and account are right at rank 0. Collective, all of them.

    // Rank 0's sums, those of a file, are the newest of all rows. The others know their tint then.
    void begin_at_rank_0(Ranks& ranks);
    // Rank 0 has all rows; who has them, stays.
    void bring_to_rank_0(Ranks& ranks);

    // A row's sums, as bytes.
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
    ItemStates rows;
};

// Rays in the lamp's frame, as the rig's centre is. Those that do not go towards +z are booked and left out.
// Each has Y = 1 per unit of flux; `tints`, if there are any, are theirs. Ranks share out the rows of
// filters. False: the user stopped the ranks before anything was added. Throws InputError if sums of several
// colours do not fit into memory.
bool add_rays(FilterSums& sums, std::span<const LampRay> rays, const Workers& workers,
              const RayTints& tints = {});

// The images as the rig records them: irradiance, each ray's flux times `share` (1 / number of light paths).
FilterImages images_of(const FilterSums& sums, double share, const LightFieldInfo& info);

// What the finite number of rays does to the coefficients.
struct SamplingNoise {
    double rms = 0;  // standard deviation of a coefficient, root mean square over all, flux unit / m⁴
    double relative =
        0;  // of all coefficients together: √(Σ variance / Σ E²), the noise's own part of E² taken out
};
// From independent rays; stratified ones have less. `field` is that of the same sums and share.
SamplingNoise sampling_noise(const FilterSums& sums, double share, const LightField& field);

// Where the light of a ray set may pass the planes; what of it is chosen by choose_resolution().
struct PlaneBoxes {
    V2d centre_s, half_s;  // metres
    V2d half_m;
    double held = 0;    // share of the light of `rays` that must be held
    V2i views, pixels;  // 0: to be chosen
};

// The rays that the resolution is chosen by, three quarters of those given, and the rest, by which the error
// of what was chosen is stated. Which part a ray goes to is drawn.
struct HeldOutParts {
    std::vector<std::size_t> choosing, judging;
};
HeldOutParts held_out_parts(std::span<const std::size_t> rays);

// Sets all of `planes` that depends on the resolution; planes.rig has centre and distance already.
void choose_resolution(const RaySet& set, std::span<const std::size_t> rays, const PlaneBoxes& boxes,
                       RayPlanes& planes, const Workers& workers, Monitor& monitor);

}  // namespace lucerna
