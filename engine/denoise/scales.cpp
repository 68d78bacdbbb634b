#include "engine/denoise/scales.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/vec.h"
#include "engine/denoise/edges.h"

namespace lucerna {
namespace {

// Returns how much noisier each pixel of a row is than kMuch times those around it, squared: it holds light
// that the others have missed. The pixels around it are two apart, because noise is blended over 3 x 3
// pixels.
std::vector<float> excess_of(const HalfPlanes& half, int y) {
    constexpr int kReach = 4, kStep = 2;
    constexpr float kMuch = 10;
    // Trust falls with the fourth power of this: float32 holds its squares.
    constexpr float kMost = 1e3F;
    std::vector<float> others(static_cast<std::size_t>(half.own_noise.width())), excess(others.size());
    mean_of_most<kReach, kStep>(half.own_noise, y, others);
    const float* const here = half.own_noise.row(y);
    for (std::size_t x = 0; x < others.size(); ++x) {
        const float ratio = here[x] / (kMuch * others[x] + std::numeric_limits<float>::min());
        excess[x] = sqr(std::min(ratio, kMost));
    }
    return excess;
}

// Returns how many pixels of the wider surroundings have half the noise of a pixel or more, weighted by the
// likeness of their features. Its nearest pixels share its noise, and do not count.
float company_of(const V2i& p, const FeaturePlanes& f, const Plane& noise) {
    constexpr int kReach = 8, kStep = 2, kNearest = 2;
    static_assert(kReach <= Plane::kRim);
    constexpr float kLeast = 0.5F;
    const float least = kLeast * noise.row(p.y)[p.x], emitter = f.emitter.row(p.y)[p.x];
    const V3f albedo = at(f.albedo, p), normal = at(f.normal, p), place = at(f.position, p),
              across = at(f.geometric_normal, p);
    const float near = f.inverse_footprint.row(p.y)[p.x];
    const V2i size = size_of(noise);
    float company = 0;
    for (int j = -kReach; j <= kReach; j += kStep) {
        const int v = p.y + j;
        if (v < 0 || v >= size.y) continue;
        const float* const there = noise.row(v);
        for (int i = -kReach; i <= kReach; i += kStep) {
            const V2i q(p.x + i, v);
            if (there[q.x] < least || q.x < 0 || q.x >= size.x) continue;
            if (std::max(std::abs(i), std::abs(j)) <= kNearest) continue;
            company += weight_of(feature_distance(
                (at(f.albedo, q) - albedo).length2(), (at(f.normal, q) - normal).length2(),
                near * across.dot(at(f.position, q) - place), f.emitter.row(q.y)[q.x] - emitter));
        }
    }
    return company;
}

// Sets the trust in the pixels: little where noise exceeds that around them, unless many other pixels are as
// noisy. Their light is then rare, but no accident, and without it dark spots would be left.
void set_trust(const FeaturePlanes& features, HalfPlanes& half, const Workers& workers) {
    constexpr float kTrusted = 0.5F, kOthers = 6;
    const auto trust_with = [](float excess) { return 1 / sqr(1 + excess); };
    fill_rows(workers, {&half.trust}, [&](int y) {
        const float* const sampled = half.sampled.row(y);
        float* const to = half.trust.row(y);
        const std::vector<float> excess = excess_of(half, y);
        for (std::size_t x = 0; x < excess.size(); ++x) {
            float trust = trust_with(excess[x]);
            if (trust < kTrusted) {
                const float company = company_of(V2i(static_cast<int>(x), y), features, half.own_noise);
                trust = trust_with(excess[x] * sqr(std::max(0.0F, 1 - company / kOthers)));
            }
            to[x] = sampled[x] * trust;
        }
    });
}

}  // namespace

void guide_of(const ColourPlanes& value, int y, float* guide) {
    const float *const r = value[0].row(y), *const g = value[1].row(y), *const b = value[2].row(y);
    for (int x = 0; x < value[0].width(); ++x) guide[x] = guide_of({r[x], g[x], b[x]});
}
void guide_deviation(const ColourPlanes& variance, int y, float* deviation) {
    const float *const r = variance[0].row(y), *const g = variance[1].row(y), *const b = variance[2].row(y);
    for (int x = 0; x < variance[0].width(); ++x)
        deviation[x] = 0.25F * (std::sqrt(r[x]) + std::sqrt(b[x])) + 0.5F * std::sqrt(g[x]);
}

void set_guides(const FeaturePlanes& features, std::array<HalfPlanes, 2>& halves, const Workers& workers) {
    const V2i size = size_of(halves[0].sampled);
    std::array<Plane, 2> light, noise;
    make_planes(size, {&light[0], &light[1], &noise[0], &noise[1]});
    for (HalfPlanes& half : halves) make_planes(size, {&half.trust, &half.guide, &half.noise});
    for (HalfPlanes& half : halves) set_trust(features, half, workers);
    fill_rows(workers, {&light[0], &light[1], &noise[0], &noise[1]}, [&](int y) {
        for (std::size_t h = 0; h < 2; ++h) {
            HalfPlanes& half = halves[h];
            float *const of_light = light[h].row(y), *const of_noise = noise[h].row(y);
            guide_of(half.value, y, of_light);
            guide_deviation(half.variance, y, of_noise);
            const float* const trust = half.trust.row(y);
            for (int x = 0; x < size.x; ++x) {
                of_light[x] = trust[x] * of_light[x];
                of_noise[x] = sqr(trust[x] * of_noise[x]);
            }
        }
    });
    fill_rows(workers, {&halves[0].guide, &halves[1].guide, &halves[0].noise, &halves[1].noise}, [&](int y) {
        for (std::size_t h = 0; h < 2; ++h) {
            const Around trust(halves[h].trust, y), of_light(light[h], y), of_noise(noise[h], y);
            float *const to_guide = halves[h].guide.row(y), *const to_noise = halves[h].noise.row(y);
            for (int x = 0; x < size.x; ++x) {
                to_guide[x] = of_light(x) / trust(x);
                to_noise[x] = of_noise(x) / sqr(trust(x));
            }
        }
    });
}

namespace {

// Number of scales, and the side of images that have no coarser scale.
constexpr int kScales = 4, kLeastSide = 16;
// Limits the change that a coarser scale makes to the light of a finer one, as a share of it. Noise that is
// left at low frequencies is well below this; what is more comes from a neighbourhood of different light.
constexpr float kMostChange = 0.3F;
// Where much noise is left, the change may also be so many mean differences of the two halves' filtered
// light. The mean is over kReachOfNoise pixels to each side, kStepOfNoise apart, without the two largest:
// small lamps must not let their light leak into the dark around them.
constexpr float kMostDeviations = 6;
constexpr int kReachOfNoise = 3, kStepOfNoise = 2;
// The least share of a pixel's light that a change leaves.
constexpr float kLeastLeft = 0.1F;

// Calls body(x, left, right) for each pixel x of a row of half the width, with the columns of its fine
// pixels. Where the last column has no neighbour, it counts twice.
template <typename Body>
void for_each_2(int width, Body&& body) {
    for (int x = 0; x < width / 2; ++x) body(x, 2 * x, 2 * x + 1);
    if (width % 2 == 1) body(width / 2, width - 1, width - 1);
}

// Writes the means over 2 x 2 pixels, times a factor, to row y of a plane of half the size. Where the last
// row has no neighbour, it counts twice.
void halve(const Plane& fine, int y, Plane& coarse, float factor = 1) {
    const float share = 0.25F * factor;
    const float *const up = fine.row(2 * y), *const down = fine.row(std::min(2 * y + 1, fine.height() - 1));
    float* const to = coarse.row(y);
    for_each_2(fine.width(), [=](int x, int left, int right) {
        to[x] = share * (up[left] + up[right] + down[left] + down[right]);
    });
}

// Writes means over 2 x 2 pixels of light, and the variances of these means. Pixels are weighted.
void halve(const Plane& light, const Plane& variance, const Plane& weight, int y, Plane& coarse_light,
           Plane& coarse_variance) {
    const int upper = 2 * y, lower = std::min(upper + 1, light.height() - 1);
    const float *const up = light.row(upper), *const down = light.row(lower);
    const float *const noise_up = variance.row(upper), *const noise_down = variance.row(lower);
    const float *const of_up = weight.row(upper), *const of_down = weight.row(lower);
    float *const to = coarse_light.row(y), *const to_noise = coarse_variance.row(y);
    for_each_2(light.width(), [=](int x, int left, int right) {
        const float a = of_up[left], b = of_up[right], c = of_down[left], d = of_down[right];
        const float all = 1 / (a + b + c + d);
        to[x] = all * (a * up[left] + b * up[right] + c * down[left] + d * down[right]);
        to_noise[x] = sqr(a * all) * noise_up[left] + sqr(b * all) * noise_up[right] +
                      sqr(c * all) * noise_down[left] + sqr(d * all) * noise_down[right];
    });
}

// Holds what a scale's regression is given.
struct Scale {
    FeaturePlanes features;
    std::array<HalfPlanes, 2> halves;
};

Scale halved(const FeaturePlanes& fine, const std::array<HalfPlanes, 2>& fine_halves,
             const Workers& workers) {
    const V2i fine_size = size_of(fine.emitter), size((fine_size.x + 1) / 2, (fine_size.y + 1) / 2);
    Scale coarse;
    FeaturePlanes& f = coarse.features;
    std::vector<const Plane*> from;
    std::vector<Plane*> means, filled;
    const auto add_mean = [&](const Plane& of, Plane& to) { from.push_back(&of), means.push_back(&to); };
    for (std::size_t c = 0; c < 3; ++c) {
        add_mean(fine.albedo[c], f.albedo[c]);
        add_mean(fine.normal[c], f.normal[c]);
        add_mean(fine.geometric_normal[c], f.geometric_normal[c]);
        add_mean(fine.position[c], f.position[c]);
    }
    add_mean(fine.emitter, f.emitter);
    add_mean(fine.inverse_albedo, f.inverse_albedo);
    filled = means;
    filled.push_back(&f.inverse_footprint);
    for (HalfPlanes& half : coarse.halves) {
        for (std::size_t c = 0; c < 3; ++c) filled.insert(filled.end(), {&half.value[c], &half.variance[c]});
        filled.insert(filled.end(), {&half.own, &half.own_noise, &half.sampled});
    }
    make_planes(size, filled);
    f.inside = Plane(size.x, size.y);
    fill_rows(workers, filled, [&](int y) {
        for (std::size_t i = 0; i < from.size(); ++i) halve(*from[i], y, *means[i]);
        halve(fine.inverse_footprint, y, f.inverse_footprint, 0.5F);
        std::fill_n(f.inside.row(y), size.x, 1.0F);
        for (std::size_t h = 0; h < 2; ++h) {
            const HalfPlanes& of = fine_halves[h];
            HalfPlanes& to = coarse.halves[h];
            for (std::size_t c = 0; c < 3; ++c)
                halve(of.value[c], of.variance[c], of.sampled, y, to.value[c], to.variance[c]);
            halve(of.own, of.own_noise, of.sampled, y, to.own, to.own_noise);
            halve(of.sampled, y, to.sampled, 4);
            float* const sampled = to.sampled.row(y);
            for (int x = 0; x < size.x; ++x) sampled[x] = std::min(1.0F, sampled[x]);
        }
    });
    set_guides(coarse.features, coarse.halves, workers);
    return coarse;
}

// Upsamples from a coarse scale, row by row. Each fine pixel gets values from four coarse ones: the one that
// holds it and the nearest others.
class Upsampler {
  public:
    Upsampler(const FeaturePlanes& fine, const FeaturePlanes& coarse)
        : fine_(planes_of(fine)), coarse_(planes_of(coarse)) {}

    // Changes row y of planes by upsampled ones: adds what is positive in these, and multiplies by one plus
    // what is negative.
    void apply(int y, const std::vector<std::pair<const Plane*, Plane*>>& planes) const {
        const int width = fine_[0]->width();
        // Pixels of even and of odd columns have their nearest other columns on different sides.
        for (const int parity : {0, 1}) {
            const int pixels = (width + 1 - parity) / 2;
            for (int begin = 0; begin < pixels; begin += kBlock)
                apply_block(y, parity, begin, std::min(kBlock, pixels - begin), planes);
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

    // Changes `pixels` pixels of row y, whose coarse columns begin at `begin`.
    void apply_block(int y, int parity, int begin, int pixels,
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
            Block change{}, factor{};
            for (std::size_t k = 0; k < 4; ++k) {
                const float* const in = from->row(rows[k / 2]) + columns[k % 2];
                for (int x = 0; x < pixels; ++x) {
                    const auto i = static_cast<std::size_t>(x);
                    const float share = weights[k][i] * sum[i];
                    change[i] += share * std::max(in[x], 0.0F);
                    factor[i] += share * std::min(in[x], 0.0F);
                }
            }
            float* const out = to->row(y) + parity + 2 * begin;
            for (int x = 0; x < pixels; ++x) {
                const auto i = static_cast<std::size_t>(x);
                out[2 * x] = std::max(1 + factor[i], kLeastLeft) * out[2 * x] + change[i];
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

constexpr auto kLinear = static_cast<std::size_t>(Candidate::linear);

void correct(std::array<Filtered, 2>& fine, const FeaturePlanes& features,
             const std::array<HalfPlanes, 2>& halves, int scales, const Workers& workers);

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, int scales,
                                          const Workers& workers) {
    const int width = features.emitter.width(), height = features.emitter.height();
    Regression regression = regress(width, height, features, halves, workers);
    std::array<Filtered, 2>& fine = regression.light;
    if (scales > 1 && std::min(width, height) > kLeastSide) correct(fine, features, halves, scales, workers);
    // Edges follow: no coarser pixel resembles theirs, but those on both sides have been corrected.
    for (std::size_t half = 0; half < 2; ++half)
        mix_edges(features, halves[half], regression.support[half], fine[half][kLinear], workers);
    return std::move(fine);
}

// Corrects filtered light by coarser scales.
void correct(std::array<Filtered, 2>& fine, const FeaturePlanes& features,
             const std::array<HalfPlanes, 2>& halves, int scales, const Workers& workers) {
    const int width = features.emitter.width(), height = features.emitter.height();
    const Scale coarse = halved(features, halves, workers);
    std::array<Filtered, 2> change = regress_in_scales(coarse.features, coarse.halves, scales - 1, workers);
    const V2i size = size_of(coarse.features.emitter);
    std::array<ColourPlanes, 2> before;
    ColourPlanes noise;
    std::vector<Plane*> changes;
    std::vector<std::pair<const Plane*, Plane*>> planes;
    for (std::size_t c = 0; c < 3; ++c) {
        make_planes(size, {&before[0][c], &before[1][c], &noise[c]});
        for (std::size_t half = 0; half < 2; ++half) {
            changes.push_back(&change[half][kLinear][c]);
            planes.emplace_back(&change[half][kLinear][c], &fine[half][kLinear][c]);
        }
    }
    fill_rows(workers, {&noise[0], &noise[1], &noise[2]}, [&](int y) {
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t half = 0; half < 2; ++half) halve(fine[half][kLinear][c], y, before[half][c]);
            const float *const a = before[0][c].row(y), *const b = before[1][c].row(y);
            float* const difference = noise[c].row(y);
            for (int x = 0; x < size.x; ++x) difference[x] = std::fabs(a[x] - b[x]);
        }
    });
    fill_rows(workers, changes, [&](int y) {
        std::vector<float> deviation(static_cast<std::size_t>(size.x));
        for (std::size_t c = 0; c < 3; ++c) {
            mean_of_most<kReachOfNoise, kStepOfNoise>(noise[c], y, deviation);
            for (std::size_t half = 0; half < 2; ++half) {
                const float* const was = before[half][c].row(y);
                float* const to = change[half][kLinear][c].row(y);
                for (int x = 0; x < size.x; ++x) {
                    const float most = kMostChange * std::fabs(was[x]) +
                                       kMostDeviations * deviation[static_cast<std::size_t>(x)];
                    // A positive change is added to fine pixels. A negative one becomes a share of the light,
                    // by which they are multiplied: beside a steep edge dark ones would become black. The
                    // share is at least -1, where a tiny value would not let it be finite.
                    const float added = std::clamp(to[x] - was[x], -most, most);
                    to[x] = added < 0 && was[x] > 0 ? std::max(added / was[x], -1.0F) : std::max(added, 0.0F);
                }
            }
        }
    });
    const Upsampler upsampler(features, coarse.features);
    for_each_row(workers, {width, height}, [&](int y) { upsampler.apply(y, planes); });
}

}  // namespace

std::array<Filtered, 2> regress_in_scales(const FeaturePlanes& features,
                                          const std::array<HalfPlanes, 2>& halves, const Workers& workers) {
    return regress_in_scales(features, halves, kScales, workers);
}

}  // namespace lucerna
