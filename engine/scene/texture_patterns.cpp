// A pattern is a function of a point that its node holds. Constants are folded where textures are combined,
// so that a product of constants costs as much as one constant.
#include "engine/scene/texture_patterns.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <type_traits>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

template <typename Value, typename Function>
class FunctionNode final : public TextureNode<Value> {
  public:
    explicit FunctionNode(Function function) : function_(std::move(function)) {}
    Value at(const TexturePoint& point) const override { return function_(point); }

  private:
    Function function_;
};

// Returns evaluations() of a node that evaluates each of these textures once.
template <typename... Textures>
std::uint32_t evaluations_of(const Textures&... asked) {
    const std::uint64_t sum = (std::uint64_t{1} + ... + asked.evaluations());
    return static_cast<std::uint32_t>(
        std::min<std::uint64_t>(sum, std::numeric_limits<std::uint32_t>::max()));
}

template <typename Value, typename Function, typename... Textures>
Texture<Value> pattern(const ValueRange& range, Function function, const Textures&... asked) {
    return {std::make_shared<FunctionNode<Value, Function>>(std::move(function)), range,
            evaluations_of(asked...)};
}

// Multiplies two textures, the second of which may be a number.
template <typename Value, typename Factor>
class ProductNode final : public TextureNode<Value> {
  public:
    ProductNode(const Texture<Value>& a, const Texture<Factor>& b) : a_(a), b_(b) {}

    Value at(const TexturePoint& point) const override { return a_.at(point) * b_.at(point); }
    void at_each(std::span<const TexturePoint> points, std::span<Value> values) const override {
        constexpr std::size_t kMost = 8;
        for (std::size_t first = 0; first < points.size(); first += kMost) {
            const std::size_t count = std::min(kMost, points.size() - first);
            const auto here = points.subspan(first, count);
            const auto products = values.subspan(first, count);
            std::array<Factor, kMost> factors;
            a_.at_each(here, products);
            b_.at_each(here, std::span(factors).first(count));
            for (std::size_t i = 0; i < count; ++i) products[i] = products[i] * factors[i];
        }
    }
    void prefetch(const TexturePoint& point) const override {
        a_.prefetch(point);
        b_.prefetch(point);
    }

  private:
    Texture<Value> a_;
    Texture<Factor> b_;
};

// Sums octaves of noise.
template <typename Sum>
class OctavesNode final : public TextureNode<float> {
  public:
    OctavesNode(const Octaves& octaves, const Mapping3& mapping, Sum sum)
        : octaves_(octaves), mapping_(mapping), sum_(sum) {}

    float at(const TexturePoint& point) const override {
        float value = 0;
        at_each({&point, 1}, {&value, 1});
        return value;
    }
    void at_each(std::span<const TexturePoint> points, std::span<float> values) const override {
        constexpr std::size_t kMost = 8;
        for (std::size_t first = 0; first < points.size(); first += kMost) {
            const std::size_t count = std::min(kMost, points.size() - first);
            std::array<V3d, kMost> at;
            std::array<double, kMost> noise;
            for (std::size_t i = 0; i < count; ++i) at[i] = texture_position(mapping_, points[first + i]);
            sum_(std::span<const V3d>(at).first(count), octaves_, std::span(noise).first(count));
            for (std::size_t i = 0; i < count; ++i) values[first + i] = static_cast<float>(noise[i]);
        }
    }

  private:
    Octaves octaves_;
    Mapping3 mapping_;
    Sum sum_;
};

template <typename Sum>
FloatTexture octaves_texture(const ValueRange& range, const Octaves& octaves, const Mapping3& mapping,
                             Sum sum) {
    return {std::make_shared<OctavesNode<Sum>>(octaves, mapping, sum), range};
}

ValueRange joined(const ValueRange& a, const ValueRange& b) {
    return {std::min(a.least, b.least), std::max(a.most, b.most)};
}
// Returns the range of a product, whose extremes are at corners.
ValueRange times(const ValueRange& a, const ValueRange& b) {
    const float c[] = {a.least * b.least, a.least * b.most, a.most * b.least, a.most * b.most};
    return {*std::min_element(c, c + 4), *std::max_element(c, c + 4)};
}
ValueRange plus(const ValueRange& a, const ValueRange& b) {
    return {a.least + b.least, a.most + b.most};
}
ValueRange mixed(const ValueRange& a, const ValueRange& b, float amount) {
    return plus(times(range_of(1 - amount), a), times(range_of(amount), b));
}

bool is_odd(double x) {
    return std::fmod(std::floor(x), 2.0) != 0;
}

template <typename Value>
Value between(const Value& a, const Value& b, float share) {
    return a * (1 - share) + b * share;
}

// Returns noise over the plane, which pbrt evaluates at z = 1/2.
double noise2(double x, double y) {
    return perlin_noise({x, y, 0.5});
}

}  // namespace

template <typename Value>
Texture<Value> Texture<Value>::checkerboard(const Value& even, const Value& odd, const V2f& scale) {
    return checkerboard_texture(constant(even), constant(odd), Mapping2(UvMapping{scale, {0, 0}}));
}
template class Texture<Rgb>;
template class Texture<float>;

template <typename Value>
Texture<Value> product_texture(const Texture<Value>& a, const Texture<Value>& b) {
    const auto x = a.constant_value(), y = b.constant_value();
    if (x && y) return Texture<Value>::constant(*x * *y);
    return {std::make_shared<ProductNode<Value, Value>>(a, b), times(a.range(), b.range()),
            evaluations_of(a, b)};
}

template <typename Value>
Texture<Value> scaled_texture(const Texture<Value>& a, const FloatTexture& by) {
    const auto x = a.constant_value();
    const auto y = by.constant_value();
    if (x && y) return Texture<Value>::constant(*x * *y);
    return {std::make_shared<ProductNode<Value, float>>(a, by), times(a.range(), by.range()),
            evaluations_of(a, by)};
}

template <typename Value>
Texture<Value> mix_texture(const Texture<Value>& a, const Texture<Value>& b, const FloatTexture& amount) {
    const auto x = a.constant_value(), y = b.constant_value();
    const auto share = amount.constant_value();
    if (x && y && share) return Texture<Value>::constant(between(*x, *y, *share));
    // The mixture is linear in the amount, so that the extremes are at its ends.
    const ValueRange range =
        joined(mixed(a.range(), b.range(), amount.least()), mixed(a.range(), b.range(), amount.largest()));
    return pattern<Value>(
        range, [a, b, amount](const TexturePoint& p) { return between(a.at(p), b.at(p), amount.at(p)); }, a,
        b, amount);
}

template <typename Value>
Texture<Value> direction_mix_texture(const Texture<Value>& a, const Texture<Value>& b, const V3d& direction) {
    return pattern<Value>(
        joined(a.range(), b.range()),
        [a, b, d = V3f(direction)](const TexturePoint& p) {
            const bool known = p.n != V3f(0.0F);
            const float share = known ? std::min(1.0F, std::fabs(p.n.dot(d))) : 0.5F;
            return between(b.at(p), a.at(p), share);
        },
        a, b);
}

template <typename Value>
Texture<Value> checkerboard_texture(const Texture<Value>& even, const Texture<Value>& odd,
                                    const Mapping2& mapping) {
    return pattern<Value>(
        joined(even.range(), odd.range()),
        [even, odd, mapping](const TexturePoint& p) {
            const V2d st = texture_st(mapping, p);
            return is_odd(st.x) == is_odd(st.y) ? even.at(p) : odd.at(p);
        },
        even, odd);
}

template <typename Value>
Texture<Value> checkerboard_texture(const Texture<Value>& even, const Texture<Value>& odd,
                                    const Mapping3& mapping) {
    return pattern<Value>(
        joined(even.range(), odd.range()),
        [even, odd, mapping](const TexturePoint& p) {
            const V3d q = texture_position(mapping, p);
            const bool is_even = (is_odd(q.x) != is_odd(q.y)) == is_odd(q.z);
            return is_even ? even.at(p) : odd.at(p);
        },
        even, odd);
}

template <typename Value>
Texture<Value> bilerp_texture(const std::array<Value, 4>& corners, const Mapping2& mapping) {
    ValueRange range = range_of(corners[0]);
    for (const Value& corner : corners) range = joined(range, range_of(corner));
    return pattern<Value>(range, [corners, mapping](const TexturePoint& p) {
        const V2d st = texture_st(mapping, p);
        const auto s = static_cast<float>(std::clamp(st.x, 0.0, 1.0));
        const auto t = static_cast<float>(std::clamp(st.y, 0.0, 1.0));
        return between(between(corners[0], corners[1], t), between(corners[2], corners[3], t), s);
    });
}

template <typename Value>
Texture<Value> dots_texture(const Texture<Value>& inside, const Texture<Value>& outside,
                            const Mapping2& mapping) {
    return pattern<Value>(
        joined(inside.range(), outside.range()),
        [inside, outside, mapping](const TexturePoint& p) {
            constexpr double kRadius = 0.35, kShift = 0.5 - kRadius;
            const V2d st = texture_st(mapping, p);
            const double s = std::floor(st.x + 0.5), t = std::floor(st.y + 0.5);
            if (noise2(s + 0.5, t + 0.5) <= 0) return outside.at(p);
            // The noise is evaluated at the same places as in pbrt, so that the dots have the same positions.
            const V2d centre(s + kShift * noise2(s + 1.5, t + 2.8), t + kShift * noise2(s + 4.5, t + 9.8));
            return (st - centre).length2() < kRadius * kRadius ? inside.at(p) : outside.at(p);
        },
        inside, outside);
}

RgbTexture uv_texture(const Mapping2& mapping) {
    return pattern<Rgb>({0, 1}, [mapping](const TexturePoint& p) {
        const V2d st = texture_st(mapping, p);
        return Rgb(static_cast<float>(st.x - std::floor(st.x)), static_cast<float>(st.y - std::floor(st.y)),
                   0);
    });
}

FloatTexture fbm_texture(const Octaves& octaves, const Mapping3& mapping) {
    const auto bound = static_cast<float>(fractal_bound(octaves));
    return octaves_texture({-bound, bound}, octaves, mapping,
                           [](std::span<const V3d> at, const Octaves& of, std::span<double> noise) {
                               fractal_noise(at, of, noise);
                           });
}

FloatTexture wrinkled_texture(const Octaves& octaves, const Mapping3& mapping) {
    const auto bound = static_cast<float>(fractal_bound(octaves));
    return octaves_texture({0, bound}, octaves, mapping,
                           [](std::span<const V3d> at, const Octaves& of, std::span<double> noise) {
                               turbulence(at, of, noise);
                           });
}

// Returns waves of six octaves, whose height is a slower noise of three octaves.
FloatTexture windy_texture(const Mapping3& mapping) {
    static constexpr Octaves kStrength{0.5, 3}, kWaves{0.5, 6};
    const auto bound = static_cast<float>(fractal_bound(kStrength) * fractal_bound(kWaves));
    return pattern<float>({-bound, bound}, [mapping](const TexturePoint& point) {
        const V3d p = texture_position(mapping, point);
        return static_cast<float>(std::fabs(fractal_noise(0.1 * p, kStrength)) * fractal_noise(p, kWaves));
    });
}

// Returns pbrt's marble: a Bézier curve of colours, with six segments that share their control points.
RgbTexture marble_texture(const Marble& marble, const Mapping3& mapping) {
    static constexpr float kColours[9][3] = {
        {0.58F, 0.58F, 0.6F}, {0.58F, 0.58F, 0.6F}, {0.58F, 0.58F, 0.6F},
        {0.5F, 0.5F, 0.5F},   {0.6F, 0.59F, 0.58F}, {0.58F, 0.58F, 0.6F},
        {0.58F, 0.58F, 0.6F}, {0.2F, 0.2F, 0.33F},  {0.58F, 0.58F, 0.6F}};
    // The range is that of the control points, times 1.5.
    return pattern<Rgb>({0.3F, 0.9F}, [marble, mapping](const TexturePoint& point) {
        const V3d p = marble.scale * texture_position(mapping, point);
        const double layer = 0.5 + 0.5 * sin(p.y + marble.variation * fractal_noise(p, marble.octaves));
        const double place = 6 * std::clamp(layer, 0.0, 1.0);
        const int first = std::min(5, static_cast<int>(place));
        const auto t = static_cast<float>(place - first);
        std::array<Rgb, 4> c;
        for (int i = 0; i < 4; ++i) {
            const float* colour = kColours[first + i];
            c[static_cast<std::size_t>(i)] = Rgb(colour[0], colour[1], colour[2]);
        }
        for (std::size_t left = 3; left > 0; --left) {  // de Casteljau
            for (std::size_t i = 0; i < left; ++i) c[i] = between(c[i], c[i + 1], t);
        }
        return c[0] * 1.5F;
    });
}

RgbTexture grey_texture(const FloatTexture& of) {
    if (const auto value = of.constant_value()) return RgbTexture::constant(Rgb(std::max(0.0F, *value)));
    return pattern<Rgb>(
        {std::max(0.0F, of.least()), std::max(0.0F, of.largest())},
        [of](const TexturePoint& p) { return Rgb(std::max(0.0F, of.at(p))); }, of);
}

FloatTexture luminance_texture(const RgbTexture& of) {
    if (const auto value = of.constant_value()) return FloatTexture::constant(luminance(*value));
    return pattern<float>(
        of.range(), [of](const TexturePoint& p) { return luminance(of.at(p)); }, of);
}

RgbTexture ratio_texture(const RgbTexture& of, const WorkingSpace& colours) {
    if (colours.is_srgb()) return of;
    if (const auto value = of.constant_value()) return RgbTexture::constant(colours.ratio(*value));
    // sRGB's gamut is within the others', so that ratios are means of the channels.
    return pattern<Rgb>(
        of.range(), [of, colours](const TexturePoint& p) { return colours.ratio(of.at(p)); }, of);
}

template <typename Value>
Texture<Value> clamped_texture(const Texture<Value>& of, float least, float most) {
    assert(least <= most);
    const auto held = [least, most](Value value) {
        if constexpr (std::is_same_v<Value, float>) {
            return std::clamp(value, least, most);
        } else {
            for (int c = 0; c < 3; ++c) value[c] = std::clamp(value[c], least, most);
            return value;
        }
    };
    if (of.least() >= least && of.largest() <= most) return of;
    if (const auto value = of.constant_value()) return Texture<Value>::constant(held(*value));
    return pattern<Value>(
        {std::clamp(of.least(), least, most), std::clamp(of.largest(), least, most)},
        [of, held](const TexturePoint& p) { return held(of.at(p)); }, of);
}

#define LUCERNA_TEXTURES_OF(Value)                                                                           \
    template Texture<Value> product_texture(const Texture<Value>&, const Texture<Value>&);                   \
    template Texture<Value> scaled_texture(const Texture<Value>&, const FloatTexture&);                      \
    template Texture<Value> mix_texture(const Texture<Value>&, const Texture<Value>&, const FloatTexture&);  \
    template Texture<Value> direction_mix_texture(const Texture<Value>&, const Texture<Value>&, const V3d&); \
    template Texture<Value> checkerboard_texture(const Texture<Value>&, const Texture<Value>&,               \
                                                 const Mapping2&);                                           \
    template Texture<Value> checkerboard_texture(const Texture<Value>&, const Texture<Value>&,               \
                                                 const Mapping3&);                                           \
    template Texture<Value> bilerp_texture(const std::array<Value, 4>&, const Mapping2&);                    \
    template Texture<Value> dots_texture(const Texture<Value>&, const Texture<Value>&, const Mapping2&);     \
    template Texture<Value> clamped_texture(const Texture<Value>&, float, float);
LUCERNA_TEXTURES_OF(Rgb)
LUCERNA_TEXTURES_OF(float)
#undef LUCERNA_TEXTURES_OF

}  // namespace lucerna
