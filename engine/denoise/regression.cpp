#include "engine/denoise/regression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace lucerna {
namespace {

// Side of the window, and how far it reaches to the left of its centre and above it.
constexpr int kSide = 12, kBefore = 6, kPixels = kSide * kSide;
// Distance of centres. A window reaches equally far on all sides of the square of pixels that is nearest to
// its centre.
constexpr int kStride = 4;
// One thread processes this number of rows at a time. Windows of a band reach less than half of it into the
// bands above and below.
constexpr int kBand = 16;
// Patches are 3 x 3 values of the guide, two pixels apart: they show 7 x 7 pixels.
constexpr int kPatchStep = 2;
static_assert(kBefore + kPatchStep <= Plane::kRim);

// Standard deviation, in pixels, of the weights by distance.
constexpr float kSpread = 3.5F;
// Largest distance of two values of the guide, whose squared difference is compared to their noise.
constexpr float kFarthest = 8;
// A pixel's own value may differ by the root of kChance standard deviations. With a distance of kUnlike more,
// it is not alike at all.
constexpr float kChance = 20, kUnlike = 36;
// Keeps divisors above 0: black next to black is alike.
constexpr float kAboveZero = 1e-20F;
// A fit's slopes are damped by this share of the sum of weights, which matters where a feature hardly varies.
constexpr float kRidge = 1e-3F;
// A fit to fewer alike pixels than kMany counts for as much less, since it keeps as much more of the noise.
// The centre itself is alike, so that each fit counts for something.
constexpr float kMany = 24;

// The terms of a fit: 1, x, y, the normal, the inverse albedo and the share of emitters. All but the first
// are relative to the centre's.
constexpr int kTerms = 8;
static_assert(kPixels % kTerms == 0);
using Terms = std::array<float, kTerms>;
using Lanes = float __attribute__((vector_size(sizeof(Terms)), may_alias, aligned(4)));
Lanes& lanes(Terms& terms) {
    return *reinterpret_cast<Lanes*>(terms.data());
}
const Lanes& lanes(const Terms& terms) {
    return *reinterpret_cast<const Lanes*>(terms.data());
}
constexpr float kPixelStep = 0.125F;  // the terms x and y per pixel

using OfWindow = std::array<float, kPixels>;

// Solves the symmetric, positive definite system A x = b for three right sides by A = L D Lᵀ. A and b are
// overwritten, b by the solutions.
void solve(std::array<Terms, kTerms>& a, std::array<Terms, 3>& b) {
    for (std::size_t k = 0; k < kTerms; ++k) {
        const float inverse = 1 / a[k][k];
        for (std::size_t i = k + 1; i < kTerms; ++i) {
            const float factor = a[k][i] * inverse;
            for (std::size_t j = i; j < kTerms; ++j) a[i][j] -= factor * a[k][j];
            for (Terms& side : b) side[i] -= factor * side[k];
        }
        for (std::size_t j = k + 1; j < kTerms; ++j) a[k][j] *= inverse;
        for (Terms& side : b) side[k] *= inverse;
    }
    for (std::size_t k = kTerms; k-- > 0;) {
        for (Terms& side : b) {
            for (std::size_t j = k + 1; j < kTerms; ++j) side[k] -= a[k][j] * side[j];
        }
    }
}

// Holds what the fits of all centres share.
struct Picture {
    const FeaturePlanes& features;
    const std::array<HalfPlanes, 2>& halves;
    int width, height;
    int stride;                // row length of `terms`, which has a rim as planes have
    std::vector<Terms> terms;  // terms before the centre's are subtracted

    Picture(int w, int h, const FeaturePlanes& f, const std::array<HalfPlanes, 2>& both,
            const Workers& workers)
        : features(f),
          halves(both),
          width(w),
          height(h),
          stride(w + 2 * Plane::kRim),
          terms(static_cast<std::size_t>(stride) * static_cast<std::size_t>(h + 2 * Plane::kRim)) {
        constexpr int kRim = Plane::kRim;
        const std::int64_t grain = Plane::rows_at_a_time(w);
        parallel_each(workers, static_cast<std::size_t>(h + 2 * kRim), grain, [&](std::size_t row) {
            const int y = static_cast<int>(row) - kRim;
            Terms* const to = &terms[row * static_cast<std::size_t>(stride)] + kRim;
            for (int x = -kRim; x < w + kRim; ++x) {
                to[x] = {1,
                         kPixelStep * static_cast<float>(x),
                         kPixelStep * static_cast<float>(y),
                         f.normal[0].row(y)[x],
                         f.normal[1].row(y)[x],
                         f.normal[2].row(y)[x],
                         f.inverse_albedo.row(y)[x],
                         f.emitter.row(y)[x]};
            }
        });
    }

    const Terms* row(int y) const {
        return &terms[static_cast<std::size_t>(y + Plane::kRim) * static_cast<std::size_t>(stride)] +
               Plane::kRim;
    }
};

// Holds the sums over fits: of weights, and of weights times fitted values.
struct Sums {
    std::array<Plane, 2> weights;
    std::array<Filtered, 2>& values;
};

// Fits the light about centres, one after the other, and adds the results to sums.
class Fitter {
  public:
    Fitter(const Picture& picture, Sums& sums) : picture_(picture), sums_(sums) {
        for (int i = 0; i < kPixels; ++i) {
            const auto dx = static_cast<float>(i % kSide - kBefore) + 0.5F,
                       dy = static_cast<float>(i / kSide - kBefore) + 0.5F;
            falloff_[static_cast<std::size_t>(i)] = exp(-0.5F * (dx * dx + dy * dy) / sqr(kSpread));
        }
    }

    // Adds the fits of those halves whose flag is set.
    void add(int x, int y, const std::array<bool, 2>& halves = {true, true}) {
        x_ = x, y_ = y;
        compare_features();
        set_terms();
        for (std::size_t half = 0; half < 2; ++half) {
            if (!halves[half]) continue;
            compare_patches(picture_.halves[half]);
            add_half(half);
        }
    }

  private:
    // Returns the addresses of the leftmost pixels of a plane in a row of the window about (x, y).
    static const float* row(const Plane& plane, int x, int y, int of_window) {
        return plane.row(y - kBefore + of_window) + x - kBefore;
    }
    const float* row(const Plane& plane, int of_window) const { return row(plane, x_, y_, of_window); }
    std::array<const float*, 3> rows(const ColourPlanes& planes, int of_window) const {
        return {row(planes[0], of_window), row(planes[1], of_window), row(planes[2], of_window)};
    }
    std::array<float, 3> centre(const ColourPlanes& planes) const {
        return {planes[0].row(y_)[x_], planes[1].row(y_)[x_], planes[2].row(y_)[x_]};
    }

    // Compares the window's pixels to the centre by their features.
    void compare_features() {
        const FeaturePlanes& f = picture_.features;
        const auto a = centre(f.albedo), n = centre(f.normal), g = centre(f.geometric_normal),
                   p = centre(f.position);
        const float e = f.emitter.row(y_)[x_], near = f.inverse_footprint.row(y_)[x_];
        OfWindow alike;  // a local array aliases no plane, so that the loop is vectorised
        for (int y = 0; y < kSide; ++y) {
            const auto as = rows(f.albedo, y), ns = rows(f.normal, y), ps = rows(f.position, y);
            const float *const es = row(f.emitter, y), *const inside = row(f.inside, y);
            float* const to = &alike[static_cast<std::size_t>(y * kSide)];
            const float* const falloff = &falloff_[static_cast<std::size_t>(y * kSide)];
            for (int x = 0; x < kSide; ++x) {
                const float of_a = sqr(as[0][x] - a[0]) + sqr(as[1][x] - a[1]) + sqr(as[2][x] - a[2]);
                const float of_n = sqr(ns[0][x] - n[0]) + sqr(ns[1][x] - n[1]) + sqr(ns[2][x] - n[2]);
                const float of_p =
                    near * (g[0] * (ps[0][x] - p[0]) + g[1] * (ps[1][x] - p[1]) + g[2] * (ps[2][x] - p[2]));
                to[x] = falloff[x] * inside[x] * weight_of(feature_distance(of_a, of_n, of_p, es[x] - e));
            }
        }
        alike_ = alike;
    }

    // Sets the terms of the window's pixels, pixel by pixel and term by term.
    void set_terms() {
        Terms middle = picture_.row(y_)[x_];
        middle[0] = 0;
        for (int y = 0; y < kSide; ++y) {
            const Terms* const from = picture_.row(y_ - kBefore + y) + x_ - kBefore;
            Terms* const to = &terms_[static_cast<std::size_t>(y * kSide)];
            for (int x = 0; x < kSide; ++x) lanes(to[x]) = lanes(from[x]) - lanes(middle);
        }
        const FeaturePlanes& f = picture_.features;
        const Plane* const planes[kTerms] = {nullptr,      nullptr,      nullptr,           &f.normal[0],
                                             &f.normal[1], &f.normal[2], &f.inverse_albedo, &f.emitter};
        for (int y = 0; y < kSide; ++y) {
            const auto first = static_cast<std::size_t>(y * kSide);
            for (int x = 0; x < kSide; ++x) {
                by_term_[1][first + x] = kPixelStep * static_cast<float>(x - kBefore);
                by_term_[2][first + x] = kPixelStep * static_cast<float>(y - kBefore);
            }
            for (std::size_t k = 3; k < kTerms; ++k) {
                const float* const from = row(*planes[k], y);
                for (int x = 0; x < kSide; ++x) by_term_[k][first + x] = from[x] - middle[k];
            }
        }
    }

    // Compares the window's patches to the centre's by their squared differences relative to noise.
    void compare_patches(const HalfPlanes& half) {
        constexpr float kShare = 1.0F / 9;
        alignas(32) OfWindow distance{};
        compare_own(half, distance);
        for (int j = -kPatchStep; j <= kPatchStep; j += kPatchStep) {
            for (int i = -kPatchStep; i <= kPatchStep; i += kPatchStep) {
                const int u = x_ + i, v = y_ + j;
                const float value = half.guide.row(v)[u], noise = half.noise.row(v)[u];
                for (int y = 0; y < kSide; ++y) {
                    const float *const values = row(half.guide, u, v, y), *const noises =
                                                                              row(half.noise, u, v, y);
                    float* const to = &distance[static_cast<std::size_t>(y * kSide)];
                    for (int x = 0; x < kSide; ++x) {
                        const float both = noises[x] + noise;
                        to[x] += std::min((sqr(values[x] - value) - both) / (both + kAboveZero), kFarthest);
                    }
                }
            }
        }
        for (std::size_t i = 0; i < kPixels; ++i) likeness_[i] = alike_[i] * weight_of(kShare * distance[i]);
        for (int y = 0; y < kSide; ++y) {
            const float* const trust = row(half.trust, y);
            const auto first = static_cast<std::size_t>(y * kSide);
            for (int x = 0; x < kSide; ++x) trusted_[first + x] = likeness_[first + x] * trust[x];
        }
    }

    // Adds the squared differences to the centre's own value, as far as these are too large for chance.
    void compare_own(const HalfPlanes& half, OfWindow& distance) const {
        const float value = half.own.row(y_)[x_], noise = half.own_noise.row(y_)[x_];
        for (int y = 0; y < kSide; ++y) {
            const float *const values = row(half.own, y), *const noises = row(half.own_noise, y);
            float* const to = &distance[static_cast<std::size_t>(y * kSide)];
            for (int x = 0; x < kSide; ++x) {
                const float both = noises[x] + noise + kAboveZero;
                to[x] += std::clamp(sqr(values[x] - value) / both - kChance, 0.0F, kUnlike);
            }
        }
    }

    static float sum_of(const OfWindow& values) {
        Terms sums{};
        for (std::size_t i = 0; i < kPixels; i += kTerms) {
            for (std::size_t k = 0; k < kTerms; ++k) sums[k] += values[i + k];
        }
        return std::accumulate(sums.begin(), sums.end(), 0.0F);
    }

    struct Fit {
        std::array<Terms, 3> factors;  // of each colour's terms
        std::array<float, 3> means;    // weighted
    };
    // Fits the window's values by these weights.
    Fit fit(const ColourPlanes& values, const OfWindow& weights) const {
        Lanes squares[kTerms] = {}, products[3] = {};
        for (int y = 0; y < kSide; ++y) {
            const auto of = rows(values, y);
            for (int x = 0; x < kSide; ++x) {
                const auto i = static_cast<std::size_t>(y * kSide + x);
                const float* const terms = terms_[i].data();
                const Lanes weighted = weights[i] * lanes(terms_[i]);
                for (int k = 0; k < kTerms; ++k) squares[k] += terms[k] * weighted;
                for (int c = 0; c < 3; ++c) products[c] += of[static_cast<std::size_t>(c)][x] * weighted;
            }
        }
        const float sum = squares[0][0];
        std::array<Terms, kTerms> a;
        Fit result;
        std::array<Terms, 3>& b = result.factors;
        for (std::size_t k = 0; k < kTerms; ++k) {
            for (std::size_t j = 0; j < kTerms; ++j) a[k][j] = squares[k][static_cast<int>(j)];
            if (k > 0) a[k][k] += kRidge * sum;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            result.means[c] = products[c][0] / sum;
            for (std::size_t j = 0; j < kTerms; ++j) b[c][j] = products[c][static_cast<int>(j)];
        }
        solve(a, b);
        return result;
    }

    void add_half(std::size_t half) {
        const Fit fitted = fit(picture_.halves[half].value, trusted_);
        const float share = std::min(1.0F, sum_of(likeness_) / kMany);
        for (float& weight : likeness_) weight *= share;
        add_rows(sums_.weights[half], [this](std::size_t i) { return likeness_[i]; });
        Filtered& to = sums_.values[half];
        for (std::size_t c = 0; c < 3; ++c) {
            add_rows(to[static_cast<std::size_t>(Candidate::constant)][c],
                     [&](std::size_t i) { return likeness_[i] * fitted.means[c]; });
            add_fit(to[static_cast<std::size_t>(Candidate::linear)][c], fitted.factors[c]);
        }
    }
    void add_fit(Plane& to, const Terms& factors) const {
        add_rows(to, [&](std::size_t i) {
            float value = factors[0];
            for (std::size_t k = 1; k < kTerms; ++k) value += factors[k] * by_term_[k][i];
            return likeness_[i] * value;
        });
    }
    // Adds a function of the window's pixels to a plane.
    template <typename Value>
    void add_rows(Plane& plane, Value&& value) const {
        for (int y = 0; y < kSide; ++y) {
            float* const to = plane.row(y_ - kBefore + y) + x_ - kBefore;
            const auto first = static_cast<std::size_t>(y * kSide);
            for (std::size_t x = 0; x < kSide; ++x) to[x] += value(first + x);
        }
    }

    const Picture& picture_;
    Sums& sums_;
    int x_ = 0, y_ = 0;  // the centre
    alignas(32) OfWindow falloff_, alike_, likeness_, trusted_;
    alignas(32) std::array<Terms, kPixels> terms_;
    alignas(32) std::array<OfWindow, kTerms> by_term_;
};

// Calls body(first row, last row + 1) for all bands: first for every second one, and then for those between
// them, whose windows reach into the same pixels.
template <typename Body>
void for_each_band(const Workers& workers, int height, Body&& body) {
    const std::int64_t bands = (height + kBand - 1) / kBand;
    for (const std::int64_t parity : {0, 1}) {
        parallel_chunks(workers, (bands + 1 - parity) / 2, [&](std::int64_t chunk) {
            const auto begin = static_cast<int>(kBand * (2 * chunk + parity));
            body(begin, std::min(height, begin + kBand));
        });
    }
}

// Divides the sums of a row by the weights. Beside a steep edge, such as that of a shadow, a linear fit may
// be far below all light of its window, or below 0: it is then raised to a share of the weighted mean, or to
// the mean where that is negative.
void finish_row(int y, int width, const Plane& weights, Filtered& filtered) {
    constexpr float kLeast = 0.3F;
    const float* const weight = weights.row(y);
    for (ColourPlanes& candidate : filtered) {
        for (Plane& plane : candidate) {
            float* const to = plane.row(y);
            for (int x = 0; x < width; ++x) to[x] /= weight[x];
        }
    }
    for (std::size_t c = 0; c < 3; ++c) {
        float* const to = filtered[static_cast<std::size_t>(Candidate::linear)][c].row(y);
        const float* const mean = filtered[static_cast<std::size_t>(Candidate::constant)][c].row(y);
        for (int x = 0; x < width; ++x) to[x] = std::max(to[x], std::min(mean[x], kLeast * mean[x]));
    }
}

}  // namespace

Regression regress(int width, int height, const FeaturePlanes& features,
                   const std::array<HalfPlanes, 2>& halves, const Workers& workers) {
    Regression result;
    std::array<Filtered, 2>& filtered = result.light;
    for (Filtered& half : filtered) {
        for (ColourPlanes& candidate : half) {
            for (Plane& plane : candidate) plane = Plane(width, height);
        }
    }
    Sums sums{{Plane(width, height), Plane(width, height)}, filtered};
    const Picture picture(width, height, features, halves, workers);
    for_each_band(workers, height, [&](int begin, int end) {
        Fitter fitter(picture, sums);
        for (int y = begin; y < end; y += kStride) {
            for (int x = 0; x < width; x += kStride)
                fitter.add(std::min(x + kStride / 2, width - 1), std::min(y + kStride / 2, height - 1));
        }
    });
    result.support = sums.weights;
    for_each_band(workers, height, [&](int begin, int end) {
        Fitter fitter(picture, sums);
        for (int y = begin; y < end; ++y) {
            const float *const first = sums.weights[0].row(y), *const second = sums.weights[1].row(y);
            for (int x = 0; x < width; ++x) {
                const std::array bare{first[x] < kSupported, second[x] < kSupported};
                if (bare[0] || bare[1]) fitter.add(x, y, bare);
            }
        }
    });
    parallel_each(workers, static_cast<std::size_t>(height), Plane::rows_at_a_time(width),
                  [&](std::size_t row) {
                      for (std::size_t half = 0; half < 2; ++half)
                          finish_row(static_cast<int>(row), width, sums.weights[half], filtered[half]);
                  });
    return result;
}

}  // namespace lucerna
