// Which pixels show an edge: where the camera rays of one pixel meet different surfaces.
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
    // By a ray through each corner of the view's pixels, and the middle of the lens: a function of the scene
    // and the camera. What is too thin to be met by any is not found.
    PixelEdges(const Scene& scene, const View& view, const Workers& workers);

    // At a place of the whole film, in pixels. False outside of the view.
    bool at(const V2f& film) const {
        const auto x = static_cast<std::int64_t>(std::floor(film.x)) - x0_;
        const auto y = static_cast<std::int64_t>(std::floor(film.y)) - y0_;
        return x >= 0 && x < width_ && y >= 0 && y < height_ &&
               edges_[static_cast<std::size_t>(y * width_ + x)] != 0;
    }

  private:
    std::int64_t x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
    std::vector<std::uint8_t> edges_;  // of each pixel, by rows
};

}  // namespace lucerna
