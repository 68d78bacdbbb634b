#include "engine/scene/receiver.h"

namespace lucerna {

float clearance_of(const Receiver& receiver, const Scene& scene) {
    const V3f p(receiver.position - scene.origin());
    const float reach = surface_error(p, diagonal(scene));  // the greatest error that any surface has
    const float clearance = surface_error(p, 0);
    const V3f& n = receiver.normal;
    const auto hit = scene.intersect(Ray{p + reach * n, -n, 2 * reach});
    return hit ? std::max(clearance, hit->at.error) : clearance;
}

Hit receiver_hit(const Receiver& receiver, const V2f& u, const Scene& scene) {
    Hit hit;
    const V3f n = head_normal(receiver, u);
    const V3f p(receiver.position - scene.origin());
    hit.at = {p, n, receiver.clearance};
    hit.ns = hit.wo = n;
    const Frame frame(n);
    hit.dpdu = frame.s;
    hit.dpdv = frame.t;
    return hit;
}

}  // namespace lucerna
