#include "engine/denoise/scales.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {
namespace {

// Reduces the trust in a pixel whose variance is much larger than the mean of those around it, of five rows
// of five pixels: it holds light that the others have missed. The pixels are two apart, because the variances
// are blended over 3 x 3 pixels.
Plane trust(const ColourPlanes& variance, const Plane& sampled, const Workers& workers) {
    constexpr float kMuch = 4, kLeast = 1e-4F, kOthers = 24;
    const int width = variance[0].width(), height = variance[0].height();
    Plane own(width, height), of_row(width, height), trust(width, height);
    own.fill(workers, [&](int x, int y) {
        return variance[0].row(y)[x] + variance[1].row(y)[x] + variance[2].row(y)[x];
    });
    const auto sum_of_five = [](float a, float b, float c, float d, float e) { return a + b + c + d + e; };
    of_row.fill(workers, [&](int x, int y) {
        const float* const s = own.row(y) + x;
        return sum_of_five(s[-4], s[-2], s[0], s[2], s[4]);
    });
    trust.fill(workers, [&](int x, int y) {
        const auto at = [&of_row, x](int row) { return of_row.row(row)[x]; };
        const float here = own.row(y)[x],
                    all = sum_of_five(at(y - 4), at(y - 2), at(y), at(y + 2), at(y + 4));
        const float others = std::max(0.0F, all - here) / kOthers;
        const float ratio = here / (kMuch * others + std::numeric_limits<float>::min());
        return sampled.row(y)[x] * std::max(kLeast, 1 / (1 + sqr(std::min(ratio, 1e3F))));
    });
    return trust;
}

}  // namespace

float guide_of(const ColourPlanes& value, int x, int y) {
    return 0.25F * (value[0].row(y)[x] + value[2].row(y)[x]) + 0.5F * value[1].row(y)[x];
}
float guide_deviation(const ColourPlanes& variance, int x, int y) {
    return 0.25F * (std::sqrt(variance[0].row(y)[x]) + std::sqrt(variance[2].row(y)[x])) +
           0.5F * std::sqrt(variance[1].row(y)[x]);
}

Plane around(const Plane& plane, const Workers& workers) {
    const int width = plane.width(), height = plane.height();
    Plane columns(width, height), sum(width, height);
    columns.fill(workers,
                 [&](int x, int y) { return plane.row(y - 1)[x] + plane.row(y)[x] + plane.row(y + 1)[x]; });
    sum.fill(workers, [&](int x, int y) {
        const float* const row = columns.row(y) + x;
        return row[-1] + row[0] + row[1];
    });
    return sum;
}

void set_guide(HalfPlanes& planes, const Workers& workers) {
    const ColourPlanes& variance = planes.variance;
    const int width = variance[0].width(), height = variance[0].height();
    planes.trust = trust(variance, planes.sampled, workers);
    Plane light(width, height), noise(width, height);
    light.fill(workers, [&](int x, int y) { return planes.trust.row(y)[x] * guide_of(planes.value, x, y); });
    noise.fill(workers, [&](int x, int y) {
        return sqr(planes.trust.row(y)[x] * guide_deviation(planes.variance, x, y));
    });
    const Plane trust = around(planes.trust, workers);
    planes.guide = around(light, workers);
    planes.noise = around(noise, workers);
    planes.guide.fill(workers, [&](int x, int y) { return planes.guide.row(y)[x] / trust.row(y)[x]; });
    planes.noise.fill(workers, [&](int x, int y) { return planes.noise.row(y)[x] / sqr(trust.row(y)[x]); });
}

namespace {

// Number of scales, and the side of images that have no coarser scale.
constexpr int kScales = 3, kLeastSide = 16;
// Limits the change that a coarser scale makes to the light of a finer one, as a share of it. Noise that is
// left at low frequencies is well below this; what is more comes from a neighbourhood of different light.
constexpr float kMostChange = 0.3F;
// Where much noise is left, the change may also be so many mean differences of the two halves' filtered
// light, over squares of half side kReachOfNoise.
constexpr float kMostDeviations = 2;
constexpr int kReachOfNoise = 7;
// The least share of a pixel's light that a change leaves: a darker surrounding must not make it negative.
constexpr float kLeastLeft = 0.1F;

// Makes a plane of half the size. body(x, left, right) gives pixel x of a row by the columns of its fine
// pixels; of_row(upper, lower) returns such a body for the rows of these. Where the last column or row has no
// neighbour, it counts twice.
template <typename OfRow>
Plane made_of_2_x_2(int width, int height, const Workers& workers, OfRow&& of_row) {
    Plane coarse((width + 1) / 2, (height + 1) / 2);
    for_each_row(workers, size_of(coarse), [&](int y) {
        const auto body = of_row(2 * y, std::min(2 * y + 1, height - 1));
        float* const to = coarse.row(y);
        for (int x = 0; x < width / 2; ++x) to[x] = body(2 * x, 2 * x + 1);
        if (width % 2 == 1) to[width / 2] = body(width - 1, width - 1);
    });
    coarse.extend();
    return coarse;
}

// Returns means over 2 x 2 pixels, times a factor.
Plane halved(const Plane& fine, const Workers& workers, float factor = 1) {
    const float share = 0.25F * factor;
    return made_of_2_x_2(fine.width(), fine.height(), workers, [&fine, share](int upper, int lower) {
        const float *const up = fine.row(upper), *const down = fine.row(lower);
        return [up, down, share](int left, int right) {
            return share * (up[left] + up[right] + down[left] + down[right]);
        };
    });
}
ColourPlanes halved(const ColourPlanes& fine, const Workers& workers) {
    return {halved(fine[0], workers), halved(fine[1], workers), halved(fine[2], workers)};
}

// Returns means over 2 x 2 pixels of light or, if is_variance is set, their variances. Pixels are weighted.
Plane halved(const Plane& fine, const Plane& weight, bool is_variance, const Workers& workers) {
    return made_of_2_x_2(fine.width(), fine.height(), workers, [&, is_variance](int upper, int lower) {
        const float *const up = fine.row(upper), *const down = fine.row(lower);
        const float *const of_up = weight.row(upper), *const of_down = weight.row(lower);
        return [=](int left, int right) {
            const float a = of_up[left], b = of_up[right], c = of_down[left], d = of_down[right];
            const float all = 1 / (a + b + c + d);
            return is_variance ? (sqr(a * all) * up[left] + sqr(b * all) * up[right] +
                                  sqr(c * all) * down[left] + sqr(d * all) * down[right])
                               : all * (a * up[left] + b * up[right] + c * down[left] + d * down[right]);
        };
    });
}
ColourPlanes halved(const ColourPlanes& fine, const Plane& weight, bool is_variance, const Workers& workers) {
    return {halved(fine[0], weight, is_variance, workers), halved(fine[1], weight, is_variance, workers),
            halved(fine[2], weight, is_variance, workers)};
}

FeaturePlanes halved(const FeaturePlanes& fine, const Workers& workers) {
    FeaturePlanes coarse{
        halved(fine.albedo, workers),           halved(fine.normal, workers),
        halved(fine.geometric_normal, workers), halved(fine.position, workers),
        halved(fine.emitter, workers),          halved(fine.inverse_footprint, workers, 0.5F),
        halved(fine.inverse_albedo, workers),   {}};
    const int width = coarse.emitter.width(), height = coarse.emitter.height();
    coarse.inside = Plane(width, height);
    for (int y = 0; y < height; ++y) std::fill_n(coarse.inside.row(y), width, 1.0F);
    return coarse;
}

HalfPlanes halved(const HalfPlanes& fine, const Workers& workers) {
    HalfPlanes coarse;
    coarse.value = halved(fine.value, fine.sampled, false, workers);
    coarse.variance = halved(fine.variance, fine.sampled, true, workers);
    coarse.own = halved(fine.own, fine.sampled, false, workers);
    coarse.own_noise = halved(fine.own_noise, fine.sampled, true, workers);
    coarse.sampled = halved(fine.sampled, workers, 4);
    coarse.sampled.fill(workers, [&](int x, int y) { return std::min(1.0F, coarse.sampled.row(y)[x]); });
    set_guide(coarse, workers);
    // The energy of fireflies, which finer scales distrust, is spread here.
    coarse.trust = coarse.sampled;
    return coarse;
}

// Upsamples from a coarse scale, row by row. Each fine pixel gets values from four coarse ones: the one that
// holds it and the nearest others.
class Upsampler {
  public:
    Upsampler(const FeaturePlanes& fine, const FeaturePlanes& coarse)
        : fine_(planes_of(fine)), coarse_(planes_of(coarse)) {}

    // Adds the upsampled planes to row y of others.
    void add(int y, const std::vector<std::pair<const Plane*, Plane*>>& planes) const {
        const int width = fine_[0]->width();
        // Pixels of even and of odd columns have their nearest other columns on different sides.
        for (const int parity : {0, 1}) {
            const int pixels = (width + 1 - parity) / 2;
            for (int begin = 0; begin < pixels; begin += kBlock)
                add_block(y, parity, begin, std::min(kBlock, pixels - begin), planes);
        }
    }

  private:
    // Where the sum of weights is less, there is nothing alike, and nothing is added.
    static constexpr float kLeastWeight = 0.05F;
    static constexpr int kBlock = 64;
    using Block = std::array<float, kBlock>;  // a local one aliases no plane, so that loops are vectorised
    enum : std::uint8_t {
        kColours = 0,
        kNormals = 3,
        kPlaces = 6,
        kPlanes = 9,
        kLamp = 12,
        kNear,
        kIn,
        kAll
    };
    using Planes = std::array<const Plane*, kAll>;

    static Planes planes_of(const FeaturePlanes& of) {
        return {&of.albedo[0],
                &of.albedo[1],
                &of.albedo[2],
                &of.normal[0],
                &of.normal[1],
                &of.normal[2],
                &of.position[0],
                &of.position[1],
                &of.position[2],
                &of.geometric_normal[0],
                &of.geometric_normal[1],
                &of.geometric_normal[2],
                &of.emitter,
                &of.inverse_footprint,
                &of.inside};
    }

    // Adds to `pixels` pixels of row y, whose coarse columns begin at `begin`.
    void add_block(int y, int parity, int begin, int pixels,
                   const std::vector<std::pair<const Plane*, Plane*>>& planes) const {
        std::array<Block, kAll> here;
        for (std::size_t i = 0; i < kAll; ++i) {
            const float* const from = fine_[i]->row(y) + parity + 2 * begin;
            for (int x = 0; x < pixels; ++x) here[i][static_cast<std::size_t>(x)] = from[2 * x];
        }
        const int rows[2] = {y / 2, y % 2 == 0 ? y / 2 - 1 : y / 2 + 1};
        const int columns[2] = {begin, begin + 2 * parity - 1};
        std::array<Block, 4> weights;
        Block sum{};
        for (std::size_t k = 0; k < 4; ++k) {
            set_weights(here, rows[k / 2], columns[k % 2], pixels, weights[k]);
            const float share = (k / 2 == 0 ? 0.75F : 0.25F) * (k % 2 == 0 ? 0.75F : 0.25F);
            for (std::size_t x = 0; x < kBlock; ++x) sum[x] += weights[k][x] *= share;
        }
        for (std::size_t x = 0; x < kBlock; ++x) sum[x] = 1 / std::max(sum[x], kLeastWeight);
        for (const auto& [from, to] : planes) {
            Block change{};
            for (std::size_t k = 0; k < 4; ++k) {
                const float* const in = from->row(rows[k / 2]) + columns[k % 2];
                for (int x = 0; x < pixels; ++x) {
                    const auto i = static_cast<std::size_t>(x);
                    change[i] += weights[k][i] * sum[i] * in[x];
                }
            }
            float* const out = to->row(y) + parity + 2 * begin;
            for (int x = 0; x < pixels; ++x) {
                const float was = out[2 * x];
                out[2 * x] =
                    std::max(was + change[static_cast<std::size_t>(x)], std::min(was, kLeastLeft * was));
            }
        }
    }

    // Sets the likeness of the block's pixels to those of a coarse row from column `begin` on, and 0 beyond.
    void set_weights(const std::array<Block, kAll>& here, int row, int begin, int pixels,
                     Block& weights) const {
        std::array<const float*, kAll> there;
        for (std::size_t i = 0; i < kAll; ++i) there[i] = coarse_[i]->row(row) + begin;
        Block result{};
        for (int x = 0; x < pixels; ++x) {
            const auto i = static_cast<std::size_t>(x);
            float of_a = 0, of_n = 0, of_p = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                of_a += sqr(there[kColours + c][x] - here[kColours + c][i]);
                of_n += sqr(there[kNormals + c][x] - here[kNormals + c][i]);
                of_p += here[kPlanes + c][i] * (there[kPlaces + c][x] - here[kPlaces + c][i]);
            }
            result[i] = there[kIn][x] * weight_of(feature_distance(of_a, of_n, here[kNear][i] * of_p,
                                                                   there[kLamp][x] - here[kLamp][i]));
        }
        weights = result;
    }

    Planes fine_, coarse_;
};

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, int scales,
                                          const Workers& workers) {
    constexpr auto kLinear = static_cast<std::size_t>(Candidate::linear);
    const int width = features.emitter.width(), height = features.emitter.height();
    std::array<Filtered, 2> fine = regress(width, height, features, halves, workers);
    if (scales == 1 || std::min(width, height) <= kLeastSide) return fine;
    const FeaturePlanes coarse_features = halved(features, workers);
    std::array<Filtered, 2> coarse = regress_in_scales(
        coarse_features, {halved(halves[0], workers), halved(halves[1], workers)}, scales - 1, workers);
    std::vector<std::pair<const Plane*, Plane*>> planes;
    for (std::size_t c = 0; c < 3; ++c) {
        const std::array<Plane, 2> before{halved(fine[0][kLinear][c], workers),
                                          halved(fine[1][kLinear][c], workers)};
        const V2i size = size_of(before[0]);
        Plane noise(size.x, size.y);
        for_each_row(workers, size, [&](int y) {
            for (int x = 0; x < size.x; ++x)
                noise.row(y)[x] = std::fabs(before[0].row(y)[x] - before[1].row(y)[x]);
        });
        noise = smoothed(noise, kReachOfNoise, workers);
        for (std::size_t half = 0; half < 2; ++half) {
            Plane &to = fine[half][kLinear][c], &change = coarse[half][kLinear][c];
            change.fill(workers, [&](int x, int y) {
                const float was = before[half].row(y)[x],
                            most = kMostChange * std::fabs(was) + kMostDeviations * noise.row(y)[x];
                return std::clamp(change.row(y)[x] - was, -most, most);
            });
            planes.emplace_back(&change, &to);
        }
    }
    const Upsampler upsampler(features, coarse_features);
    for_each_row(workers, {width, height}, [&](int y) { upsampler.add(y, planes); });
    return fine;
}

}  // namespace

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, const Workers& workers) {
    return regress_in_scales(features, halves, kScales, workers);
}

}  // namespace lucerna
