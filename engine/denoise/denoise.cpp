#include "engine/denoise/denoise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "engine/colour/colour_space.h"
#include "engine/denoise/scales.h"

namespace lucerna {
namespace {

using Numbers = std::vector<double>;

// Limits the brightness for comparisons, as a multiple of the image's mean: float32 holds its square.
constexpr float kBrightest = 1e15F;
// A pixel of a half without a sample has been filled from its neighbours (complete_halves()), so that its
// noise is that of about so many samples.
constexpr float kSamplesOfFilled = 8;
// Weight, relative to a pixel with samples, of one that has been filled: it repeats what its neighbours say.
constexpr float kTrustInFilled = 1e-3F;

std::size_t area(const V2i& size) {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
}
V2i size_of(const Image& image) {
    return {image.width, image.height};
}

// Keeps squares within what float32 holds.
float bounded(double square) {
    return static_cast<float>(std::min(square, sqr(double{kBrightest})));
}

// --- input of the filter ---

float inverse_footprint(const ColourPlanes& position, int x, int y) {
    const V2i size = size_of(position[0]);
    float nearest2 = INFINITY;
    for (const V2i& step : {V2i(1, 0), V2i(-1, 0), V2i(0, 1), V2i(0, -1)}) {
        const int u = x + step.x, v = y + step.y;
        if (u < 0 || v < 0 || u >= size.x || v >= size.y) continue;
        float distance2 = 0;
        for (const Plane& p : position) distance2 += sqr(p.row(v)[u] - p.row(y)[x]);
        if (distance2 > 0) nearest2 = std::min(nearest2, distance2);
    }
    return std::isfinite(nearest2) ? 1 / std::sqrt(nearest2) : 0;
}

FeaturePlanes feature_planes(const Image& features, const Workers& workers) {
    const V2i size = size_of(features);
    FeaturePlanes planes;
    static_assert(kNormal == kAlbedo + 3 && kPosition == kNormal + 3 && kGeometricNormal == kDepth + 1 &&
                  kEmitter == kGeometricNormal + 3);
    constexpr std::size_t kFirst = 9, kCopied = 13;  // channels from kAlbedo and from kGeometricNormal on
    const std::array<Plane*, kCopied> copied{&planes.albedo[0],
                                             &planes.albedo[1],
                                             &planes.albedo[2],
                                             &planes.normal[0],
                                             &planes.normal[1],
                                             &planes.normal[2],
                                             &planes.position[0],
                                             &planes.position[1],
                                             &planes.position[2],
                                             &planes.geometric_normal[0],
                                             &planes.geometric_normal[1],
                                             &planes.geometric_normal[2],
                                             &planes.emitter};
    std::vector<Plane*> filled(copied.begin(), copied.end());
    filled.push_back(&planes.inverse_albedo);
    make_planes(size, filled);
    make_planes(size, {&planes.inside, &planes.inverse_footprint});
    // Falls from 2 to 0.1 as the albedo's luminance grows from 0 to 1.
    constexpr float kSlope = 0.1F, kLeast = 0.05F;
    fill_rows(workers, filled, [&](int y) {
        const float* const from = &features.data[features.index(0, y)];
        std::array<float*, kCopied> to;
        for (std::size_t i = 0; i < kCopied; ++i) to[i] = copied[i]->row(y);
        float* const inverse_albedo = planes.inverse_albedo.row(y);
        for (int x = 0; x < size.x; ++x) {
            const float* const pixel = from + kFeatureChannels * x;
            for (std::size_t i = 0; i < kFirst; ++i) to[i][x] = pixel[kAlbedo + i];
            for (std::size_t i = kFirst; i < kCopied; ++i) to[i][x] = pixel[kGeometricNormal + i - kFirst];
            const Rgb albedo(pixel[kAlbedo], pixel[kAlbedo + 1], pixel[kAlbedo + 2]);
            inverse_albedo[x] = kSlope / (luminance(albedo) + kLeast);
        }
        std::fill_n(planes.inside.row(y), size.x, 1.0F);
    });
    planes.inverse_footprint.fill(workers,
                                  [&](int x, int y) { return inverse_footprint(planes.position, x, y); });
    return planes;
}

// Holds a half's light in multiples of the image's mean luminance, and the variance of it. `samples` is the
// number of samples whose noise a pixel has: at least 1, and kSamplesOfFilled where `trust` is
// kTrustInFilled; elsewhere `trust` is 1. Rims are 0.
struct HalfLight {
    ColourPlanes light, variance;
    Plane samples, trust;
};

std::array<HalfLight, 2> light_of(const std::array<Image, 2>& halves, double scale, const Workers& workers) {
    const V2i size = size_of(halves[0]);
    std::array<HalfLight, 2> result;
    for (HalfLight& half : result) {
        for (std::size_t c = 0; c < 3; ++c) make_planes(size, {&half.light[c], &half.variance[c]});
        make_planes(size, {&half.samples, &half.trust});
    }
    for_each_row(workers, size, [&](int y) {
        for (std::size_t h = 0; h < 2; ++h) {
            HalfLight& planes = result[h];
            const float* const from = &halves[h].data[halves[h].index(0, y)];
            for (int x = 0; x < size.x; ++x) {
                const float* const pixel = from + kHalfChannels * x;
                for (std::size_t c = 0; c < 3; ++c) {
                    planes.light[c].row(y)[x] = static_cast<float>(std::clamp(
                        double{pixel[kLight + c]} * scale, -double{kBrightest}, double{kBrightest}));
                    planes.variance[c].row(y)[x] = bounded(double{pixel[kVariance + c]} * sqr(scale));
                }
                const bool is_filled = !(pixel[kSamples] > 0);
                planes.samples.row(y)[x] = is_filled ? kSamplesOfFilled : std::max(1.0F, pixel[kSamples]);
                planes.trust.row(y)[x] = is_filled ? kTrustInFilled : 1;
            }
        }
    });
    return result;
}

// Completes variances of pixels with a single sample or none, which say nothing about their variance: they
// get that of the surrounding pixels, estimated from their samples and the difference of their halves. The
// pixel's own difference is one of many: where the halves agree by chance, both would otherwise stay as they
// are.
void complete_variances(std::array<HalfLight, 2>& halves, const Workers& workers) {
    const V2i size = size_of(halves[0].samples);
    const auto is_known = [](const HalfLight& half, int x, int y) {
        return half.samples.row(y)[x] > 1 && half.trust.row(y)[x] == 1;
    };
    std::vector<std::uint8_t> row_is_known(static_cast<std::size_t>(size.y), 1);
    Plane freedom(size.x, size.y);
    // The variances of one sample results, per pixel, from the sum of squares and its degrees of freedom.
    const auto more = [&](const HalfLight& half, int x, int y) {
        return half.trust.row(y)[x] == 1 ? half.samples.row(y)[x] - 1 : 0;
    };
    for_each_row(workers, size, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            freedom.row(y)[x] = 1 + more(halves[0], x, y) + more(halves[1], x, y);
            if (!is_known(halves[0], x, y) || !is_known(halves[1], x, y))
                row_is_known[static_cast<std::size_t>(y)] = 0;
        }
    });
    if (std::find(row_is_known.begin(), row_is_known.end(), 0) == row_is_known.end()) return;
    ColourPlanes squares;
    make_planes(size, {&squares[0], &squares[1], &squares[2]});
    for_each_row(workers, size, [&](int y) {
        for (std::size_t c = 0; c < 3; ++c) {
            float* const to = squares[c].row(y);
            for (int x = 0; x < size.x; ++x) {
                const float n_a = halves[0].samples.row(y)[x], n_b = halves[1].samples.row(y)[x];
                float sum = sqr(halves[0].light[c].row(y)[x] - halves[1].light[c].row(y)[x]) *
                            (n_a * n_b / (n_a + n_b));
                for (const HalfLight& half : halves)
                    sum += more(half, x, y) * half.samples.row(y)[x] * half.variance[c].row(y)[x];
                to[x] = sum;
            }
        }
    });
    for_each_row(workers, size, [&](int y) {
        if (row_is_known[static_cast<std::size_t>(y)] != 0) return;
        std::vector<float> freedoms(static_cast<std::size_t>(size.x)), others(freedoms.size());
        mean_of_most<2, 1>(freedom, y, freedoms);
        for (std::size_t c = 0; c < 3; ++c) {
            mean_of_most<2, 1>(squares[c], y, others);
            for (int x = 0; x < size.x; ++x) {
                const auto i = static_cast<std::size_t>(x);
                // The pixel's own counts where there are hardly others.
                const float variance =
                    freedoms[i] > 0 ? others[i] / freedoms[i] : squares[c].row(y)[x] / freedom.row(y)[x];
                for (HalfLight& half : halves) {
                    if (!is_known(half, x, y))
                        half.variance[c].row(y)[x] = bounded(double{variance / half.samples.row(y)[x]});
                }
            }
        }
    });
}

// Returns the ratio of the halves' squared difference to what their samples' variances predict: below 1 where
// samples are stratified, above 1 where they depend on each other, as those of one pass do. It is averaged
// over a wide window, so that a pixel's weights learn almost nothing about the other half from it.
Plane dependence(const std::array<HalfLight, 2>& halves, const Workers& workers) {
    constexpr int kReach = 7;
    constexpr float kMost = 16;
    const V2i size = size_of(halves[0].samples);
    Plane measured(size.x, size.y), stated(size.x, size.y);
    for_each_row(workers, size, [&](int y) {
        float *const of_difference = measured.row(y), *const of_samples = stated.row(y);
        for (const HalfLight& half : halves) {
            const float *const r = half.light[0].row(y), *const g = half.light[1].row(y),
                               *const b = half.light[2].row(y);
            const float sign = &half == &halves[0] ? 1.0F : -1.0F;
            for (int x = 0; x < size.x; ++x) of_difference[x] += sign * luminance(Rgb(r[x], g[x], b[x]));
            const float *const vr = half.variance[0].row(y), *const vg = half.variance[1].row(y),
                               *const vb = half.variance[2].row(y);
            for (int x = 0; x < size.x; ++x)
                of_samples[x] += sqr(luminance(Rgb(std::sqrt(vr[x]), std::sqrt(vg[x]), std::sqrt(vb[x]))));
        }
        for (int x = 0; x < size.x; ++x) of_difference[x] = sqr(of_difference[x]);
    });
    std::array<Plane, 2> both = sums<2>({&measured, &stated}, kReach, workers);
    Plane& ratio = both[0];
    const Plane& predicted = both[1];
    for_each_row(workers, size, [&](int y) {
        float* const to = ratio.row(y);
        const float* const by = predicted.row(y);
        for (int x = 0; x < size.x; ++x) to[x] = by[x] > 0 ? std::clamp(to[x] / by[x], 1 / kMost, kMost) : 1;
    });
    return std::move(ratio);
}

// Returns the halves' light divided by the albedo, and what its variance determines: that of the pixel's own
// samples, blended with that of its neighbours where the samples are few. Takes the trust of `halves`.
std::array<HalfPlanes, 2> half_planes(std::array<HalfLight, 2>& halves, const FeaturePlanes& features,
                                      const Plane& dependence, const Workers& workers) {
    const ColourPlanes& albedo = features.albedo;
    constexpr float kWorth = 4;  // number of samples that the neighbours count for
    const V2i size = size_of(albedo[0]);
    std::array<HalfPlanes, 2> result;
    std::array<ColourPlanes, 2> own;  // variances of the pixels' own samples
    std::vector<Plane*> first, second;
    for (std::size_t h = 0; h < 2; ++h) {
        HalfPlanes& planes = result[h];
        for (std::size_t c = 0; c < 3; ++c) {
            first.insert(first.end(), {&planes.value[c], &own[h][c]});
            second.push_back(&planes.variance[c]);
        }
        second.insert(second.end(), {&planes.own, &planes.own_noise});
    }
    make_planes(size, first);
    make_planes(size, second);
    fill_rows(workers, first, [&](int y) {
        for (std::size_t h = 0; h < 2; ++h) {
            for (std::size_t c = 0; c < 3; ++c) {
                const float *const light = halves[h].light[c].row(y),
                                   *const variance = halves[h].variance[c].row(y),
                                   *const by = albedo[c].row(y);
                float *const value = result[h].value[c].row(y), *const of_own = own[h][c].row(y);
                for (int x = 0; x < size.x; ++x) {
                    const float factor = 1 / (by[x] + kLeastAlbedo);
                    value[x] = std::clamp(factor * light[x], -kBrightest, kBrightest);
                    of_own[x] = std::min(factor * factor * variance[x], sqr(kBrightest));
                }
            }
        }
    });
    for (std::size_t h = 0; h < 2; ++h) {
        result[h].sampled = std::move(halves[h].trust);
        second.push_back(&result[h].sampled);
    }
    fill_rows(workers, second, [&](int y) {
        const float* const depends = dependence.row(y);
        for (std::size_t h = 0; h < 2; ++h) {
            HalfPlanes& planes = result[h];
            const float* const samples = halves[h].samples.row(y);
            for (std::size_t c = 0; c < 3; ++c) {
                const float* const of_own = own[h][c].row(y);
                const Around sum(own[h][c], y);
                float* const to = planes.variance[c].row(y);
                for (int x = 0; x < size.x; ++x) {
                    const float known = samples[x] - 1;  // degrees of freedom
                    const float mixed = (known * of_own[x] + kWorth / 9 * sum(x)) / (known + kWorth);
                    to[x] = std::min(depends[x] * mixed, sqr(kBrightest));
                }
            }
            float *const guide = planes.own.row(y), *const noise = planes.own_noise.row(y);
            guide_of(planes.value, y, guide);
            guide_deviation(planes.variance, y, noise);
            // The variance of few samples is often much too small.
            for (int x = 0; x < size.x; ++x) {
                const float n = samples[x];
                noise[x] = sqr(noise[x]) + sqr(guide[x]) / (n * n * n);
            }
        }
    });
    set_guides(features, result, workers);
    return result;
}

// --- input of the mixture ---

// Weights the halves in their mean by their numbers of samples in the whole image. Where samples were
// allocated adaptively, a pixel's own numbers would bias it.
using Shares = std::array<double, 2>;

// Holds sums over a half's pixels.
struct Totals {
    double luminance = 0, samples = 0;
};
Totals totals_of(const Image& half, const Workers& workers) {
    const V2i size = size_of(half);
    std::vector<Totals> rows(static_cast<std::size_t>(size.y));
    for_each_row(workers, size, [&](int y) {
        Totals& row = rows[static_cast<std::size_t>(y)];
        for (int x = 0; x < size.x; ++x) {
            row.luminance += double{luminance(half.rgb_at(x, y))};
            row.samples += double{half.value(x, y, kSamples)};
        }
    });
    Totals all;
    for (const Totals& row : rows) all.luminance += row.luminance, all.samples += row.samples;
    return all;
}

// Holds an image made of each half, and the estimated error of their mean by pixel, squared and relative.
struct Estimate {
    std::array<ColourPlanes, 2> of;
    std::array<Plane, 2> luminance;
    // In these images each pixel is mixed in shares that its own error did not influence. A share that is
    // chosen as the best for noisy errors looks better than it is if the same errors judge it.
    std::array<Plane, 2> held_out;
    Plane error;
};

void set_luminance(const ColourPlanes& colours, int y, Plane& luminances) {
    float* const to = luminances.row(y);
    const float *const r = colours[0].row(y), *const g = colours[1].row(y), *const b = colours[2].row(y);
    for (int x = 0; x < luminances.width(); ++x) to[x] = luminance(Rgb(r[x], g[x], b[x]));
}

// Standard errors by which a gain must be known before one filtered image is mixed into the other, or before
// the measured one is: its fireflies would show. With less caution, dark spots are left where many samples
// happen to have missed rare light, because these samples judge, too.
constexpr float kCaution = 1.5F, kCautionWithNoise = 2;

class Mixer {
  public:
    // `measured` has the halves as they are. Errors are relative to the lesser luminance of two filtered
    // images: where light has leaked into the dark, errors would look smaller than they are.
    Mixer(const V2i& size, const Shares& shares, Estimate measured, const Estimate& linear,
          const Estimate& constant, const Workers& workers)
        : size_(size),
          a_(shares[0]),
          b_(shares[1]),
          workers_(workers),
          measured_(std::move(measured)),
          inverse_scale_(size.x, size.y),
          columns_(static_cast<std::size_t>(size.x + 2 * Plane::kRim)) {
        std::fill(columns_.begin(), columns_.end(), 1.0F);
        for (int x = 0; x < size.x; ++x)
            columns_[static_cast<std::size_t>(Plane::kRim + x)] =
                static_cast<float>(pixels_along(x, size.x, kReach));
        std::vector<double> rows(static_cast<std::size_t>(size.y));
        for_each_row(workers, size, [&](int y) {
            float* const level = inverse_scale_.row(y);
            const float *const a_1 = linear.luminance[0].row(y), *const b_1 = linear.luminance[1].row(y);
            const float *const a_2 = constant.luminance[0].row(y), *const b_2 = constant.luminance[1].row(y);
            for (int x = 0; x < size.x; ++x) level[x] = std::min(mean(a_1[x], b_1[x]), mean(a_2[x], b_2[x]));
            rows[static_cast<std::size_t>(y)] = std::accumulate(level, level + size.x, 0.0);
        });
        const double average =
            std::accumulate(rows.begin(), rows.end(), 0.0) / static_cast<double>(area(size));
        for_each_row(workers, size, [&](int y) {
            float* const level = inverse_scale_.row(y);
            for (int x = 0; x < size.x; ++x) {
                const double scale = error_scale2(double{level[x]}, average);
                level[x] = scale > 0 ? static_cast<float>(1 / scale) : 0;  // 0 where everything is black
            }
        });
        measured_.error = error(measured_.luminance);
    }

    const Estimate& measured() const { return measured_; }

    // Estimates the squared error of images made of the halves. D_A, made of A, has the error mean[(D_A - B)²
    // - a (A - B)²], where a is A's share of the samples, because that part of the difference is B's own
    // error. The mean of D_A and D_B has their errors' mean, weighted by their shares, less a b (D_A - D_B)².
    Plane error(const std::array<Plane, 2>& of) const {
        Plane error(size_.x, size_.y);
        for_each_row(workers_, size_, [&](int y) {
            const float *const as = measured_.luminance[0].row(y), *const bs = measured_.luminance[1].row(y);
            const float *const of_a = of[0].row(y), *const of_b = of[1].row(y);
            const float* const inverse = inverse_scale_.row(y);
            float* const to = error.row(y);
            for (int x = 0; x < size_.x; ++x) {
                // Where a half has a pixel of much light, terms cancel that are far above their sum.
                const double light_a = double{as[x]}, light_b = double{bs[x]};
                const double made_a = double{of_a[x]}, made_b = double{of_b[x]};
                const double noise = sqr(light_a - light_b);
                const double error_a = sqr(made_a - light_b) - a_ * noise;
                const double error_b = sqr(made_b - light_a) - b_ * noise;
                const double sum = a_ * error_a + b_ * error_b - a_ * b_ * sqr(made_a - made_b);
                to[x] = static_cast<float>(double{inverse[x]} * sum);
            }
        });
        return error;
    }

    // Mixes the second into the first with the share that minimises the error: with the errors E and the
    // difference d of both, it is (E₁ - E₂ + d²)/(2 d²), with both terms summed over the neighbourhood. The
    // first sum is reduced by `caution` standard errors: chance must not bring noise into the first.
    void mix(Estimate& first, const Estimate& second, float caution) const {
        Plane difference_of(size_.x, size_.y), gain_of(size_.x, size_.y), square_of(size_.x, size_.y),
            share(size_.x, size_.y);
        for_each_row(workers_, size_, [&](int y) {
            float *const difference = difference_of.row(y), *const gain = gain_of.row(y),
                         *const square = square_of.row(y);
            const float *const inverse = inverse_scale_.row(y), *const error_1 = first.error.row(y),
                               *const error_2 = second.error.row(y);
            const float *const a_1 = first.luminance[0].row(y), *const b_1 = first.luminance[1].row(y);
            const float *const a_2 = second.luminance[0].row(y), *const b_2 = second.luminance[1].row(y);
            for (int x = 0; x < size_.x; ++x) {
                const float d = inverse[x] * sqr(mean(a_1[x], b_1[x]) - mean(a_2[x], b_2[x]));
                const float g = error_1[x] - error_2[x] + d;
                difference[x] = d, gain[x] = g, square[x] = sqr(g);
            }
        });
        const Terms terms{&gain_of, &square_of, &difference_of};
        const auto about = sums(terms, kReach, workers_), nearest = sums(terms, kSmooth, workers_);
        for_each_row(workers_, size_, [&](int y) {
            const float *const gain = about[0].row(y), *const square = about[1].row(y),
                               *const difference = about[2].row(y);
            float* const to = share.row(y);
            const auto rows = static_cast<float>(pixels_along(y, size_.y, kReach));
            const float* const columns = &columns_[Plane::kRim];
            for (int x = 0; x < size_.x; ++x)
                to[x] = best(gain[x], square[x], 1 / (rows * columns[x]), difference[x], caution);
            hold_out(y, first, second, about, nearest, caution);
        });
        const auto smooth = smoothed<1>({&share}, kSmooth, workers_);
        for_each_row(workers_, size_, [&](int y) { blend(y, first, second, smooth[0], difference_of); });
    }

  private:
    // Half sides of the squares over which errors and shares are averaged.
    static constexpr int kReach = 8, kSmooth = 2;
    static_assert(kReach <= Plane::kRim);

    // The terms of shares by pixel: the gain, its square, and the squared difference. Rims are 0.
    using Terms = std::array<const Plane*, 3>;
    using SumsOfTerms = std::array<Plane, 3>;
    // Returns the best share by sums over pixels: of the gain, of its square, and of the squared difference.
    static float best(float gain, float squares, float inverse_of_pixels, float difference, float caution) {
        const float variance = std::max(0.0F, squares - sqr(gain) * inverse_of_pixels);
        const float share = (gain - caution * std::sqrt(variance)) / (2 * difference);
        return difference > 0 ? std::clamp(share, 0.0F, 1.0F) : 0;
    }

    // Mixes a row of the images that are held out, in shares from the neighbourhood without the pixel itself
    // and those nearest to it, whose filtered values have samples in common with its own.
    void hold_out(int y, Estimate& first, const Estimate& second, const SumsOfTerms& about,
                  const SumsOfTerms& nearest, float caution) const {
        const float *const all_gain = about[0].row(y), *const gain = nearest[0].row(y);
        const float *const all_square = about[1].row(y), *const square = nearest[1].row(y);
        const float *const all_difference = about[2].row(y), *const difference = nearest[2].row(y);
        float *const to_a = first.held_out[0].row(y), *const to_b = first.held_out[1].row(y);
        const float *const a = second.luminance[0].row(y), *const b = second.luminance[1].row(y);
        for (int x = 0; x < size_.x; ++x) {
            const int others = pixels_about(x, y, kReach) - pixels_about(x, y, kSmooth);
            const float share =
                best(all_gain[x] - gain[x], all_square[x] - square[x],
                     1 / static_cast<float>(std::max(1, others)), all_difference[x] - difference[x], caution);
            to_a[x] += share * (a[x] - to_a[x]);
            to_b[x] += share * (b[x] - to_b[x]);
        }
    }
    int pixels_about(int x, int y, int reach) const {
        return pixels_along(x, size_.x, reach) * pixels_along(y, size_.y, reach);
    }

    // Mixes a row of the second into the first.
    void blend(int y, Estimate& first, const Estimate& second, const Plane& shares,
               const Plane& differences) const {
        const float *const share = shares.row(y), *const difference = differences.row(y);
        const auto mix_row = [&](Plane& to, const Plane& from) {
            float* const t = to.row(y);
            const float* const f = from.row(y);
            for (int x = 0; x < size_.x; ++x) t[x] += share[x] * (f[x] - t[x]);
        };
        mix_row(first.error, second.error);
        float* const error = first.error.row(y);
        for (int x = 0; x < size_.x; ++x) error[x] -= share[x] * (1 - share[x]) * difference[x];
        for (std::size_t half = 0; half < 2; ++half) {
            for (std::size_t c = 0; c < 3; ++c) mix_row(first.of[half][c], second.of[half][c]);
            mix_row(first.luminance[half], second.luminance[half]);
        }
    }
    float mean(float of_a, float of_b) const {
        return static_cast<float>(a_ * double{of_a} + b_ * double{of_b});
    }

    V2i size_;
    double a_, b_;  // shares of the halves in their mean
    const Workers& workers_;
    Estimate measured_;
    Plane inverse_scale_;
    std::vector<float> columns_;  // number of columns of the neighbourhood, with the rim of a plane
};

// Holds the mean of the pixels' squared errors, and its standard error. Each error is noisy and as often
// below as above its mean, so it may be negative. As in Film::error(), outliers that would dominate the mean
// are left out.
struct MeanError {
    double mean, standard_error;
    std::uint64_t pixels;

    // Returns the root of the mean, but at least that of its standard error.
    double root() const { return std::sqrt(std::max(mean, standard_error)); }
    // Tells whether two standard errors are less than what makes the root wrong by a factor of 1.5.
    bool is_known() const { return pixels > 1 && standard_error <= 0.25 * mean; }
};
MeanError mean_error(const Numbers& errors) {
    Numbers sizes(errors.size());
    for (std::size_t i = 0; i < errors.size(); ++i) sizes[i] = std::fabs(errors[i]);
    const double limit = limit_of_most(std::move(sizes));
    RunningStats stats;
    for (const double error : errors) {
        if (std::fabs(error) <= limit) stats.add(error);
    }
    return {stats.mean(), stats.standard_error(), stats.count()};
}

// Returns the filtered images, multiplied by the albedo, by whose inverse the light was multiplied.
std::array<Estimate, kCandidates> estimates_of(std::array<Filtered, 2> filtered, const ColourPlanes& albedo,
                                               const Workers& workers) {
    const V2i size = size_of(albedo[0]);
    std::array<Estimate, kCandidates> result;
    for (std::size_t candidate = 0; candidate < kCandidates; ++candidate) {
        Estimate& estimate = result[candidate];
        make_planes(size, {&estimate.luminance[0], &estimate.luminance[1]});
        for (std::size_t half = 0; half < 2; ++half) estimate.of[half] = std::move(filtered[half][candidate]);
    }
    for_each_row(workers, size, [&](int y) {
        for (Estimate& estimate : result) {
            for (std::size_t half = 0; half < 2; ++half) {
                for (std::size_t c = 0; c < 3; ++c) {
                    float* const to = estimate.of[half][c].row(y);
                    const float* const by = albedo[c].row(y);
                    for (int x = 0; x < size.x; ++x) to[x] *= by[x] + kLeastAlbedo;
                }
                set_luminance(estimate.of[half], y, estimate.luminance[half]);
            }
        }
    });
    return result;
}

// Returns the halves as they are.
Estimate measured(std::array<HalfLight, 2>& halves, const Workers& workers) {
    Estimate estimate;
    const V2i size = size_of(halves[0].samples);
    make_planes(size, {&estimate.luminance[0], &estimate.luminance[1]});
    for (std::size_t half = 0; half < 2; ++half) estimate.of[half] = std::move(halves[half].light);
    for_each_row(workers, size, [&](int y) {
        for (std::size_t half = 0; half < 2; ++half)
            set_luminance(estimate.of[half], y, estimate.luminance[half]);
    });
    return estimate;
}

}  // namespace

const std::vector<std::string>& feature_channels() {
    static const std::vector<std::string> names{"albedo.R", "albedo.G", "albedo.B", "N.X",      "N.Y",
                                                "N.Z",      "P.X",      "P.Y",      "P.Z",      "Z",
                                                "Ng.X",     "Ng.Y",     "Ng.Z",     "emitter.Y"};
    return names;
}

const std::vector<std::string>& half_channels() {
    static const std::vector<std::string> names{"R",          "G",          "B",      "variance.R",
                                                "variance.G", "variance.B", "samples"};
    return names;
}

namespace {

// Returns some of an image's channels, selected by their names after `prefix`.
Image part_of(const Image& image, const std::vector<std::string>& names, const std::string& prefix,
              const std::string& file) {
    std::vector<std::size_t> from;
    for (const std::string& name : names) {
        const auto channel = find_channel(image, prefix + name);
        if (!channel) {
            throw InputError(
                {file}, "has no channel " + prefix + name +
                            ", which denoising needs; expected an image written by lucerna render --layers");
        }
        from.push_back(*channel);
    }
    Image part(image.width, image.height, names);
    part.space = space_of_layers(image);
    for (std::size_t i = 0; i < area(size_of(image)); ++i) {
        for (std::size_t c = 0; c < from.size(); ++c)
            part.data[i * from.size() + c] = image.data[i * image.channels.size() + from[c]];
    }
    return part;
}

}  // namespace

void add_denoiser_input(Image& image, const DenoiserInput& layers) {
    for (std::size_t half = 0; half < 2; ++half) add_channels(image, layers.halves[half], kHalfNames[half]);
    add_channels(image, layers.features, "");
}

DenoiserInput denoiser_input_of(const Image& image, const std::string& file, const std::string& layer) {
    return {{part_of(image, half_channels(), kHalfNames[0] + layer, file),
             part_of(image, half_channels(), kHalfNames[1] + layer, file)},
            part_of(image, feature_channels(), "", file)};
}

namespace {

// Filters both halves. Takes the trust of `halves`.
std::array<Filtered, 2> filtered(std::array<HalfLight, 2>& halves, const FeaturePlanes& features,
                                 const Workers& workers) {
    const std::array<HalfPlanes, 2> planes =
        half_planes(halves, features, dependence(halves, workers), workers);
    return regress_in_scales(features, planes, workers);
}

}  // namespace

Denoised denoise(const DenoiserInput& input, const Workers& workers) {
    const V2i size = size_of(input.features);
    const std::array<Totals, 2> totals{totals_of(input.halves[0], workers),
                                       totals_of(input.halves[1], workers)};
    const double samples = totals[0].samples + totals[1].samples;
    const Shares shares =
        samples > 0 ? Shares{totals[0].samples / samples, totals[1].samples / samples} : Shares{0.5, 0.5};
    const auto pixels = static_cast<double>(area(size));
    const double mean = (shares[0] * totals[0].luminance + shares[1] * totals[1].luminance) / pixels;
    // Distances are relative to noise, whatever the unit. The scale puts values into float32's middle range.
    const double scale = mean > 0 ? 1 / mean : 1;
    const FeaturePlanes features = feature_planes(input.features, workers);
    std::array<HalfLight, 2> halves = light_of(input.halves, scale, workers);
    complete_variances(halves, workers);
    auto estimates = estimates_of(filtered(halves, features, workers), features.albedo, workers);
    Estimate &result = estimates[0], &constant = estimates[1];
    const Mixer mixer(size, shares, measured(halves, workers), result, constant, workers);
    result.error = mixer.error(result.luminance);
    result.held_out = result.luminance;
    constant.error = mixer.error(constant.luminance);
    mixer.mix(result, constant, kCaution);
    mixer.mix(result, mixer.measured(), kCautionWithNoise);

    Denoised denoised{Image::rgb(size.x, size.y), 0, false};
    denoised.image.space = input.halves[0].space;
    for_each_row(workers, size, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            for (std::size_t c = 0; c < 3; ++c) {
                const double value = shares[0] * double{result.of[0][c].row(y)[x]} +
                                     shares[1] * double{result.of[1][c].row(y)[x]};
                denoised.image.value(x, y, static_cast<int>(c)) = static_cast<float>(value / scale);
            }
        }
    });
    const Plane errors = mixer.error(result.held_out);
    Numbers each;
    each.reserve(area(size));
    for (int y = 0; y < size.y; ++y) each.insert(each.end(), errors.row(y), errors.row(y) + size.x);
    const MeanError error = mean_error(each);
    denoised.relative_error = error.root();
    // Halves of one sample per pixel have seldom met the rare bright samples that cause most of the error, so
    // that their difference is too small.
    const auto has_two = [pixels](const Totals& of) { return of.samples >= 2 * pixels; };
    denoised.error_is_known = error.is_known() && has_two(totals[0]) && has_two(totals[1]);
    return denoised;
}

}  // namespace lucerna
