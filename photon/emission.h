// The first moment of a photon's life: a light is chosen by its power and asked for a particle.
#pragma once

#include <optional>

#include "engine/base/stream.h"
#include "engine/world/scene.h"

namespace lucerna {

struct LightPathStart {
    std::uint32_t light;
    CellId cell;
    SurfacePoint from;
    V3f d;      // unit
    Rgb power;  // W; its mean over paths is the flux of all lights together
};

// No sample: no light has power, or the light had nothing to emit for these numbers.
std::optional<LightPathStart> emit_path(const Scene& scene, Stream& stream);

}  // namespace lucerna
