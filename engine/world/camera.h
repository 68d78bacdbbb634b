// Where the picture is taken from.
#pragma once

#include <cstdint>

#include "engine/base/vec.h"

namespace lucerna {

// Perspective (a pinhole, or a thin lens) or orthographic. Film coordinates are pixels: (0,0) is the upper left
// corner of the upper left pixel.
class Camera {
  public:
    struct Settings {
        enum class Kind : std::uint8_t { perspective, orthographic } kind = Kind::perspective;
        M44d world_from_camera;       // Imath convention; camera looks along +z, y up; relative to the scene's origin
        float fov_degrees = 90;       // of the shorter image side, as pbrt has it
        float screen[4] = {0, 0, 0, 0};  // x0 x1 y0 y1 of the screen window; all 0: from the aspect ratio
        float lens_radius = 0;        // scene units
        float focal_distance = 1e6F;  // scene units
        int width = 640, height = 480;  // pixels
    };

    explicit Camera(const Settings& settings);

    // `film` in pixels, `lens` uniform in [0,1)².
    Ray ray(const V2f& film, const V2f& lens) const;

    const Settings& settings() const { return settings_; }

  private:
    Settings settings_;
    V3f origin_, x_, y_, z_;  // camera frame in the scene; x_, y_ per pixel step on the plane z = 1
    V3f corner_;              // film (0,0) on the plane z = 1
};

}  // namespace lucerna
