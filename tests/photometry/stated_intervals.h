// Compares illuminance on planes with the truth: stated intervals must cover it as often as they claim.
#pragma once

#include <gtest/gtest.h>

#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "tests/support/statistics.h"

namespace lucerna::testing {

// Reads a job; files that the scene names are looked for in `folder`.
inline Job job_of(const std::string& world, const std::filesystem::path& folder = {}) {
    Monitor silent;
    return read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + world, folder / "scene.pbrt",
                           {}, Workers{2}, silent);
}

inline CalculationSurface plane(double height, double size, V2i points,
                                ReceiverKind kind = ReceiverKind::planar) {
    CalculationSurface surface;
    surface.name = "plane";
    surface.corner = {-size / 2, -size / 2, height};
    surface.u = {size, 0, 0};
    surface.v = {0, size, 0};
    surface.normal = surface.up = {0, 0, 1};
    surface.points = points;
    surface.kind = kind;
    return surface;
}

inline IlluminanceReport measure(Job job, const CalculationSurface& surface, int samples, int threads = 2) {
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {threads};
    options.most_samples = samples;
    return illuminance_on(std::vector{surface}, std::move(job), options, silent);
}
inline IlluminanceReport measure(const std::string& world, const CalculationSurface& surface, int samples,
                                 int threads = 2) {
    return measure(job_of(world), surface, samples, threads);
}

using Truth = std::function<double(const V3d&)>;

// Returns how many intervals, scaled by `share`, miss the truth, and the number of all. `rounding` is
// relative and allows for single precision.
inline std::pair<int, int> misses(const SurfaceIlluminance& found, const Truth& truth, double share = 1,
                                  double rounding = 1e-5) {
    int missed = 0;
    for (int y = 0; y < found.surface.points.y; ++y) {
        for (int x = 0; x < found.surface.points.x; ++x) {
            const Reading95& reading = found.at(x, y).all;
            const double e = truth(found.surface.position(x, y));
            missed += std::fabs(reading.value - e) > share * reading.half_width + rounding * e;
        }
    }
    return {missed, static_cast<int>(found.points.size())};
}

// Returns whether the misses are at most as many as 95 % intervals have (exact values have none).
inline bool as_stated(const std::pair<int, int>& missed) {
    const boost::math::binomial of(missed.second, 0.05);
    return missed.first == 0 || cdf(complement(of, missed.first - 1)) > kFalseAlarm;
}

inline void expect_as_stated(const SurfaceIlluminance& found, const Truth& truth, double rounding = 1e-5) {
    const auto missed = misses(found, truth, 1, rounding);
    EXPECT_TRUE(as_stated(missed)) << missed.first << " of " << missed.second;
    double mean = 0;
    for (int y = 0; y < found.surface.points.y; ++y) {
        for (int x = 0; x < found.surface.points.x; ++x)
            mean += truth(found.surface.position(x, y)) / static_cast<double>(found.points.size());
    }
    EXPECT_NEAR(found.mean.value, mean, 2 * found.mean.half_width + rounding * mean);  // 4 sigma
}

// Returns the illuminance of a horizontal plane under a parallel disc of radiance l and radius r at height h,
// d beside its axis.
inline double under_disc(double l, double d, double h, double r) {
    const double a = d * d + h * h + r * r;
    return kPiD * l / 2 * (1 - (d * d + h * h - r * r) / std::sqrt(a * a - 4 * r * r * d * d));
}

}  // namespace lucerna::testing
