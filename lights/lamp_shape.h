// The shape on which a lamp is seen to shine: its glass, its bulb, its front.
//
// A light field says what travels along every line, not where on the line the light begins. Without a shape
// that is the sampling plane S. With one, the light of a line begins where the line last crosses the shape;
// lines that miss it begin on S as before, so that the lamp's flux is the same whatever shape it is given.
#pragma once

#include <optional>

#include "engine/base/surface_point.h"
#include "engine/base/vec.h"

namespace lucerna {

// Implemented where geometry is traced; constant and safe to share between threads. Positions are relative to
// the scene's origin.
class LampShape {
  public:
    virtual ~LampShape() = default;

    // Where the line through p along d (unit) crosses the shape for the last time. None: it misses the shape.
    virtual std::optional<SurfacePoint> last_crossing(const V3d& p, const V3d& d) const = 0;

    // Of its bounding box's diagonal, scene units, > 0.
    virtual float extent() const = 0;
};

}  // namespace lucerna
