// A picture's features: what it shows beside light (engine/denoise/denoise.h). They have next to no noise,
// and tell a denoiser where pictures of light have edges [Rousselle et al. 2013, section 4].
#pragma once

#include <cstdint>

#include "engine/base/image.h"
#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"

namespace lucerna {

// `samples` > 0 of each pixel, at the places of the render's own first ones. The monitor may stop it: what
// is missing then is 0.
Image render_features(const Job& job, std::uint64_t seed, int samples, const Workers& workers,
                      Monitor& monitor);

}  // namespace lucerna
