// A point light with a shape: a lamp's distribution as an image or photometric web, or a projected slide.
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "engine/base/vec.h"
#include "lights/analytic.h"
#include "lights/image_lights.h"
#include "lights/light.h"

namespace lucerna {

// `Shape` draws directions (draw), evaluates the intensity in one (at) and integrates it over all (integral),
// in its own frame.
template <typename Shape>
class ShapedPointLight final : public Light {
  public:
    ShapedPointLight(std::string_view kind, std::shared_ptr<const Shape> shape, const V3f& position,
                     const LightAxes& axes, const Rgb& scale, FluxUnit unit)
        : Light(unit),
          kind_(kind),
          shape_(std::move(shape)),
          position_(position),
          axes_(axes),
          scale_(scale) {}

    std::string_view kind() const override { return kind_; }
    bool is_delta() const override { return true; }
    Rgb flux() const override { return scale_ * shape_->integral(); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        const auto drawn = shape_->draw(u.direction);
        if (!drawn) return std::nullopt;
        const Rgb weight = scale_ * drawn->value / drawn->pdf_w;
        if (is_black(weight) || !is_finite(weight)) return std::nullopt;
        return LeSample{{position_}, axes_.to_world(drawn->w).normalized(), weight};
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f&, std::optional<CellId>) const override {
        const V3d way = V3d(x) - V3d(position_);
        const double r = way.length();
        if (!(r > 0)) return std::nullopt;
        return sample_Li_from_point(position_, x, scale_ * shape_->at(axes_.to_local(V3f(way / r))));
    }
    std::optional<LightBounds> bounds() const override {
        return LightBounds{.box = Box3f(position_), .axis = axes_.to_world(V3f(0, 0, 1)).normalized()};
    }

  private:
    std::string_view kind_;
    std::shared_ptr<const Shape> shape_;
    V3f position_;  // scene units
    LightAxes axes_;
    Rgb scale_;  // flux unit/sr per unit of the shape
};

}  // namespace lucerna
