// Defines the camera of a scene.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/vec.h"

namespace lucerna {

// A camera is perspective (a pinhole or a thin lens), orthographic, or spherical (all directions at once).
// Film coordinates are pixels: (0,0) is the upper left corner of the upper left pixel.
class Camera {
  public:
    struct Settings {
        enum class Kind : std::uint8_t { perspective, orthographic, spherical } kind = Kind::perspective;
        // Determines how a spherical image spreads the directions. Two mappings are pbrt's, in which the
        // film's vertical is camera y. `fisheye` is an angular fisheye: the angle from the viewing direction
        // is proportional to the distance from the film's centre, with 90 degrees at the middle of each side.
        enum class Mapping : std::uint8_t {
            equal_area,
            equirectangular,
            fisheye
        } mapping = Mapping::equal_area;
        M44d world_from_camera;  // Imath convention; camera looks along +z, y up; relative to the scene's
                                 // origin
        float fov_degrees = 90;  // of the shorter image side, as in pbrt
        float screen[4] = {0, 0, 0, 0};  // x0 x1 y0 y1 of the screen window; all 0: from the aspect ratio
        // These two are in camera space: scene units, unless world_from_camera scales.
        float lens_radius = 0;          // 0: a pinhole
        float focal_distance = 1e6F;    // along z
        int width = 640, height = 480;  // pixels
    };

    // Throws InputError that names the setting from which no image results, and what is accepted.
    explicit Camera(const Settings& settings);

    // Returns the ray of a film point. `film` is in pixels, `lens` uniform in [0,1)² (ignored by a pinhole).
    Ray ray(const V2f& film, const V2f& lens) const;

    // Inverts ray(): holds the place on the film at which a direction from one lens point is seen.
    struct Projection {
        V2f film;              // pixels, possibly beyond the film
        float pixels2_per_sr;  // d(area on the film) / d(solid angle), there
    };
    // Returns the point where the rays through one place of the lens begin. Valid for a perspective camera
    // only, because the rays of an orthographic one are parallel.
    V3f lens_point(const V2f& lens) const;
    // Projects the unit direction `w` from that point. Returns none if it does not lead towards the film's
    // plane, or if the camera is not perspective.
    std::optional<Projection> project(const V2f& lens, const V3f& w) const;
    // Returns bounds on the film, in pixels, of everything that is seen of a box through any place of the
    // lens. Returns none if the camera is not perspective, or if a part of the box is closer to the lens than
    // its diagonal.
    std::optional<Box2f> bounds_on_film(const Box3f& box) const;

    const Settings& settings() const { return settings_; }

  private:
    Ray spherical_ray(const V2f& film) const;
    bool is_perspective() const { return settings_.kind == Settings::Kind::perspective; }
    V3f lens_shift(const V2f& disc) const { return disc.x * lens_x_ + disc.y * lens_y_; }
    std::optional<Projection> project_from(const V3d& shift, const V3d& way) const;

    Settings settings_;
    // These are in scene space and scene units. The image plane is z = 1 for a perspective, z = 0 for an
    // orthographic camera.
    V3f origin_, z_;       // camera position and viewing direction (not normalised)
    M33f directions_;      // spherical camera: from camera to scene
    V3f x_, y_;            // one pixel to the right and one down on the image plane
    V3f corner_;           // film (0,0) on the image plane, from origin_
    V3f lens_x_, lens_y_;  // the lens' two semi-axes
};

}  // namespace lucerna
