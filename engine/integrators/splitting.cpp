#include "engine/integrators/splitting.h"

#include <algorithm>
#include <cmath>

#include "engine/base/image.h"

namespace lucerna {
namespace {

// Costs, in microseconds of one core in rooms of some 100,000 triangles: only their ratios matter.
constexpr double kCameraSample = 2, kLightSample = 2.5, kGatherRay = 3, kCausticEstimate = 8;

// Bounds of what is chosen. Many samples are cut off where each more brings little; few, where a pilot that
// met nothing is no proof that there is nothing.
constexpr double kMostLightSamples = 8, kMostGatherRays = 32;
constexpr double kLeastGatherRays = 0.25, kLeastCausticEstimates = 0.1;

// A pixel's camera samples, and the first light sample of each, are stratified among each other, where those
// of the pilot are not: what they leave is so many times less than it shows (4 is about that of 16 to 64
// samples of light and edges in rooms).
constexpr double kStratified = 4;
// A camera sample's own variance is taken for this share of its square at the least: a pilot of few pixels
// sees no edge, and there is one in nearly every cell.
constexpr double kLeastOwnVariance = 0.02;

}  // namespace

void Splitting::Cell::add(const Cell& other, double scale) {
    const auto sum = [scale](SplitMoments& to, const SplitMoments& more) {
        to.variance += scale * more.variance;
        to.second_moment += scale * more.second_moment;
    };
    sum(kinds.light, other.kinds.light);
    sum(kinds.gather, other.kinds.gather);
    sum(kinds.caustic, other.kinds.caustic);
    between += scale * other.between;
    square += scale * other.square;
}

SplitNumbers Splitting::best(const Cell& cell) {
    if (!(cell.square > 0)) return {};
    // Each kind was looked at twice, by both camera samples of a pixel: half of its sums stand for one
    // sample, and half of its variance was in each camera sample's value.
    const double light = 0.5 * cell.kinds.light.variance, gather = 0.5 * cell.kinds.gather.variance;
    const double gather2 = 0.5 * cell.kinds.gather.second_moment,
                 caustic2 = 0.5 * cell.kinds.caustic.second_moment;
    double variance =
        std::max(cell.between - 0.5 * (light + gather), kLeastOwnVariance * cell.square) / kStratified;
    double cost = kCameraSample;
    const auto number = [&](double of, double each) { return std::sqrt(of / each * cost / variance); };

    SplitNumbers numbers;
    const double lights = std::clamp(number(light / kStratified, kLightSample), 1.0, kMostLightSamples);
    numbers.light_samples = static_cast<float>(lights);
    // Of light samples there is always one: it is a part of the camera sample where it pays no better to have
    // more.
    variance += light / (lights * kStratified);
    cost += lights * kLightSample;
    double rays = number(gather, kGatherRay);
    if (rays < 1) rays = std::min(number(gather2, kGatherRay), 1.0);
    numbers.gather_rays = static_cast<float>(std::clamp(rays, kLeastGatherRays, kMostGatherRays));
    numbers.caustic_estimates =
        static_cast<float>(std::clamp(number(caustic2, kCausticEstimate), kLeastCausticEstimates, 1.0));
    return numbers;
}

// What few pixels met is evened out: with the cells around, and a little with all.
void Splitting::settle(const std::vector<Cell>& pixels) {
    double mean = 0;
    for (const Cell& pixel : pixels) mean += std::sqrt(pixel.square) / static_cast<double>(pixels.size());
    std::vector<Cell> cells(pixels.size() / kPixels);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double scale = error_scale2(std::sqrt(pixels[i].square), mean);
        if (scale > 0) cells[i / kPixels].add(pixels[i], 1 / scale);
    }
    numbers_.assign(cells.size(), {});
    for (int y = 0; y < down_; ++y) {
        for (int x = 0; x < across_; ++x) {
            Cell sum;
            for (int v = std::max(0, y - 1); v <= std::min(down_ - 1, y + 1); ++v) {
                for (int u = std::max(0, x - 1); u <= std::min(across_ - 1, x + 1); ++u)
                    sum.add(cells[static_cast<std::size_t>(v * across_ + u)]);
            }
            numbers_[static_cast<std::size_t>(y * across_ + x)] = best(sum);
        }
    }
}

std::size_t Splitting::cell_of(const V2f& film) const {
    if (numbers_.size() == 1) return 0;
    const auto index = [](float at, float size, int cells) {
        return std::clamp(static_cast<int>(at / size * static_cast<float>(cells)), 0, cells - 1);
    };
    return static_cast<std::size_t>(index(film.y - begin_.y, size_.y, down_) * across_ +
                                    index(film.x - begin_.x, size_.x, across_));
}

}  // namespace lucerna
