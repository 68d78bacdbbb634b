// A receiver is a point of a calculation surface, where a photometer measures in free space, with no surface
// of the scene behind it.
//
// The kinds of illuminance (EN 12665, CIE 17.3) are, with the radiance L from the direction w, which makes
// the angle ε with the vertical:
//
//   planar            E    = ∫ L max(0, n·w) dw
//   cylindrical       E_z  = 1/π ∫ L sin ε dw, all sides of a vertical cylinder
//   semicylindrical   E_sc = 1/π ∫ L (1 + cos α) sin ε dw, the half whose middle faces n; α is w's azimuth
//                     from n
//   hemispherical     E_hs = 1/4 ∫ L (1 + n·w) dw, a dome on a base with the normal n
//   spherical         E_s  = 1/4 ∫ L dw; the scalar illuminance is E_0 = 4 E_s
//
// The last four are means of E over planar sensors whose normals are distributed evenly over the cylinder,
// its half, the dome and the sphere. They are estimated in this way, with one sensor for each sample.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/scene/scene.h"

namespace lucerna {

enum class ReceiverKind : std::uint8_t { planar, cylindrical, semicylindrical, hemispherical, spherical };
inline constexpr std::string_view kReceiverKinds[] = {"planar", "cylindrical", "semicylindrical",
                                                      "hemispherical", "spherical"};

inline std::string_view receiver_kind_name(ReceiverKind kind) {
    return kReceiverKinds[static_cast<std::size_t>(kind)];
}
// Returns none for an unknown name.
inline std::optional<ReceiverKind> receiver_kind(std::string_view name) {
    const auto found = std::find(std::begin(kReceiverKinds), std::end(kReceiverKinds), name);
    if (found == std::end(kReceiverKinds)) return std::nullopt;
    return static_cast<ReceiverKind>(found - std::begin(kReceiverKinds));
}

// Tells whether turning the receiver changes its reading, apart from turning a cylinder's axis.
inline bool has_facing(ReceiverKind kind) {
    return kind != ReceiverKind::cylindrical && kind != ReceiverKind::spherical;
}
// Returns a message that says why such a receiver has no direction to face.
inline std::string no_facing_text(ReceiverKind kind) {
    return std::string("a ") + std::string(receiver_kind_name(kind)) +
           " sensor receives light from all sides and faces no direction; leave \"facing\" out, or use "
           "kind " +
           "planar or semicylindrical";
}

struct Receiver {
    V3d position;  // world, scene units
    V3f normal;    // unit: of a planar sensor; horizontal for a semicylinder; the axis of a cylinder
    V3f up;  // unit: a semicylinder's axis, normal to `normal`; away from the surface that it may lie on
    ReceiverKind kind = ReceiverKind::planar;
    V3f off{0, 0, 0};                 // scene units: from the position to the rays' origin (set by placed())
    std::int32_t medium = kNoMedium;  // medium of the interfaces around it (set by placed())
};

// Returns the receiver placed in the scene: off the surfaces that it lies on, on the side of `up` and
// `normal`, and in its medium. Rays begin at a distance equal to the position error of those surfaces, which
// grows with their size: a floor of a few metres is measured to micrometres, even if the ground around it is
// kilometres wide.
Receiver placed(Receiver receiver, const Scene& scene);

// Returns where the rays of a placed receiver begin, relative to the scene's origin.
inline V3f ray_origin(const Receiver& receiver, const Scene& scene) {
    return V3f(receiver.position - scene.origin()) + receiver.off;
}

// Returns the normal of one planar sensor of the receiver. `u` is uniform in [0,1)².
inline V3f sensor_normal(const Receiver& receiver, const V2f& u) {
    const V3f& n = receiver.normal;
    switch (receiver.kind) {
        case ReceiverKind::cylindrical: {
            const Frame frame(n);
            const double phi = 2 * kPiD * double{u.x};
            return frame.to_world(V3f(V3d(cos(phi), sin(phi), 0)));
        }
        case ReceiverKind::semicylindrical: {
            const double phi = kPiD * (double{u.x} - 0.5);
            return V3f(cos(phi) * V3d(n) + sin(phi) * V3d(receiver.up).cross(V3d(n)));
        }
        case ReceiverKind::hemispherical:
        case ReceiverKind::spherical: {
            const V3f w = square_to_sphere(u);
            return receiver.kind == ReceiverKind::spherical ? w : face_forward(w, n);
        }
        case ReceiverKind::planar:
            break;
    }
    return n;
}

// Returns that planar sensor as the first surface of a path from the eye: white, seen from its front
// (quantity.h). It is not part of the scene. Rays leave from the point plus `off`, so that rounding does not
// put a sensor on a floor below it.
Hit receiver_hit(const Receiver& receiver, const V2f& u, const Scene& scene);

}  // namespace lucerna
