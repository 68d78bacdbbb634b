#include "engine/scene/receiver.h"

#include "engine/scene/media_traversal.h"

namespace lucerna {

Receiver placed(Receiver receiver, const Scene& scene) {
    const V3f p(receiver.position - scene.origin());
    const float reach = surface_error(p, diagonal(scene));  // the largest error of any surface
    receiver.off = V3f(0);
    for (const V3f& side : {receiver.up, receiver.normal}) {
        const auto hit = scene.intersect(Ray{p + reach * side, -side, 2 * reach});
        if (!hit) continue;
        const V3f n = face_forward(hit->at.n, side);
        // The offset slightly exceeds the error, so that sensors that face the surface begin off it, too. A
        // surface that both rays find is left once.
        const float height = 2 * surface_error(p, 0) + hit->at.error;
        receiver.off += std::max(0.0F, height - receiver.off.dot(n)) * n;
    }
    const SurfacePoint at{p + receiver.off, receiver.normal, surface_error(p, 0)};
    receiver.medium = medium_around(scene, at, receiver.normal);
    return receiver;
}

Hit receiver_hit(const Receiver& receiver, const V2f& u, const Scene& scene) {
    Hit hit;
    const V3f n = sensor_normal(receiver, u);
    const V3f p(receiver.position - scene.origin());
    hit.at = {ray_origin(receiver, scene), n, surface_error(p, 0)};
    hit.ns = hit.wo = n;
    const Frame frame(n);
    hit.dpdu = frame.s;
    hit.dpdv = frame.t;
    return hit;
}

}  // namespace lucerna
