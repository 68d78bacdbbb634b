// Small light fields for tests, and integrals of them that share no code with the library.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/sampler.h"
#include "lights/light_field.h"

namespace lucerna::testing {

// Remembers what it was told.
class ListeningMonitor : public Monitor {
  public:
    void info(std::string_view line) override { infos.emplace_back(line); }
    void warn(std::string_view line) override { warnings.emplace_back(line); }
    std::vector<std::string> infos, warnings;
};

inline Rig rig_b() {  // the screen stands still
    Rig rig;
    rig.views = {3, 2};
    rig.spacing = {0.01, 0.02};
    rig.pixels = {4, 5};
    rig.pixel = {0.03, 0.02};
    rig.distance = 0.08;
    rig.centre = {0.001, -0.002, 0.003};
    return rig;
}

inline Rig rig_a() {  // the sensor travels
    Rig rig = rig_b();
    rig.pixel = {0.01 / 2, 0.02 / 3};
    rig.shift = {2, 3};
    return rig;
}

// Coefficients in [low, high].
inline LightField random_field(const Rig& rig, float low, float high, std::uint64_t seed,
                               LightFieldInfo info = {}) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    std::vector<float> e(rig.coefficients());
    for (float& x : e) x = low + (high - low) * sampler.next();
    return {rig, std::move(e), std::move(info)};
}

// A Lambertian disc on S of radiance 1: the coefficients are the flux density at each filter and pixel, times
// the share of the disc in the filter's square. To second order in the spacing and the pixels.
inline LightField lambertian_disc(const Rig& rig, double radius, LightFieldInfo info = {}) {
    constexpr int kSteps = 16;
    std::vector<float> e(rig.coefficients());
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            const V2d at(rig.filter(0, m), rig.filter(1, n));
            double share = 0;
            for (int i = 0; i < kSteps * kSteps; ++i) {
                const V2d step((i % kSteps + 0.5) / kSteps - 0.5, (i / kSteps + 0.5) / kSteps - 0.5);
                share += (at + step * rig.spacing).length() < radius ? 1.0 / (kSteps * kSteps) : 0.0;
            }
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    const V2d sensor(rig.shift.x > 0 ? at.x : 0.0, rig.shift.y > 0 ? at.y : 0.0);
                    const V2d on_m = sensor + V2d((k + 0.5 - 0.5 * rig.pixels.x) * rig.pixel.x,
                                                  (l + 0.5 - 0.5 * rig.pixels.y) * rig.pixel.y);
                    e[rig.index(m, n, k, l)] = static_cast<float>(share * rig.geometric_term(at, on_m));
                }
            }
        }
    }
    return {rig, std::move(e), std::move(info)};
}

// Φ, written down once more.
inline double phi(double x) {
    x = std::fabs(x);
    return x <= 0.5 ? 1 - 2 * x * x : x <= 1 ? 2 * (1 - x) * (1 - x) : 0.0;
}

// h by its definition: a sum over all coefficients, before the clamp.
inline double brute_h(const LightField& field, const V2d& on_s, const V2d& on_m) {
    const Rig& rig = field.rig();
    double h = 0;
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            const V2d at((m - (rig.views.x - 1) / 2.0) * rig.spacing.x,
                         (n - (rig.views.y - 1) / 2.0) * rig.spacing.y);
            const double weight = phi((on_s.x - at.x) / rig.spacing.x) * phi((on_s.y - at.y) / rig.spacing.y);
            const V2d sensor(rig.shift.x > 0 ? at.x : 0, rig.shift.y > 0 ? at.y : 0);
            const double k = std::floor((on_m.x - sensor.x) / rig.pixel.x + rig.pixels.x / 2.0);
            const double l = std::floor((on_m.y - sensor.y) / rig.pixel.y + rig.pixels.y / 2.0);
            if (weight == 0 || k < 0 || l < 0 || k >= rig.pixels.x || l >= rig.pixels.y) continue;
            h += weight *
                 double{field.coefficients()[rig.index(m, n, static_cast<int>(k), static_cast<int>(l))]};
        }
    }
    return h;
}

// ∫∫∫∫ f max(0, h) by the midpoint rule, `s` points per interval and axis on S and `m` per pixel on M.
inline double integrate(const LightField& field, int s, int m,
                        const std::function<double(const V2d& on_s, const V2d& on_m)>& f) {
    const Rig& rig = field.rig();
    double sum = 0;
    V2d span;
    V2i steps;
    for (int a = 0; a < 2; ++a) {
        const double shift_m = rig.shift[a] > 0 ? rig.spacing[a] * (rig.views[a] - 1) : 0.0;
        span[a] = rig.pixels[a] * rig.pixel[a] + shift_m;
        steps[a] = static_cast<int>(std::lround(span[a] / rig.pixel[a])) * m;
    }
    const V2i cells((rig.views.x + 1) * s, (rig.views.y + 1) * s);
    const V2d whole((rig.views.x + 1) * rig.spacing.x, (rig.views.y + 1) * rig.spacing.y);
    for (int i = 0; i < cells.x; ++i) {
        for (int j = 0; j < cells.y; ++j) {
            const V2d on_s(whole.x * ((i + 0.5) / cells.x - 0.5), whole.y * ((j + 0.5) / cells.y - 0.5));
            for (int p = 0; p < steps.x; ++p) {
                for (int q = 0; q < steps.y; ++q) {
                    const V2d on_m(span.x * ((p + 0.5) / steps.x - 0.5),
                                   span.y * ((q + 0.5) / steps.y - 0.5));
                    const double h = brute_h(field, on_s, on_m);
                    if (h > 0) sum += h * f(on_s, on_m);
                }
            }
        }
    }
    return sum * whole.x * whole.y / cells.x / cells.y * span.x * span.y / steps.x / steps.y;
}

}  // namespace lucerna::testing
