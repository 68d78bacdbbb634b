#include "engine/scene/vertex.h"

namespace lucerna {

bool visible_between(const Scene& scene, const SurfacePoint& x, const SurfacePoint& y) {
    const V3f w = y.p - x.p;
    const V3f begin = x.towards(w);
    const V3f way = y.towards(-w) - begin;
    const float distance = way.length();
    if (!(distance > 0)) return true;  // the two ends have met: there is no room for anything between them
    return scene.unoccluded(SurfacePoint{begin}, way / distance, distance);
}

}  // namespace lucerna
