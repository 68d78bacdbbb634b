#include "engine/pbrt/transforms.h"

#include <Imath/ImathMatrixAlgo.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

V3d row(const M44d& m, int i) {
    return {m[i][0], m[i][1], m[i][2]};
}

}  // namespace

bool is_finite(const M44d& m) {
    return std::all_of(&m[0][0], &m[0][0] + 16, [](double x) { return std::isfinite(x); });
}

M44d translation(const V3d& by) {
    M44d m;
    m.setTranslation(by);
    return m;
}

M44d scaling(const V3d& by) {
    M44d m;
    m.setScale(by);
    return m;
}

M44d rotation(double degrees, const V3d& axis) {
    // As Imath's setAxisAngle(), which takes sine and cosine from the C library.
    const auto [s, c] = sin_cos(degrees * (M_PI / 180));
    const V3d n = axis.normalized(), rest = (1 - c) * n;
    return {n.x * rest.x + c,
            n.x * rest.y + n.z * s,
            n.x * rest.z - n.y * s,
            0,
            n.y * rest.x - n.z * s,
            n.y * rest.y + c,
            n.y * rest.z + n.x * s,
            0,
            n.z * rest.x + n.y * s,
            n.z * rest.y - n.x * s,
            n.z * rest.z + c,
            0,
            0,
            0,
            0,
            1};
}

std::optional<M44d> look_at(const V3d& eye, const V3d& target, const V3d& up) {
    const V3d z = (target - eye).normalized();
    const V3d right = up.normalized().cross(z);
    if (z.length2() == 0 || !(right.length() > 1e-12)) return std::nullopt;
    const V3d x = right.normalized();
    const V3d y = z.cross(x);
    const M44d world_from_camera(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, eye.x, eye.y, eye.z,
                                 1);
    return inverse(world_from_camera);
}

M44d matrix_of(std::span<const double> sixteen) {
    M44d m;
    std::copy_n(sixteen.begin(), 16, &m[0][0]);
    // The corner may hold a divisor as a scale, which pbrt applies to points.
    const double w = m[3][3];
    const bool scaled = m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && w != 0 && w != 1;
    if (scaled) {
        for (double& x : std::span(&m[0][0], 16)) x /= w;
    }
    return m;
}

std::optional<M44d> inverse(const M44d& m) {
    const bool affine = m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && m[3][3] == 1;
    if (!affine || !is_finite(m)) return std::nullopt;
    // Normalises each axis first, so that a scene in 1e-6 units is no flatter than one in metres.
    const V3d lengths(row(m, 0).length(), row(m, 1).length(), row(m, 2).length());
    if (!(lengths.x > 0 && lengths.y > 0 && lengths.z > 0)) return std::nullopt;
    const V3d a = row(m, 0) / lengths.x, b = row(m, 1) / lengths.y, c = row(m, 2) / lengths.z;
    if (!(std::fabs(a.dot(b.cross(c))) > 1e-14)) return std::nullopt;
    try {
        const M44d result =
            m.inverse(true);  // without `true` Imath returns the identity for a singular matrix
        return is_finite(result) ? std::optional(result) : std::nullopt;
    } catch (const std::invalid_argument&) {
        return std::nullopt;
    }
}

bool swaps_handedness(const M44d& m) {
    return row(m, 0).normalized().dot(row(m, 1).cross(row(m, 2)).normalized()) < 0;
}

std::optional<double> uniform_scale(const M44d& m) {
    constexpr double kTolerance = 1e-4;
    const V3d a = row(m, 0), b = row(m, 1), c = row(m, 2);
    const double s = (a.length() + b.length() + c.length()) / 3;
    if (!(s > 0)) return std::nullopt;
    for (const V3d& axis : {a, b, c}) {
        if (!(std::fabs(axis.length() - s) <= kTolerance * s)) return std::nullopt;
    }
    const double skew = std::max({std::fabs(a.dot(b)), std::fabs(b.dot(c)), std::fabs(c.dot(a))}) / (s * s);
    return skew <= kTolerance ? std::optional(s) : std::nullopt;
}

V3d transform_point(const M44d& m, const V3d& p) {
    V3d out;
    m.multVecMatrix(p, out);
    return out;
}

V3d transform_vector(const M44d& m, const V3d& v) {
    V3d out;
    m.multDirMatrix(v, out);
    return out;
}

V3d transform_normal(const M44d& inverse_of_m, const V3d& n) {
    return {n.dot(row(inverse_of_m, 0)), n.dot(row(inverse_of_m, 1)), n.dot(row(inverse_of_m, 2))};
}

M44d relative_to(const M44d& world_from_local, const V3d& origin) {
    M44d m = world_from_local;
    for (int i = 0; i < 3; ++i) m[3][i] -= origin[i];
    return m;
}

}  // namespace lucerna
