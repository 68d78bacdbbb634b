#include "engine/denoise/denoise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "engine/colour/colour_space.h"
#include "engine/denoise/regression.h"

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

template <typename Body>
void for_each_row(const Workers& workers, const V2i& size, Body&& body) {
    parallel_each(workers, static_cast<std::size_t>(size.y), Plane::rows_at_a_time(size.x),
                  [&body](std::size_t y) { body(static_cast<int>(y)); });
}

// Returns means over squares of half side `reach`, clipped at the image's rim.
Numbers smoothed(const Numbers& numbers, const V2i& size, int reach, const Workers& workers) {
    // Returns the places [first, second) of the window about place i, where `last` is the last valid place.
    const auto window = [reach](std::ptrdiff_t i, std::ptrdiff_t last) {
        return std::pair{std::max<std::ptrdiff_t>(0, i - reach), std::min(last, i + reach) + 1};
    };
    const std::ptrdiff_t width = size.x, height = size.y;
    Numbers across(numbers.size()), result(numbers.size());
    for_each_row(workers, size, [&](int y) {
        const double* const in = &numbers[place(size, 0, y)];
        double* const out = &across[place(size, 0, y)];
        Numbers upto(static_cast<std::size_t>(width) + 1);
        for (std::ptrdiff_t x = 0; x < width; ++x) upto[x + 1] = upto[x] + in[x];
        for (std::ptrdiff_t x = 0; x < width; ++x) {
            const auto [begin, end] = window(x, width - 1);
            out[x] = (upto[end] - upto[begin]) / static_cast<double>(end - begin);
        }
    });
    // Columns are processed side by side, so that memory is read sequentially.
    parallel_ranges(workers, width, Plane::rows_at_a_time(size.y),
                    [&](std::int64_t begin_x, std::int64_t end_x, std::int64_t /*chunk*/) {
                        const auto columns = static_cast<std::size_t>(end_x - begin_x);
                        Numbers upto(columns * static_cast<std::size_t>(height + 1));
                        const auto row = [&upto, columns](std::ptrdiff_t y) {
                            return &upto[static_cast<std::size_t>(y) * columns];
                        };
                        for (int y = 0; y < height; ++y) {
                            const double* const in = &across[place(size, static_cast<int>(begin_x), y)];
                            for (std::size_t x = 0; x < columns; ++x) row(y + 1)[x] = row(y)[x] + in[x];
                        }
                        for (int y = 0; y < height; ++y) {
                            const auto [begin, end] = window(y, height - 1);
                            const double share = 1 / static_cast<double>(end - begin);
                            double* const out = &result[place(size, static_cast<int>(begin_x), y)];
                            for (std::size_t x = 0; x < columns; ++x)
                                out[x] = (row(end)[x] - row(begin)[x]) * share;
                        }
                    });
    return result;
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
std::array<Image, 2> with_known_variances(const std::array<Image, 2>& halves, const Workers& workers) {
    constexpr int kReach = 2;
    std::array<Image, 2> known = halves;
    const V2i size = size_of(halves[0]);
    const auto samples = [&halves](std::size_t h, std::size_t i) {
        return std::max(1.0, double{halves[h].data[kHalfChannels * i + kSamples]});
    };
    const auto at = [&known](std::size_t h, std::size_t i, int channel) -> float& {
        return known[h].data[kHalfChannels * i + static_cast<std::size_t>(channel)];
    };
    bool all_known = true;
    for (std::size_t i = 0; i < area(size); ++i) all_known &= samples(0, i) > 1 && samples(1, i) > 1;
    if (all_known) return known;
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
        const Numbers sums = smoothed(sum, size, kReach, workers),
                      freedoms = smoothed(freedom, size, kReach, workers);
        const auto window = [](int place, int end) {
            return std::min(place + kReach, end - 1) - std::max(place - kReach, 0) + 1;
        };
        for (std::size_t i = 0; i < area(size); ++i) {
            const int x = static_cast<int>(i % static_cast<std::size_t>(size.x));
            const int y = static_cast<int>(i / static_cast<std::size_t>(size.x));
            const int pixels = window(x, size.x) * window(y, size.y);
            // The means over the window exclude the pixel itself, unless the window has no other pixel.
            const double others = pixels > 1 ? freedoms[i] - freedom[i] / pixels : freedom[i];
            const double variance = (pixels > 1 ? std::max(0.0, sums[i] - sum[i] / pixels) : sum[i]) / others;
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
Numbers dependence(const std::array<Image, 2>& halves, const Workers& workers) {
    constexpr int kReach = 7;
    constexpr double kMost = 16;
    const Image &a = halves[0], &b = halves[1];
    const V2i size = size_of(a);
    Numbers measured(area(size)), stated(area(size));
    for_each_row(workers, size, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            const std::size_t i = place(size, x, y);
            measured[i] = sqr(double{luminance(a.rgb_at(x, y))} - double{luminance(b.rgb_at(x, y))});
            for (const Image* half : {&a, &b}) {
                V3d variance;
                for (int c = 0; c < 3; ++c) variance[c] = double{half->value(x, y, kVariance + c)};
                stated[i] += luminance_variance(variance);
            }
        }
    });
    measured = smoothed(measured, size, kReach, workers), stated = smoothed(stated, size, kReach, workers);
    for (std::size_t i = 0; i < measured.size(); ++i)
        measured[i] = stated[i] > 0 ? std::clamp(measured[i] / stated[i], 1 / kMost, kMost) : 1;
    return measured;
}

// Reduces the trust in a pixel whose variance is much larger than the median around it: it holds light that
// the others have missed.
Plane trust(const V2i& size, const ColourPlanes& variance, const Workers& workers) {
    constexpr int kReach = 2;
    constexpr float kMuch = 4, kLeast = 1e-4F;
    const auto of = [&](int x, int y) {
        return variance[0].row(y)[x] + variance[1].row(y)[x] + variance[2].row(y)[x];
    };
    Plane trust(size.x, size.y);
    trust.fill(workers, [&](int x, int y) {
        std::array<float, (2 * kReach + 1) * (2 * kReach + 1)> around;
        auto end = around.begin();
        for (int v = std::max(0, y - kReach); v <= std::min(size.y - 1, y + kReach); ++v) {
            for (int u = std::max(0, x - kReach); u <= std::min(size.x - 1, x + kReach); ++u)
                *end++ = of(u, v);
        }
        const auto middle = around.begin() + (end - around.begin()) / 2;
        std::nth_element(around.begin(), middle, end);
        const float ratio = of(x, y) / (kMuch * *middle + std::numeric_limits<float>::min());
        return std::max(kLeast, 1 / (1 + sqr(ratio)));
    });
    return trust;
}

// Sets the guide, the mean luminance of 3 x 3 pixels weighted by their trust, and its variance.
void set_guide(HalfPlanes& planes, const V2i& size, const ColourPlanes& variance, const Workers& workers) {
    const auto luminance_at = [](const ColourPlanes& colours, int x, int y) {
        return 0.25F * (colours[0].row(y)[x] + colours[2].row(y)[x]) + 0.5F * colours[1].row(y)[x];
    };
    Plane light(size.x, size.y), noise(size.x, size.y);
    light.fill(workers, [&](int x, int y) { return luminance_at(planes.value, x, y); });
    noise.fill(workers, [&](int x, int y) {
        const auto deviation = [&](std::size_t c) { return std::sqrt(variance[c].row(y)[x]); };
        return sqr(0.25F * (deviation(0) + deviation(2)) + 0.5F * deviation(1));
    });
    planes.guide = Plane(size.x, size.y), planes.noise = Plane(size.x, size.y);
    // Sums a function of the pixels of the window that lie in the image, and divides it by `by`.
    const auto around = [&size](int x, int y, auto&& value) {
        float sum = 0;
        for (int v = std::max(0, y - 1); v <= std::min(size.y - 1, y + 1); ++v) {
            for (int u = std::max(0, x - 1); u <= std::min(size.x - 1, x + 1); ++u) sum += value(u, v);
        }
        return sum;
    };
    const auto trust_at = [&planes](int u, int v) { return planes.trust.row(v)[u]; };
    planes.guide.fill(workers, [&](int x, int y) {
        return around(x, y, [&](int u, int v) { return trust_at(u, v) * light.row(v)[u]; }) /
               around(x, y, trust_at);
    });
    planes.noise.fill(workers, [&](int x, int y) {
        return around(x, y, [&](int u, int v) { return sqr(trust_at(u, v)) * noise.row(v)[u]; }) /
               sqr(around(x, y, trust_at));
    });
}

// Returns a half's light divided by the albedo, and what its variance determines: that of the pixel's own
// samples, blended with that of its neighbours where the samples are few.
HalfPlanes half_planes(const Image& half, const Image& features, const Numbers& dependence, float scale,
                       const Workers& workers) {
    constexpr int kReach = 1;
    constexpr double kWorth = 4;  // number of samples that the neighbours count for
    const V2i size = size_of(half);
    HalfPlanes planes;
    ColourPlanes variance;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto channel = static_cast<int>(c);
        const auto divided = [&](int x, int y) {
            return scale / (features.value(x, y, kAlbedo + channel) + kLeastAlbedo);
        };
        planes.value[c] = Plane(size.x, size.y);
        planes.value[c].fill(workers, [&](int x, int y) {
            return std::clamp(half.value(x, y, kLight + channel) * divided(x, y), -kBrightest, kBrightest);
        });
        Numbers own(area(size));
        const auto at = [&size](int x, int y) { return place(size, x, y); };
        for_each_row(workers, size, [&](int y) {
            for (int x = 0; x < size.x; ++x)
                own[at(x, y)] = double{half.value(x, y, kVariance + channel)} * sqr(double{divided(x, y)});
        });
        const Numbers around = smoothed(own, size, kReach, workers);
        variance[c] = Plane(size.x, size.y);
        variance[c].fill(workers, [&](int x, int y) {
            const double known = std::max(0.0, double{half.value(x, y, kSamples)} - 1);  // degrees of freedom
            const double mixed = (known * own[at(x, y)] + kWorth * around[at(x, y)]) / (known + kWorth);
            return static_cast<float>(std::min(dependence[at(x, y)] * mixed, sqr(double{kBrightest})));
        });
    }
    planes.trust = trust(size, variance, workers);
    set_guide(planes, size, variance, workers);
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
    Shares shares;
    std::array<std::vector<Rgb>, 2> of = {};
    // In these images each pixel is mixed in shares that its own error did not influence. A share that is
    // chosen as the best for noisy errors looks better than it is if the same errors judge it.
    std::array<std::vector<Rgb>, 2> held_out = {};
    Numbers error = {};

    Rgb mean(std::size_t i) const {
        return static_cast<float>(shares[0]) * of[0][i] + static_cast<float>(shares[1]) * of[1][i];
    }
};

double luminance_of(const Rgb& c) {
    return double{luminance(c)};
}

class Mixer {
  public:
    // `measured` has the halves as they are; errors are relative to `level`.
    Mixer(const V2i& size, Estimate measured, const Numbers& level, const Workers& workers)
        : size_(size), workers_(workers), measured_(std::move(measured)), inverse_scale_(level.size()) {
        double mean = 0;
        for (const double l : level) mean += l / static_cast<double>(level.size());
        for (std::size_t i = 0; i < level.size(); ++i) {
            const double scale = error_scale2(level[i], mean);
            inverse_scale_[i] = scale > 0 ? 1 / scale : 0;  // 0 where everything is black
        }
        measured_.error = error(measured_);
    }

    const Estimate& measured() const { return measured_; }

    // Estimates the squared error of images made of the halves. D_A, made of A, has the error mean[(D_A - B)²
    // - a (A - B)²], where a is A's share of the samples, because that part of the difference is B's own
    // error. The mean of D_A and D_B has their errors' mean, weighted by their shares, less a b (D_A - D_B)².
    Numbers error(const Estimate& made) const { return error(made.of, made.shares); }
    Numbers error(const std::array<std::vector<Rgb>, 2>& of, const Shares& shares) const {
        Numbers error(inverse_scale_.size());
        for_each([&](std::size_t i) {
            const double a = luminance_of(measured_.of[0][i]), b = luminance_of(measured_.of[1][i]);
            const double d_a = luminance_of(of[0][i]), d_b = luminance_of(of[1][i]);
            const auto [of_a, of_b] = shares;
            const double error_a = sqr(d_a - b) - of_a * sqr(a - b);
            const double error_b = sqr(d_b - a) - of_b * sqr(a - b);
            error[i] = inverse_scale_[i] * (of_a * error_a + of_b * error_b - of_a * of_b * sqr(d_a - d_b));
        });
        return error;
    }

    // Mixes the second into the first with the share that minimises the error: with the errors E and the
    // difference d of both, it is (E₁ - E₂ + d²)/(2 d²), with both terms summed over the neighbourhood.
    void mix(Estimate& first, const Estimate& second) const {
        constexpr int kReach = 8, kSmooth = 2;
        Numbers gain(inverse_scale_.size()), difference(gain.size()), share(gain.size());
        for_each([&](std::size_t i) {
            difference[i] =
                inverse_scale_[i] * sqr(luminance_of(first.mean(i)) - luminance_of(second.mean(i)));
            gain[i] = first.error[i] - second.error[i] + difference[i];
        });
        const Numbers d2 = smoothed(difference, size_, kReach, workers_);
        const Numbers gains = smoothed(gain, size_, kReach, workers_);
        const auto best = [](double gained, double squares) {
            return squares > 0 ? std::clamp(gained / (2 * squares), 0.0, 1.0) : 0;
        };
        for_each([&](std::size_t i) { share[i] = best(gains[i], d2[i]); });
        share = smoothed(share, size_, kSmooth, workers_);
        const auto mix_by = [](std::array<Rgb, 2>& to, const std::array<Rgb, 2>& other, double s) {
            for (std::size_t half = 0; half < 2; ++half)
                to[half] += static_cast<float>(s) * (other[half] - to[half]);
        };
        // Returns the share that results from the neighbourhood without the pixel itself.
        const auto share_without = [&](int x, int y) {
            const std::size_t own = place(size_, x, y);
            double sum = 0;
            int count = 0;
            for (int v = std::max(0, y - kSmooth); v <= std::min(size_.y - 1, y + kSmooth); ++v) {
                const int rows = std::min(v + kReach, size_.y - 1) - std::max(v - kReach, 0) + 1;
                for (int u = std::max(0, x - kSmooth); u <= std::min(size_.x - 1, x + kSmooth);
                     ++u, ++count) {
                    const int columns = std::min(u + kReach, size_.x - 1) - std::max(u - kReach, 0) + 1;
                    const std::size_t at = place(size_, u, v);
                    const double pixels = rows * columns;
                    sum += best(pixels * gains[at] - gain[own], pixels * d2[at] - difference[own]);
                }
            }
            return sum / count;
        };
        for_each_row(workers_, size_, [&](int y) {
            for (int x = 0; x < size_.x; ++x) {
                const std::size_t i = place(size_, x, y);
                std::array<Rgb, 2> held_out{first.held_out[0][i], first.held_out[1][i]};
                mix_by(held_out, {second.of[0][i], second.of[1][i]}, share_without(x, y));
                first.held_out[0][i] = held_out[0], first.held_out[1][i] = held_out[1];
            }
        });
        for_each([&](std::size_t i) {
            const double s = share[i];
            std::array<Rgb, 2> mixed{first.of[0][i], first.of[1][i]};
            mix_by(mixed, {second.of[0][i], second.of[1][i]}, s);
            first.of[0][i] = mixed[0], first.of[1][i] = mixed[1];
            first.error[i] += s * (second.error[i] - first.error[i]) - s * (1 - s) * difference[i];
        });
    }

  private:
    template <typename Body>
    void for_each(Body&& body) const {
        for_each_row(workers_, size_, [&](int y) {
            const std::size_t begin = place(size_, 0, y), end = place(size_, 0, y + 1);
            for (std::size_t i = begin; i < end; ++i) body(i);
        });
    }

    V2i size_;
    const Workers& workers_;
    Estimate measured_;
    Numbers inverse_scale_;
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

Estimate estimate_of(const DenoiserInput& input, const Shares& shares,
                     const std::array<Filtered, 2>& filtered, Candidate candidate, float scale,
                     const Workers& workers) {
    const V2i size = size_of(input.features);
    Estimate estimate{shares};
    for (std::size_t half = 0; half < 2; ++half) {
        const ColourPlanes& planes = filtered[half][static_cast<std::size_t>(candidate)];
        estimate.of[half].resize(area(size));
        for_each_row(workers, size, [&](int y) {
            Rgb* const to = &estimate.of[half][place(size, 0, y)];
            for (int x = 0; x < size.x; ++x) {
                for (int k = 0; k < 3; ++k) {
                    to[x][k] = planes[static_cast<std::size_t>(k)].row(y)[x] *
                               ((input.features.value(x, y, kAlbedo + k) + kLeastAlbedo) / scale);
                }
            }
        });
    }
    return estimate;
}

Estimate measured(const DenoiserInput& input, const Shares& shares, const Workers& workers) {
    const V2i size = size_of(input.features);
    Estimate estimate{shares};
    for (std::size_t half = 0; half < 2; ++half) {
        estimate.of[half].resize(area(size));
        for_each_row(workers, size, [&](int y) {
            Rgb* const to = &estimate.of[half][place(size, 0, y)];
            for (int x = 0; x < size.x; ++x) to[x] = input.halves[half].rgb_at(x, y);
        });
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

Denoised denoise(const DenoiserInput& input, const Workers& workers) {
    const V2i size = size_of(input.features);
    const Shares shares = shares_of(input.halves);
    Estimate raw = measured(input, shares, workers);
    double mean = 0;
    for (std::size_t i = 0; i < area(size); ++i)
        mean += luminance_of(raw.mean(i)) / static_cast<double>(area(size));
    // Distances are relative to noise, whatever the unit. The scale puts values into float32's middle range.
    const float scale = mean > 0 ? static_cast<float>(1 / mean) : 1;

    const std::array<Image, 2> halves = with_known_variances(input.halves, workers);
    const Numbers dependence = lucerna::dependence(halves, workers);
    std::array<HalfPlanes, 2> planes;
    for (std::size_t half = 0; half < 2; ++half)
        planes[half] = half_planes(halves[half], input.features, dependence, scale, workers);
    const std::array<Filtered, 2> filtered =
        regress(size.x, size.y, feature_planes(input.features, workers), planes, workers);
    Estimate result = estimate_of(input, shares, filtered, Candidate::linear, scale, workers);
    Numbers level(area(size));
    for (std::size_t i = 0; i < level.size(); ++i) level[i] = luminance_of(result.mean(i));
    const Mixer mixer(size, std::move(raw), level, workers);
    result.error = mixer.error(result);
    result.held_out = result.of;
    for (const Candidate candidate : {Candidate::constant, Candidate::trusting}) {
        Estimate other = estimate_of(input, shares, filtered, candidate, scale, workers);
        other.error = mixer.error(other);
        mixer.mix(result, other);
    }
    mixer.mix(result, mixer.measured());

    Denoised denoised{Image::rgb(size.x, size.y), 0, false};
    denoised.image.space = input.halves[0].space;
    for (std::size_t i = 0; i < level.size(); ++i) {
        const Rgb c = result.mean(i);
        denoised.image.data[3 * i] = c.x, denoised.image.data[3 * i + 1] = c.y,
                                denoised.image.data[3 * i + 2] = c.z;
    }
    const MeanError error = mean_error(mixer.error(result.held_out, shares));
    denoised.relative_error = error.root();
    denoised.error_is_known = error.is_known() && have_two_samples(input.halves);
    return denoised;
}

}  // namespace lucerna
