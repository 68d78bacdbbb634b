#include "engine/denoise/edges.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <vector>

#include "engine/base/vec.h"
#include "engine/denoise/scales.h"

namespace lucerna {
namespace {

// The pixels on either side of an edge are looked for along these steps in both directions, no farther than
// kFarthestSide pixels along an axis.
constexpr std::array<V2i, 8> kSteps{V2i(1, 0), V2i(0, 1),  V2i(1, 1), V2i(1, -1),
                                    V2i(2, 1), V2i(2, -1), V2i(1, 2), V2i(1, -2)};
constexpr int kFarthestSide = 3;
// The squared distance of the features of both sides, at least: where they are alike the shares are unknown.
constexpr float kLeastContrast = 2;
// The squared distance of a pixel's features from those of the mixture, at most: otherwise it sees something
// else.
constexpr float kMostUnlike = 0.5F;
// The squared error of a mixture is estimated as the squared difference of both sides times kOfShare, plus
// the mixture's square times its squared distance in features times kOfUnlike. The regression's is taken for
// a share of the pixel's noise.
constexpr float kOfShare = 0.1F, kOfUnlike = 10, kNoiseLeft = 0.125F;

// Holds features, in units of the differences that count as 1, and the places along the normals of both
// sides.
using FeatureVector = std::array<float, 9>;

struct Mixture {
    V2i first, second;  // pixels on either side
    float share;        // of the first, in [0, 1]
    float unlike;       // squared distance of the pixel's features from the mixture
};

class Edges {
  public:
    Edges(const FeaturePlanes& features, const HalfPlanes& of_half, const Plane& support,
          const ColourPlanes& light)
        : features_(features), half_(of_half), support_(support), light_(light) {}

    bool is_supported(const V2i& p) const { return support_.row(p.y)[p.x] >= kSupported; }

    // Returns the pixel's light, blended with the best mixture; none if there is no mixture.
    std::optional<std::array<float, 3>> blended(const V2i& pixel) const {
        const std::optional<Mixture> best = mixture(pixel);
        if (!best) return std::nullopt;
        const V2i &p = best->first, &q = best->second;
        const float share = best->share;
        std::array<float, 3> first, second, mixed;
        std::array<float, 2> noise_scale;
        for (std::size_t c = 0; c < 3; ++c) {
            // The light is divided by the albedo, which is more than 0 (kLeastAlbedo).
            const Plane& albedo = features_.albedo[c];
            const float own = albedo.row(pixel.y)[pixel.x] + kLeastAlbedo;
            const float of_p = (albedo.row(p.y)[p.x] + kLeastAlbedo) / own,
                        of_q = (albedo.row(q.y)[q.x] + kLeastAlbedo) / own;
            first[c] = of_p * light_[c].row(p.y)[p.x];
            second[c] = of_q * light_[c].row(q.y)[q.x];
            mixed[c] = share * first[c] + (1 - share) * second[c];
            if (c == 1) noise_scale = {share * of_p, (1 - share) * of_q};
        }
        // With few samples a pixel's own noise may be unseen.
        const Plane& noise_of = half_.own_noise;
        const float noise =
            std::max(noise_of.row(pixel.y)[pixel.x], sqr(noise_scale[0]) * noise_of.row(p.y)[p.x] +
                                                         sqr(noise_scale[1]) * noise_of.row(q.y)[q.x]);
        const float error = kOfShare * sqr(guide_of(first) - guide_of(second)) +
                            kOfUnlike * best->unlike * sqr(guide_of(mixed));
        const float left = kNoiseLeft * noise, sum = left + error;
        if (!(sum > 0)) return std::nullopt;
        const float weight = left / sum;
        for (std::size_t c = 0; c < 3; ++c) {
            const float regressed = light_[c].row(pixel.y)[pixel.x];
            mixed[c] = regressed + weight * (mixed[c] - regressed);
        }
        return mixed;
    }

  private:
    // Returns the nearest pixel along a step that many others resemble.
    std::optional<V2i> side(const V2i& pixel, const V2i& step) const {
        const V2i size = size_of(support_);
        V2i p = pixel + step;
        while (std::max(std::abs(p.x - pixel.x), std::abs(p.y - pixel.y)) <= kFarthestSide && p.x >= 0 &&
               p.y >= 0 && p.x < size.x && p.y < size.y) {
            if (is_supported(p)) return p;
            p += step;
        }
        return std::nullopt;
    }

    // Returns the mixture of two pixels on opposite sides that comes closest to the pixel's features; none if
    // no two that differ come close.
    std::optional<Mixture> mixture(const V2i& pixel) const {
        std::optional<Mixture> best;
        const float near = features_.inverse_footprint.row(pixel.y)[pixel.x] / kPlaneStep;
        for (const V2i& step : kSteps) {
            const auto first = side(pixel, step);
            if (!first) continue;
            const auto second = side(pixel, -step);
            if (!second) continue;
            // Along a surface places differ, but not along its normal.
            const V3f n = near * at(features_.geometric_normal, *first),
                      m = near * at(features_.geometric_normal, *second);
            const FeatureVector a = features_at(*first, n, m), b = features_at(*second, n, m);
            float contrast = 0, along = 0, unlike = 0;
            for (std::size_t i = 0; i < a.size(); ++i) contrast += sqr(a[i] - b[i]);
            if (contrast < kLeastContrast) continue;
            const FeatureVector own = features_at(pixel, n, m);
            for (std::size_t i = 0; i < a.size(); ++i) along += (own[i] - b[i]) * (a[i] - b[i]);
            const float share = std::clamp(along / contrast, 0.0F, 1.0F);
            for (std::size_t i = 0; i < a.size(); ++i) unlike += sqr(own[i] - b[i] - share * (a[i] - b[i]));
            if (unlike < (best ? best->unlike : kMostUnlike)) best = {*first, *second, share, unlike};
        }
        return best;
    }
    FeatureVector features_at(const V2i& p, const V3f& n, const V3f& m) const {
        const V3f albedo = at(features_.albedo, p) * (1 / kAlbedoStep),
                  normal = at(features_.normal, p) * (1 / kNormalStep), place = at(features_.position, p);
        const float emitter = features_.emitter.row(p.y)[p.x] * (1 / kEmitterStep);
        return {albedo.x, albedo.y, albedo.z,     normal.x,    normal.y,
                normal.z, emitter,  n.dot(place), m.dot(place)};
    }

    const FeaturePlanes& features_;
    const HalfPlanes& half_;
    const Plane& support_;
    const ColourPlanes& light_;
};

}  // namespace

void mix_edges(const FeaturePlanes& features, const HalfPlanes& half, const Plane& support,
               ColourPlanes& light, const Workers& workers) {
    struct Blended {
        int x;
        std::array<float, 3> light;
    };
    const V2i size = size_of(support);
    std::vector<std::vector<Blended>> rows(static_cast<std::size_t>(size.y));
    const Edges edges(features, half, support, light);
    for_each_row(workers, size, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            if (edges.is_supported({x, y})) continue;
            if (const auto blended = edges.blended({x, y}))
                rows[static_cast<std::size_t>(y)].push_back({x, *blended});
        }
    });
    for_each_row(workers, size, [&](int y) {
        for (const Blended& pixel : rows[static_cast<std::size_t>(y)]) {
            for (std::size_t c = 0; c < 3; ++c) light[c].row(y)[pixel.x] = pixel.light[c];
        }
    });
}

}  // namespace lucerna
