// A cell of a photometric grid: the piece of the sphere between two polar angles and two azimuths, with an
// intensity that is linear in both.
//
// Light per polar angle is intensity times sin θ, so the integrals of (a + b t) sin θ are elementary. They
// are written in a form that does not cancel in thin cells.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {

// A step of the polar angle [rad] from `from` on; t in [0, 1] runs across it.
struct PolarStep {
    double from, width;  // width > 0

    // Returns ∫ sin θ dθ over [0, t].
    double solid(double t) const {
        const double half = 0.5 * t * width;
        return 2 * sin(from + half) * sin(half);
    }
    // Returns ∫ τ sin θ dθ over τ in [0, t], the share of the upper end; falling() is that of the lower end.
    double rising(double t) const {
        const double half = 0.5 * t * width, middle = from + half;
        return 2 * (cos(middle) * sin_minus(half) + half * sin(middle) * sin(half)) / width;
    }
    double falling(double t) const { return solid(t) - rising(t); }

  private:
    // Returns sin h - h cos h.
    static double sin_minus(double h) {
        if (std::fabs(h) > 0.1) return sin(h) - h * cos(h);
        const double h2 = h * h;
        return h * h2 * (1.0 / 3 - h2 * (1.0 / 30 - h2 * (1.0 / 840 - h2 / 45360)));
    }
};

struct PhotometricCell {
    PolarStep step;
    double azimuth_width;  // radians
    double low[2];         // at the lower polar angle, at the lower and the upper azimuth
    double high[2];        // at the upper polar angle

    double flux() const {
        const double lower = 0.5 * (low[0] + low[1]), upper = 0.5 * (high[0] + high[1]);
        return azimuth_width * (lower * step.falling(1) + upper * step.rising(1));
    }
    double value(double t, double s) const { return along(t, 0) * (1 - s) + along(t, 1) * s; }

    // Draws t in [0, 1] in proportion to the light at t over all azimuths. Requires flux() > 0.
    double draw_polar(double u) const {
        const double lower = 0.5 * (low[0] + low[1]), upper = 0.5 * (high[0] + high[1]);
        const auto light_upto = [&](double t) { return lower * step.falling(t) + upper * step.rising(t); };
        const double wanted = u * light_upto(1);
        // Newton's steps stay within a bracket that bisection shrinks.
        double from = 0, to = 1, t = 0.5;
        for (int i = 0; i < 60 && to - from > 1e-14; ++i) {
            const double excess = light_upto(t) - wanted;
            (excess > 0 ? to : from) = t;
            const double slope =
                (lower * (1 - t) + upper * t) * sin(step.from + t * step.width) * step.width;
            const double next = slope > 0 ? t - excess / slope : -1;
            const double previous = t;
            t = next > from && next < to ? next : 0.5 * (from + to);
            if (std::fabs(t - previous) < 1e-13) break;
        }
        return t;
    }
    // Draws s in [0, 1] in proportion to the intensity at t.
    double draw_azimuth(double u, double t) const {
        const double p = along(t, 0), q = along(t, 1);
        // Solves p s + (q - p) s²/2 = u (p + q)/2 by the root that does not cancel.
        const double root = std::sqrt(std::max(0.0, p * p + u * (q * q - p * p)));
        return p + root > 0 ? std::min(1.0, u * (p + q) / (p + root)) : 0.0;
    }

  private:
    double along(double t, int side) const { return low[side] * (1 - t) + high[side] * t; }
};

}  // namespace lucerna
