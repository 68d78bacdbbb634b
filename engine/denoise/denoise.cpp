#include "engine/denoise/denoise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
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
constexpr double kMostVariance = std::numeric_limits<float>::max();

std::size_t area(const V2i& size) {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
}
std::size_t place(const V2i& size, int x, int y) {
    return area({size.x, y}) + static_cast<std::size_t>(x);
}
V2i size_of(const Image& image) {
    return {image.width, image.height};
}

// Keeps squares within what float32 holds.
float bounded(double square) {
    return static_cast<float>(std::min(square, sqr(double{kBrightest})));
}

// --- input of the filter ---

// Fills three planes from three consecutive channels.
ColourPlanes planes_of(const Image& image, int first, const Workers& workers) {
    ColourPlanes planes;
    for (int c = 0; c < 3; ++c) {
        Plane& plane = planes[static_cast<std::size_t>(c)];
        plane = Plane(image.width, image.height);
        plane.fill(workers, [&](int x, int y) { return image.value(x, y, first + c); });
    }
    return planes;
}

float inverse_footprint(const Image& features, int x, int y) {
    const auto position = [&](int u, int v) {
        return V3f(features.value(u, v, kPosition), features.value(u, v, kPosition + 1),
                   features.value(u, v, kPosition + 2));
    };
    const V3f here = position(x, y);
    float nearest2 = INFINITY;
    for (const V2i& step : {V2i(1, 0), V2i(-1, 0), V2i(0, 1), V2i(0, -1)}) {
        const int u = x + step.x, v = y + step.y;
        if (u < 0 || v < 0 || u >= features.width || v >= features.height) continue;
        const float distance2 = (position(u, v) - here).length2();
        if (distance2 > 0) nearest2 = std::min(nearest2, distance2);
    }
    return std::isfinite(nearest2) ? 1 / std::sqrt(nearest2) : 0;
}

// Returns a number that falls from 2 to 0.1 as the albedo's luminance grows from 0 to 1.
float inverse_albedo(const Image& features, int x, int y) {
    constexpr float kSlope = 0.1F, kLeast = 0.05F;
    const Rgb albedo(features.value(x, y, kAlbedo), features.value(x, y, kAlbedo + 1),
                     features.value(x, y, kAlbedo + 2));
    return kSlope / (luminance(albedo) + kLeast);
}

FeaturePlanes feature_planes(const Image& features, const Workers& workers) {
    const int width = features.width, height = features.height;
    const auto plane = [&](auto&& value) {
        Plane result(width, height);
        result.fill(workers, value);
        return result;
    };
    FeaturePlanes planes{planes_of(features, kAlbedo, workers),
                         planes_of(features, kNormal, workers),
                         planes_of(features, kGeometricNormal, workers),
                         planes_of(features, kPosition, workers),
                         plane([&](int x, int y) { return features.value(x, y, kEmitter); }),
                         plane([&](int x, int y) { return inverse_footprint(features, x, y); }),
                         plane([&](int x, int y) { return inverse_albedo(features, x, y); }),
                         Plane(width, height)};
    for (int y = 0; y < height; ++y) std::fill_n(planes.inside.row(y), width, 1.0F);
    return planes;
}

// Completes variances of pixels with a single sample, which says nothing about its variance: they get that of
// the surrounding pixels, estimated from their samples and the difference of their halves. The pixel's own
// difference is excluded: where the halves agree by chance, both would stay as they are.
// Returns nothing if all are known.
std::optional<std::array<Image, 2>> with_known_variances(const std::array<Image, 2>& halves) {
    constexpr int kReach = 2;
    const V2i size = size_of(halves[0]);
    const auto samples = [&halves](std::size_t h, std::size_t i) {
        return std::max(1.0, double{halves[h].data[kHalfChannels * i + kSamples]});
    };
    bool all_known = true;
    for (std::size_t i = 0; i < area(size); ++i) all_known &= samples(0, i) > 1 && samples(1, i) > 1;
    if (all_known) return std::nullopt;
    std::array<Image, 2> known = halves;
    const auto at = [&known](std::size_t h, std::size_t i, int channel) -> float& {
        return known[h].data[kHalfChannels * i + static_cast<std::size_t>(channel)];
    };
    for (int c = 0; c < 3; ++c) {
        // The variance of one sample results, per pixel, from the sum of squares and its degrees of freedom.
        Numbers sum(area(size)), freedom(area(size), 1.0);
        for (std::size_t i = 0; i < area(size); ++i) {
            const double n_a = samples(0, i), n_b = samples(1, i);
            const double between = double{at(0, i, kLight + c)} - double{at(1, i, kLight + c)};
            sum[i] = sqr(between) * n_a * n_b / (n_a + n_b);
            for (const std::size_t h : {std::size_t{0}, std::size_t{1}}) {
                const double more = samples(h, i) - 1;
                sum[i] += more * samples(h, i) * double{at(h, i, kVariance + c)};
                freedom[i] += more;
            }
        }
        for (std::size_t i = 0; i < area(size); ++i) {
            if (samples(0, i) > 1 && samples(1, i) > 1) continue;
            const int x = static_cast<int>(i % static_cast<std::size_t>(size.x));
            const int y = static_cast<int>(i / static_cast<std::size_t>(size.x));
            // The pixel itself counts only if the window has no other.
            double squares = 0, freedoms = 0;
            for (int v = std::max(0, y - kReach); v <= std::min(size.y - 1, y + kReach); ++v) {
                for (int u = std::max(0, x - kReach); u <= std::min(size.x - 1, x + kReach); ++u) {
                    const std::size_t other = place(size, u, v);
                    if (other != i) squares += sum[other], freedoms += freedom[other];
                }
            }
            const double variance = freedoms > 0 ? squares / freedoms : sum[i] / freedom[i];
            for (const std::size_t h : {std::size_t{0}, std::size_t{1}}) {
                if (samples(h, i) == 1)
                    at(h, i, kVariance + c) = static_cast<float>(std::min(variance, kMostVariance));
            }
        }
    }
    return known;
}

// Returns the ratio of the halves' squared difference to what their samples' variances predict: below 1 where
// samples are stratified, above 1 where they depend on each other, as those of one pass do. It is averaged
// over a wide window, so that a pixel's weights learn almost nothing about the other half from it.
Plane dependence(const std::array<Image, 2>& halves, double scale, const Workers& workers) {
    constexpr int kReach = 7;
    constexpr float kMost = 16;
    const Image &a = halves[0], &b = halves[1];
    const V2i size = size_of(a);
    Plane measured(size.x, size.y), stated(size.x, size.y);
    for_each_row(workers, size, [&](int y) {
        float *const of_difference = measured.row(y), *const of_samples = stated.row(y);
        for (int x = 0; x < size.x; ++x) {
            const double difference = double{luminance(a.rgb_at(x, y))} - double{luminance(b.rgb_at(x, y))};
            double variance = 0;
            for (const Image* half : {&a, &b}) {
                const float* const v = &half->data[half->index(x, y) + kVariance];
                variance += luminance_variance(V3d(double{v[0]}, double{v[1]}, double{v[2]}));
            }
            of_difference[x] = bounded(sqr(difference * scale));
            of_samples[x] = bounded(variance * sqr(scale));
        }
    });
    Plane ratio = smoothed(measured, size, kReach, workers);
    stated = smoothed(stated, size, kReach, workers);
    for_each_row(workers, size, [&](int y) {
        float* const to = ratio.row(y);
        const float* const by = stated.row(y);
        for (int x = 0; x < size.x; ++x) to[x] = by[x] > 0 ? std::clamp(to[x] / by[x], 1 / kMost, kMost) : 1;
    });
    return ratio;
}

// Returns a half's light divided by the albedo, and what its variance determines: that of the pixel's own
// samples, blended with that of its neighbours where the samples are few.
HalfPlanes half_planes(const Image& half, const ColourPlanes& albedo, const Plane& dependence, double scale,
                       const Workers& workers) {
    constexpr float kWorth = 4;  // number of samples that the neighbours count for
    const V2i size = size_of(half);
    HalfPlanes planes;
    ColourPlanes variance;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto channel = static_cast<int>(c);
        const auto divided = [&](int x, int y) { return scale / double{albedo[c].row(y)[x] + kLeastAlbedo}; };
        planes.value[c] = Plane(size.x, size.y);
        planes.value[c].fill(workers, [&](int x, int y) {
            const double value = double{half.value(x, y, kLight + channel)} * divided(x, y);
            return static_cast<float>(std::clamp(value, double{-kBrightest}, double{kBrightest}));
        });
        Plane own(size.x, size.y);
        own.fill(workers, [&](int x, int y) {
            return bounded(double{half.value(x, y, kVariance + channel)} * sqr(divided(x, y)));
        });
        const Plane sum = around(own, workers);
        variance[c] = Plane(size.x, size.y);
        variance[c].fill(workers, [&](int x, int y) {
            const float known = std::max(0.0F, half.value(x, y, kSamples) - 1);  // degrees of freedom
            const float mixed = (known * own.row(y)[x] + kWorth / 9 * sum.row(y)[x]) / (known + kWorth);
            return std::min(dependence.row(y)[x] * mixed, sqr(kBrightest));
        });
    }
    planes.variance = std::move(variance);
    planes.own = planes.own_noise = Plane(size.x, size.y);
    planes.own.fill(workers, [&](int x, int y) { return guide_of(planes.value, x, y); });
    // The variance of few samples is often much too small.
    planes.own_noise.fill(workers, [&](int x, int y) {
        const float n = std::max(1.0F, half.value(x, y, kSamples));
        return sqr(guide_deviation(planes.variance, x, y)) + sqr(planes.own.row(y)[x]) / (n * n * n);
    });
    set_guide(planes, workers);
    return planes;
}

// --- input of the mixture ---

// Weights the halves in their mean by their numbers of samples in the whole image. Where samples were
// allocated adaptively, a pixel's own numbers would bias it.
using Shares = std::array<double, 2>;
Shares shares_of(const std::array<Image, 2>& halves) {
    std::array<double, 2> samples{0, 0};
    for (std::size_t h = 0; h < 2; ++h) {
        for (std::size_t i = 0; i < area(size_of(halves[h])); ++i)
            samples[h] += double{halves[h].data[kHalfChannels * i + kSamples]};
    }
    const double all = samples[0] + samples[1];
    return all > 0 ? Shares{samples[0] / all, samples[1] / all} : Shares{0.5, 0.5};
}

// Tells whether both halves have two samples per pixel on average. Halves of one sample have seldom met the
// rare bright samples that cause most of the error, so that their difference is too small.
bool have_two_samples(const std::array<Image, 2>& halves) {
    constexpr double kLeast = 2;
    return std::all_of(halves.begin(), halves.end(), [](const Image& half) {
        const std::size_t pixels = area(size_of(half));
        double samples = 0;
        for (std::size_t i = 0; i < pixels; ++i) samples += double{half.data[kHalfChannels * i + kSamples]};
        return samples >= kLeast * static_cast<double>(pixels);
    });
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

Plane luminance_of(const ColourPlanes& colours, const V2i& size, const Workers& workers) {
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
          inverse_scale_(size.x, size.y) {
        Plane level(size.x, size.y);
        double sum = 0;
        for_each([&](int x, int y) {
            level.row(y)[x] = std::min(mean(linear.luminance, x, y), mean(constant.luminance, x, y));
        });
        for (int y = 0; y < size.y; ++y) {
            for (int x = 0; x < size.x; ++x) sum += double{level.row(y)[x]};
        }
        const double average = sum / static_cast<double>(area(size));
        for_each([&](int x, int y) {
            const double scale = error_scale2(double{level.row(y)[x]}, average);
            // 0 where everything is black
            inverse_scale_.row(y)[x] = scale > 0 ? static_cast<float>(1 / scale) : 0;
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
        for_each([&](int x, int y) {
            const float difference =
                inverse_scale_.row(y)[x] * sqr(mean(first.luminance, x, y) - mean(second.luminance, x, y));
            terms.difference.row(y)[x] = difference;
            terms.gain.row(y)[x] = first.error.row(y)[x] - second.error.row(y)[x] + difference;
        });
        for_each([&](int x, int y) { terms.square.row(y)[x] = sqr(terms.gain.row(y)[x]); });
        terms.differences = smoothed(terms.difference, size_, kReach, workers_);
        terms.gains = smoothed(terms.gain, size_, kReach, workers_);
        terms.squares = smoothed(terms.square, size_, kReach, workers_);
        Plane share(size_.x, size_.y);
        for_each([&](int x, int y) {
            const float pixels = pixels_about(x, y, kReach);
            share.row(y)[x] = best(pixels * terms.gains.row(y)[x], pixels * terms.squares.row(y)[x], pixels,
                                   pixels * terms.differences.row(y)[x], caution);
        });
        share = smoothed(share, size_, kSmooth, workers_);
        hold_out(first, second, terms, caution);
        for_each([&](int x, int y) {
            const float s = share.row(y)[x];
            float& error = first.error.row(y)[x];
            error += s * (second.error.row(y)[x] - error) - s * (1 - s) * terms.difference.row(y)[x];
        });
        for (std::size_t half = 0; half < 2; ++half) {
            for (std::size_t c = 0; c < 3; ++c) blend(first.of[half][c], second.of[half][c], share);
            blend(first.luminance[half], second.luminance[half], share);
        }
    }

  private:
    // Half sides of the squares over which errors and shares are averaged.
    static constexpr int kReach = 8, kSmooth = 2;
    static_assert(kReach <= Plane::kRim);

    // Holds the terms of shares by pixel, and their means and the gain's mean square over the neighbourhood.
    struct Terms {
        Plane gain, square, difference, gains, squares, differences;
    };
    // Returns the best share by sums over pixels: of the gain, of its square, and of the squared difference.
    static float best(float gain, float squares, float pixels, float difference, float caution) {
        const float variance = std::max(0.0F, squares - sqr(gain) / pixels);
        return difference > 0
                   ? std::clamp((gain - caution * std::sqrt(variance)) / (2 * difference), 0.0F, 1.0F)
                   : 0.0F;
    }
    // Returns the number of pixels of a square of this half side.
    float pixels_about(int x, int y, int reach) const {
        const auto along = [reach](int i, int end) {
            return std::min(i + reach, end - 1) - std::max(i - reach, 0) + 1;
        };
        return static_cast<float>(along(x, size_.x) * along(y, size_.y));
    }

    // Mixes the images that are held out, in shares from the neighbourhood without the pixel itself and those
    // nearest to it, whose filtered values have samples in common with its own.
    void hold_out(Estimate& first, const Estimate& second, const Terms& terms, float caution) const {
        const Plane gains = smoothed(terms.gain, size_, kSmooth, workers_),
                    squares = smoothed(terms.square, size_, kSmooth, workers_),
                    differences = smoothed(terms.difference, size_, kSmooth, workers_);
        for_each([&](int x, int y) {
            const float all = pixels_about(x, y, kReach), own = pixels_about(x, y, kSmooth);
            const auto others = [&](const Plane& of_all, const Plane& of_own) {
                return all * of_all.row(y)[x] - own * of_own.row(y)[x];
            };
            const float share =
                best(others(terms.gains, gains), others(terms.squares, squares), std::max(1.0F, all - own),
                     others(terms.differences, differences), caution);
            for (std::size_t half = 0; half < 2; ++half) {
                float& to = first.held_out[half].row(y)[x];
                to += share * (second.luminance[half].row(y)[x] - to);
            }
        });
    }

    void blend(Plane& first, const Plane& second, const Plane& share) const {
        for_each([&](int x, int y) {
            float& to = first.row(y)[x];
            to += share.row(y)[x] * (second.row(y)[x] - to);
        });
    }
    float mean(const std::array<Plane, 2>& of, int x, int y) const {
        return static_cast<float>(a_ * double{of[0].row(y)[x]} + b_ * double{of[1].row(y)[x]});
    }
    template <typename Body>
    void for_each(Body&& body) const {
        for_each_row(workers_, size_, [&](int y) {
            for (int x = 0; x < size_.x; ++x) body(x, y);
        });
    }

    V2i size_;
    double a_, b_;  // shares of the halves in their mean
    const Workers& workers_;
    Estimate measured_;
    Plane inverse_scale_;
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
        estimate.luminance[half] = luminance_of(estimate.of[half], size, workers);
    }
    return estimate;
}

// Returns the halves as they are, times `scale`.
Estimate measured(const std::array<Image, 2>& halves, double scale, const Workers& workers) {
    const V2i size = size_of(halves[0]);
    Estimate estimate;
    for (std::size_t half = 0; half < 2; ++half) {
        for (std::size_t c = 0; c < 3; ++c) {
            const auto channel = static_cast<int>(c);
            Plane& plane = estimate.of[half][c];
            plane = Plane(size.x, size.y);
            for_each_row(workers, size, [&](int y) {
                float* const to = plane.row(y);
                for (int x = 0; x < size.x; ++x)
                    to[x] = static_cast<float>(double{halves[half].value(x, y, channel)} * scale);
            });
        }
        estimate.luminance[half] = luminance_of(estimate.of[half], size, workers);
    }
    return estimate;
}

// Returns the mean luminance of both halves, weighted by their shares.
double mean_luminance(const std::array<Image, 2>& halves, const Shares& shares) {
    const V2i size = size_of(halves[0]);
    double sum = 0;
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            for (std::size_t half = 0; half < 2; ++half)
                sum += shares[half] * double{luminance(halves[half].rgb_at(x, y))};
        }
    }
    return sum / static_cast<double>(area(size));
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
std::array<Filtered, 2> filtered(const DenoiserInput& input, const FeaturePlanes& features, double scale,
                                 const Workers& workers) {
    const auto completed = with_known_variances(input.halves);
    const std::array<Image, 2>& halves = completed ? *completed : input.halves;
    const Plane dependence = lucerna::dependence(halves, scale, workers);
    std::array<HalfPlanes, 2> planes;
    for (std::size_t half = 0; half < 2; ++half)
        planes[half] = half_planes(halves[half], features.albedo, dependence, scale, workers);
    return regress_in_scales(features, planes, workers);
}

}  // namespace

Denoised denoise(const DenoiserInput& input, const Workers& workers) {
    const V2i size = size_of(input.features);
    const Shares shares = shares_of(input.halves);
    const double mean = mean_luminance(input.halves, shares);
    // Distances are relative to noise, whatever the unit. The scale puts values into float32's middle range.
    const double scale = mean > 0 ? 1 / mean : 1;
    const FeaturePlanes features = feature_planes(input.features, workers);
    std::array<Filtered, 2> candidates = filtered(input, features, scale, workers);
    const auto estimate = [&](Candidate candidate) {
        return estimate_of(candidates, candidate, features.albedo, size, workers);
    };
    Estimate result = estimate(Candidate::linear), constant = estimate(Candidate::constant);
    const Mixer mixer(size, shares, measured(input.halves, scale, workers), result, constant, workers);
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
    denoised.error_is_known = error.is_known() && have_two_samples(input.halves);
    return denoised;
}

}  // namespace lucerna
