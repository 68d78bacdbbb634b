// Shapes in light that gives irradiance 1, or none, where an estimate is evaluated, with the photons on them:
// the bias of an estimate is then due to the metric of photon distances alone.
//
// Lengths are in units of the estimate's radius.
#pragma once

#include <fmt/core.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "photon/tangent_metric.h"

namespace lucerna::testing {

struct DepositedPhoton {
    V3f p, n;  // position; normal on the side that was hit
    V3f d;     // direction of travel
};

struct LitShape {
    std::string name;
    double size;   // the shape's parameter; see below
    double t;      // distance of the point from an edge or a corner
    V3f x, n;      // point and normal of the estimate
    double exact;  // exact irradiance there
    double area;   // area on which photons land uniformly, with irradiance 1
    std::function<DepositedPhoton(Sampler&)> photon;  // draws the same numbers for any photon
};

inline constexpr float kShapeReach = 9;  // photons farther away are in no ball of ratio <= 8

inline V3f cosine_to(const V3f& n, const V2f& u) {
    return -Frame(n).to_world(square_to_cosine_hemisphere(u));
}

// The floor z = 0 (x > 0) and an infinite wall x = 0 (z > 0): each hides half of the other's sky, so both
// receive 1 from a sky of radiance 2/π.
inline LitShape concave_corner(float t) {
    return {"corner",
            0,
            static_cast<double>(t),
            {t, 0, 0},
            {0, 0, 1},
            1,
            4.0 * sqr(double{kShapeReach}),
            [](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const V2f u = s.next2();
                const bool floor = s.next() < 0.5F;
                const V3f n = floor ? V3f(0, 0, 1) : V3f(1, 0, 0);
                V3f d = cosine_to(n, u);
                (floor ? d.x : d.z) = -std::fabs(floor ? d.x : d.z);
                const float a = kShapeReach * at.x, y = kShapeReach * (2 * at.y - 1);
                return {floor ? V3f(a, y, 0) : V3f(0, y, a), n, d};
            }};
}

// The same floor and wall in parallel light that falls towards the wall, `degrees` (0 to 90) from the
// vertical: the floor receives 1, the wall the tangent of the angle.
inline LitShape corner_in_sunlight(float t, float degrees) {
    const float angle = degrees * kPi / 180;
    const float wall = std::tan(angle);
    return {fmt::format("corner, {:g} degrees", degrees),
            static_cast<double>(degrees),
            static_cast<double>(t),
            {t, 0, 0},
            {0, 0, 1},
            1,
            2.0 * sqr(double{kShapeReach}) * static_cast<double>(1 + wall),
            [angle, wall](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const bool floor = s.next() * (1 + wall) < 1;
                const float a = kShapeReach * at.x, y = kShapeReach * (2 * at.y - 1);
                const V3f d(-std::sin(angle), 0, -std::cos(angle));
                return {floor ? V3f(a, y, 0) : V3f(0, y, a), floor ? V3f(0, 0, 1) : V3f(1, 0, 0), d};
            }};
}

// The top z = 0 (x < 0) and the side x = 0 (z < 0) of a block under a sky all around.
inline LitShape convex_edge(float t) {
    return {"edge",
            0,
            static_cast<double>(t),
            {-t, 0, 0},
            {0, 0, 1},
            1,
            4.0 * sqr(double{kShapeReach}),
            [](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const V2f u = s.next2();
                const bool top = s.next() < 0.5F;
                const V3f n = top ? V3f(0, 0, 1) : V3f(1, 0, 0);
                const float a = -kShapeReach * at.x, y = kShapeReach * (2 * at.y - 1);
                return {top ? V3f(a, y, 0) : V3f(0, y, a), n, cosine_to(n, u)};
            }};
}

// A sphere of radius R = size, lit from within or from all around. Photons lie only on the cap that a ball
// reaches.
inline LitShape sphere(float radius, bool inside) {
    const float height = std::min(2 * radius, sqr(kShapeReach) / (2 * radius));  // height of the cap
    const float pole = inside ? -radius : radius;
    return {inside ? "inside sphere" : "outside sphere",
            static_cast<double>(radius),
            0,
            {0, 0, pole},
            {0, 0, 1},
            1,
            2 * M_PI * static_cast<double>(radius * height),
            [radius, height, inside](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const float up = 1 - at.x * height / radius, phi = 2 * kPi * at.y;  // cosine to the pole
                const float across = std::sqrt(std::max(0.0F, 1 - up * up));
                const V3f out(across * std::cos(phi), across * std::sin(phi), inside ? -up : up);
                const V3f n = inside ? -out : out;
                return {radius * out, n, cosine_to(n, s.next2())};
            }};
}

// A cylinder along y of radius R = size, lit from all around.
inline LitShape cylinder(float radius) {
    const double area = 2 * M_PI * static_cast<double>(radius) * 2 * kShapeReach;
    return {"cylinder",
            static_cast<double>(radius),
            0,
            {0, 0, radius},
            {0, 0, 1},
            1,
            area,
            [radius](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const float phi = 2 * kPi * at.x;
                const V3f n(std::sin(phi), 0, std::cos(phi));
                const V3f p = radius * n + V3f(0, kShapeReach * (2 * at.y - 1), 0);
                return {p, n, cosine_to(n, s.next2())};
            }};
}

// An unlit floor under an infinite shelf at height h = size, which is lit from above.
inline LitShape under_shelf(float height) {
    return {"shelf",
            static_cast<double>(height),
            0,
            {0, 0, 0},
            {0, 0, 1},
            0,
            4.0 * sqr(double{kShapeReach}),
            [height](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const V3f p(kShapeReach * (2 * at.x - 1), kShapeReach * (2 * at.y - 1), height);
                return {p, {0, 0, 1}, cosine_to({0, 0, 1}, s.next2())};
            }};
}

// A wall without thickness, lit from behind.
inline LitShape lit_from_behind() {
    return {"behind",
            0,
            0,
            {0, 0, 0},
            {0, 0, 1},
            0,
            4.0 * sqr(double{kShapeReach}),
            [](Sampler& s) -> DepositedPhoton {
                const V2f at = s.next2();
                const V3f p(kShapeReach * (2 * at.x - 1), kShapeReach * (2 * at.y - 1), 0);
                return {p, {0, 0, -1}, cosine_to({0, 0, -1}, s.next2())};
            }};
}

struct Measure {
    const char* name;
    MetricKind kind;
    float ratio;
};
inline constexpr Measure kMeasures[] = {{"euclidean", MetricKind::euclidean, 1},
                                        {"projected, ratio 1", MetricKind::projected, 1},
                                        {"projected, ratio 1.5", MetricKind::projected, 1.5F},
                                        {"projected, ratio 2", MetricKind::projected, 2},
                                        {"projected, ratio 4", MetricKind::projected, 4},
                                        {"projected, ratio 8", MetricKind::projected, 8}};

// Returns the mean of the estimate of radius 1 for each of kMeasures, from many photons.
inline std::vector<double> mean_estimates(const LitShape& shape, KernelShape kernel_shape,
                                          std::uint32_t photons) {
    std::vector<TangentMetric> metrics;
    for (const Measure& m : kMeasures) metrics.emplace_back(shape.x, shape.n, m.kind, m.ratio);
    std::vector<double> sums(metrics.size());
    for (std::uint32_t i = 0; i < photons; ++i) {
        Sampler sampler = Sampler::stratified(1, Purpose::test, 0, i);
        const DepositedPhoton photon = shape.photon(sampler);
        const float r2 = (photon.p - shape.x).length2();
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            const float d2 = metrics[m](photon.p, photon.d, r2);
            if (d2 < 1) sums[m] += static_cast<double>(kernel(kernel_shape, d2));
        }
    }
    for (double& sum : sums) sum *= shape.area / photons;
    return sums;
}

}  // namespace lucerna::testing
