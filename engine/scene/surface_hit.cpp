#include "engine/scene/surface_hit.h"

#include <algorithm>
#include <cmath>

#include "engine/base/vec.h"

namespace lucerna {
namespace {

// These are pbrt's texture coordinates for a triangle that has none.
constexpr float kDefaultUv[3][2] = {{0, 0}, {1, 0}, {1, 1}};

// Sets the derivatives of position by u and v from two edges and the change of coordinates along them; uses
// an arbitrary frame where the coordinates are degenerate.
void set_tangents(Hit& hit, const V3d& e1, const V3d& e2, const V2f& uv0, const V2f& uv1, const V2f& uv2) {
    const V2f d1 = uv1 - uv0, d2 = uv2 - uv0;
    const double du1 = static_cast<double>(d1.x), dv1 = static_cast<double>(d1.y);
    const double du2 = static_cast<double>(d2.x), dv2 = static_cast<double>(d2.y);
    const double determinant = du1 * dv2 - dv1 * du2;
    hit.dpdu = V3f((dv2 * e1 - dv1 * e2) / determinant);  // may be 0/0; checked next
    hit.dpdv = V3f((du1 * e2 - du2 * e1) / determinant);
    const auto good = [](const V3f& v) { return is_finite(v) && v.length2() > 0; };
    if (good(hit.dpdu) && good(hit.dpdv)) return;
    const Frame frame(hit.at.n);
    hit.dpdu = frame.s;
    hit.dpdv = frame.t;
}

// Returns the interpolated normal turned into n's hemisphere, or n itself if it is degenerate.
V3f shading_normal(const V3f& interpolated, const V3f& n) {
    const float length = interpolated.length();
    if (!(length > 0) || !std::isfinite(length)) return n;
    return face_forward(interpolated / length, n);
}

float extent_of(const V3d& e1, const V3d& e2) {
    double largest = 0;
    for (int i = 0; i < 3; ++i) {
        largest = std::max({largest, std::fabs(e1[i]), std::fabs(e2[i]), std::fabs(e1[i] - e2[i])});
    }
    return static_cast<float>(largest);
}

std::size_t corner(const V3i& triangle, int c) {
    return static_cast<std::size_t>(triangle[c]);
}

V2f uv_of(const Mesh& mesh, const V3i& triangle, int c) {
    return mesh.uv.empty() ? V2f(kDefaultUv[c][0], kDefaultUv[c][1]) : mesh.uv[corner(triangle, c)];
}

// Holds a triangle's first corner, and its edges from there to the others.
struct TriangleEdges {
    V3d p0, e1, e2;

    TriangleEdges(const Mesh& mesh, const V3i& triangle)
        : p0(mesh.p[corner(triangle, 0)]),
          e1(V3d(mesh.p[corner(triangle, 1)]) - p0),
          e2(V3d(mesh.p[corner(triangle, 2)]) - p0) {}
};

// Returns the tangent if float32 holds it as a finite vector other than 0, else the fallback.
V3f tangent_or(const V3d& tangent, const V3f& fallback) {
    const V3f t(tangent);
    return is_finite(t) && t.length2() > 0 ? t : fallback;
}

}  // namespace

// ---- triangles

namespace {

// Implements [Möller and Trumbore 1997] in double.
std::optional<TrianglePoint> point_of(const TriangleEdges& edges, const LocalRay& ray) {
    const auto& [p0, e1, e2] = edges;
    const V3d across = ray.d.cross(e2);
    const double determinant = e1.dot(across);
    const V3d from = ray.o - p0;
    const V3d turned = from.cross(e1);
    const double t = e2.dot(turned) / determinant;
    if (determinant == 0 || !std::isfinite(t)) return std::nullopt;
    const double b1 = std::clamp(from.dot(across) / determinant, 0.0, 1.0);
    const double b2 = std::clamp(ray.d.dot(turned) / determinant, 0.0, 1 - b1);
    return TrianglePoint{t, b1, b2};
}

void set_hit(Hit& hit, const Mesh& mesh, const V3i& t, const TriangleEdges& edges, float b1, float b2) {
    const auto& [p0, e1, e2] = edges;
    const float b0 = 1 - b1 - b2;
    hit.at.p = V3f(p0 + static_cast<double>(b1) * e1 + static_cast<double>(b2) * e2);
    hit.at.n = V3f(unit(e1.cross(e2)));  // not 0, because degenerate triangles were left out
    if (mesh.traits.reverse_orientation) hit.at.n.negate();
    hit.at.error = surface_error(hit.at.p, extent_of(e1, e2));
    const V2f uv0 = uv_of(mesh, t, 0), uv1 = uv_of(mesh, t, 1), uv2 = uv_of(mesh, t, 2);
    hit.uv = b0 * uv0 + b1 * uv1 + b2 * uv2;
    set_tangents(hit, e1, e2, uv0, uv1, uv2);
    hit.ns = hit.at.n;
    if (!mesh.n.empty()) {
        hit.ns = shading_normal(
            b0 * mesh.n[corner(t, 0)] + b1 * mesh.n[corner(t, 1)] + b2 * mesh.n[corner(t, 2)], hit.at.n);
    }
}

}  // namespace

std::optional<TrianglePoint> triangle_point(const Mesh& mesh, std::uint32_t triangle, const LocalRay& ray) {
    return point_of(TriangleEdges(mesh, mesh.triangles[triangle]), ray);
}

V2f triangle_uv(const Mesh& mesh, std::uint32_t triangle, float b1, float b2) {
    const V3i& t = mesh.triangles[triangle];
    return (1 - b1 - b2) * uv_of(mesh, t, 0) + b1 * uv_of(mesh, t, 1) + b2 * uv_of(mesh, t, 2);
}

Hit triangle_hit(const Mesh& mesh, std::uint32_t triangle, float b1, float b2) {
    const V3i& t = mesh.triangles[triangle];
    Hit hit;
    set_hit(hit, mesh, t, TriangleEdges(mesh, t), b1, b2);
    return hit;
}

void triangle_hit(const Mesh& mesh, const PrimitiveHit& embrees, const LocalRay& ray, Hit& hit) {
    const V3i& t = mesh.triangles[embrees.primitive];
    const TriangleEdges edges(mesh, t);
    const auto exact = point_of(edges, ray);
    const auto [along, b1, b2] = exact ? *exact : TrianglePoint{embrees.t, embrees.u, embrees.v};
    set_hit(hit, mesh, t, edges, static_cast<float>(b1), static_cast<float>(b2));
    hit.t = static_cast<float>(exact ? ahead(along) : along);
}

NormalField triangle_normal_field(const Mesh& mesh, std::uint32_t triangle, const PrimitiveHit& exact) {
    const V3i& t = mesh.triangles[triangle];
    const auto [p0, e1, e2] = TriangleEdges(mesh, t);
    NormalField field;
    if (mesh.n.empty()) {
        field.value = e1.cross(e2);
        return field;
    }
    const V3d n0(mesh.n[corner(t, 0)]), n1(mesh.n[corner(t, 1)]), n2(mesh.n[corner(t, 2)]);
    field.value = (1 - exact.u - exact.v) * n0 + exact.u * n1 + exact.v * n2;
    // The weights' gradients are the edges' dual vectors. The denominator is the squared double area, > 0.
    const V3d across = e1.cross(e2);
    const V3d g1 = e2.cross(across) / across.length2(), g2 = across.cross(e1) / across.length2();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            field.by_position[i][j] = (n1[i] - n0[i]) * g1[j] + (n2[i] - n0[i]) * g2[j];
    }
    return field;
}

// ---- quadrics

Hit quadric_hit(const QuadricShape& shape, const LocalRay& ray, double t) {
    const QuadricShape::Surface surface = shape.at(ray.o, ray.d, t);
    Hit hit;
    hit.at.p = V3f(surface.p);
    hit.at.n = V3f(surface.n);
    hit.at.error = surface_error(hit.at.p, shape.extent());
    hit.ns = hit.at.n;
    const Frame frame(hit.at.n);
    hit.dpdu = tangent_or(surface.dpdu, frame.s);
    hit.dpdv = tangent_or(surface.dpdv, frame.t);
    hit.uv = surface.uv;
    return hit;
}

// ---- bilinear patches

namespace {

template <typename Value>
Value blend(const std::vector<Value>& values, const std::array<std::int32_t, 4>& corners, double u,
            double v) {
    const double weights[] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    Value sum(0.0F);
    for (std::size_t i = 0; i < 4; ++i) {
        sum += static_cast<float>(weights[i]) * values[static_cast<std::size_t>(corners[i])];
    }
    return sum;
}

}  // namespace

V2f patch_uv(const BilinearMesh& mesh, std::uint32_t patch, double u, double v) {
    if (mesh.uv.empty()) return {static_cast<float>(u), static_cast<float>(v)};
    return blend(mesh.uv, mesh.patches[patch], u, v);
}

Hit patch_hit(const BilinearMesh& mesh, std::uint32_t patch, double u, double v) {
    const PatchShape shape(mesh, patch);
    Hit hit;
    hit.at.p = V3f(shape.point(u, v));
    V3d n = shape.normal(u, v);
    const V3f interpolated = mesh.n.empty() ? V3f(0.0F) : blend(mesh.n, mesh.patches[patch], u, v);
    const bool turn = mesh.n.empty() ? mesh.traits.reverse_orientation : n.dot(V3d(interpolated)) < 0;
    hit.at.n = V3f(turn ? -n : n);
    hit.at.error = surface_error(hit.at.p, shape.extent());
    hit.ns = shading_normal(interpolated, hit.at.n);
    hit.uv = patch_uv(mesh, patch, u, v);
    const V3d dpdu = shape.dpdu(v), dpdv = shape.dpdv(u);
    if (mesh.uv.empty()) {
        const Frame frame(hit.at.n);
        hit.dpdu = tangent_or(dpdu, frame.s);
        hit.dpdv = tangent_or(dpdv, frame.t);
    } else {
        const auto at = [&](std::size_t c) {
            return mesh.uv[static_cast<std::size_t>(mesh.patches[patch][c])];
        };
        const auto fu = static_cast<float>(u), fv = static_cast<float>(v);
        const V2f by_u = (1 - fv) * (at(1) - at(0)) + fv * (at(3) - at(2));
        const V2f by_v = (1 - fu) * (at(2) - at(0)) + fu * (at(3) - at(1));
        set_tangents(hit, dpdu, dpdv, V2f(0, 0), by_u, by_v);
    }
    return hit;
}

// ---- curves

CurveShape::CurveShape(const Curves& curves, std::size_t segment) {
    for (std::size_t i = 0; i < 4; ++i) {
        const Curves::V4f& c = curves.control[4 * segment + i];
        p[i] = V3d(static_cast<double>(c.x), static_cast<double>(c.y), static_cast<double>(c.z));
        r[i] = static_cast<double>(c.w);
    }
}

V3d CurveShape::point(double u) const {
    const double w = 1 - u;
    return w * w * w * p[0] + 3 * u * w * w * p[1] + 3 * u * u * w * p[2] + u * u * u * p[3];
}

double CurveShape::radius(double u) const {
    const double w = 1 - u;
    return w * w * w * r[0] + 3 * u * w * w * r[1] + 3 * u * u * w * r[2] + u * u * u * r[3];
}

V3d CurveShape::derivative(double u) const {
    const double w = 1 - u;
    V3d d = 3.0 * (w * w * (p[1] - p[0]) + 2 * u * w * (p[2] - p[1]) + u * u * (p[3] - p[2]));
    if (!(d.length2() > 0)) d = p[3] - p[0];  // repeated control point at the end
    return d.length2() > 0 ? d : V3d(0, 0, 1);
}

V2f curve_uv(const Curves& curves, std::uint32_t segment, float u, float v) {
    const Curves::Segment& part = curves.segments[segment];
    const float along = part.u_from + u * (part.u_to - part.u_from);
    switch (curves.kind) {
        case Curves::Kind::flat:
            return {along, 0.5F - 0.5F * v};
        case Curves::Kind::round:
            return {along, 0.5F};
        case Curves::Kind::ribbon:
            return {along, v};
    }
    return {along, v};
}

Hit curve_hit(const Curves& curves, const CurvePoint& at, const LocalRay& ray, double t) {
    const CurveShape shape(curves, at.segment);
    const auto u = static_cast<double>(at.u);
    const V3d centre = shape.point(u);
    const double r = shape.radius(u);
    const Curves::Segment& part = curves.segments[at.segment];
    // The derivative by the whole curve's u is longer for many segments; u_from < u_to.
    const V3d dpdu = shape.derivative(u) / static_cast<double>(part.u_to - part.u_from);
    V3d p = ray.at(t), n(at.n), across;
    Hit hit;
    hit.uv = curve_uv(curves, at.segment, at.u, at.v);
    if (curves.kind == Curves::Kind::flat) {
        across = dpdu.cross(ray.d);  // the band faces the ray; along the curve it is seen edge-on
        n = dpdu.cross(across);
    } else {
        if (curves.traits.reverse_orientation) n.negate();
        across = n.cross(dpdu);
        if (curves.kind == Curves::Kind::ribbon) {
            across = V3d(at.n).cross(dpdu);
            p = centre + (2 * static_cast<double>(at.v) - 1) * r * across.normalized();
        } else {
            // On a tube, v runs from one silhouette to the other, as pbrt's does across its band.
            const V3d side = dpdu.cross(ray.d).normalized();
            const double offset = r > 0 ? std::clamp((p - centre).dot(side) / r, -1.0, 1.0) : 0.0;
            hit.uv.y = static_cast<float>(0.5 + 0.5 * offset);
        }
    }
    hit.at.p = V3f(p);
    hit.at.n = V3f(n.normalized());
    if (!(hit.at.n.length2() > 0)) hit.at.n = V3f(-ray.d.normalized());
    hit.at.error = surface_error(hit.at.p, static_cast<float>((shape.p[3] - shape.p[0]).length() + 2 * r)) +
                   static_cast<float>(1e-3 * r);  // tolerance of Embree's own search
    hit.ns = hit.at.n;
    const Frame frame(hit.at.n);
    hit.dpdu = tangent_or(dpdu, frame.s);
    hit.dpdv = tangent_or(across.normalized() * (2 * r), frame.t);
    return hit;
}

// ---- instances

namespace {

// Returns an upper bound of the length that the map gives a unit vector (the Frobenius norm).
float largest_stretch(const M44d& m) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) sum += sqr(m[i][j]);
    }
    return static_cast<float>(std::sqrt(sum));
}

V3f carried(const M44d& m, const V3f& v) {
    V3d out;
    m.multDirMatrix(V3d(v), out);
    return V3f(out);
}

}  // namespace

// The map is rounded to float32 as in Embree, so that both use the same one.
InstancePlacement::InstancePlacement(const M44d& world_from_local) {
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
            to_world[i][j] = static_cast<double>(static_cast<float>(world_from_local[i][j]));
        }
    }
    to_local = to_world.inverse();
    scale = largest_stretch(to_world);
    inverse_scale = largest_stretch(to_local);
    reach = static_cast<float>(to_local.translation().length());
}

LocalRay InstancePlacement::local(const Ray& ray) const {
    LocalRay out;
    to_local.multVecMatrix(V3d(ray.o), out.o);
    to_local.multDirMatrix(V3d(ray.d), out.d);
    return out;
}

Hit InstancePlacement::world(const Hit& hit) const {
    const auto normal = [this](const V3f& n) { return V3f(carried_normal(to_local, V3d(n)).normalized()); };
    Hit out = hit;
    V3d p;
    to_world.multVecMatrix(V3d(hit.at.p), p);
    out.at.p = V3f(p);
    out.at.n = normal(hit.at.n);
    out.ns = face_forward(normal(hit.ns), out.at.n);  // a stretch may turn it past the horizon
    out.dpdu = carried(to_world, hit.dpdu);
    out.dpdv = carried(to_world, hit.dpdv);
    // The error includes the prototype's own error and the rounding of the ray's transformation.
    const float far = std::max({std::fabs(out.at.p.x), std::fabs(out.at.p.y), std::fabs(out.at.p.z)});
    out.at.error = scale * (hit.at.error + kSurfaceUlps * (inverse_scale * far + reach)) + kSurfaceUlps * far;
    return out;
}

}  // namespace lucerna
