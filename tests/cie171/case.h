// A case of CIE 171:2006: its scene, the reference values of its points, and the computed values. There are
// two references. `derived` is computed by the test, from a closed form or by numerical integration of the
// geometry; computed values must agree with it within their stated intervals. `published` comes from CIE
// 171's own tables, as transcribed by [Thompson 2026]; derived values must agree with it within the table's
// rounding, which shows that the geometry is that of the case. Where a table is known to be in error, there
// is no published value.
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "tests/support/statistics.h"

namespace lucerna::cie171 {

constexpr double kNone = NAN;  // no published value

struct Point {
    std::string name;
    double derived, published;  // in `unit`, as in the case's table
    Reading95 computed;
};

using Changes = std::vector<std::pair<std::string, std::string>>;

// Reads the scene of a case, with each first text of `changes` replaced by the second.
inline Job scene(const std::string& name, const Changes& changes = {}) {
    const std::string path = std::string(LUCERNA_SOURCE_DIR) + "/scenes/cie171/" + name;
    std::ifstream file(path);
    std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    for (const auto& [from, to] : changes) {
        EXPECT_NE(text.find(from), std::string::npos) << path << ": " << from;
        for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
            text.replace(at, from.size(), to);
    }
    Monitor silent;
    return read_scene_text(text, path, {}, Workers{2}, silent);
}

// Measures with `samples` for each of a point's sensors; all points together have 16,384 or more.
inline IlluminanceReport measure(Job job, int samples) {
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = samples;
    const std::vector<CalculationSurface> surfaces = job.surfaces;
    return illuminance_on(surfaces, std::move(job), options, silent);
}

inline const SurfaceIlluminance& surface(const IlluminanceReport& report, std::string_view name) {
    for (const SurfaceIlluminance& found : report.surfaces)
        if (found.surface.name == name) return found;
    throw std::out_of_range(std::string(name));
}

inline Reading95 scaled(const Reading95& reading, double factor) {
    return {reading.value * factor, reading.half_width * factor};
}

// Appends rows of docs/results/cie171.md to the file that LUCERNA_CIE171_ROWS names.
inline void write_rows(const std::string& title, const std::string& unit, const std::vector<Point>& points) {
    const char* name = std::getenv("LUCERNA_CIE171_ROWS");
    if (name == nullptr) return;
    std::ofstream out(name, std::ios::app);
    for (const Point& point : points) {
        out << fmt::format("| {} | {} | {} | {:.4g} | {:.4g} ± {:.2g} | {} | {:+.2f} % |\n", title,
                           point.name,
                           std::isnan(point.published) ? "–" : fmt::format("{:.4g}", point.published),
                           point.derived, point.computed.value, point.computed.half_width, unit,
                           point.derived == 0 ? 0 : 100 * (point.computed.value / point.derived - 1));
    }
}

// Expects at most as many points outside their intervals as 95 % allow, none of them far outside, and no
// interval wider than `precision` of the value, so that agreement is significant.
inline void expect_as_stated(const std::string& title, const std::string& unit, double precision,
                             const std::vector<Point>& points) {
    write_rows(title, unit, points);
    int missed = 0;
    for (const Point& point : points) {
        const double off = std::fabs(point.computed.value - point.derived);
        const double exact = 1e-3 * point.derived;  // error of the numerical integral
        missed += off > point.computed.half_width + exact;
        // The bound is at least 5.9 standard errors.
        EXPECT_LE(off, 3 * point.computed.half_width + exact)
            << title << ' ' << point.name << ": " << point.computed.value << " ± "
            << point.computed.half_width << ", not " << point.derived;
        EXPECT_LE(point.computed.half_width, precision * point.derived) << title << ' ' << point.name;
    }
    const boost::math::binomial of(static_cast<double>(points.size()), 0.05);
    EXPECT_TRUE(missed == 0 || cdf(complement(of, missed - 1)) > testing::kFalseAlarm)
        << title << ": " << missed << " of " << points.size() << " outside";
}

// Expects the derived values to agree with the table, within `rounding` of the table and `share` of the
// value.
inline void expect_as_published(const std::string& title, double rounding, double share,
                                const std::vector<Point>& points) {
    for (const Point& point : points) {
        if (std::isnan(point.published)) continue;
        EXPECT_NEAR(point.derived, point.published, rounding + share * point.published)
            << title << ' ' << point.name;
    }
}

// Returns the configuration factor of a polygon in front of the point's plane, by Lambert's contour integral.
// It is positive if the corners run clockwise as seen from the point.
inline double factor(const V3d& p, const V3d& normal, const std::vector<V3d>& corners) {
    double sum = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const V3d a = (corners[i] - p).normalized(), b = (corners[(i + 1) % corners.size()] - p).normalized();
        const V3d across = a.cross(b);
        const double sine = across.length();
        if (sine > 0) sum += std::atan2(sine, a.dot(b)) * normal.dot(across) / sine;
    }
    return std::fabs(sum) / (2 * kPiD);
}

}  // namespace lucerna::cie171
