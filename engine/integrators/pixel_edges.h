// Finds pixels that show an edge, where the camera rays of one pixel meet different surfaces.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/scene/render_context.h"
#include "engine/scene/scene.h"

namespace lucerna {

class PixelEdges {
  public:
    PixelEdges() = default;
    // Traces a ray through each corner of the view's pixels and the middle of the lens. The result is a
    // function of the scene and the camera. Objects too thin to be met by any of these rays are missed.
    PixelEdges(const Scene& scene, const View& view, const Workers& workers);

    // Tells whether the pixel at a position on the whole film, pixels, shows an edge; false outside the view.
    bool at(const V2f& film) const {
        const auto x = static_cast<std::int64_t>(std::floor(film.x)) - x0_;
        const auto y = static_cast<std::int64_t>(std::floor(film.y)) - y0_;
        return x >= 0 && x < width_ && y >= 0 && y < height_ &&
               edges_[static_cast<std::size_t>(y * width_ + x)] != 0;
    }

  private:
    std::int64_t x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
    std::vector<std::uint8_t> edges_;  // of each pixel, row by row
};

}  // namespace lucerna
