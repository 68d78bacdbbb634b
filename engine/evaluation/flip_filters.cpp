#include "engine/base/elementary.h"
#include "engine/evaluation/flip.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {
namespace {

constexpr std::int64_t kRowsPerChunk = 16;

// The eye's contrast sensitivity, transformed from frequencies to positions: Σ amplitude exp(-π² x² / width),
// x in degrees [FLIP table 1].
struct Gaussian {
    double amplitude, width;
};
constexpr Gaussian kAchromatic{1, 0.0047};
constexpr Gaussian kRedGreen{1, 0.0053};
constexpr Gaussian kBlueYellow[] = {{34.1, 0.04}, {13.5, 0.025}};
constexpr double kWidest = 0.04;

// Width in degrees of the eye's edge and point detection [FLIP 4.2].
constexpr double kFeatureWidth = 0.082;

int radius_of(double sigma_pixels) {
    return std::max(1, static_cast<int>(std::ceil(3 * sigma_pixels)));
}

template <typename Weight>
std::vector<double> weights(int radius, Weight&& weight) {
    std::vector<double> result;
    for (int x = -radius; x <= radius; ++x) result.push_back(weight(static_cast<double>(x)));
    return result;
}

double sum_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return sum;
}

Kernel scaled(const std::vector<double>& values, double by) {
    Kernel kernel;
    for (const double v : values) kernel.push_back(static_cast<float>(v * by));
    return kernel;
}

// Scales positive weights to a sum of 1 and negative ones to -1; leaves all 0 if the kernel is too narrow to
// have any.
Kernel balanced(const std::vector<double>& values) {
    double positive = 0, negative = 0;
    for (const double v : values) (v > 0 ? positive : negative) += std::fabs(v);
    Kernel kernel;
    for (const double v : values) {
        const double whole = v > 0 ? positive : negative;
        kernel.push_back(whole > 0 ? static_cast<float>(v / whole) : 0.0F);
    }
    return kernel;
}

Blur blur_of(std::span<const Gaussian> gaussians, int radius, double pixels_per_degree) {
    Blur blur;
    std::vector<double> shares;
    for (const Gaussian& g : gaussians) {
        const auto values =
            weights(radius, [&](double x) { return exp(-sqr(kPiD * x / pixels_per_degree) / g.width); });
        const double sum = sum_of(values);  // at least 1, the central weight
        shares.push_back(g.amplitude * std::sqrt(kPiD / g.width) * sum * sum);
        blur.parts.push_back({0, scaled(values, 1 / sum)});
    }
    const double whole = sum_of(shares);  // > 0, as every share is
    for (std::size_t i = 0; i < shares.size(); ++i)
        blur.parts[i].weight = static_cast<float>(shares[i] / whole);
    return blur;
}

}  // namespace

FlipPlane along_rows(const FlipPlane& plane, const Kernel& kernel, const Workers& workers) {
    FlipPlane result(plane.width, plane.height);
    const int radius = static_cast<int>(kernel.size() / 2);
    parallel_ranges(workers, plane.height, kRowsPerChunk,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t) {
                        std::vector<float> padded(static_cast<std::size_t>(plane.width + 2 * radius));
                        for (int y = static_cast<int>(begin); y < end; ++y) {
                            const float* row = plane.row(y);
                            std::fill_n(padded.begin(), radius, row[0]);
                            std::copy_n(row, plane.width, padded.begin() + radius);
                            std::fill_n(padded.end() - radius, radius, row[plane.width - 1]);
                            float* out = result.row(y);
                            for (std::size_t k = 0; k < kernel.size(); ++k) {
                                const float weight = kernel[k];
                                const float* in = &padded[k];
                                for (int x = 0; x < plane.width; ++x) out[x] += weight * in[x];
                            }
                        }
                    });
    return result;
}

FlipPlane along_columns(const FlipPlane& plane, const Kernel& kernel, const Workers& workers) {
    FlipPlane result(plane.width, plane.height);
    const int radius = static_cast<int>(kernel.size() / 2);
    parallel_ranges(workers, plane.height, kRowsPerChunk,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t) {
                        for (int y = static_cast<int>(begin); y < end; ++y) {
                            float* out = result.row(y);
                            for (int k = -radius; k <= radius; ++k) {
                                const float weight = kernel[static_cast<std::size_t>(k + radius)];
                                const float* in = plane.row(std::clamp(y + k, 0, plane.height - 1));
                                for (int x = 0; x < plane.width; ++x) out[x] += weight * in[x];
                            }
                        }
                    });
    return result;
}

EyeBlurs eye_blurs(double pixels_per_degree) {
    // All channels have the same radius, three standard deviations of the widest Gaussian.
    const int radius = radius_of(std::sqrt(kWidest / (2 * kPiD * kPiD)) * pixels_per_degree);
    return {blur_of({&kAchromatic, 1}, radius, pixels_per_degree),
            blur_of({&kRedGreen, 1}, radius, pixels_per_degree),
            blur_of(kBlueYellow, radius, pixels_per_degree)};
}

FlipPlane blurred(const FlipPlane& plane, const Blur& blur, const Workers& workers) {
    FlipPlane result(plane.width, plane.height);
    for (const Blur::Part& part : blur.parts) {
        const FlipPlane one = along_columns(along_rows(plane, part.kernel, workers), part.kernel, workers);
        for (std::size_t i = 0; i < result.data.size(); ++i) result.data[i] += part.weight * one.data[i];
    }
    return result;
}

FeatureKernels feature_kernels(double pixels_per_degree) {
    const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;  // > 0
    const int radius = radius_of(sigma);
    const auto gaussian = [&](double x) { return exp(-sqr(x / sigma) / 2); };
    const auto smooth = weights(radius, gaussian);
    return {scaled(smooth, 1 / sum_of(smooth)),
            balanced(weights(radius, [&](double x) { return -x * gaussian(x); })),
            balanced(weights(radius, [&](double x) { return (sqr(x / sigma) - 1) * gaussian(x); }))};
}

}  // namespace lucerna
