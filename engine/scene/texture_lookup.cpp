// Finds the four texels around (s,t), and evaluates the mappings.
#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/scene/texture.h"
#include "engine/scene/texture_image.h"

namespace lucerna {
namespace {

// Returns the position within a repeat, [0,1).
double fraction(double x) {
    const double within = x - std::floor(x);
    return within < 1 ? within : 0.0;  // 1: a tiny negative x, rounded
}

// Holds the two texels between whose centres x lies, the second's weight, and whether they are in the image.
struct Between {
    int texel[2];
    float share;  // of the second
    bool there[2] = {true, true};
};

// It is inlined: a returned struct would pass through memory, and wide reads after narrow stores would stall.
[[gnu::always_inline]] inline Between between(double x, int n, Wrap wrap) {
    if (wrap == Wrap::repeat) x = fraction(x);
    // From two texels beyond the edge on, clamped and black textures are constant.
    const double place = std::clamp(x * n - 0.5, -2.0, n + 1.0);
    const double below = std::floor(place);
    const int first = static_cast<int>(below);
    Between result{{first, first + 1}, static_cast<float>(place - below)};
    for (int i = 0; i < 2; ++i) {
        int& texel = result.texel[i];
        result.there[i] = wrap != Wrap::black || (texel >= 0 && texel < n);
        texel = wrap == Wrap::repeat ? (texel < 0   ? n - 1
                                        : texel < n ? texel
                                                    : 0)
                                     : std::clamp(texel, 0, n - 1);
    }
    return result;
}

// Holds the texels around a place; y points down.
struct Around {
    Between x, y;

    Around(const Texels& texels, const V2d& st, Wrap wrap)
        : x(between(st.x, texels.width(), wrap)),
          y(between(wrap == Wrap::repeat ? -st.y : 1 - st.y, texels.height(), wrap)) {}
    TexelSquare square() const { return {{x.texel[0], x.texel[1]}, {y.texel[0], y.texel[1]}}; }
};

Rgb bilinear(const Texels& texels, const V2d& st, Wrap wrap) {
    const Around around(texels, st, wrap);
    const Between &x = around.x, &y = around.y;
    std::array<Rgb, 4> c = texels.square(around.square());
    for (std::size_t i = 0; i < 4; ++i) {
        if (!x.there[i % 2] || !y.there[i / 2]) c[i] = Rgb(0.0F);
    }
    const Rgb upper = c[0] * (1 - x.share) + c[1] * x.share;
    const Rgb lower = c[2] * (1 - x.share) + c[3] * x.share;
    return upper * (1 - y.share) + lower * y.share;
}

template <typename Value>
class ImageNode final : public TextureNode<Value> {
  public:
    ImageNode(std::shared_ptr<const Texels> texels, const ImageLookup& lookup)
        : texels_(std::move(texels)), lookup_(lookup) {}

    Value at(const TexturePoint& point) const override {
        Rgb value = bilinear(*texels_, texture_st(lookup_.mapping, point), lookup_.wrap) * lookup_.scale;
        if (lookup_.invert) {
            for (int c = 0; c < 3; ++c) value[c] = std::max(0.0F, 1 - value[c]);
        }
        if constexpr (std::is_same_v<Value, float>) {
            return luminance(value);
        } else {
            return value;
        }
    }

    void prefetch(const TexturePoint& point) const override {
        texels_->prefetch(Around(*texels_, texture_st(lookup_.mapping, point), lookup_.wrap).square());
    }

  private:
    std::shared_ptr<const Texels> texels_;
    ImageLookup lookup_;
};

}  // namespace

template <typename Value>
Texture<Value> image_texture(std::shared_ptr<const Texels> texels, const ImageLookup& lookup) {
    assert(texels && texels->width() > 0 && texels->height() > 0 && lookup.scale >= 0);
    ValueRange range = texels->range();
    if (lookup.wrap == Wrap::black) range.least = 0;
    range = {range.least * lookup.scale, range.most * lookup.scale};
    if (lookup.invert) range = {std::max(0.0F, 1 - range.most), std::max(0.0F, 1 - range.least)};
    return {std::make_shared<ImageNode<Value>>(std::move(texels), lookup), range};
}
template RgbTexture image_texture(std::shared_ptr<const Texels>, const ImageLookup&);
template FloatTexture image_texture(std::shared_ptr<const Texels>, const ImageLookup&);

namespace {

double finite(double x) {
    return std::isfinite(x) ? x : 0.0;
}

// Applies an affine map; the scene reader guarantees that it is affine.
V3d moved(const M44d& m, const V3d& p) {
    return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
            p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
            p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}

struct Map {
    const TexturePoint& point;

    V2d operator()(const UvMapping& m) const {
        return {
            static_cast<double>(point.uv.x) * static_cast<double>(m.scale.x) + static_cast<double>(m.delta.x),
            static_cast<double>(point.uv.y) * static_cast<double>(m.scale.y) +
                static_cast<double>(m.delta.y)};
    }
    V2d operator()(const SphericalMapping& m) const {
        const V3d p = moved(m.texture_from_world, point.p);
        // atan2 is defined everywhere, also at the poles and the origin.
        const double phi = atan2(p.y, p.x);
        return {atan2(hypot(p.x, p.y), p.z) / kPiD, (phi < 0 ? phi + 2 * kPiD : phi) / (2 * kPiD)};
    }
    V2d operator()(const CylindricalMapping& m) const {
        const V3d p = moved(m.texture_from_world, point.p);
        return {(kPiD + atan2(p.y, p.x)) / (2 * kPiD), p.z};
    }
    V2d operator()(const PlanarMapping& m) const {
        const V3d p = moved(m.texture_from_world, point.p);
        return {m.delta.x + p.dot(m.v1), m.delta.y + p.dot(m.v2)};
    }
};

}  // namespace

V2d texture_st(const Mapping2& mapping, const TexturePoint& point) {
    const V2d st = std::visit(Map{point}, mapping);
    return {finite(st.x), finite(st.y)};
}

V3d texture_position(const Mapping3& mapping, const TexturePoint& point) {
    const V3d p = moved(mapping.texture_from_world, point.p);
    return {finite(p.x), finite(p.y), finite(p.z)};
}

}  // namespace lucerna
