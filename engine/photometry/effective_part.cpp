#include "engine/photometry/effective_part.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/stats.h"

namespace lucerna {
namespace {

constexpr double kLeast = 500;    // cd/m²
constexpr double kReach = 4;      // standard deviations of the filter
constexpr double kPitch = 0.8;    // of pixels, in standard deviations of the filter
constexpr int kMostPixels = 200;  // along a side, without what the filter adds

// An image of the luminaire over the slopes x / z and y / z of directions, seen along its middle.
struct Grid {
    double left = 0, bottom = 0, pitch = 1;
    int width = 0, height = 0;

    std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
    double x(int i) const { return left + (i + 0.5) * pitch; }
    double y(int j) const { return bottom + (j + 0.5) * pitch; }
    double solid_angle(int i, int j) const { return sqr(pitch) * pow(1 + sqr(x(i)) + sqr(y(j)), -1.5); }
};

struct Slopes {
    double x, y, sigma;  // sigma: of the filter there
};

Slopes slopes_of(const SeenLight& light, const Frame& frame, double fwhm) {
    const V3d local(frame.to_local(light.w));
    const double z = std::max(local.z, 0.05), x = local.x / z, y = local.y / z;
    // Slopes are longer than angles: the filter covers the same solid angle everywhere.
    return {x, y, fwhm / kFwhmOverSigma / light.distance * pow(1 + sqr(x) + sqr(y), 0.75)};
}

// Flux, and flux over the square of the position index, of the pixels of a batch.
struct Picture {
    std::vector<double> flux, over_p2;

    explicit Picture(std::size_t size) : flux(size), over_p2(size) {}
    void add(const Picture& other, double times) {
        for (std::size_t i = 0; i < flux.size(); ++i) {
            flux[i] += times * other.flux[i];
            over_p2[i] += times * other.over_p2[i];
        }
    }
};

// Pixels along one side that the filter reaches, and their shares of the light.
struct Spread {
    int first = 0;
    std::vector<double> shares;

    // `at` and `sigma` are in slopes from the side's beginning.
    void set(double at, double sigma, double reach, double pitch, int pixels) {
        first = std::max(0, static_cast<int>((at - reach) / pitch));
        const int last = std::min(pixels - 1, static_cast<int>((at + reach) / pitch));
        shares.clear();
        double sum = 0;
        for (int i = first; i <= last; ++i) {
            shares.push_back(exp(-sqr((i + 0.5) * pitch - at) / (2 * sqr(sigma))));
            sum += shares.back();
        }
        for (double& share : shares) share /= sum;  // > 0, as a pixel's centre is within its pitch
    }
};

// Adds a sample's light, spread by the filter.
void spread(const SeenLight& light, const Slopes& at, const Grid& grid, Picture& picture, Spread& across,
            Spread& up) {
    // Where pixels are wider than the filter, as in a very large luminaire, they take its place.
    const double sigma = std::max(at.sigma, 0.5 * grid.pitch);
    const double reach = std::max(kReach * at.sigma, grid.pitch);
    across.set(at.x - grid.left, sigma, reach, grid.pitch, grid.width);
    up.set(at.y - grid.bottom, sigma, reach, grid.pitch, grid.height);
    for (std::size_t j = 0; j < up.shares.size(); ++j) {
        std::size_t pixel = (static_cast<std::size_t>(up.first) + j) * static_cast<std::size_t>(grid.width) +
                            static_cast<std::size_t>(across.first);
        for (const double share : across.shares) {
            const double flux = light.flux * share * up.shares[j];
            picture.flux[pixel] += flux;
            picture.over_p2[pixel] += flux / sqr(light.position);
            ++pixel;
        }
    }
}

EffectivePart part_of(const Picture& picture, const Grid& grid) {
    double flux = 0, over_p2 = 0;
    EffectivePart part;
    for (int j = 0; j < grid.height; ++j) {
        for (int i = 0; i < grid.width; ++i) {
            const std::size_t pixel = static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.width) +
                                      static_cast<std::size_t>(i);
            const double solid_angle = grid.solid_angle(i, j);
            if (!(picture.flux[pixel] > kLeast * solid_angle)) continue;
            part.solid_angle += solid_angle;
            flux += picture.flux[pixel];
            over_p2 += picture.over_p2[pixel];
        }
    }
    if (!(part.solid_angle > 0)) return part;
    part.luminance = flux / part.solid_angle;
    part.term.value = part.luminance * over_p2;
    return part;
}

}  // namespace

EffectivePart effective_part(std::span<const std::vector<SeenLight>> batches, int of_batch, double fwhm) {
    V3f middle(0);
    for (const std::vector<SeenLight>& batch : batches)
        for (const SeenLight& light : batch) middle += static_cast<float>(light.flux) * light.w;
    if (!(middle.length2() > 0)) return {};
    const Frame frame(middle.normalized());
    double left = INFINITY, right = -INFINITY, bottom = INFINITY, top = -INFINITY, sigma = INFINITY,
           widest = 0;
    for (const std::vector<SeenLight>& batch : batches) {
        for (const SeenLight& light : batch) {
            const Slopes at = slopes_of(light, frame, fwhm);
            left = std::min(left, at.x);
            right = std::max(right, at.x);
            bottom = std::min(bottom, at.y);
            top = std::max(top, at.y);
            sigma = std::min(sigma, at.sigma);
            widest = std::max(widest, at.sigma);
        }
    }
    Grid grid;
    grid.pitch = std::max(kPitch * sigma, std::max(right - left, top - bottom) / kMostPixels);  // > 0
    const double margin = std::max(kReach * widest, 2 * grid.pitch);
    grid.left = left - margin;
    grid.bottom = bottom - margin;
    grid.width = static_cast<int>((right - left + 2 * margin) / grid.pitch) + 1;
    grid.height = static_cast<int>((top - bottom + 2 * margin) / grid.pitch) + 1;

    // The standard error is that of the jackknife, since the part itself depends on the samples.
    const auto count = static_cast<double>(batches.size());
    Picture all(grid.size());
    std::vector<Picture> pictures;
    Spread across, up;
    for (const std::vector<SeenLight>& batch : batches) {
        Picture& picture = pictures.emplace_back(grid.size());
        for (const SeenLight& light : batch)
            spread(light, slopes_of(light, frame, fwhm), grid, picture, across, up);
        all.add(picture, 1);
    }
    const auto of = [&](const Picture* without) {
        const double share = 1 / (of_batch * (without ? count - 1 : count));
        Picture mean(grid.size());
        mean.add(all, share);
        if (without) mean.add(*without, -share);
        return part_of(mean, grid);
    };
    EffectivePart part = of(nullptr);
    RunningStats rest;
    for (const Picture& picture : pictures) rest.add(of(&picture).term.value);
    part.term.half_width = student_95(batches.size()) * (count - 1) * rest.standard_error();
    return part;
}

}  // namespace lucerna
