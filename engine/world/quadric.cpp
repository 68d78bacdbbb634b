#include "engine/world/quadric.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/surface_point.h"

namespace lucerna {
namespace {

constexpr double kTwoPi = 6.28318530717958647692;

const char* name_of(Quadric::Kind kind) {
    return kind == Quadric::Kind::sphere ? "sphere" : "disk";
}

void require(bool good, Quadric::Kind kind, const char* what, double value, const char* accepted) {
    if (!good)
        throw InputError(fmt::format("{}: {} is {}; accepted: {}", name_of(kind), what, value, accepted));
}

M44d inverse_of(const M44d& m, Quadric::Kind kind) {
    bool finite = true;
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) finite = finite && std::isfinite(m[i][j]);
    }
    const double determinant = m.determinant();
    require(finite && std::isfinite(determinant) && determinant != 0, kind,
            "the transformation's determinant", determinant, "a finite number other than 0");
    try {
        return m.inverse(true);
    } catch (const std::exception&) {
        require(false, kind, "the transformation's determinant", determinant, "one that can be inverted");
        throw;
    }
}

// Angle about z in [0, 2π).
double phi_of(const V3d& p) {
    const double phi = std::atan2(p.y, p.x);
    return phi < 0 ? phi + kTwoPi : phi;
}

}  // namespace

QuadricShape::QuadricShape(const Quadric& q)
    : kind_(q.kind),
      radius_(static_cast<double>(q.radius)),
      inner_radius_(static_cast<double>(q.inner_radius)),
      height_(static_cast<double>(q.height)),
      z_min_(std::max(-radius_, static_cast<double>(q.z_min))),
      z_max_(std::min(radius_, static_cast<double>(q.z_max))),
      phi_max_(std::min(kTwoPi, static_cast<double>(q.phi_max))),
      whole_z_(z_min_ <= -radius_ && z_max_ >= radius_),
      whole_phi_(q.phi_max >= 2 * kPi),
      reverse_(q.traits.reverse_orientation),
      world_from_object_(q.world_from_object),
      object_from_world_(inverse_of(q.world_from_object, q.kind)) {
    require(std::isfinite(radius_) && radius_ > 0, kind_, "the radius", radius_, "greater than 0");
    require(phi_max_ > 0, kind_, "the largest angle phi", phi_max_, "greater than 0");
    if (kind_ == Quadric::Kind::sphere) {
        require(z_min_ < z_max_, kind_, "zmin", z_min_, "less than zmax");
    } else {
        require(inner_radius_ >= 0 && inner_radius_ < radius_, kind_, "the inner radius", inner_radius_,
                "from 0 to less than the radius");
        require(std::isfinite(height_), kind_, "the height", height_, "finite");
    }
    if (whole_phi_) phi_max_ = kTwoPi;
    bounds_ = compute_bounds();
    const V3f size = bounds_.size();
    extent_ = std::max({size.x, size.y, size.z});
    require(std::isfinite(extent_), kind_, "the size", static_cast<double>(extent_), "finite in float32");
}

QuadricShape::Line QuadricShape::to_object(const Ray& ray) const {
    Line line;
    object_from_world_.multVecMatrix(V3d(ray.o), line.o);
    object_from_world_.multDirMatrix(V3d(ray.d), line.d);
    line.scale = line.d.length();
    line.d /= line.scale;  // > 0: the map is invertible and ray.d is a unit vector
    return line;
}

bool QuadricShape::within_phi(const V3d& p) const {
    return whole_phi_ || phi_of(p) <= phi_max_;
}

std::optional<double> QuadricShape::nearest(const Ray& ray) const {
    const Line line = to_object(ray);
    const double s_max = static_cast<double>(ray.t_max) * line.scale;
    const std::optional<double> s =
        kind_ == Quadric::Kind::sphere ? nearest_on_sphere(line, s_max) : nearest_on_disk(line, s_max);
    if (!s) return std::nullopt;
    return *s / line.scale;
}

// The half chord comes from the distance between centre and line, not from b² - ac, which loses all of a
// small sphere seen from afar (difference of two numbers of the size of distance⁴).
std::optional<double> QuadricShape::nearest_on_sphere(const Line& line, double s_max) const {
    const double middle = -line.o.dot(line.d);
    const V3d off = line.o + middle * line.d;
    const double half2 = sqr(radius_) - off.length2();
    if (!(half2 >= 0)) return std::nullopt;  // also when the ray is not a number
    const double half = std::sqrt(half2);
    for (const double s : {middle - half, middle + half}) {
        if (!(s > 0 && s <= s_max)) continue;
        const V3d p = line.o + s * line.d;
        if (!whole_z_ && (p.z < z_min_ || p.z > z_max_)) continue;
        if (within_phi(p)) return s;
    }
    return std::nullopt;
}

std::optional<double> QuadricShape::nearest_on_disk(const Line& line, double s_max) const {
    if (line.d.z == 0) return std::nullopt;  // parallel: seen edge-on, a disk has no thickness
    const double s = (height_ - line.o.z) / line.d.z;
    if (!(s > 0 && s <= s_max)) return std::nullopt;
    const V3d p = line.o + s * line.d;
    const double r2 = sqr(p.x) + sqr(p.y);
    if (!(r2 <= sqr(radius_) && r2 >= sqr(inner_radius_)) || !within_phi(p)) return std::nullopt;
    return s;
}

QuadricShape::Surface QuadricShape::at(const Ray& ray, double t) const {
    const Line line = to_object(ray);
    V3d p = line.o + t * line.scale * line.d;
    V3d n(0, 0, 1);
    double v = 0;
    // Put the point back on the surface, whatever the distance has rounded away.
    if (kind_ == Quadric::Kind::sphere) {
        p *= radius_ / p.length();  // > 0: p lies on the sphere but for rounding
        n = p / radius_;
        const auto theta = [&](double z) { return std::acos(std::clamp(z / radius_, -1.0, 1.0)); };
        v = (theta(p.z) - theta(z_min_)) / (theta(z_max_) - theta(z_min_));  // z_min < z_max
    } else {
        p.z = height_;
        v = (radius_ - std::hypot(p.x, p.y)) / (radius_ - inner_radius_);  // inner < radius
    }
    const double u = phi_of(p) / phi_max_;
    V3d dpdu(-phi_max_ * p.y, phi_max_ * p.x, 0);
    // On the axis the derivative vanishes; any tangent will do.
    if (dpdu.length2() < 1e-20 * sqr(radius_)) dpdu = V3d(0, phi_max_ * radius_, 0);

    Surface surface;
    world_from_object_.multVecMatrix(p, surface.p);
    world_from_object_.multDirMatrix(dpdu, surface.dpdu);
    // Normals go by the inverse transpose; with row vectors p' = p A that is n' = A⁻¹ n.
    for (int i = 0; i < 3; ++i) {
        surface.n[i] =
            object_from_world_[i][0] * n.x + object_from_world_[i][1] * n.y + object_from_world_[i][2] * n.z;
    }
    surface.n.normalize();
    if (reverse_) surface.n.negate();
    surface.uv =
        V2f(static_cast<float>(std::clamp(u, 0.0, 1.0)), static_cast<float>(std::clamp(v, 0.0, 1.0)));
    return surface;
}

// Each shape reaches ±(its half-axes' norm) along a world axis; a partial sphere also fits the image of its
// box.
Box3f QuadricShape::compute_bounds() const {
    const bool sphere = kind_ == Quadric::Kind::sphere;
    const M44d& m = world_from_object_;
    V3d centre;
    m.multVecMatrix(V3d(0, 0, sphere ? 0 : height_), centre);
    V3d reach;
    for (int j = 0; j < 3; ++j) {
        reach[j] = radius_ * std::sqrt(sqr(m[0][j]) + sqr(m[1][j]) + (sphere ? sqr(m[2][j]) : 0.0));
    }
    V3d lower = centre - reach;
    V3d upper = centre + reach;
    if (sphere && !whole_z_) {
        const double middle = 0.5 * (z_min_ + z_max_);
        const double half = 0.5 * (z_max_ - z_min_);
        m.multVecMatrix(V3d(0, 0, middle), centre);
        for (int j = 0; j < 3; ++j) {
            const double side =
                radius_ * (std::fabs(m[0][j]) + std::fabs(m[1][j])) + half * std::fabs(m[2][j]);
            lower[j] = std::max(lower[j], centre[j] - side);
            upper[j] = std::min(upper[j], centre[j] + side);
        }
    }
    // Room for the float32 rounding of points on the shape and of the box itself.
    const V3d size = upper - lower;
    const double span = std::max({size.x, size.y, size.z});
    const V3f far(static_cast<float>(std::max(std::fabs(lower.x), std::fabs(upper.x))),
                  static_cast<float>(std::max(std::fabs(lower.y), std::fabs(upper.y))),
                  static_cast<float>(std::max(std::fabs(lower.z), std::fabs(upper.z))));
    const auto slack = static_cast<double>(surface_error(far, static_cast<float>(span)));
    return {V3f(lower - V3d(slack)), V3f(upper + V3d(slack))};
}

}  // namespace lucerna
