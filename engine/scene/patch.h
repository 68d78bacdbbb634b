// Bilinear patches, met exactly, in double precision.
#pragma once

#include <optional>

#include "engine/base/vec.h"
#include "engine/scene/mesh.h"

namespace lucerna {

// p(u, v) = (1-u)(1-v) p00 + u(1-v) p10 + (1-u)v p01 + uv p11
struct PatchShape {
    V3d p00, p10, p01, p11;

    PatchShape(const BilinearMesh& mesh, std::size_t patch);

    struct Crossing {
        double t, u, v;  // t in units of d's length
    };
    // The nearest with t_min < t <= t_max.
    std::optional<Crossing> nearest(const V3d& o, const V3d& d, double t_min, double t_max) const;

    V3d point(double u, double v) const;
    V3d dpdu(double v) const { return (1 - v) * (p10 - p00) + v * (p11 - p01); }
    V3d dpdv(double u) const { return (1 - u) * (p01 - p00) + u * (p11 - p10); }
    // Unit; where an edge has shrunk to a point, that of the patch as a whole.
    V3d normal(double u, double v) const;
    // Largest side of the bounds.
    float extent() const;
    bool is_flat_parallelogram() const;
};

}  // namespace lucerna
