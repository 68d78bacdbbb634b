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

// kLeastAlbedo is added to albedos before light is divided by them, so that black surfaces cause no division
// by 0.
constexpr float kLeastAlbedo = 0.01F;
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

// Copies channels into planes, the values of consecutive channels from `first` on.
template <std::size_t N>
void copy_channels(const Image& image, int first, const std::array<Plane*, N>& planes,
                   const Workers& workers) {
    for (Plane* const plane : planes) *plane = Plane(image.width, image.height);
    const std::size_t stride = image.channels.size();
    for_each_row(workers, size_of(image), [&](int y) {
        const float* const from = &image.data[image.index(0, y) + static_cast<std::size_t>(first)];
        std::array<float*, N> to;
        for (std::size_t i = 0; i < N; ++i) to[i] = planes[i]->row(y);
        for (std::size_t x = 0; x < static_cast<std::size_t>(image.width); ++x) {
            for (std::size_t i = 0; i < N; ++i) to[i][x] = from[stride * x + i];
        }
    });
    for (Plane* const plane : planes) plane->extend();
}

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
    FeaturePlanes planes;
    static_assert(kNormal == kAlbedo + 3 && kPosition == kNormal + 3 && kGeometricNormal == kDepth + 1 &&
                  kEmitter == kGeometricNormal + 3);
    copy_channels<9>(
        features, kAlbedo,
        {&planes.albedo[0], &planes.albedo[1], &planes.albedo[2], &planes.normal[0], &planes.normal[1],
         &planes.normal[2], &planes.position[0], &planes.position[1], &planes.position[2]},
        workers);
    copy_channels<4>(features, kGeometricNormal,
                     {&planes.geometric_normal[0], &planes.geometric_normal[1], &planes.geometric_normal[2],
                      &planes.emitter},
                     workers);
    planes.inverse_footprint = Plane(features.width, features.height);
    planes.inverse_footprint.fill(workers,
                                  [&](int x, int y) { return inverse_footprint(planes.position, x, y); });
    // Falls from 2 to 0.1 as the albedo's luminance grows from 0 to 1.
    constexpr float kSlope = 0.1F, kLeast = 0.05F;
    planes.inverse_albedo = Plane(features.width, features.height);
    planes.inverse_albedo.fill(workers, [&](int x, int y) {
        const Rgb albedo(planes.albedo[0].row(y)[x], planes.albedo[1].row(y)[x], planes.albedo[2].row(y)[x]);
        return kSlope / (luminance(albedo) + kLeast);
    });
    planes.inside = Plane(features.width, features.height);
    for (int y = 0; y < features.height; ++y) std::fill_n(planes.inside.row(y), features.width, 1.0F);
    return planes;
}

// Holds a half's light in multiples of the image's mean luminance, and the variance of it. `samples` is the
// number of samples whose noise a pixel has: at least 1, and kSamplesOfFilled where `trust` is
// kTrustInFilled; elsewhere `trust` is 1. Rims are 0.
struct HalfLight {
    ColourPlanes light, variance;
    Plane samples, trust;
};

HalfLight half_light(const Image& half, double scale, const Workers& workers) {
    const V2i size = size_of(half);
    HalfLight planes{{}, {}, Plane(size.x, size.y), Plane(size.x, size.y)};
    for (std::size_t c = 0; c < 3; ++c)
        planes.light[c] = Plane(size.x, size.y), planes.variance[c] = Plane(size.x, size.y);
    for_each_row(workers, size, [&](int y) {
        const float* const from = &half.data[half.index(0, y)];
        for (int x = 0; x < size.x; ++x) {
            const float* const pixel = from + kHalfChannels * x;
            for (std::size_t c = 0; c < 3; ++c) {
                planes.light[c].row(y)[x] = static_cast<float>(
                    std::clamp(double{pixel[kLight + c]} * scale, -double{kBrightest}, double{kBrightest}));
                planes.variance[c].row(y)[x] = bounded(double{pixel[kVariance + c]} * sqr(scale));
            }
            const bool is_filled = !(pixel[kSamples] > 0);
            planes.samples.row(y)[x] = is_filled ? kSamplesOfFilled : std::max(1.0F, pixel[kSamples]);
            planes.trust.row(y)[x] = is_filled ? kTrustInFilled : 1;
        }
    });
    return planes;
}

// Returns sums over 5 x 5 pixels without the one in the middle: if that one has much light, it would not
// cancel exactly. The rim of `from` must be 0.
Plane sums_of_others(const Plane& from, const Workers& workers) {
    const V2i size = size_of(from);
    Plane columns(size.x, size.y), result(size.x, size.y);
    for_each_row(workers, size, [&](int y) {
        const std::array<const float*, 5> in{from.row(y - 2), from.row(y - 1), from.row(y), from.row(y + 1),
                                             from.row(y + 2)};
        float *const column = columns.row(y), *const to = result.row(y);
        for (int x = 0; x < size.x; ++x) {
            to[x] = in[0][x] + in[1][x] + in[3][x] + in[4][x];
            column[x] = to[x] + in[2][x];
        }
        for (int x = 0; x < size.x; ++x)
            to[x] += column[x - 2] + column[x - 1] + column[x + 1] + column[x + 2];
    });
    return result;
}

// Completes variances of pixels with a single sample or none, which say nothing about their variance: they
// get that of the surrounding pixels, estimated from their samples and the difference of their halves. The
// pixel's own difference is excluded: where the halves agree by chance, both would stay as they are.
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
    const Plane freedoms = sums_of_others(freedom, workers);
    for (std::size_t c = 0; c < 3; ++c) {
        Plane squares(size.x, size.y);
        for_each_row(workers, size, [&](int y) {
            for (int x = 0; x < size.x; ++x) {
                const float n_a = halves[0].samples.row(y)[x], n_b = halves[1].samples.row(y)[x];
                float sum = sqr(halves[0].light[c].row(y)[x] - halves[1].light[c].row(y)[x]) *
                            (n_a * n_b / (n_a + n_b));
                for (const HalfLight& half : halves)
                    sum += more(half, x, y) * half.samples.row(y)[x] * half.variance[c].row(y)[x];
                squares.row(y)[x] = sum;
            }
        });
        const Plane others = sums_of_others(squares, workers);
        for_each_row(workers, size, [&](int y) {
            for (int x = 0; x < size.x; ++x) {
                // The pixel itself counts only if the image has no other.
                const float variance = freedoms.row(y)[x] > 0 ? others.row(y)[x] / freedoms.row(y)[x]
                                                              : squares.row(y)[x] / freedom.row(y)[x];
                for (HalfLight& half : halves) {
                    if (!is_known(half, x, y))
                        half.variance[c].row(y)[x] = bounded(double{variance / half.samples.row(y)[x]});
                }
            }
        });
    }
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
    Plane ratio = sums(measured, kReach, workers);
    stated = sums(stated, kReach, workers);
    for_each_row(workers, size, [&](int y) {
        float* const to = ratio.row(y);
        const float* const by = stated.row(y);
        for (int x = 0; x < size.x; ++x) to[x] = by[x] > 0 ? std::clamp(to[x] / by[x], 1 / kMost, kMost) : 1;
    });
    return ratio;
}

// Returns a half's light divided by the albedo, and what its variance determines: that of the pixel's own
// samples, blended with that of its neighbours where the samples are few.
HalfPlanes half_planes(const HalfLight& half, const ColourPlanes& albedo, const Plane& dependence,
                       const Workers& workers) {
    constexpr float kWorth = 4;  // number of samples that the neighbours count for
    const V2i size = size_of(half.samples);
    HalfPlanes planes;
    Plane own(size.x, size.y);
    for (std::size_t c = 0; c < 3; ++c) {
        planes.value[c] = Plane(size.x, size.y), planes.variance[c] = Plane(size.x, size.y);
        for_each_row(workers, size, [&](int y) {
            const float *const light = half.light[c].row(y), *const variance = half.variance[c].row(y),
                               *const by = albedo[c].row(y);
            float *const value = planes.value[c].row(y), *const of_own = own.row(y);
            for (int x = 0; x < size.x; ++x) {
                const float factor = 1 / (by[x] + kLeastAlbedo);
                value[x] = std::clamp(factor * light[x], -kBrightest, kBrightest);
                of_own[x] = std::min(factor * factor * variance[x], sqr(kBrightest));
            }
        });
        planes.value[c].extend(), own.extend();
        const Plane sum = around(own, workers);
        for_each_row(workers, size, [&](int y) {
            const float *const samples = half.samples.row(y), *const of_own = own.row(y),
                               *const sums = sum.row(y), *const depends = dependence.row(y);
            float* const to = planes.variance[c].row(y);
            for (int x = 0; x < size.x; ++x) {
                const float known = samples[x] - 1;  // degrees of freedom
                const float mixed = (known * of_own[x] + kWorth / 9 * sums[x]) / (known + kWorth);
                to[x] = std::min(depends[x] * mixed, sqr(kBrightest));
            }
        });
        planes.variance[c].extend();
    }
    planes.own = Plane(size.x, size.y), planes.own_noise = Plane(size.x, size.y);
    planes.own.fill(workers, [&](int x, int y) { return guide_of(planes.value, x, y); });
    // The variance of few samples is often much too small.
    planes.own_noise.fill(workers, [&](int x, int y) {
        const float n = half.samples.row(y)[x];
        return sqr(guide_deviation(planes.variance, x, y)) + sqr(planes.own.row(y)[x]) / (n * n * n);
    });
    planes.sampled = half.trust;
    planes.sampled.extend();
    set_guide(planes, workers);
    return planes;
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

Plane luminance_of(const ColourPlanes& colours, const Workers& workers) {
    const V2i size = size_of(colours[0]);
    Plane result(size.x, size.y);
    for_each_row(workers, size, [&](int y) {
        float* const to = result.row(y);
        const float *const r = colours[0].row(y), *const g = colours[1].row(y), *const b = colours[2].row(y);
        for (int x = 0; x < size.x; ++x) to[x] = luminance(Rgb(r[x], g[x], b[x]));
    });
    return result;
}

// Standard errors by which a gain must be known before one filtered image is mixed into the other, or before
// the measured one is: its fireflies would show.
constexpr float kCaution = 1, kCautionWithNoise = 2;

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
        Terms terms{Plane(size_.x, size_.y), Plane(size_.x, size_.y), Plane(size_.x, size_.y), {}, {}, {}};
        Plane share(size_.x, size_.y);
        for_each_row(workers_, size_, [&](int y) {
            float *const difference = terms.difference.row(y), *const gain = terms.gain.row(y),
                         *const square = terms.square.row(y);
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
        terms.differences = sums(terms.difference, kReach, workers_);
        terms.gains = sums(terms.gain, kReach, workers_);
        terms.squares = sums(terms.square, kReach, workers_);
        for_each_row(workers_, size_, [&](int y) {
            const float *const gain = terms.gains.row(y), *const square = terms.squares.row(y),
                               *const difference = terms.differences.row(y);
            float* const to = share.row(y);
            const auto rows = static_cast<float>(pixels_along(y, size_.y, kReach));
            const float* const columns = &columns_[Plane::kRim];
            for (int x = 0; x < size_.x; ++x)
                to[x] = best(gain[x], square[x], 1 / (rows * columns[x]), difference[x], caution);
        });
        share = smoothed(share, kSmooth, workers_);
        hold_out(first, second, terms, caution);
        for_each_row(workers_, size_, [&](int y) { blend(y, first, second, share, terms.difference); });
    }

  private:
    // Half sides of the squares over which errors and shares are averaged.
    static constexpr int kReach = 8, kSmooth = 2;
    static_assert(kReach <= Plane::kRim);

    // Holds the terms of shares by pixel, and their sums and the sum of the gain's square over the
    // neighbourhood. Rims are 0.
    struct Terms {
        Plane gain, square, difference, gains, squares, differences;
    };
    // Returns the best share by sums over pixels: of the gain, of its square, and of the squared difference.
    static float best(float gain, float squares, float inverse_of_pixels, float difference, float caution) {
        const float variance = std::max(0.0F, squares - sqr(gain) * inverse_of_pixels);
        const float share = (gain - caution * std::sqrt(variance)) / (2 * difference);
        return difference > 0 ? std::clamp(share, 0.0F, 1.0F) : 0;
    }

    // Mixes the images that are held out, in shares from the neighbourhood without the pixel itself and those
    // nearest to it, whose filtered values have samples in common with its own.
    void hold_out(Estimate& first, const Estimate& second, const Terms& terms, float caution) const {
        const Plane gains = sums(terms.gain, kSmooth, workers_),
                    squares = sums(terms.square, kSmooth, workers_),
                    differences = sums(terms.difference, kSmooth, workers_);
        for_each_row(workers_, size_, [&](int y) {
            const float *const all_gain = terms.gains.row(y), *const gain = gains.row(y);
            const float *const all_square = terms.squares.row(y), *const square = squares.row(y);
            const float *const all_difference = terms.differences.row(y), *const difference =
                                                                              differences.row(y);
            float *const to_a = first.held_out[0].row(y), *const to_b = first.held_out[1].row(y);
            const float *const a = second.luminance[0].row(y), *const b = second.luminance[1].row(y);
            for (int x = 0; x < size_.x; ++x) {
                const int others = pixels_about(x, y, kReach) - pixels_about(x, y, kSmooth);
                const float share = best(all_gain[x] - gain[x], all_square[x] - square[x],
                                         1 / static_cast<float>(std::max(1, others)),
                                         all_difference[x] - difference[x], caution);
                to_a[x] += share * (a[x] - to_a[x]);
                to_b[x] += share * (b[x] - to_b[x]);
            }
        });
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
Estimate estimate_of(std::array<Filtered, 2>& filtered, Candidate candidate, const ColourPlanes& albedo,
                     const V2i& size, const Workers& workers) {
    Estimate estimate;
    for (std::size_t half = 0; half < 2; ++half) {
        estimate.of[half] = std::move(filtered[half][static_cast<std::size_t>(candidate)]);
        for (std::size_t c = 0; c < 3; ++c) {
            for_each_row(workers, size, [&](int y) {
                float* const to = estimate.of[half][c].row(y);
                const float* const by = albedo[c].row(y);
                for (int x = 0; x < size.x; ++x) to[x] *= by[x] + kLeastAlbedo;
            });
        }
        estimate.luminance[half] = luminance_of(estimate.of[half], workers);
    }
    return estimate;
}

// Returns the halves as they are.
Estimate measured(std::array<HalfLight, 2>& halves, const Workers& workers) {
    Estimate estimate;
    for (std::size_t half = 0; half < 2; ++half) {
        estimate.of[half] = std::move(halves[half].light);
        estimate.luminance[half] = luminance_of(estimate.of[half], workers);
    }
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

// Filters both halves.
std::array<Filtered, 2> filtered(const std::array<HalfLight, 2>& halves, const FeaturePlanes& features,
                                 const Workers& workers) {
    const Plane dependence = lucerna::dependence(halves, workers);
    std::array<HalfPlanes, 2> planes;
    for (std::size_t half = 0; half < 2; ++half)
        planes[half] = half_planes(halves[half], features.albedo, dependence, workers);
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
    std::array<HalfLight, 2> halves{half_light(input.halves[0], scale, workers),
                                    half_light(input.halves[1], scale, workers)};
    complete_variances(halves, workers);
    std::array<Filtered, 2> candidates = filtered(halves, features, workers);
    const auto estimate = [&](Candidate candidate) {
        return estimate_of(candidates, candidate, features.albedo, size, workers);
    };
    Estimate result = estimate(Candidate::linear), constant = estimate(Candidate::constant);
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
