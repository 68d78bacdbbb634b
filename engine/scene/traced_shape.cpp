#include "engine/scene/traced_shape.h"

#include "engine/scene/scene.h"

namespace lucerna {
namespace {

// Of a surface, only where it is.
template <typename Shape>
void strip(std::vector<Shape>& shapes) {
    for (Shape& shape : shapes) {
        shape.traits.material = 0;
        shape.traits.light = kNoLight;
        shape.traits.media = {};
    }
}

Scene bare_scene(Shapes shapes, const V3d& origin) {
    SceneParts parts;
    parts.origin = origin;
    static_cast<Shapes&>(parts) = std::move(shapes);
    strip(parts.meshes);
    strip(parts.quadrics);
    strip(parts.patches);
    strip(parts.curves);
    parts.materials.push_back({"", DiffuseMaterial{RgbTexture::constant(Rgb(0.0F))}});
    return Scene(std::move(parts), Workers{1});
}

class TracedShape final : public LampShape {
  public:
    TracedShape(Shapes shapes, const V3d& origin)
        : scene_(bare_scene(std::move(shapes), origin)),
          sphere_(scene_.sphere()),
          extent_(diagonal(scene_)) {}

    // Seen from the other end, the last crossing is the first.
    std::optional<SurfacePoint> last_crossing(const V3d& p, const V3d& d) const override {
        const V3d to_centre = V3d(sphere_.centre) - p;
        const double middle = to_centre.dot(d);
        const double reach = 1.01 * static_cast<double>(sphere_.radius);
        if (!((to_centre - middle * d).length2() <= reach * reach)) return std::nullopt;
        const auto hit =
            scene_.intersect(Ray{V3f(p + (middle + reach) * d), V3f(-d), static_cast<float>(2 * reach)});
        if (!hit) return std::nullopt;
        return hit->at;
    }

    float extent() const override { return extent_; }

  private:
    Scene scene_;
    SceneSphere sphere_;
    float extent_;
};

}  // namespace

std::unique_ptr<const LampShape> make_traced_shape(Shapes shapes, const V3d& origin) {
    return std::make_unique<TracedShape>(std::move(shapes), origin);
}

}  // namespace lucerna
