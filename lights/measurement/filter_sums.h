// Rays behind the two opacities of a measuring filter, gathered as they come.
//
// A real rig measures every filter position twice: behind the opacity of Φ̃⊗Φ̃'s positive part and behind that
// of its negative part [Goesele 2003, 4.1]. Rays do the same here: each adds its flux, times the opacities
// over it, to the pixels that see it, the two signs apart. Blocks of rays may come one after the other; the
// sums are the same for any number of threads.
#pragma once

#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "lights/light_field.h"
#include "lights/measurement/opacity.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {

struct FilterSums {
    Rig rig;
    // Σ φ max(0, ±Φ̃⊗Φ̃) of every pixel of every view, Φ̃ in units of the filter spacing; laid out as
    // Rig::index. In double: thousands of millions of terms are added.
    std::vector<double> positive, negative;
    double squares = 0;   // Σ (φ Φ̃⊗Φ̃)² over all rays and pixels: the noise
    FluxAccount account;  // of the rays: backward, beside_s, beside_m, not_in_basis

    // Nothing yet. Throws InputError for a rig that is none.
    explicit FilterSums(const Rig& of);
};

// Rays in the lamp's frame, as the rig's centre is. Those that do not go towards +z are booked and left out.
void add_rays(FilterSums& sums, std::span<const LampRay> rays, const Workers& workers);

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

}  // namespace lucerna
