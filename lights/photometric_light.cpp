// Lamps of photometric files as lights.
//
// A file that states a luminous opening shines from it: the radiance along a line in the direction w that
// leaves the opening's shining part is
//
//     L(w) = I(w) / A(w)                 A: the part's projected area
//
// So the intensity from afar is the file's, and close by the light is that of an evenly bright body. A flat
// opening has no area in its own plane, where I/A is not finite if the file states light there. Only lines in
// that plane are affected, which have measure 0: towards them I/A grows as the sliver that is seen shrinks,
// and the light I of the sliver stays finite.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/warp.h"
#include "lights/opening_body.h"
#include "lights/photometric.h"
#include "lights/shaped_point.h"
#include "lights/spherical_rectangle.h"

namespace lucerna {
namespace {

// Draws directions from a place towards a body, with bounded ratios of radiance to density.
//
// Nearby, directions are uniform in the solid angle of the box around the body, and those that miss the body
// carry nothing. So its density does not depend on what is met. Far away that would lose digits, and for
// round bodies samples. There, points of the surface are uniform in the projection along the way to the
// body's middle; the surface that faces the place is part of the surface that faces the place's direction.
class Aim {
  public:
    Aim(const OpeningBody& body, const V3d& x) : body_(body), x_(x), distance_(x.length()) {
        const V3d& half = body.half();
        // A solid angle is the small difference of four angles, with an error of about 1e-15.
        constexpr double kFarBox = 64, kFarRound = 3, kLeastSolidAngle = 1e-9;
        const double reach = (body.is_box() ? kFarBox : kFarRound) * half.length();
        far_ = distance_ > reach;
        for (int axis = 0; axis < 3 && !far_; ++axis) {
            const double z = std::fabs(x[axis]) - half[axis];
            const int b = (axis + 1) % 3, c = (axis + 2) % 3;
            if (!(z > 0)) continue;
            inside_box_ = false;
            if (!(half[b] > 0 && half[c] > 0)) continue;
            faces_[axis].emplace(-half[b] - x[b], half[b] - x[b], -half[c] - x[c], half[c] - x[c], z);
            solid_angle_ += faces_[axis]->solid_angle();
        }
        far_ = far_ || (!inside_box_ && solid_angle_ < kLeastSolidAngle);
    }

    // Returns a unit vector from the place, or none for a sample that carries nothing.
    std::optional<V3d> draw(const V2f& u) const {
        if (far_) return draw_far(u);
        if (inside_box_) return V3d(square_to_sphere(u)).normalized();
        double at = double{u.x} * solid_angle_;
        int axis = 0;
        for (int other = 0; other < 3; ++other) {
            if (!faces_[other] || !(faces_[other]->solid_angle() > 0)) continue;
            axis = other;
            if (at < faces_[other]->solid_angle()) break;
            at -= faces_[other]->solid_angle();
        }
        const SphericalRectangle& face = *faces_[axis];  // some face has a solid angle, as their sum has
        const Imath::V2d on_face = face.draw(std::min(at / face.solid_angle(), 1.0), double{u.y});
        V3d way;
        way[axis] = std::copysign(std::fabs(x_[axis]) - body_.half()[axis], -x_[axis]);
        way[(axis + 1) % 3] = on_face.x;
        way[(axis + 2) % 3] = on_face.y;
        return way.normalized();
    }

    // Returns the density per solid angle of the unit vector d, whose line enters the body at `seen`.
    double pdf_w(const OpeningBody::Entry& seen, const V3d& d) const {
        if (!far_) return 1 / (inside_box_ ? 4 * kPiD : solid_angle_);
        const V3d towards = x_ / distance_;  // far_ implies a distance
        return sqr(seen.t) * seen.n.dot(towards) / (body_.whole_area(towards) * -seen.n.dot(d));
    }

  private:
    std::optional<V3d> draw_far(const V2f& u) const {
        const auto place = body_.draw_whole(x_ / distance_, u);
        if (!place) return std::nullopt;
        const V3d way = place->p - x_;
        if (!(place->n.dot(way) < 0)) return std::nullopt;  // faces away from the place
        return way.normalized();
    }

    const OpeningBody& body_;
    V3d x_;
    double distance_;
    bool far_ = false, inside_box_ = true;
    std::array<std::optional<SphericalRectangle>, 3> faces_;  // those that are seen
    double solid_angle_ = 0;                                  // of all faces
};

class OpeningLight final : public Light {
  public:
    OpeningLight(std::string_view kind, std::shared_ptr<const PhotometricWeb> web, const LampPlace& place,
                 const Rgb& scale, FluxUnit unit)
        : Light(unit),
          kind_(kind),
          web_(std::move(web)),
          body_(web_->info().opening, double{place.metre}),
          origin_(place.position),
          scale_(scale),
          extent_(static_cast<float>(2 * body_.half().length())) {
        // The axes are orthonormal to the accuracy of a float; lengths along lines are needed to more.
        const V3d x = V3d(place.axes.x), y = V3d(place.axes.y);
        axis_[2] = V3d(place.axes.z).normalized();
        axis_[0] = (x - x.dot(axis_[2]) * axis_[2]).normalized();
        axis_[1] = axis_[2].cross(axis_[0]);
        if (axis_[1].dot(y) < 0) axis_[1].negate();
    }

    std::string_view kind() const override { return kind_; }
    Rgb flux() const override { return scale_ * web_->integral(); }
    bool has_impostor() const override { return true; }

    // Directions are drawn in proportion to I and places uniformly over A, so all particles have one weight.
    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        const auto drawn = web_->draw(u.direction);
        if (!drawn || is_black(scale_)) return std::nullopt;
        const V3d w = V3d(drawn->w).normalized();
        const auto place = body_.draw_shining(w, u.position);
        if (!place) return std::nullopt;  // a direction in the plane of a flat opening, of measure 0
        const V3f p(origin_ + to_world(place->p));
        return LeSample{
            {p, V3f(to_world(place->n)), surface_error(p, extent_)}, V3f(to_world(w)).normalized(), flux()};
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f& u, std::optional<CellId>) const override {
        const V3d o = to_local(V3d(x) - origin_);
        const Aim aim(body_, o);
        const auto d = aim.draw(u);
        if (!d) return std::nullopt;
        const auto seen = seen_along(o, *d, x);
        if (!seen) return std::nullopt;
        const double pdf_w = aim.pdf_w(*seen, *d);
        const auto pdf = static_cast<float>(pdf_w);
        const Rgb weight = scale_ * static_cast<float>(seen->radiance / pdf_w);
        if (is_black(weight) || !is_finite(weight) || !(pdf > 0) || !std::isfinite(pdf)) return std::nullopt;
        return LightSample{V3f(to_world(*d)).normalized(), seen->distance, weight, pdf};
    }

    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        const V3d o = to_local(V3d(ray.o) - origin_), d = to_local(V3d(ray.d)).normalized();
        const auto seen = seen_along(o, d, ray.o);
        if (!seen || seen->distance > ray.t_max) return std::nullopt;
        const Rgb radiance = scale_ * static_cast<float>(seen->radiance);
        if (is_black(radiance) || !is_finite(radiance)) return std::nullopt;
        const auto pdf = static_cast<float>(Aim(body_, o).pdf_w(*seen, d));
        return EmittedRadiance{radiance, std::isfinite(pdf) ? pdf : 0.0F, seen->distance};
    }

    std::optional<LightBounds> bounds() const override {
        Box3d box;
        for (int i = 0; i < kBoxCorners; ++i)
            box.extendBy(origin_ + to_world(box_corner({-body_.half(), body_.half()}, i)));
        return LightBounds{.box = Box3f(V3f(box.min), V3f(box.max)), .axis = V3f(axis_[2])};
    }

  private:
    struct Seen : OpeningBody::Entry {
        double radiance;  // per unit of `scale_`
        float distance;   // just short of the body: a ceiling in the plane of a flat opening does not hide it
    };

    // Returns what is seen along the local unit vector d from o, which is x in the lamp's frame.
    std::optional<Seen> seen_along(const V3d& o, const V3d& d, const V3f& x) const {
        const auto entry = body_.entry(o, d);
        if (!entry || !body_.shines(*entry, -d)) return std::nullopt;
        const double cosine = -entry->n.dot(d), area = body_.shining_area(-d);
        if (!(cosine > 0 && area > 0)) return std::nullopt;
        const double gap = double{surface_error(x, extent_ + static_cast<float>(entry->t))} / cosine;
        return Seen{*entry, web_->intensity(-d) / area,
                    static_cast<float>(std::max(0x1p-126, entry->t - gap))};
    }

    V3d to_world(const V3d& v) const { return v.x * axis_[0] + v.y * axis_[1] + v.z * axis_[2]; }
    V3d to_local(const V3d& v) const { return {v.dot(axis_[0]), v.dot(axis_[1]), v.dot(axis_[2])}; }

    std::string_view kind_;
    std::shared_ptr<const PhotometricWeb> web_;
    OpeningBody body_;
    V3d origin_;  // scene units
    std::array<V3d, 3> axis_;
    Rgb scale_;     // flux unit/sr per candela
    float extent_;  // of the body [scene units]
};

}  // namespace

std::unique_ptr<Light> make_photometric_light(std::string_view kind,
                                              std::shared_ptr<const PhotometricWeb> web,
                                              const LampPlace& place, const Rgb& scale, FluxUnit unit) {
    // Densities per solid angle of smaller openings leave the range of float32.
    constexpr double kLeastArea = 1e-20;  // scene units²
    if (web->info().opening.faces().second * sqr(double{place.metre}) > kLeastArea)
        return std::make_unique<OpeningLight>(kind, std::move(web), place, scale, unit);
    return std::make_unique<ShapedPointLight<PhotometricWeb>>(kind, std::move(web), place.position,
                                                              place.axes, scale, unit);
}

}  // namespace lucerna
