#include "engine/integrators/pixel_edges.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/ranks/shared_work.h"
#include "engine/scene/camera.h"

namespace lucerna {
namespace {

struct Seen {
    V3f p{0.0F}, n{0.0F};
    bool hit = false;
};

// Tells whether both points may lie on one surface without an edge: their normals nearly agree, and the way
// from one to the other runs along the surface.
bool same_surface(const Seen& a, const Seen& b) {
    constexpr float kSameWay = 0.95F, kAlong = 0.2F;
    if (!a.hit || !b.hit) return a.hit == b.hit;
    const V3f way = b.p - a.p;
    const float off = std::max(std::fabs(a.n.dot(way)), std::fabs(b.n.dot(way)));
    return a.n.dot(b.n) > kSameWay && off <= kAlong * way.length();
}

}  // namespace

PixelEdges::PixelEdges(const Scene& scene, const View& view, const Workers& workers)
    : x0_(static_cast<std::int64_t>(std::floor(view.begin.x))),
      y0_(static_cast<std::int64_t>(std::floor(view.begin.y))),
      width_(static_cast<std::int64_t>(std::ceil(view.end.x)) - x0_),
      height_(static_cast<std::int64_t>(std::ceil(view.end.y)) - y0_),
      edges_(static_cast<std::size_t>(width_ * height_)) {
    constexpr std::int64_t kRows = 8;
    const auto look = [&](std::int64_t chunk) {
        const std::int64_t begin = chunk * kRows, end = std::min(begin + kRows, height_);
        const auto corners_of_row = [&](std::int64_t y) {
            std::vector<Seen> row(static_cast<std::size_t>(width_) + 1);
            for (std::size_t x = 0; x < row.size(); ++x) {
                const V2f film(static_cast<float>(x0_ + static_cast<std::int64_t>(x)),
                               static_cast<float>(y0_ + y));
                const Ray ray = view.camera->ray(film, V2f(0.5F, 0.5F));
                if (const auto hit = scene.intersect(ray))
                    row[x] = {hit->at.p, face_forward(hit->at.n, -ray.d), true};
            }
            return row;
        };
        std::vector<Seen> above = corners_of_row(begin);
        for (std::int64_t y = begin; y < end; ++y) {
            std::vector<Seen> below = corners_of_row(y + 1);
            for (std::size_t x = 0; x + 1 < above.size(); ++x) {
                const bool whole = same_surface(above[x], above[x + 1]) && same_surface(above[x], below[x]) &&
                                   same_surface(above[x], below[x + 1]);
                edges_[static_cast<std::size_t>(y * width_) + x] = !whole;
            }
            above.swap(below);
        }
    };
    shared_chunks(workers, "pixel edges", (height_ + kRows - 1) / kRows, ResultsGo::to_all_ranks, look,
                  [&](std::int64_t chunk, auto& archive) {
                      const std::int64_t begin = chunk * kRows, rows = std::min(kRows, height_ - begin);
                      auto own = std::span(edges_).subspan(static_cast<std::size_t>(begin * width_),
                                                           static_cast<std::size_t>(rows * width_));
                      archive(own);
                  });
}

}  // namespace lucerna
