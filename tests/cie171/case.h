// A case of CIE 171:2006: its scene, what its points must read, and what they read.
//
// Two references stand beside each other. `derived` is worked out by the test, by a closed form or by
// numerical integration of the geometry; computed values are held to it within their stated intervals.
// `published` is of CIE 171's own tables, as [Thompson 2026] transcribes them: derived values are held to it
// within the table's rounding, which is what shows that the geometry is the case's; where a table is known to
// be in error there is none.
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
    double derived, published;  // in `unit`, as the case's table has them
    Reading95 computed;
};

using Changes = std::vector<std::pair<std::string, std::string>>;

// The scene of a case, with each first text replaced by the second.
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

// `samples` of each of a point's heads, of which all points together have 16,384 or more.
inline IlluminanceReport measure(Job job, int samples) {
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = samples;
    const std::vector<CalculationSurface> surfaces = job.surfaces;
    return illuminance_on(surfaces, std::move(job), options, silent);
}

inline const SurfaceIlluminance& surface(const IlluminanceReport& report, const std::string& name) {
    for (const SurfaceIlluminance& found : report.surfaces)
        if (found.surface.name == name) return found;
    throw std::out_of_range(name);
}

inline Reading95 scaled(const Reading95& reading, double factor) {
    return {reading.value * factor, reading.half_width * factor};
}

// Rows of docs/results/cie171.md, added to the file that LUCERNA_CIE171_ROWS names.
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

// As many of the points outside their intervals as 95 % leave, or fewer, none of them far outside, and
// intervals no wider than `precision` of the value: so that what agrees does so for a reason.
inline void expect_as_stated(const std::string& title, const std::string& unit, double precision,
                             const std::vector<Point>& points) {
    write_rows(title, unit, points);
    int missed = 0;
    for (const Point& point : points) {
        const double off = std::fabs(point.computed.value - point.derived);
        const double exact = 1e-3 * point.derived;  // of the numerical integral
        missed += off > point.computed.half_width + exact;
        // 5.9 standard errors and more.
        EXPECT_LE(off, 3 * point.computed.half_width + exact)
            << title << ' ' << point.name << ": " << point.computed.value << " ± "
            << point.computed.half_width << ", not " << point.derived;
        EXPECT_LE(point.computed.half_width, precision * point.derived) << title << ' ' << point.name;
    }
    const boost::math::binomial of(static_cast<double>(points.size()), 0.05);
    EXPECT_TRUE(missed == 0 || cdf(complement(of, missed - 1)) > testing::kFalseAlarm)
        << title << ": " << missed << " of " << points.size() << " outside";
}

// What the test works out is what the table has, to `rounding` of the table and `share` of the value.
inline void expect_as_published(const std::string& title, double rounding, double share,
                                const std::vector<Point>& points) {
    for (const Point& point : points) {
        if (std::isnan(point.published)) continue;
        EXPECT_NEAR(point.derived, point.published, rounding + share * point.published)
            << title << ' ' << point.name;
    }
}

// Configuration factor of a polygon that lies before the plane of the point, by Lambert's contour integral;
// it counts where its corners go round clockwise as seen from the point.
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
