// Textures are values that vary over a surface: colours and numbers.
//
// A texture is a handle, cheap to copy. A constant is stored in the handle itself; any other kind is an
// immutable node that handles share, and nodes refer to other textures. Every texture has bounds of its
// values, so that a reader can reject a reflectance above 1 before rendering, and the number of nodes that an
// evaluation visits, so that it can reject textures that would take forever.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "engine/base/vec.h"

namespace lucerna {

// Describes the place where a texture is evaluated.
struct TexturePoint {
    TexturePoint(const V2f& at_uv, const V3d& at_p = V3d(0), const V3f& at_n = V3f(0.0F))
        : uv(at_uv), p(at_p), n(at_n) {}

    V2f uv;  // the surface's
    V3d p;   // world position, for solid textures
    V3f n;   // unit normal, for textures that depend on it; zero where it is unknown
};

// Bounds all values, channel by channel: [least, most].
struct ValueRange {
    float least = 0, most = 0;
};
inline ValueRange range_of(float value) {
    return {value, value};
}
inline ValueRange range_of(const Rgb& value) {
    return {std::min({value.x, value.y, value.z}), max_component(value)};
}

template <typename Value>
class TextureNode {
  public:
    virtual ~TextureNode() = default;
    virtual Value at(const TexturePoint& point) const = 0;
    // Evaluates several points at once, for nodes that can share work between them.
    virtual void at_each(std::span<const TexturePoint> points, std::span<Value> values) const {
        for (std::size_t i = 0; i < points.size(); ++i) values[i] = at(points[i]);
    }
    // Prefetches the memory that at(point) will read.
    virtual void prefetch(const TexturePoint& /*point*/) const {}
};

struct UvMapping;

template <typename Value>
class Texture {
  public:
    Texture() : Texture(Value(0.0F)) {}
    static Texture constant(const Value& value) { return Texture(value); }
    // Returns squares of side 1 in (u scale.x, v scale.y); the one that starts at (0,0) is even.
    static Texture checkerboard(const Value& even, const Value& odd, const V2f& scale);
    // `range` bounds all values of the node; see evaluations().
    Texture(std::shared_ptr<const TextureNode<Value>> node, const ValueRange& range,
            std::uint32_t evaluations = 1)
        : range_(range), evaluations_(evaluations), node_(std::move(node)) {}

    Value at(const TexturePoint& point) const { return node_ ? node_->at(point) : value_; }

    // `values` must be as long as `points`.
    void at_each(std::span<const TexturePoint> points, std::span<Value> values) const {
        if (node_) {
            node_->at_each(points, values);
        } else {
            std::fill(values.begin(), values.end(), value_);
        }
    }
    void prefetch(const TexturePoint& point) const {
        if (node_) node_->prefetch(point);
    }

    // Returns the value if it is the same everywhere.
    std::optional<Value> constant_value() const {
        if (node_) return std::nullopt;
        return value_;
    }
    const ValueRange& range() const { return range_; }
    // Returns the largest number of nodes that one evaluation visits, counting the textures that it refers to
    // as often as they are evaluated. It is 0 for a constant, saturates, and bounds the depth.
    std::uint32_t evaluations() const { return evaluations_; }
    float least() const { return range_.least; }
    float largest() const { return range_.most; }

  private:
    explicit Texture(const Value& value) : value_(value), range_(range_of(value)) {}

    Value value_{0.0F};
    ValueRange range_;
    std::uint32_t evaluations_ = 0;
    std::shared_ptr<const TextureNode<Value>> node_;
};

using RgbTexture = Texture<Rgb>;
using FloatTexture = Texture<float>;

extern template class Texture<Rgb>;
extern template class Texture<float>;

// The following are pbrt's mappings from a point of a surface to texture coordinates.
//
// World positions are double, because a solid pattern must not shimmer far from the origin. Nothing here
// fails: coordinates that are not finite become 0.

using V2d = Imath::V2d;

// Maps the surface's own coordinates: (scale.x u + delta.x, scale.y v + delta.y).
struct UvMapping {
    V2f scale{1, 1};
    V2f delta{0, 0};
};
// Maps to (θ/π, φ/2π) of the direction from the texture's origin, θ from its +z and φ from its +x towards +y.
struct SphericalMapping {
    M44d texture_from_world;
};
// Maps to ((π + atan2(y, x))/2π, z).
struct CylindricalMapping {
    M44d texture_from_world;
};
// Maps to (delta.x + p·v1, delta.y + p·v2).
struct PlanarMapping {
    M44d texture_from_world;
    V3d v1{1, 0, 0}, v2{0, 1, 0};
    V2d delta{0, 0};
};
using Mapping2 = std::variant<UvMapping, SphericalMapping, CylindricalMapping, PlanarMapping>;

// Maps to coordinates in space, for solid textures.
struct Mapping3 {
    M44d texture_from_world;
};

V2d texture_st(const Mapping2& mapping, const TexturePoint& point);
V3d texture_position(const Mapping3& mapping, const TexturePoint& point);

}  // namespace lucerna
