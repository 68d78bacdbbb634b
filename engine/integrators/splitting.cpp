#include "engine/integrators/splitting.h"

#include <algorithm>
#include <cmath>

#include "engine/image/image.h"

namespace lucerna {
namespace {

// These are costs in microseconds of one core, in rooms of some 100,000 triangles. Only their ratios matter.
constexpr double kCameraSample = 2, kLightSample = 2.5, kGatherRay = 3, kCausticEstimate = 8;

// These bound the numbers of samples. Above the upper bounds each sample brings little; lower ones are needed
// because a pilot that found nothing does not prove that there is nothing.
constexpr double kMostLightSamples = 8, kMostGatherRays = 32;
constexpr double kLeastGatherRays = 0.25, kLeastCausticEstimates = 0.1;

// A camera sample's own variance is assumed to be at least this share of its square. A pilot of few pixels
// misses edges, which nearly every cell has, and the difference of two estimated variances is seldom as small
// as it looks. A pixel's camera samples are stratified, unlike the pilot's, but that makes up for little:
// with few samples at edges, or many lamps, for hardly anything.
constexpr double kLeastOwnVariance = 0.1;

// A guided ray costs this many times as much, with a margin because few samples estimate the variances.
constexpr double kGuidedRay = 1.5;

}  // namespace

bool SplitMoments::choose_guiding() {
    if (unguided_variance() > kGuidedRay * variance) return true;
    variance = std::max(0.0, unguided_variance());
    second_moment = unguided_moment;
    return false;
}

void Splitting::Cell::add(const Cell& other, double scale) {
    const auto sum = [scale](SplitMoments& to, const SplitMoments& more) {
        to.variance += scale * more.variance;
        to.second_moment += scale * more.second_moment;
        to.unguided_moment += scale * more.unguided_moment;
        to.places += more.places;
    };
    for (std::size_t i = 0; i < kShareClasses; ++i) {
        sum(kinds[i].light, other.kinds[i].light);
        sum(kinds[i].gather, other.kinds[i].gather);
        sum(kinds[i].caustic, other.kinds[i].caustic);
    }
    samples += other.samples;
    between += scale * other.between;
    square += scale * other.square;
}

SplitPlan Splitting::best(const Cell& cell) {
    if (!(cell.square > 0)) return {};
    // Both camera samples of a pixel took two samples of each kind. Half of the sums is the moment of one
    // sample, and half of its variance was in each camera sample's value.
    double of_kinds = 0;
    for (const SplitKinds& kinds : cell.kinds)
        of_kinds += 0.5 * (kinds.light.variance + kinds.gather.variance);
    double variance = std::max(cell.between - 0.5 * of_kinds, kLeastOwnVariance * cell.square);
    double cost = kCameraSample;
    // `of` is the variance, or second moment, of one sample. `places` counts those of all camera samples.
    const auto number = [&](double of, double places, double each) {
        return std::sqrt(of / (each * places / cell.samples) * cost / variance);
    };

    SplitPlan plan;
    for (std::size_t i = 0; i < kShareClasses; ++i) {
        const SplitMoments& light = cell.kinds[i].light;
        // Without any such place, there is no reason to spend more than in the class above.
        if (i > 0) plan[i].light_samples = plan[i - 1].light_samples;
        if (!(light.places > 0)) continue;
        const double left = 0.5 * light.variance;
        const double lights = std::clamp(number(left, light.places, kLightSample), 1.0, kMostLightSamples);
        plan[i].light_samples = static_cast<float>(lights);
    }
    // At least one light sample is always taken. Light samples therefore become part of the camera sample:
    // their variance and cost add to its own.
    for (std::size_t i = 0; i < kShareClasses; ++i) {
        const SplitMoments& light = cell.kinds[i].light;
        const double lights{plan[i].light_samples};
        variance += 0.5 * light.variance / lights;
        cost += lights * kLightSample * light.places / cell.samples;
    }
    for (std::size_t i = 0; i < kShareClasses; ++i) {
        if (i > 0) {
            plan[i].gather_rays = plan[i - 1].gather_rays;
            plan[i].caustic_estimates = plan[i - 1].caustic_estimates;
            plan[i].guided = plan[i - 1].guided;
        }
        const double share{kMostShare[i]};
        SplitMoments gather = cell.kinds[i].gather;
        if (gather.places > 0) {
            plan[i].guided = gather.choose_guiding();
            double rays = number(0.5 * gather.variance, gather.places, kGatherRay);
            if (rays < 1) rays = std::min(number(0.5 * gather.second_moment, gather.places, kGatherRay), 1.0);
            plan[i].gather_rays =
                static_cast<float>(std::clamp(rays, share * kLeastGatherRays, kMostGatherRays));
        }
        const SplitMoments& caustic = cell.kinds[i].caustic;
        if (caustic.places > 0) {
            const double estimates = number(0.5 * caustic.second_moment, caustic.places, kCausticEstimate);
            plan[i].caustic_estimates =
                static_cast<float>(std::clamp(estimates, share * kLeastCausticEstimates, 1.0));
        }
    }
    return plan;
}

// Makes the plans. Sums each cell with its neighbours, because the few pixels of one cell tell too little.
void Splitting::settle(const std::vector<Cell>& pixels) {
    double mean = 0;
    for (const Cell& pixel : pixels) mean += std::sqrt(pixel.square) / static_cast<double>(pixels.size());
    std::vector<Cell> cells(pixels.size() / kPixels);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double scale = error_scale2(std::sqrt(pixels[i].square), mean);
        if (scale > 0) cells[i / kPixels].add(pixels[i], 1 / scale);
    }
    plans_.assign(cells.size(), {});
    for (int y = 0; y < down_; ++y) {
        for (int x = 0; x < across_; ++x) {
            Cell sum;
            for (int v = std::max(0, y - 1); v <= std::min(down_ - 1, y + 1); ++v) {
                for (int u = std::max(0, x - 1); u <= std::min(across_ - 1, x + 1); ++u)
                    sum.add(cells[static_cast<std::size_t>(v * across_ + u)]);
            }
            plans_[static_cast<std::size_t>(y * across_ + x)] = best(sum);
        }
    }
}

bool Splitting::any_guided() const {
    const auto is_guided = [](const SplitNumbers& numbers) { return numbers.guided; };
    return std::any_of(plans_.begin(), plans_.end(), [&](const SplitPlan& plan) {
        return std::any_of(plan.begin(), plan.end(), is_guided);
    });
}

std::size_t Splitting::cell_of(const V2f& film) const {
    if (plans_.size() == 1) return 0;
    const auto index = [](float at, float size, int cells) {
        return std::clamp(static_cast<int>(at / size * static_cast<float>(cells)), 0, cells - 1);
    };
    return static_cast<std::size_t>(index(film.y - begin_.y, size_.y, down_) * across_ +
                                    index(film.x - begin_.x, size_.x, across_));
}

}  // namespace lucerna
