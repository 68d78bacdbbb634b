// A smooth lamp given by a formula, its irradiance, and the error of a measured light field of it, for tests
// of the virtual acquisition and the figure of its accuracy.
#pragma once

#include <algorithm>
#include <cmath>

#include "lights/measurement/acquire.h"
#include "lights/measurement/plane_irradiance.h"

namespace lucerna::testing {

inline constexpr double kLampRadius = 0.01;

// A disc that is brightest in its middle and fades out towards its edge.
struct SmoothLamp {
    explicit SmoothLamp(double exponent_)
        : exponent(exponent_),
          model(cosine_emitter(EmitterModel::Outline::disc, {kLampRadius, 0}, 1, exponent_, [](const V2d& p) {
              const double rest = std::max(0.0, 1 - p.length2());
              return rest * rest;
          })) {}
    double exponent;
    EmitterModel model;
};

// Integrates L cos²θ / R² over the emitter: rings by the midpoint rule, angles by the trapezoidal rule. On
// the emitter itself a cosine power has the closed form 2π L₀ / (exponent + 1).
inline double irradiance_of(const SmoothLamp& lamp, const V3d& point) {
    const double pi = std::acos(-1.0);
    const auto& radiance = lamp.model.radiance;
    if (point.z == 0) return radiance({point.x, point.y}, {0, 0, 1}) * 2 * pi / (lamp.exponent + 1);
    constexpr int kRings = 200, kAngles = 128;
    double sum = 0;
    for (int i = 0; i < kRings; ++i) {
        const double r = kLampRadius * (i + 0.5) / kRings;
        for (int j = 0; j < kAngles; ++j) {
            const double phi = 2 * pi * j / kAngles;
            const V2d at(r * std::cos(phi), r * std::sin(phi));
            const V3d way(point.x - at.x, point.y - at.y, point.z);
            const V3d d = way.normalized();
            sum += r * radiance(at, d) * d.z * d.z / way.length2();
        }
    }
    return sum * kLampRadius / kRings * 2 * pi / kAngles;
}

inline Rig rig_before_lamp(int views, int pixels) {
    Rig rig;
    rig.views = {views, views};
    rig.spacing = V2d(2 * kLampRadius / (views - 3));
    rig.pixels = {pixels, pixels};
    rig.distance = 0.05;
    rig.pixel = V2d(0.16 / pixels);
    return rig;
}

inline LightField measured(const SmoothLamp& lamp, int views, int pixels) {
    Monitor silent;
    AcquireOptions options;
    options.s_nodes = 2;
    options.m_nodes = 1;
    return acquire(lamp.model, rig_before_lamp(views, pixels), {}, silent, options);
}

// Returns the root mean square error of the irradiance over a square of half side 0.6 of the lamp's radius,
// relative to the irradiance at its middle.
inline double rms_error(const SmoothLamp& lamp, const LightField& field, double z) {
    double sum = 0;
    constexpr int kSide = 9;
    for (int i = 0; i < kSide * kSide; ++i) {
        const double step = 1.2 * kLampRadius / (kSide - 1);
        const V3d point(step * (i % kSide) - 0.6 * kLampRadius + 1e-4,
                        step * (i / kSide) - 0.6 * kLampRadius + 3e-4, z);
        const double error = irradiance(field, point) - irradiance_of(lamp, point);
        sum += error * error;
    }
    return std::sqrt(sum) / kSide / irradiance_of(lamp, {0, 0, z});
}

}  // namespace lucerna::testing
