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
Plane trust(const ColourPlanes& variance, const Workers& workers) {
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
        return std::max(kLeast, 1 / (1 + sqr(std::min(ratio, 1e3F))));
    });
    return trust;
}

}  // namespace

Plane smoothed(const Plane& from, const V2i& size, int reach, const Workers& workers) {
    const auto pixels = [reach](int i, int end) {
        return static_cast<float>(std::min(end - 1, i + reach) - std::max(0, i - reach) + 1);
    };
    Plane across(size.x, size.y), result(size.x, size.y);
    for_each_row(workers, size, [&](int y) {
        const float* const in = from.row(y);
        float* const out = across.row(y);
        for (int offset = -reach; offset <= reach; ++offset) {
            for (int x = 0; x < size.x; ++x) out[x] += in[x + offset];
        }
        for (int x = 0; x < size.x; ++x) out[x] /= pixels(x, size.x);
    });
    for_each_row(workers, size, [&](int y) {
        float* const out = result.row(y);
        for (int v = std::max(0, y - reach); v <= std::min(size.y - 1, y + reach); ++v) {
            const float* const in = across.row(v);
            for (int x = 0; x < size.x; ++x) out[x] += in[x];
        }
        const float share = 1 / pixels(y, size.y);
        for (int x = 0; x < size.x; ++x) out[x] *= share;
    });
    return result;
}

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
    planes.trust = trust(variance, workers);
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
constexpr float kMostChange = 0.3F, kMostDeviations = 2;
constexpr int kReachOfNoise = 7;
constexpr float kLeastLeft = 0.1F;

// Returns means over 2 x 2 pixels, times a factor. Where the last column or row has no neighbour, it counts
// twice.
Plane halved(const Plane& fine, const Workers& workers, float factor = 1) {
    Plane coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
    const float share = 0.25F * factor;
    coarse.fill(workers, [&](int x, int y) {
        const int u = 2 * x, v = 2 * y;
        const int right = std::min(u + 1, fine.width() - 1), below = std::min(v + 1, fine.height() - 1);
        return share * (fine.row(v)[u] + fine.row(v)[right] + fine.row(below)[u] + fine.row(below)[right]);
    });
    return coarse;
}
ColourPlanes halved(const ColourPlanes& fine, const Workers& workers, float factor = 1) {
    return {halved(fine[0], workers, factor), halved(fine[1], workers, factor),
            halved(fine[2], workers, factor)};
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
    coarse.value = halved(fine.value, workers);
    coarse.variance = halved(fine.variance, workers, 0.25F);
    set_guide(coarse, workers);
    coarse.own = halved(fine.own, workers);
    coarse.own_noise = halved(fine.own_noise, workers, 0.25F);
    // The energy of fireflies, which finer scales distrust, is spread here.
    coarse.trust.fill(workers, [](int /*x*/, int /*y*/) { return 1.0F; });
    return coarse;
}

// Upsamples from a coarse scale, row by row. Each fine pixel gets values from four coarse ones: the one that
// holds it and the nearest others.
class Upsampler {
  public:
    Upsampler(const FeaturePlanes& fine, const FeaturePlanes& coarse) : fine_(fine), coarse_(coarse) {}

    // Adds the upsampled planes to row y of others.
    void add(int y, const std::vector<std::pair<const Plane*, Plane*>>& planes) const {
        const int width = fine_.emitter.width();
        const auto size = static_cast<std::size_t>(width);
        std::vector<float> sum(size), changes(size * planes.size());
        std::array<std::vector<float>, 4> weights;
        const int rows[2] = {y / 2, y % 2 == 0 ? y / 2 - 1 : y / 2 + 1};
        for (std::size_t k = 0; k < 4; ++k) {
            weights[k].resize(size);
            set_weights(y, rows[k / 2], k % 2 == 1, weights[k]);
            const float share = (k / 2 == 0 ? 0.75F : 0.25F) * (k % 2 == 0 ? 0.75F : 0.25F);
            for (std::size_t i = 0; i < size; ++i) sum[i] += weights[k][i] *= share;
        }
        for (std::size_t k = 0; k < 4; ++k) {
            for (std::size_t i = 0; i < size; ++i) weights[k][i] /= std::max(sum[i], kLeastWeight);
            for (std::size_t p = 0; p < planes.size(); ++p) {
                const float* const in = planes[p].first->row(rows[k / 2]);
                float* const out = &changes[p * size];
                for (int x = 0; x < width; ++x)
                    out[x] += weights[k][static_cast<std::size_t>(x)] * in[column(x, k % 2 == 1)];
            }
        }
        for (std::size_t p = 0; p < planes.size(); ++p) {
            float* const out = planes[p].second->row(y);
            for (std::size_t i = 0; i < size; ++i)
                out[i] = std::max(out[i] + changes[p * size + i], std::min(out[i], kLeastLeft * out[i]));
        }
    }

  private:
    // Where the sum of weights is less, there is nothing alike, and nothing is added.
    static constexpr float kLeastWeight = 0.05F;
    static int column(int x, bool other) { return x / 2 + (other ? 2 * (x % 2) - 1 : 0); }

    void set_weights(int y, int row, bool other, std::vector<float>& weights) const {
        for (int x = 0; x < fine_.emitter.width(); ++x)
            weights[static_cast<std::size_t>(x)] = likeness(fine_, x, y, coarse_, column(x, other), row);
    }

    const FeaturePlanes& fine_;
    const FeaturePlanes& coarse_;
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
        const V2i size(before[0].width(), before[0].height());
        Plane noise(size.x, size.y);
        for_each_row(workers, size, [&](int y) {
            for (int x = 0; x < size.x; ++x)
                noise.row(y)[x] = std::fabs(before[0].row(y)[x] - before[1].row(y)[x]);
        });
        noise = smoothed(noise, size, kReachOfNoise, workers);
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
    parallel_each(workers, static_cast<std::size_t>(height), Plane::rows_at_a_time(width),
                  [&](std::size_t row) { upsampler.add(static_cast<int>(row), planes); });
    return fine;
}

}  // namespace

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, const Workers& workers) {
    return regress_in_scales(features, halves, kScales, workers);
}

}  // namespace lucerna
