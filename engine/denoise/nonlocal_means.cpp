#include "engine/denoise/nonlocal_means.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace lucerna {
namespace {

constexpr int kWindow = Plane::kWindow, kPatch = Plane::kPatch;
// One thread processes this number of rows at a time.
constexpr int kBand = 16;

// kSharpness is the factor k of [Rousselle et al. 2012, (5)]: a patch distance of 1 means that the squared
// difference exceeds that of noise by k² times the noise.
constexpr float kSharpness = 0.5F;
constexpr float kFarthest = 50;
// Multiplies patch distances for `loose`, whose patches may thus be less alike.
constexpr float kLoose = 0.15F;
// These differences of two pixels' features count as 1: albedo, normals, share of emitters, and the distance
// of one position from the other's tangent plane, in footprints.
constexpr float kAlbedoStep = 0.3F, kNormalStep = 0.25F, kEmitterStep = 0.2F, kPlaneStep = 2;

// Approximates exp(-d) for small d; 0 from d = 4 on.
inline float weight_of(float d) {
    const float t = std::max(0.0F, 1 - 0.25F * std::max(0.0F, d));
    return sqr(sqr(t));
}

// Filters the rows of one band, offset by offset.
class Band {
  public:
    Band(int width, int begin, int end, const FeaturePlanes& features,
         const std::array<HalfPlanes, 2>& halves)
        : width_(width),
          begin_(begin),
          rows_(end - begin),
          features_(features),
          halves_(halves),
          stride_(static_cast<std::size_t>(width + 2 * kPatch)),
          distances_(stride_ * static_cast<std::size_t>(rows_ + 2 * kPatch)),
          columns_(stride_),
          strict_(static_cast<std::size_t>(width)),
          loose_(static_cast<std::size_t>(width)),
          alike_(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows_)) {
        for (auto& of_half : sums_) {
            for (auto& candidate : of_half) {
                for (auto& sum : candidate) sum.assign(alike_.size(), 0);
            }
        }
    }

    void add(const V2i& offset) {
        const float falloff = exp(-0.5F * static_cast<float>(offset.dot(offset)) / sqr(0.5F * kWindow));
        compare_features(offset, falloff);
        for (std::size_t half = 0; half < 2; ++half) {
            compare_pixels(halves_[half], offset);
            add_half(half, offset);
        }
    }

    void finish(std::array<Filtered, 2>& to) const {
        for (std::size_t half = 0; half < 2; ++half) {
            for (std::size_t k = 0; k < kCandidates; ++k) {
                const auto& sums = sums_[half][k];
                for (int y = 0; y < rows_; ++y) {
                    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
                    for (std::size_t c = 0; c < 3; ++c) {
                        float* const out = to[half][k][c].row(begin_ + y);
                        // The divisor is above 0, because the pixel's own weight is.
                        for (int x = 0; x < width_; ++x) {
                            const std::size_t at = row + static_cast<std::size_t>(x);
                            out[x] = sums[c][at] / sums[3][at];
                        }
                    }
                }
            }
        }
    }

  private:
    // Compares pixels by their features.
    void compare_features(const V2i& offset, float falloff) {
        constexpr float kA = 1 / sqr(kAlbedoStep), kN = 1 / sqr(kNormalStep), kE = 1 / sqr(kEmitterStep),
                        kP = 1 / sqr(kPlaneStep);
        const FeaturePlanes& f = features_;
        const bool same = offset == V2i(0, 0);
        for (int y = 0; y < rows_; ++y) {
            float* const to = &alike_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
            const int v = begin_ + y, u = v + offset.y;
            const auto here = [v](const ColourPlanes& p) {
                return std::array{p[0].row(v), p[1].row(v), p[2].row(v)};
            };
            const auto there = [u, &offset](const ColourPlanes& p) {
                return std::array{p[0].row(u) + offset.x, p[1].row(u) + offset.x, p[2].row(u) + offset.x};
            };
            const auto a1 = here(f.albedo), n1 = here(f.normal), p1 = here(f.position),
                       g = here(f.geometric_normal);
            const auto a2 = there(f.albedo), n2 = there(f.normal), p2 = there(f.position);
            const float *const e1 = f.emitter.row(v), *const e2 = f.emitter.row(u) + offset.x;
            const float *const near = f.inverse_footprint.row(v), *const inside = f.inside.row(u) + offset.x;
            for (int x = 0; x < width_; ++x) {
                const float a =
                    sqr(a1[0][x] - a2[0][x]) + sqr(a1[1][x] - a2[1][x]) + sqr(a1[2][x] - a2[2][x]);
                const float n =
                    sqr(n1[0][x] - n2[0][x]) + sqr(n1[1][x] - n2[1][x]) + sqr(n1[2][x] - n2[2][x]);
                const float p = near[x] * (g[0][x] * (p1[0][x] - p2[0][x]) + g[1][x] * (p1[1][x] - p2[1][x]) +
                                           g[2][x] * (p1[2][x] - p2[2][x]));
                const float d = kA * a + kN * n + kP * sqr(p) + kE * sqr(e1[x] - e2[x]);
                to[x] = falloff * inside[x] * weight_of(d);
            }
            if (same) std::fill_n(to, width_, 1.0F);
        }
    }

    // Compares pixels by their squared differences relative to noise.
    void compare_pixels(const HalfPlanes& half, const V2i& offset) {
        constexpr float kScale = 1 / sqr(kSharpness);
        const auto width = static_cast<int>(stride_);
        for (int y = 0; y < rows_ + 2 * kPatch; ++y) {
            float* const to = &distances_[static_cast<std::size_t>(y) * stride_];
            const int v = begin_ + y - kPatch, u = v + offset.y;
            const float *a[3], *b[3], *va[3], *vb[3];
            for (std::size_t c = 0; c < 3; ++c) {
                a[c] = half.value[c].row(v) - kPatch, b[c] = half.value[c].row(u) + offset.x - kPatch;
                va[c] = half.variance[c].row(v) - kPatch, vb[c] = half.variance[c].row(u) + offset.x - kPatch;
            }
            for (int x = 0; x < width; ++x) {
                const float noise = va[0][x] + vb[0][x] + va[1][x] + vb[1][x] + va[2][x] + vb[2][x];
                const float difference =
                    sqr(a[0][x] - b[0][x]) + sqr(a[1][x] - b[1][x]) + sqr(a[2][x] - b[2][x]);
                // The added constant keeps the divisor above 0: black next to black is alike.
                to[x] = std::min(kScale * (difference - noise) / (noise + 1e-20F), kFarthest);
            }
        }
    }

    // Computes patch distances and adds the resulting weights and weighted values.
    void add_half(std::size_t half, const V2i& offset) {
        constexpr float kShare = 1.0F / ((2 * kPatch + 1) * (2 * kPatch + 1));
        const HalfPlanes& planes = halves_[half];
        const bool same = offset == V2i(0, 0);
        for (int y = 0; y < rows_; ++y) {
            const int u = begin_ + y + offset.y;
            const float* const first = &distances_[static_cast<std::size_t>(y) * stride_];
            for (std::size_t x = 0; x < stride_; ++x) {
                float sum = 0;
                for (std::size_t r = 0; r < 2 * kPatch + 1; ++r) sum += first[r * stride_ + x];
                columns_[x] = sum;
            }
            const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
            const float* const alike = &alike_[row];
            const float* const columns = columns_.data();
            float *const strict = strict_.data(), *const loose = loose_.data();
            for (int x = 0; x < width_; ++x) {
                float sum = 0;
                for (int o = 0; o < 2 * kPatch + 1; ++o) sum += columns[x + o];
                const float d = kShare * sum;
                strict[x] = alike[x] * weight_of(d);
                loose[x] = alike[x] * weight_of(kLoose * d);
            }
            if (same) {
                std::fill_n(strict, width_, 1.0F);
                std::fill_n(loose, width_, 1.0F);
            }
            const float* const trust = planes.trust.row(u) + offset.x;
            const float *const r = planes.value[0].row(u) + offset.x,
                               *const g = planes.value[1].row(u) + offset.x,
                               *const b = planes.value[2].row(u) + offset.x;
            float* out[kCandidates][4];
            for (std::size_t k = 0; k < kCandidates; ++k) {
                for (std::size_t c = 0; c < 4; ++c) out[k][c] = &sums_[half][k][c][row];
            }
            for (int x = 0; x < width_; ++x) {
                const float weights[kCandidates] = {strict[x], strict[x] * trust[x], loose[x] * trust[x]};
                for (std::size_t k = 0; k < kCandidates; ++k) {
                    out[k][0][x] += weights[k] * r[x];
                    out[k][1][x] += weights[k] * g[x];
                    out[k][2][x] += weights[k] * b[x];
                    out[k][3][x] += weights[k];
                }
            }
        }
    }

    int width_, begin_, rows_;
    const FeaturePlanes& features_;
    const std::array<HalfPlanes, 2>& halves_;
    std::size_t stride_;  // row length of distances: the image's, plus a patch's half side at both ends
    std::vector<float> distances_, columns_, strict_, loose_, alike_;
    // Holds, for each half and candidate, the weighted sums of R, G, B and the sum of weights.
    std::array<std::array<std::array<std::vector<float>, 4>, kCandidates>, 2> sums_;
};

}  // namespace

std::array<Filtered, 2> nonlocal_means(int width, int height, const FeaturePlanes& features,
                                       const std::array<HalfPlanes, 2>& halves, const Workers& workers) {
    std::array<Filtered, 2> filtered;
    for (Filtered& half : filtered) {
        for (ColourPlanes& candidate : half) candidate.fill(Plane(width, height));
    }
    parallel_ranges(workers, height, kBand,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t /*chunk*/) {
                        Band band(width, static_cast<int>(begin), static_cast<int>(end), features, halves);
                        for (int dy = -kWindow; dy <= kWindow; ++dy) {
                            for (int dx = -kWindow; dx <= kWindow; ++dx) band.add({dx, dy});
                        }
                        band.finish(filtered);
                    });
    return filtered;
}

}  // namespace lucerna
