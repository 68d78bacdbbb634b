#include "engine/scene/camera.h"

#include <algorithm>

#include "engine/base/elementary.h"
#include "engine/base/error.h"

#include "engine/base/warp.h"

namespace lucerna {
namespace {

struct Window {
    double x0, x1, y0, y1;
};

// Returns the part of the screen that is imaged. By default the image's shorter side spans [-1, 1].
Window screen_window(const Camera::Settings& s) {
    const bool given = s.screen[0] != 0 || s.screen[1] != 0 || s.screen[2] != 0 || s.screen[3] != 0;
    if (given) {
        return {static_cast<double>(s.screen[0]), static_cast<double>(s.screen[1]),
                static_cast<double>(s.screen[2]), static_cast<double>(s.screen[3])};
    }
    const double aspect = static_cast<double>(s.width) / s.height;  // height >= 1, checked before
    const double x = std::max(1.0, aspect);
    const double y = std::max(1.0, 1 / aspect);
    return {-x, x, -y, y};
}

void require(bool good, const char* what, double value, const char* accepted) {
    if (!good) throw InputError(fmt::format("camera: {} is {}; expected {}", what, value, accepted));
}

void check(const Camera::Settings& s) {
    require(s.width >= 1, "the image's width", s.width, "at least 1 pixel");
    require(s.height >= 1, "the image's height", s.height, "at least 1 pixel");
    const auto fov = static_cast<double>(s.fov_degrees);
    require(s.kind != Camera::Settings::Kind::perspective || (fov > 0 && fov < 180), "fov", fov,
            "more than 0 and less than 180 degrees");
    require(s.lens_radius >= 0 && std::isfinite(s.lens_radius), "the lens radius",
            static_cast<double>(s.lens_radius), "a finite number, not negative");
    require(s.lens_radius == 0 || (s.focal_distance > 0 && std::isfinite(s.focal_distance)),
            "the focal distance", static_cast<double>(s.focal_distance), "a finite number greater than 0");
    const double determinant = s.world_from_camera.determinant();
    require(std::isfinite(determinant) && determinant != 0, "the transformation's determinant", determinant,
            "a finite number other than 0");
}

V3f direction(const M44d& m, const V3d& d) {
    V3d out;
    m.multDirMatrix(d, out);
    return V3f(out);
}

// Returns the unit direction in camera space for a place in [0,1]², y down.
V3f fisheye_direction(const V2f& at) {
    const V2f p(2 * at.x - 1, 1 - 2 * at.y);
    const float r = p.length(), theta = 0.5F * kPi * r;
    const float across = r > 0 ? sin(theta) / r : 0.5F * kPi;  // its limit in the centre
    return {across * p.x, across * p.y, cos(theta)};
}

}  // namespace

Camera::Camera(const Settings& settings) : settings_(settings) {
    check(settings_);
    const Window window = screen_window(settings_);
    require(window.x0 != window.x1, "the screen window's x0", window.x0, "different from x1");
    require(window.y0 != window.y1, "the screen window's y0", window.y0, "different from y1");
    const bool perspective = settings_.kind == Settings::Kind::perspective;
    // `scale` is the length on the plane z = 1 per screen unit. For an orthographic camera both are the same.
    const double scale = perspective ? tan(static_cast<double>(settings_.fov_degrees) / 2 * kPiD / 180) : 1.0;
    const M44d& m = settings_.world_from_camera;
    V3d origin;
    m.multVecMatrix(V3d(0, 0, 0), origin);
    origin_ = V3f(origin);
    z_ = direction(m, {0, 0, 1});
    x_ = direction(m, {scale * (window.x1 - window.x0) / settings_.width, 0, 0});
    y_ = direction(m, {0, scale * (window.y0 - window.y1) / settings_.height, 0});  // film y points down
    corner_ = direction(m, {scale * window.x0, scale * window.y1, perspective ? 1.0 : 0.0});
    const auto radius = static_cast<double>(settings_.lens_radius);
    lens_x_ = direction(m, {radius, 0, 0});
    lens_y_ = direction(m, {0, radius, 0});
    const V3f rows[] = {direction(m, {1, 0, 0}), direction(m, {0, 1, 0}), direction(m, {0, 0, 1})};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) directions_[i][j] = rows[i][j];
    }
}

Ray Camera::spherical_ray(const V2f& film) const {
    const V2f at(film.x / static_cast<float>(settings_.width), film.y / static_cast<float>(settings_.height));
    if (settings_.mapping == Settings::Mapping::fisheye)
        return {origin_, (fisheye_direction(at) * directions_).normalized()};
    V3f d;
    if (settings_.mapping == Settings::Mapping::equal_area) {
        d = square_to_sphere(at);
    } else {
        const float theta = kPi * at.y, phi = 2 * kPi * at.x;
        d = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    }
    std::swap(d.y, d.z);  // the poles are at the top and bottom
    return {origin_, (d * directions_).normalized()};
}

Ray Camera::ray(const V2f& film, const V2f& lens) const {
    if (settings_.kind == Settings::Kind::spherical) return spherical_ray(film);
    const V3f on_plane = corner_ + film.x * x_ + film.y * y_;
    const bool perspective = is_perspective();
    Ray ray;
    ray.o = perspective ? origin_ : origin_ + on_plane;
    ray.d = perspective ? on_plane : z_;
    if (settings_.lens_radius > 0) {
        // All rays of a film point, from anywhere on the lens, pass through one point of the focal plane.
        const V3f shift = lens_shift(square_to_disc(lens));
        ray.d = settings_.focal_distance * ray.d - shift;
        ray.o += shift;
    }
    ray.d.normalize();
    return ray;
}

V3f Camera::lens_point(const V2f& lens) const {
    return settings_.lens_radius > 0 ? origin_ + lens_shift(square_to_disc(lens)) : origin_;
}

// Projects the direction `way` from the lens point at `shift` onto the focal plane, which holds the film's
// points at `focus` (corner_ + x x_ + y y_); a pinhole may use any plane. `way` need not be unit; the density
// is per solid angle.
std::optional<Camera::Projection> Camera::project_from(const V3d& shift, const V3d& way) const {
    const double focus = settings_.lens_radius > 0 ? double{settings_.focal_distance} : 1;
    const V3d x = focus * V3d(x_), y = focus * V3d(y_), corner = focus * V3d(corner_) - shift;
    // The length of n, a pixel's area, is never 0: the camera's map is regular and its window has an extent.
    const V3d n = x.cross(y);
    const double height = corner.dot(n), along = way.dot(n);
    if (!(height * along > 0)) return std::nullopt;  // behind the camera, or parallel to the plane
    const double s = height / along;                 // along is not 0
    const V3d on_plane = s * way - corner;
    const double n2 = n.length2();
    // The plane's area dA subtends the solid angle dA |cos| / r², with r = s |way|, |cos| = |along| / (|n|
    // |way|) and area |n| for each pixel.
    const double length = way.length();
    const double density = s * s * length * length * length / std::fabs(along);
    const V2f film(static_cast<float>(on_plane.cross(y).dot(n) / n2),
                   static_cast<float>(x.cross(on_plane).dot(n) / n2));
    if (!std::isfinite(film.x) || !std::isfinite(film.y) || !std::isfinite(density)) return std::nullopt;
    return Projection{film, static_cast<float>(density)};
}

std::optional<Camera::Projection> Camera::project(const V2f& lens, const V3f& w) const {
    if (!is_perspective()) return std::nullopt;
    const V3f shift = settings_.lens_radius > 0 ? lens_shift(square_to_disc(lens)) : V3f(0, 0, 0);
    return project_from(V3d(shift), V3d(w));
}

std::optional<Box2f> Camera::bounds_on_film(const Box3f& box) const {
    if (!is_perspective() || box.isEmpty()) return std::nullopt;
    const V3d towards = V3d(x_).cross(V3d(y_));
    const V3d forward = (V3d(corner_).dot(towards) > 0 ? towards : -towards).normalized();
    const double diagonal = V3d(box.size()).length();
    Box2f bounds;
    // Seen from one lens point, a convex body before the camera has a convex image, and each point's image
    // moves in proportion to the lens point. The corners of box and lens thus bound everything.
    for (int i = 0; i < 8; ++i) {
        const V3d corner((i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
                         (i & 4) != 0 ? box.max.z : box.min.z);
        const V3d from_middle = corner - V3d(origin_);
        if (!(from_middle.dot(forward) > diagonal)) return std::nullopt;
        const float r = settings_.lens_radius > 0 ? 1 : 0;
        for (const V2f& disc : {V2f(-r, -r), V2f(r, -r), V2f(-r, r), V2f(r, r)}) {
            const V3d shift(lens_shift(disc));
            const auto seen = project_from(shift, from_middle - shift);
            if (!seen) return std::nullopt;
            bounds.extendBy(seen->film);
        }
    }
    return bounds;
}

}  // namespace lucerna
