// The path tracer's two forms: for scenes without media, and for scenes with them, where every stretch of a
// path is a flight. The first is the second's special case; it stands alone because it need not ask.
#pragma once

#include <memory>

#include "engine/integrators/integrator.h"

namespace lucerna {

// Roulette begins here: the first bounces carry most of the light and are worth their rays.
inline constexpr int kRouletteFrom = 3;

std::unique_ptr<const Estimator> make_media_path(const Scene& scene, const PathSettings& settings);

}  // namespace lucerna
