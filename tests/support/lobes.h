// Lobes, directions and normals that the tests of scattering share.
#pragma once

#include <array>
#include <numbers>

#include "engine/scene/bsdf.h"

namespace lucerna::testing {

inline const V3f kUp(0, 0, 1);
inline const V3f kAlongX(1, 0, 0);
inline constexpr std::array<float, 6> kAngles{0,  25,   42.5F, 60,
                                              80, 88.5F};  // degrees; 42.5 is beyond glass's critical angle

inline V3f direction(float theta_degrees, float phi = 0.4F) {
    const double theta = static_cast<double>(theta_degrees) * std::numbers::pi / 180;
    const auto s = static_cast<float>(std::sin(theta));
    return {s * std::cos(phi), s * std::sin(phi), static_cast<float>(std::cos(theta))};
}
inline V3f below(const V3f& w) {
    return {w.x, w.y, -w.z};
}

inline Bsdf flat(const Lobe& lobe) {
    return {lobe, kUp, kUp, kAlongX};
}

inline ConductorLobe metal(float ax, float ay) {
    return {Rgb(0.2F, 0.92F, 1.1F), Rgb(3.9F, 2.45F, 2.14F), Rgb(1.0F), ax, ay};
}
inline DielectricLobe glass(float eta, float ax, float ay) {
    return {eta, Rgb(1.0F), Rgb(1.0F), ax, ay};
}

// Returns a normal tilted by this angle.
inline V3f tilted(float degrees) {
    return direction(degrees, 2.0F);
}

}  // namespace lucerna::testing
