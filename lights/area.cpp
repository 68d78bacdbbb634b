// Diffuse area lights: constant radiance over triangles, a disk or a sphere.
//
// Emission is uniform in area and cosine-weighted, so all particles have the same weight. Towards a point x,
// triangles and disks are sampled uniformly in area: pdf_w = d² / (A cosθ). A sphere is sampled uniformly in
// the cone that it subtends from outside [Shirley 1996, 3.2], and uniformly in area from inside.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "engine/base/cdf.h"
#include "engine/base/elementary.h"
#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"
#include "lights/triangle_parts.h"

namespace lucerna {
namespace {

constexpr double kTwoPi = 6.28318530717958647692;

// A point of an emitter, with its unit normal on the emitting side and the extent of the shape it lies on.
struct Place {
    V3d p, n;
    float extent;  // scene units
    CellId part = kNoCell;

    SurfacePoint surface() const {
        const V3f q(p);
        return {q, V3f(n), surface_error(q, extent)};
    }
};

// Returns the gap before the emitter at which a shadow ray from distance d ends: both ends' rounding errors.
double end_gap(const Place& y, double d) {
    return static_cast<double>(surface_error(V3f(y.p), y.extent + static_cast<float>(d)));
}

// The emission shared by all shapes: a constant radiance on either side. A side is chosen by its share of the
// light.
class Lambertian {
  public:
    Lambertian(const Rgb& front, const Rgb& back)
        : front_(front), back_(back), front_share_(share_of(front, back)) {}

    // Returns the radiance on the side given by the cosine's sign; black where that side does not emit.
    const Rgb& radiance(double cosine) const { return cosine > 0 ? front_ : back_; }
    bool shines_front() const { return !is_black(front_); }
    bool shines_back() const { return !is_black(back_); }
    bool two_sided() const { return shines_back(); }
    Rgb flux(double area) const { return (front_ + back_) * static_cast<float>(0.5 * kTwoPi * area); }

    // The weight L cosθ / (pdf_a pdf_w) is the side's flux over its share, for any place and direction.
    std::optional<LeSample> sample_Le(const Place& place, V2f u, double area) const {
        const bool back = !(u.x < front_share_);
        const float share = back ? 1 - front_share_ : front_share_, before = back ? front_share_ : 0;
        const Rgb weight =
            (back ? back_ : front_) * (static_cast<float>(0.5 * kTwoPi * area) / share);  // share > 0
        if (is_black(weight) || !is_finite(weight)) return std::nullopt;
        u.x = std::min((u.x - before) / share, kBelowOne);
        const SurfacePoint from = place.surface();
        V3f local = square_to_cosine_hemisphere(u);
        if (back) local.z = -local.z;
        return LeSample{from, unit(Frame(from.n).to_world(local)), weight};
    }

    // Returns the sample from x to a place that was chosen uniformly in area.
    std::optional<LightSample> towards(const Place& y, const V3f& x, double area) const {
        const V3d way = y.p - V3d(x);
        const double d2 = way.length2();
        if (!(d2 > 0)) return std::nullopt;
        const double d = std::sqrt(d2);
        const double facing = -y.n.dot(way) / d;
        const double cos_y = std::fabs(facing);
        if (!(cos_y > 0) || is_black(radiance(facing))) return std::nullopt;
        // The ray ends `gap` in front of the emitter's plane; points closer than that lie in the plane
        // themselves.
        const double distance = d - end_gap(y, d) / cos_y;
        if (!(distance > 0)) return std::nullopt;
        return sample_towards(way / d, distance, d2 / (area * cos_y), radiance(facing));
    }

    static std::optional<LightSample> sample_towards(const V3d& w, double distance, double pdf_w,
                                                     const Rgb& radiance) {
        const auto pdf = static_cast<float>(pdf_w);
        const Rgb weight = radiance * static_cast<float>(1 / pdf_w);
        if (is_black(weight) || !is_finite(weight) || !(pdf > 0) || !std::isfinite(pdf)) return std::nullopt;
        return LightSample{V3f(w), static_cast<float>(distance), weight, pdf};
    }

    // Returns the emission towards a ray that met the emitter at distance t, with the density of towards().
    EmittedRadiance Le_by_area(const Ray& ray, float t, const V3f& n, double area) const {
        const auto facing = static_cast<double>(-n.dot(ray.d));
        const double cos_y = std::fabs(facing);
        const Rgb& seen = radiance(facing);
        if (!(cos_y > 0) || is_black(seen)) return {Rgb(0.0F), 0, t};
        return {seen, static_cast<float>(sqr(static_cast<double>(t)) / (area * cos_y)), t};
    }

  private:
    // Uses the largest channel, which is positive wherever there is light.
    static float share_of(const Rgb& front, const Rgb& back) {
        const float f = max_component(front), b = max_component(back);
        return b > 0 ? f / (f + b) : 1.0F;
    }

    Rgb front_, back_;  // W/(m² sr)
    float front_share_;
};

class Triangles {
  public:
    explicit Triangles(TriangleEmitter shape) : shape_(std::move(shape)) {
        std::vector<double> areas;
        areas.reserve(shape_.triangles.size());
        for (const V3i& triangle : shape_.triangles) {
            const double area = 0.5 * cross(triangle).length();
            areas.push_back(std::isfinite(area) ? area : 0.0);  // the scene leaves such triangles out, too
        }
        by_area_ = Cdf(areas);
        for (std::size_t i = 0; i < shape_.triangles.size(); ++i) {
            pieces_.push_back(areas[i] > 0 ? piece(shape_.triangles[i]) : Piece{});
        }
        make_parts(areas);
    }

    double area() const { return by_area_.total(); }
    // Draws uniformly in area.
    Place at(const V2f& u) const {
        const Cdf::Draw draw = by_area_.draw(u.x);
        return place(draw.item, {draw.remainder, u.y});
    }

    // Returns the parts' bounds, with shares of area as powers; empty for one flat piece.
    std::vector<LightBounds> part_bounds() const {
        std::vector<LightBounds> bounds;
        for (const Part& part : parts_) {
            bounds.push_back(bounds_of(part.triangles));
            bounds.back().power = static_cast<float>(part.by_area.total() / area());  // > 0: there are parts
        }
        return bounds;
    }
    double area_of(CellId part) const { return parts_[part].by_area.total(); }
    CellId part_of(std::uint32_t triangle) const { return parts_.empty() ? kNoCell : part_of_[triangle]; }
    Place in_part(CellId part, const V2f& u) const {
        const Part& own = parts_[part];
        const Cdf::Draw draw = own.by_area.draw(u.x);
        return place(own.triangles[draw.item], {draw.remainder, u.y});
    }

    LightBounds bounds() const {
        std::vector<std::uint32_t> all(shape_.triangles.size());
        std::iota(all.begin(), all.end(), 0U);
        return bounds_of(all);
    }

  private:
    struct Part {
        std::vector<std::uint32_t> triangles;
        Cdf by_area;
    };

    void make_parts(std::span<const double> areas) {
        if (!(area() > 0)) return;
        part_of_ = parts_of_triangles(shape_.p, shape_.triangles);
        const std::uint32_t count = *std::max_element(part_of_.begin(), part_of_.end()) + 1;
        if (count < 2) return;
        parts_.resize(count);
        for (std::uint32_t i = 0; i < part_of_.size(); ++i) parts_[part_of_[i]].triangles.push_back(i);
        for (Part& part : parts_) {
            std::vector<double> own;
            for (const std::uint32_t i : part.triangles) own.push_back(areas[i]);
            part.by_area = Cdf(own);
        }
    }

    LightBounds bounds_of(std::span<const std::uint32_t> triangles) const {
        std::optional<LightBounds> all;
        for (const std::uint32_t i : triangles) {
            if (const auto one = bounds_of_triangle(i)) all = all ? union_of(*all, *one) : *one;
        }
        return all.value_or(LightBounds{});
    }
    // Returns none for a triangle without area.
    std::optional<LightBounds> bounds_of_triangle(std::uint32_t i) const {
        const V3i& triangle = shape_.triangles[i];
        const V3d across = cross(triangle);
        if (!std::isfinite(across.length2()) || !(across.length2() > 0)) return std::nullopt;
        LightBounds one{{}, V3f(shape_.reverse ? -across.normalized() : across.normalized()), 0};
        for (int c = 0; c < 3; ++c) one.box.extendBy(vertex(triangle, c));
        return one;
    }

    Place place(std::size_t item, const V2f& u) const {
        const V3i& triangle = shape_.triangles[item];  // has area: a Cdf never draws others
        const Piece& piece = pieces_[item];
        const V3d p0(vertex(triangle, 0));
        const V3d e1 = V3d(vertex(triangle, 1)) - p0;
        const V3d e2 = V3d(vertex(triangle, 2)) - p0;
        const V2f b = square_to_triangle(u);
        return {p0 + static_cast<double>(b.x) * e1 + static_cast<double>(b.y) * e2, piece.n, piece.extent,
                part_of(static_cast<std::uint32_t>(item))};
    }

    // Holds what all points of a triangle with area have in common.
    struct Piece {
        V3d n{0, 0, 0};
        float extent = 0;
    };
    Piece piece(const V3i& triangle) const {
        const V3d p0(vertex(triangle, 0));
        const V3d e1 = V3d(vertex(triangle, 1)) - p0;
        const V3d e2 = V3d(vertex(triangle, 2)) - p0;
        Piece made{e1.cross(e2).normalized()};
        if (shape_.reverse) made.n.negate();
        for (int i = 0; i < 3; ++i) {
            const double side = std::max({std::fabs(e1[i]), std::fabs(e2[i]), std::fabs(e1[i] - e2[i])});
            made.extent = std::max(made.extent, static_cast<float>(side));
        }
        return made;
    }
    const V3f& vertex(const V3i& triangle, int corner) const {
        const auto index = static_cast<std::size_t>(triangle[corner]);
        assert(index < shape_.p.size());
        return shape_.p[index];
    }
    V3d cross(const V3i& triangle) const {
        const V3d p0(vertex(triangle, 0));
        return (V3d(vertex(triangle, 1)) - p0).cross(V3d(vertex(triangle, 2)) - p0);
    }

    TriangleEmitter shape_;
    Cdf by_area_;
    std::vector<std::uint32_t> part_of_;  // one per triangle
    std::vector<Part> parts_;             // empty: one piece
    std::vector<Piece> pieces_;           // one per triangle
};

class Disk {
  public:
    explicit Disk(const DiskEmitter& shape)
        : centre_(shape.centre),
          frame_(shape.n.normalized()),
          outer2_(sqr(static_cast<double>(shape.radius))),
          inner2_(sqr(static_cast<double>(shape.inner_radius))),
          extent_(2 * shape.radius) {}

    double area() const { return kTwoPi / 2 * std::max(0.0, outer2_ - inner2_); }

    Place at(const V2f& u) const {
        const double r = std::sqrt(inner2_ + static_cast<double>(u.x) * (outer2_ - inner2_));
        const double phi = kTwoPi * static_cast<double>(u.y);
        const V3d p = V3d(centre_) + r * cos(phi) * V3d(frame_.s) + r * sin(phi) * V3d(frame_.t);
        return {p, V3d(frame_.n), extent_};
    }

    std::vector<LightBounds> part_bounds() const { return {}; }
    double area_of(CellId /*part*/) const { return area(); }
    CellId part_of(std::uint32_t /*primitive*/) const { return kNoCell; }
    Place in_part(CellId /*part*/, const V2f& u) const { return at(u); }

    LightBounds bounds() const {
        const V3f n = frame_.n;
        const auto reach = [&](float c) { return 0.5F * extent_ * std::sqrt(std::max(0.0F, 1 - c * c)); };
        const V3f half(reach(n.x), reach(n.y), reach(n.z));
        return {Box3f(centre_ - half, centre_ + half), n, 0};
    }

  private:
    V3f centre_;
    Frame frame_;
    double outer2_, inner2_;  // squared radii
    float extent_;
};

// A light of flat pieces: triangles or a disk.
template <typename Shape>
class FlatLight final : public Light {
  public:
    FlatLight(Shape shape, const Lambertian& emission, FluxUnit unit)
        : Light(unit), shape_(std::move(shape)), emission_(emission), parts_(shape_.part_bounds()) {
        for (LightBounds& part : parts_) part.two_sided = emission_.two_sided();
    }

    std::string_view kind() const override { return "area"; }
    Rgb flux() const override { return emission_.flux(shape_.area()); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (!(shape_.area() > 0)) return std::nullopt;
        const Place place = shape_.at(u.position);
        auto particle = emission_.sample_Le(place, u.direction, shape_.area());
        if (particle) particle->cell = place.part;
        return particle;
    }
    void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const override {
        for (std::size_t i = 0; i < u.size(); ++i) out[i] = FlatLight::sample_Le(u[i]);
    }
    std::optional<LightSample> sample_Li(const V3f& x, const V2f& u,
                                         std::optional<CellId> part) const override {
        if (!(shape_.area() > 0)) return std::nullopt;
        const bool restricted = part && *part < parts_.size();
        const Place place = restricted ? shape_.in_part(*part, u) : shape_.at(u);
        const double area = restricted ? shape_.area_of(*part) : shape_.area();
        if (!(area > 0)) return std::nullopt;
        auto sample = emission_.towards(place, x, area);
        if (sample) sample->part = densities(sample->pdf_w, area, place.part);
        return sample;
    }
    CellId part_of(CellId cell) const override { return parts_.empty() ? kNoCell : cell; }
    EmittedRadiance Le_on_surface(const Ray& ray, float t, const V3f& n,
                                  std::uint32_t primitive) const override {
        EmittedRadiance seen = emission_.Le_by_area(ray, t, n, shape_.area());
        seen.part = densities(seen.pdf_w, shape_.area(), shape_.part_of(primitive));
        return seen;
    }
    std::optional<LightBounds> bounds() const override {
        LightBounds bounds = shape_.bounds();
        bounds.two_sided = emission_.two_sided();
        return bounds;
    }
    std::span<const LightBounds> part_bounds() const override { return parts_; }

  private:
    // Returns the densities of a direction towards that part, from its density for uniform places on `area`.
    std::optional<PartPdf> densities(float pdf_w, double area, CellId part) const {
        if (part == kNoCell) return std::nullopt;
        const double per_area = double{pdf_w} * area;
        return PartPdf{part, static_cast<float>(per_area / shape_.area()),
                       static_cast<float>(per_area / shape_.area_of(part))};  // area > 0: it holds the place
    }

    Shape shape_;
    Lambertian emission_;
    std::vector<LightBounds> parts_;
};

class SphereLight final : public Light {
  public:
    SphereLight(const SphereEmitter& shape, const Lambertian& emission, FluxUnit unit)
        : Light(unit),
          centre_(shape.centre),
          radius_(static_cast<double>(shape.radius)),
          reverse_(shape.reverse),
          shell_(static_cast<double>(surface_error(shape.centre, 2 * shape.radius))),
          emission_(emission) {}

    std::string_view kind() const override { return "area"; }
    Rgb flux() const override { return emission_.flux(area()); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (!(radius_ > 0)) return std::nullopt;
        return emission_.sample_Le(at(u.position), u.direction, area());
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f& u, std::optional<CellId>) const override {
        if (!(radius_ > 0)) return std::nullopt;
        if (!outside(x)) {
            if (!shines_in()) return std::nullopt;
            return emission_.towards(at(u), x, area());
        }
        if (!shines_out()) return std::nullopt;
        const V3d way = V3d(centre_) - V3d(x);
        const double d = way.length();
        const double h_max = cone(d);
        // Draws uniformly in the cone, with h = 1 - cosθ. The line passes the centre at distance d sinθ.
        const double h = static_cast<double>(u.x) * h_max;
        const double sin2 = h * (2 - h);
        const double phi = kTwoPi * static_cast<double>(u.y);
        const V3d axis = way / d;  // d > radius > 0
        const Frame frame{V3f(axis)};
        const double sine = std::sqrt(sin2);
        V3d w = sine * cos(phi) * V3d(frame.s) + sine * sin(phi) * V3d(frame.t) + (1 - h) * axis;
        // The shadow ray ends on a slightly larger sphere, so it never touches this one, not even at grazing
        // angles.
        const double gap = end_gap({V3d(centre_), axis, static_cast<float>(2 * radius_)}, d);
        const double half = std::sqrt(std::max(0.0, sqr(radius_ + gap) - d * d * sin2));
        return emission_.sample_towards(w.normalize(), std::max(0.0, d * (1 - h) - half),
                                        1 / (kTwoPi * h_max), seen_outside());
    }

    EmittedRadiance Le_on_surface(const Ray& ray, float t, const V3f& n,
                                  std::uint32_t /*primitive*/) const override {
        if (!outside(ray.o)) return emission_.Le_by_area(ray, t, n, area());
        if (!shines_out()) return {Rgb(0.0F), 0, t};
        // From outside, a ray meets the inner side of the wall only by rounding.
        const double d = (V3d(centre_) - V3d(ray.o)).length();
        const Rgb& seen = emission_.radiance(static_cast<double>(-n.dot(ray.d)));
        return {seen, is_black(seen) ? 0.0F : static_cast<float>(1 / (kTwoPi * cone(d))), t};
    }

    std::optional<LightBounds> bounds() const override {
        const V3f half(static_cast<float>(radius_));
        return LightBounds{Box3f(centre_ - half, centre_ + half)};
    }

  private:
    double area() const { return 2 * kTwoPi * radius_ * radius_; }
    bool shines_in() const { return reverse_ ? emission_.shines_front() : emission_.shines_back(); }
    bool shines_out() const { return reverse_ ? emission_.shines_back() : emission_.shines_front(); }
    const Rgb& seen_outside() const { return emission_.radiance(reverse_ ? -1 : 1); }

    // A point of the wall counts as inside if there is light inside, lest rounding darken half of a lit wall.
    // If light only goes out, the wall sees none of it in either case.
    bool outside(const V3f& x) const {
        const double d2 = (V3d(x) - V3d(centre_)).length2();
        return d2 > sqr(radius_ + (shines_in() ? shell_ : 0.0));
    }

    // Returns 1 - cosine of the half-angle that the sphere subtends from distance d > radius. The form
    // sin²/(1 + cos) is exact for far spheres, too.
    double cone(double d) const {
        const double sin2 = sqr(radius_ / d);
        return sin2 / (1 + std::sqrt(std::max(0.0, 1 - sin2)));
    }

    Place at(const V2f& u) const {
        const V3d n = V3d(square_to_sphere(u)).normalized();
        return {V3d(centre_) + radius_ * n, reverse_ ? -n : n, static_cast<float>(2 * radius_)};
    }

    V3f centre_;
    double radius_;  // scene units
    bool reverse_;
    double shell_;  // rounding error of a point on the sphere [scene units]
    Lambertian emission_;
};

}  // namespace

std::unique_ptr<Light> make_area_light(EmitterShape shape, const Rgb& front, const Rgb& back, FluxUnit unit) {
    const Lambertian emission(front, back);
    if (const auto* sphere = std::get_if<SphereEmitter>(&shape)) {
        return std::make_unique<SphereLight>(*sphere, emission, unit);
    }
    if (const auto* disk = std::get_if<DiskEmitter>(&shape)) {
        return std::make_unique<FlatLight<Disk>>(Disk(*disk), emission, unit);
    }
    return std::make_unique<FlatLight<Triangles>>(Triangles(std::get<TriangleEmitter>(std::move(shape))),
                                                  emission, unit);
}

}  // namespace lucerna
