#include "engine/scene/quadric.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/vec.h"

namespace lucerna {
namespace {

constexpr double kTwoPi = 6.28318530717958647692;
using Kind = Quadric::Kind;

const char* name_of(Kind kind) {
    constexpr const char* names[] = {"sphere", "disk", "cylinder", "cone", "paraboloid", "hyperboloid"};
    return names[static_cast<std::size_t>(kind)];
}

void require(bool good, Kind kind, const char* what, double value, const char* accepted) {
    if (!good)
        throw InputError(fmt::format("{}: {} is {}; expected {}", name_of(kind), what, value, accepted));
}

M44d inverse_of(const M44d& m, Kind kind) {
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

// Returns the angle in [0, 2π).
double turned_positive(double phi) {
    return phi < 0 ? phi + kTwoPi : phi;
}

}  // namespace

double QuadricShape::Profile::rest(const V3d& p) const {
    const double z = p.z - z_zero;
    return sqr(p.x) + sqr(p.y) - ((a * z + 2 * b) * z + c);
}

V3d QuadricShape::Profile::half_gradient(const V3d& p) const {
    return {p.x, p.y, -(a * (p.z - z_zero) + b)};
}

QuadricShape::QuadricShape(const Quadric& q)
    : kind_(q.kind),
      radius_(static_cast<double>(q.radius)),
      inner_radius_(static_cast<double>(q.inner_radius)),
      height_(static_cast<double>(q.height)),
      p1_(q.p1),
      p2_(q.p2),
      z_min_(static_cast<double>(q.z_min)),
      z_max_(static_cast<double>(q.z_max)),
      phi_max_(std::min(kTwoPi, static_cast<double>(q.phi_max))),
      whole_z_(false),
      whole_phi_(q.phi_max >= 2 * kPi),
      reverse_(q.traits.reverse_orientation),
      world_from_object_(q.world_from_object),
      object_from_world_(inverse_of(q.world_from_object, q.kind)) {
    if (kind_ == Kind::sphere) {
        z_min_ = std::max(-radius_, z_min_);
        z_max_ = std::min(radius_, z_max_);
        whole_z_ = z_min_ <= -radius_ && z_max_ >= radius_;
    } else if (kind_ == Kind::cone) {
        z_min_ = 0;
        z_max_ = height_;
    } else if (kind_ == Kind::hyperboloid) {
        z_min_ = std::min(p1_.z, p2_.z);
        z_max_ = std::max(p1_.z, p2_.z);
    }
    check();
    if (whole_phi_) phi_max_ = kTwoPi;
    make_profile();
    box_ = compute_box();
    // The slack covers the float32 rounding of points on the shape and of the box itself.
    const V3d size = box_.size();
    const double span = std::max({size.x, size.y, size.z});
    V3f far;
    for (int j = 0; j < 3; ++j) {
        far[j] = static_cast<float>(std::max(std::fabs(box_.min[j]), std::fabs(box_.max[j])));
    }
    const auto slack = static_cast<double>(surface_error(far, static_cast<float>(span)));
    bounds_ = {V3f(box_.min - V3d(slack)), V3f(box_.max + V3d(slack))};
    const V3f rounded = bounds_.size();
    extent_ = std::max({rounded.x, rounded.y, rounded.z});
    require(std::isfinite(extent_), kind_, "the size", static_cast<double>(extent_), "finite in float32");
}

void QuadricShape::check() const {
    require(phi_max_ > 0, kind_, "the largest angle phi", phi_max_, "greater than 0");
    if (kind_ == Kind::hyperboloid) {
        require(std::isfinite(p1_.length2()) && std::isfinite(p2_.length2()), kind_, "the length of p1 or p2",
                p1_.length() + p2_.length(), "finite");
        require(p1_.z != p2_.z, kind_, "z of both p1 and p2", p1_.z, "different heights (a disk is flat)");
        return;
    }
    require(std::isfinite(radius_) && radius_ > 0, kind_, "the radius", radius_, "greater than 0");
    if (kind_ == Kind::disk) {
        require(inner_radius_ >= 0 && inner_radius_ < radius_, kind_, "the inner radius", inner_radius_,
                "from 0 to less than the radius");
        require(std::isfinite(height_), kind_, "the height", height_, "finite");
        return;
    }
    if (kind_ == Kind::cone) {
        require(std::isfinite(height_) && height_ > 0, kind_, "the height", height_, "greater than 0");
        return;
    }
    require(std::isfinite(z_min_) && std::isfinite(z_max_), kind_, "zmin or zmax", z_max_ - z_min_, "finite");
    require(z_min_ < z_max_, kind_, "zmin", z_min_, "less than zmax");
    if (kind_ == Kind::paraboloid) require(z_max_ > 0, kind_, "zmax", z_max_, "greater than 0");
}

// check() has made sure that the divisors are not 0.
void QuadricShape::make_profile() {
    if (kind_ == Kind::cylinder) {
        profile_ = {0, 0, sqr(radius_), 0};
    } else if (kind_ == Kind::cone) {
        profile_ = {sqr(radius_ / height_), -sqr(radius_) / height_, sqr(radius_), 0};
    } else if (kind_ == Kind::paraboloid) {
        profile_ = {0, sqr(radius_) / (2 * z_max_), 0, 0};
    } else if (kind_ == Kind::hyperboloid) {
        // In the plane this is |p1 + v (p2 - p1)|², with v = (z - z1) / (z2 - z1).
        const V3d way = (p2_ - p1_) / (p2_.z - p1_.z);
        profile_ = {sqr(way.x) + sqr(way.y), p1_.x * way.x + p1_.y * way.y, sqr(p1_.x) + sqr(p1_.y), p1_.z};
    }
}

QuadricShape::Line QuadricShape::to_object(const V3d& o, const V3d& d) const {
    Line line;
    object_from_world_.multVecMatrix(o, line.o);
    object_from_world_.multDirMatrix(d, line.d);
    line.scale = line.d.length();
    line.d /= line.scale;  // > 0, because the map is invertible and d is not 0
    return line;
}

// Returns the angle about z from the beginning of the sweep, in [0, 2π).
double QuadricShape::phi_at(const V3d& p) const {
    if (kind_ != Kind::hyperboloid) return turned_positive(atan2(p.y, p.x));
    const V3d start = p1_ + v_at(p) * (p2_ - p1_);  // the point of the generating line that is swept to p
    return turned_positive(atan2(start.x * p.y - start.y * p.x, start.x * p.x + start.y * p.y));
}

double QuadricShape::v_at(const V3d& p) const {
    switch (kind_) {
        case Kind::sphere: {
            const auto theta = [&](double z) { return acos(std::clamp(z / radius_, -1.0, 1.0)); };
            return (theta(p.z) - theta(z_min_)) / (theta(z_max_) - theta(z_min_));  // z_min < z_max
        }
        case Kind::disk:
            return (radius_ - hypot(p.x, p.y)) / (radius_ - inner_radius_);  // inner < radius
        case Kind::hyperboloid:
            return (p.z - p1_.z) / (p2_.z - p1_.z);  // checked to differ
        default:
            return (p.z - z_min_) / (z_max_ - z_min_);  // z_min < z_max
    }
}

bool QuadricShape::within(const V3d& p) const {
    const bool any_height = kind_ == Kind::disk || whole_z_;
    if (!any_height && (p.z < z_min_ || p.z > z_max_)) return false;
    return whole_phi_ || phi_at(p) <= phi_max_;
}

std::optional<double> QuadricShape::nearest(const V3d& o, const V3d& d, double t_min, double t_max) const {
    const Line line = to_object(o, d);
    // The factor keeps a crossing from being found twice, because s -> t -> s may round it up.
    const double s_min = t_min * line.scale * (1 + 0x1p-50), s_max = t_max * line.scale;
    const std::optional<double> s = kind_ == Kind::sphere ? nearest_on_sphere(line, s_min, s_max)
                                    : kind_ == Kind::disk ? nearest_on_disk(line, s_min, s_max)
                                                          : nearest_on_profile(line, s_min, s_max);
    if (!s) return std::nullopt;
    return *s / line.scale;
}

std::optional<double> QuadricShape::nearest(const Ray& ray) const {
    return nearest(V3d(ray.o), V3d(ray.d), 0, static_cast<double>(ray.t_max));
}

// The half chord is computed from the distance between centre and line. b² - ac would lose all digits of a
// small distant sphere, as a difference of two numbers of the size of distance⁴.
std::optional<double> QuadricShape::nearest_on_sphere(const Line& line, double s_min, double s_max) const {
    const double middle = -line.o.dot(line.d);
    const V3d off = line.o + middle * line.d;
    const double half2 = sqr(radius_) - off.length2();
    if (!(half2 >= 0)) return std::nullopt;  // true also if the ray is NaN
    const double half = std::sqrt(half2);
    for (const double s : {middle - half, middle + half}) {
        if (s > s_min && s <= s_max && within(line.o + s * line.d)) return s;
    }
    return std::nullopt;
}

std::optional<double> QuadricShape::nearest_on_disk(const Line& line, double s_min, double s_max) const {
    if (line.d.z == 0) return std::nullopt;  // parallel: a disk seen edge-on has no thickness
    const double s = (height_ - line.o.z) / line.d.z;
    if (!(s > s_min && s <= s_max)) return std::nullopt;
    const V3d p = line.o + s * line.d;
    const double r2 = sqr(p.x) + sqr(p.y);
    if (!(r2 <= sqr(radius_) && r2 >= sqr(inner_radius_)) || !within(p)) return std::nullopt;
    return s;
}

// Solves the profile's equation along the line, A s² + 2 B s + C = 0. s is relative to the line's point
// nearest to the shape's centre, so that a distant origin loses no precision.
std::optional<double> QuadricShape::nearest_on_profile(const Line& line, double s_min, double s_max) const {
    const V3d& d = line.d;
    const double middle = -(line.o - V3d(0, 0, 0.5 * (z_min_ + z_max_))).dot(d);
    const V3d q = line.o + middle * d;
    const double a = sqr(d.x) + sqr(d.y) - profile_.a * sqr(d.z);
    const double b = profile_.half_gradient(q).dot(d);
    const double c = profile_.rest(q);
    const double discriminant = b * b - a * c;
    if (!(discriminant >= 0)) return std::nullopt;  // true also if the ray is NaN
    const double large = -(b + std::copysign(std::sqrt(discriminant), b));
    // Either quotient may be infinite or 0/0 (a line along a generator). There is no crossing then, and the
    // comparisons below reject it.
    double roots[] = {large / a, c / large};
    if (roots[1] < roots[0] || std::isnan(roots[0])) std::swap(roots[0], roots[1]);
    for (const double root : roots) {
        const double s = middle + root;
        if (s > s_min && s <= s_max && within(line.o + s * d)) return s;
    }
    return std::nullopt;
}

QuadricShape::Surface QuadricShape::at(const V3d& o, const V3d& d, double t) const {
    const Line line = to_object(o, d);
    V3d p = line.o + t * line.scale * line.d;
    // The point is moved back onto the surface, because the distance is rounded.
    if (kind_ == Kind::sphere) {
        p *= radius_ / p.length();  // > 0, because p is on the sphere up to rounding
    } else if (kind_ == Kind::disk) {
        p.z = height_;
    } else {
        const V3d g = profile_.half_gradient(p);  // one Newton step along the gradient
        if (g.length2() > 0) p -= profile_.rest(p) / (2 * g.length2()) * g;
    }
    return surface(p, phi_at(p), v_at(p));
}

QuadricShape::Surface QuadricShape::at(const Ray& ray, double t) const {
    return at(V3d(ray.o), V3d(ray.d), t);
}

QuadricShape::Surface QuadricShape::at(double u, double v) const {
    const double phi = u * phi_max_;
    const double cosine = cos(phi), sine = sin(phi);
    const auto ring = [&](double r, double z) { return V3d(r * cosine, r * sine, z); };
    V3d p;
    if (kind_ == Kind::sphere) {
        const double from = acos(std::clamp(z_min_ / radius_, -1.0, 1.0));
        const double to = acos(std::clamp(z_max_ / radius_, -1.0, 1.0));
        const double theta = from + v * (to - from);
        p = ring(radius_ * sin(theta), radius_ * cos(theta));
    } else if (kind_ == Kind::disk) {
        p = ring(radius_ - v * (radius_ - inner_radius_), height_);
    } else if (kind_ == Kind::hyperboloid) {
        const V3d start = p1_ + v * (p2_ - p1_);
        p = {start.x * cosine - start.y * sine, start.x * sine + start.y * cosine, start.z};
    } else {
        const double z = z_min_ + v * (z_max_ - z_min_);
        p = ring(std::sqrt(std::max(0.0, (profile_.a * z + 2 * profile_.b) * z + profile_.c)), z);
    }
    return surface(p, phi, v);
}

V3d QuadricShape::normal_at(const V3d& p) const {
    if (kind_ == Kind::disk) return {0, 0, 1};
    if (kind_ == Kind::sphere) return p / radius_;
    V3d n = profile_.half_gradient(p);
    if (kind_ == Kind::hyperboloid && p2_.z < p1_.z) n.negate();
    return n.length2() > 0 ? n : V3d(0, 0, 1);  // a cone's tip has no normal
}

V3d QuadricShape::derivative_v(const V3d& p, double phi) const {
    const double cosine = cos(phi), sine = sin(phi);
    const double span = z_max_ - z_min_;
    switch (kind_) {
        case Kind::sphere: {
            const double from = acos(std::clamp(z_min_ / radius_, -1.0, 1.0));
            const double to = acos(std::clamp(z_max_ / radius_, -1.0, 1.0));
            return (to - from) * V3d(p.z * cosine, p.z * sine, -hypot(p.x, p.y));
        }
        case Kind::disk:
            return (inner_radius_ - radius_) * V3d(cosine, sine, 0);
        case Kind::cylinder:
            return {0, 0, span};
        case Kind::cone:
            return {-radius_ * cosine, -radius_ * sine, height_};
        case Kind::paraboloid: {
            // This is dr/dz = b / r. It is infinite at the vertex, where the surface is normal to the axis.
            const double r = hypot(p.x, p.y);
            if (r < 1e-10 * radius_) return V3d(cosine, sine, 0) * radius_;
            return span * V3d(cosine * profile_.b / r, sine * profile_.b / r, 1);
        }
        case Kind::hyperboloid:
            break;
    }
    const V3d way = p2_ - p1_;
    return {way.x * cosine - way.y * sine, way.x * sine + way.y * cosine, way.z};
}

QuadricShape::Surface QuadricShape::surface(const V3d& p, double phi, double v) const {
    V3d dpdu(-phi_max_ * p.y, phi_max_ * p.x, 0);
    // On the axis the derivative vanishes, and any tangent serves.
    const double size = kind_ == Kind::hyperboloid ? p1_.length() + p2_.length() : radius_;
    if (dpdu.length2() < 1e-20 * sqr(size)) dpdu = phi_max_ * size * V3d(-sin(phi), cos(phi), 0);

    Surface out;
    world_from_object_.multVecMatrix(p, out.p);
    world_from_object_.multDirMatrix(dpdu, out.dpdu);
    world_from_object_.multDirMatrix(derivative_v(p, phi), out.dpdv);
    out.n = carried_normal(object_from_world_, normal_at(p)).normalized();
    if (reverse_) out.n.negate();
    const double u = phi / phi_max_;  // > 0
    out.uv = V2f(static_cast<float>(std::clamp(u, 0.0, 1.0)), static_cast<float>(std::clamp(v, 0.0, 1.0)));
    return out;
}

NormalField QuadricShape::normal_field(const V3d& at) const {
    V3d p;
    object_from_world_.multVecMatrix(at, p);
    NormalField field;
    if (kind_ == Kind::disk) return field.in_frame(object_from_world_);
    field.value = kind_ == Kind::sphere ? p : profile_.half_gradient(p);
    for (int i = 0; i < 3; ++i) field.by_position[i][i] = 1;
    if (kind_ != Kind::sphere) field.by_position[2][2] = -profile_.a;
    return field.in_frame(object_from_world_);
}

// A sphere extends along a world axis by the norm of its semi-axes' components. Any other shape is bounded by
// the cylinder of its largest radius between its lowest and highest z.
Box3d QuadricShape::compute_box() const {
    const M44d& m = world_from_object_;
    const bool ball = kind_ == Kind::sphere;
    const bool flat = kind_ == Kind::disk;
    const double from_equator = ball && z_min_ > 0 ? z_min_ : ball && z_max_ < 0 ? z_max_ : 0;
    const double radius = kind_ == Kind::hyperboloid ? std::max(hypot(p1_.x, p1_.y), hypot(p2_.x, p2_.y))
                                                     : std::sqrt(sqr(radius_) - sqr(from_equator));
    const double half = flat ? 0 : 0.5 * (z_max_ - z_min_);
    V3d centre;
    m.multVecMatrix(V3d(0, 0, flat ? height_ : 0.5 * (z_min_ + z_max_)), centre);
    V3d lower, upper;
    for (int j = 0; j < 3; ++j) {
        const double reach = radius * hypot(m[0][j], m[1][j]) + half * std::fabs(m[2][j]);
        lower[j] = centre[j] - reach;
        upper[j] = centre[j] + reach;
        if (ball) {
            const double all = radius_ * std::sqrt(sqr(m[0][j]) + sqr(m[1][j]) + sqr(m[2][j]));
            lower[j] = std::max(lower[j], m[3][j] - all);
            upper[j] = std::min(upper[j], m[3][j] + all);
        }
    }
    return {lower, upper};
}

}  // namespace lucerna
