#include "engine/scene/receiver.h"

namespace lucerna {

Hit receiver_hit(const Receiver& receiver, const V2f& u, const Scene& scene) {
    Hit hit;
    const V3f n = head_normal(receiver, u);
    const V3f p(receiver.position - scene.origin());
    hit.at = {p, n, surface_error(p, diagonal(scene))};
    hit.ns = hit.wo = n;
    const Frame frame(n);
    hit.dpdu = frame.s;
    hit.dpdv = frame.t;
    return hit;
}

}  // namespace lucerna
