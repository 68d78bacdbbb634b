// A ray meets the patch where its line touches the segment between the two u-edges at some u. The volume that
// the line and that segment span is a quadratic in u [Reshetov 2019].
#include "engine/scene/mesh.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Patches overlap by this amount at their edges, so that no ray slips through between two of them.
constexpr double kOverlap = 1e-12;

bool within_unit(double x) {
    return x >= -kOverlap && x <= 1 + kOverlap;
}

V3d corner(const BilinearMesh& mesh, std::size_t patch, std::size_t which) {
    return V3d(mesh.p[static_cast<std::size_t>(mesh.patches[patch][which])]);
}

}  // namespace

PatchShape::PatchShape(const BilinearMesh& mesh, std::size_t patch)
    : p00(corner(mesh, patch, 0)),
      p10(corner(mesh, patch, 1)),
      p01(corner(mesh, patch, 2)),
      p11(corner(mesh, patch, 3)) {}

V3d PatchShape::point(double u, double v) const {
    return (1 - u) * ((1 - v) * p00 + v * p01) + u * ((1 - v) * p10 + v * p11);
}

V3d PatchShape::normal(double u, double v) const {
    V3d n = dpdu(v).cross(dpdv(u));
    if (!(n.length2() > 0)) n = (p11 - p00).cross(p01 - p10);
    return n.length2() > 0 ? n.normalized() : V3d(0, 0, 1);  // a patch without area is never hit
}

float PatchShape::extent() const {
    double largest = 0;
    for (int i = 0; i < 3; ++i) {
        const auto [low, high] = std::minmax({p00[i], p10[i], p01[i], p11[i]});
        largest = std::max(largest, high - low);
    }
    return static_cast<float>(largest);
}

bool PatchShape::is_flat_parallelogram() const {
    return (p10 - p00 - p11 + p01).length() <= 1e-6 * static_cast<double>(extent());
}

std::optional<PatchShape::Crossing> PatchShape::nearest(const V3d& o, const V3d& d, double t_min,
                                                        double t_max) const {
    const V3d e00 = p01 - p00, e11 = p11 - p10;
    const double c = (p10 - p00).cross(p01 - p11).dot(d);
    const double a = (p00 - o).cross(d).dot(e00);
    const double b = (p10 - o).cross(d).dot(e11) - a - c;
    const double discriminant = b * b - 4 * a * c;
    if (!(discriminant >= 0)) return std::nullopt;  // true also if the ray is NaN
    const double large = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    // Either root may be infinite or 0/0 (a line in the patch's plane), which within_unit() rejects.
    const double roots[] = {large / c, a / large};

    std::optional<Crossing> best;
    for (const double u : roots) {
        if (!within_unit(u)) continue;
        const V3d pa = (1 - u) * p00 + u * p10 - o;
        const V3d edge = (1 - u) * e00 + u * e11;
        const V3d across = d.cross(edge);
        const double det = across.length2();
        if (!(det > 0)) continue;  // the ray runs along the segment: no single crossing
        const V3d n = across.cross(pa);
        const double v = n.dot(d) / det;
        const double t = n.dot(edge) / det;
        if (!within_unit(v) || !(t > t_min && t <= t_max) || (best && best->t <= t)) continue;
        best = Crossing{t, std::clamp(u, 0.0, 1.0), std::clamp(v, 0.0, 1.0)};
    }
    return best;
}

}  // namespace lucerna
