// Chooses how many samples of each kind (light samples, gather rays, density estimates) a camera sample takes
// where it looks.
//
// Source: [Rath 2022; Bolin and Meyer 1997]. A camera sample costs C0 and has a variance of V0, due to edges,
// textures and the lens, which only more camera samples reduce. Each other kind of sample has cost c and
// variance v. With n samples of each kind, the pixel's error in a given time is proportional to
// (V0 + Σ v/n) (C0 + Σ n c), which is least for
//
//   n = sqrt(v/c · C0/V0).
//
// c is the cost at all places where one camera sample takes samples of the kind; behind glass and gloss there
// are several. A place seen in a faint mirror contributes little, and deserves fewer samples than what the
// camera sees directly. The numbers are therefore chosen for classes of places, by their share in the pixel.
//
// For n < 1 one sample is taken with probability n and divided by n; its second moment then takes the place
// of its variance. A pilot estimates the variances: it takes some camera samples in each cell of the image,
// and two samples of every kind at each place. Costs are constants of a typical scene, not the clock's, so
// that the same settings give the same image.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "engine/ranks/shared_work.h"
#include "engine/scene/render_context.h"

namespace lucerna {

// Holds the mean number of samples of each kind. A number below 1 is a probability.
struct SplitNumbers {
    float light_samples = 1, gather_rays = 4, caustic_estimates = 1;
    bool guided = false;  // whether photons guide the gather rays
};

// Places are classified by their throughput, the share of their radiance that reaches the pixel: class i has
// at most kMostShare[i], and more than kMostShare[i + 1].
inline constexpr std::array<float, 3> kMostShare = {1, 0.5F, 0.125F};
inline constexpr std::size_t kShareClasses = kMostShare.size();
inline std::size_t share_class(float throughput) {
    std::size_t i = 0;
    while (i + 1 < kShareClasses && throughput <= kMostShare[i + 1]) ++i;
    return i;
}
using SplitPlan = std::array<SplitNumbers, kShareClasses>;

// Accumulates what the pilot finds of one kind at all the places that it shades, as luminance that reaches
// the pixel. `a` and `b` are two independent samples at one place.
struct SplitMoments {
    double variance = 0;       // of one sample at a given place: (a - b)²/2
    double second_moment = 0;  // of one sample: the squared mean a b, plus the variance
    // This is the second moment that samples would have had without guiding: each one's square times the
    // ratio of its density to that without guiding.
    double unguided_moment = 0;
    double places = 0;  // number of places

    void add(double a, double b, double ratio_a = 1, double ratio_b = 1) {
        variance += 0.5 * (a - b) * (a - b);
        second_moment += 0.5 * (a * a + b * b);
        unguided_moment += 0.5 * (a * a * ratio_a + b * b * ratio_b);
        ++places;
    }
    // Guiding does not change the mean, so mean² = second moment - variance with and without it.
    double unguided_variance() const { return unguided_moment - second_moment + variance; }
    // Returns whether guiding pays. If it does not, replaces the moments by those without guiding.
    bool choose_guiding();
};
struct SplitKinds {
    SplitMoments light, gather, caustic;
};
using SplitPilot = std::array<SplitKinds, kShareClasses>;

class Splitting {
  public:
    Splitting() = default;
    explicit Splitting(const SplitNumbers& everywhere) : plans_{everywhere_alike(everywhere)} {}
    // Runs the pilot. Calls sample(ray, sampler, pilot) for camera rays all over the view, which returns a
    // ray's radiance from two samples of each kind at every place. The number of threads does not matter.
    template <typename Sample>
    Splitting(const View& view, std::uint64_t seed, std::uint32_t pass, const Workers& workers,
              Sample&& sample);

    // Returns the plan for a camera sample at a position on the whole film, pixels.
    const SplitPlan& at(const V2f& film) const { return plans_[cell_of(film)]; }
    std::size_t cells() const { return plans_.size(); }
    // Tells whether photons guide gather rays anywhere.
    bool any_guided() const;

    static SplitPlan everywhere_alike(const SplitNumbers& numbers) {
        SplitPlan plan;
        plan.fill(numbers);
        return plan;
    }

  private:
    static constexpr int kCells = 16;  // per side, at most
    static constexpr int kPixels = 6;  // looked at in each cell
    static constexpr int kTurn = 2;    // camera samples of each such pixel
    // Holds the moments of one pixel, or sums over the pixels of a cell, each relative to the radiance that
    // it shows, as an image's error is measured.
    struct Cell {
        SplitPilot kinds;
        double samples = 0;  // number of camera samples
        double between = 0;  // variance between camera samples of a pixel
        double square = 0;   // squared mean of the camera samples
        void add(const Cell& other, double scale = 1);
    };
    static SplitPlan best(const Cell& cell);
    void settle(const std::vector<Cell>& pixels);
    std::size_t cell_of(const V2f& film) const;

    V2f begin_{0, 0}, size_{1, 1};
    int across_ = 1, down_ = 1;
    std::vector<SplitPlan> plans_ = {SplitPlan{}};
};

template <typename Sample>
Splitting::Splitting(const View& view, std::uint64_t seed, std::uint32_t pass, const Workers& workers,
                     Sample&& sample)
    : begin_(view.begin), size_(view.end - view.begin) {
    constexpr float kLeastCell = 4;  // pixels
    across_ = std::clamp(static_cast<int>(size_.x / kLeastCell), 1, kCells);
    down_ = std::clamp(static_cast<int>(size_.y / kLeastCell), 1, kCells);
    const auto cells = static_cast<std::size_t>(across_ * down_);
    std::vector<Cell> pixels(cells * kPixels);
    const auto look = [&](std::int64_t number) {
        const auto i = static_cast<std::size_t>(number);
        const auto c = static_cast<int>(number);
        const V2f cell(static_cast<float>(c % across_), static_cast<float>(c / across_));
        const V2f extent(size_.x / static_cast<float>(across_), size_.y / static_cast<float>(down_));
        for (int p = 0; p < kPixels; ++p) {
            Sampler where = Sampler::stratified(seed, Purpose::splitting, i, static_cast<std::uint32_t>(p));
            const V2f at = begin_ + (cell + where.next2()) * extent;
            const V2f pixel(std::floor(at.x), std::floor(at.y));
            std::array<double, kTurn> seen{};
            Cell& own = pixels[i * kPixels + static_cast<std::size_t>(p)];
            for (int turn = 0; turn < kTurn; ++turn) {
                Sampler sampler =
                    Sampler(seed, Purpose::splitting, pass, i * kPixels + static_cast<std::size_t>(p))
                        .split(static_cast<std::uint32_t>(turn));
                const V2f place = pixel + sampler.next2(), lens = sampler.next2();
                const Rgb radiance = sample(view.camera->ray(place, lens), sampler, own.kinds);
                seen[static_cast<std::size_t>(turn)] = is_finite(radiance) ? double{luminance(radiance)} : 0;
            }
            own.samples = kTurn;
            own.between = 0.5 * (seen[0] - seen[1]) * (seen[0] - seen[1]);
            own.square = 0.25 * (seen[0] + seen[1]) * (seen[0] + seen[1]);
        }
    };
    shared_chunks(workers, "pilot", static_cast<std::int64_t>(cells), ResultsGo::to_all_ranks, look,
                  [&](std::int64_t cell, auto& archive) {
                      auto own = std::span(pixels).subspan(static_cast<std::size_t>(cell) * kPixels, kPixels);
                      archive(own);
                  });
    settle(pixels);
}

}  // namespace lucerna
