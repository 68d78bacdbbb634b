#include "lights/measurement/ray_projection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "lights/measurement/ray_passage.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostRays = 60'000;       // of a trial; the rest says little more
constexpr std::size_t kMostCoefficients = 2e7;  // of a choice: 80 MB in memory
constexpr int kViews[] = {4, 5, 6, 8, 11, 15, 20, 27, 36, 48, 64};
constexpr int kLeastPixels = 4, kMostPixels = 256;
constexpr int kSteps = 4;  // towards the pixels that have the noise asked for

// Contributions of the rays to one coefficient or another. Calls add(coefficient, contribution, bell) for
// each, the bell being what the coefficient contributes to the field at the ray.
template <typename Add>
void for_each_contribution(const LampRay& ray, const Rig& rig, Add&& add) {
    const Passage at(ray, rig);
    if (at.misses_s) return;
    for (std::size_t i = 0; i < 4; ++i) {
        const int z = static_cast<int>(i);
        if (!at.exists(rig, 0, z) || at.pixel[0][i] < 0) continue;
        for (std::size_t j = 0; j < 4; ++j) {
            const int w = static_cast<int>(j);
            if (!at.exists(rig, 1, w) || at.pixel[1][j] < 0) continue;
            add(rig.index(at.base[0] - 1 + z, at.base[1] - 1 + w, at.pixel[0][i], at.pixel[1][j]),
                double{ray.flux} * at.dual[0][i] * at.dual[1][j], at.bell_at(0, z) * at.bell_at(1, w));
        }
    }
}

// Σ e G e with the overlaps of the bells on S; the pixels' boxes do not overlap. e is the flux, E times a
// cell's volume.
double squared_norm(const std::vector<double>& e, const Rig& rig) {
    const double same = bell_overlap(0), next = bell_overlap(1);
    const std::size_t image = static_cast<std::size_t>(rig.pixels.x) * static_cast<std::size_t>(rig.pixels.y);
    const auto product = [&](int m, int n, int m2, int n2) {
        if (m2 >= rig.views.x || n2 < 0 || n2 >= rig.views.y) return 0.0;
        const auto a = e.begin() + static_cast<std::ptrdiff_t>(rig.index(m, n, 0, 0));
        const auto b = e.begin() + static_cast<std::ptrdiff_t>(rig.index(m2, n2, 0, 0));
        return std::inner_product(a, a + static_cast<std::ptrdiff_t>(image), b, 0.0);
    };
    double sum = 0;
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            sum += same * same * product(m, n, m, n) +
                   2 * same * next * (product(m, n, m + 1, n) + product(m, n, m, n + 1)) +
                   2 * next * next * (product(m, n, m + 1, n + 1) + product(m, n, m + 1, n - 1));
        }
    }
    return sum;
}

// What one ray alone adds to that norm, per axis and unit flux. All filters see it in the same pixel: σ = 0.
double own_norm(const Passage& at, const Rig& rig, int axis) {
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
        if (!at.exists(rig, axis, i) || at.pixel[axis][i] < 0) continue;
        for (int j = 0; j < 4; ++j) {
            if (!at.exists(rig, axis, j) || at.pixel[axis][j] < 0) continue;
            sum += at.dual[axis][static_cast<std::size_t>(i)] * at.dual[axis][static_cast<std::size_t>(j)] *
                   bell_overlap(i - j);
        }
    }
    return sum;
}

// Every k-th ray, so that there are not many more than kMostRays.
std::vector<std::size_t> thinned(std::span<const std::size_t> rays) {
    const std::size_t step = (rays.size() + kMostRays - 1) / kMostRays;
    std::vector<std::size_t> some;
    for (std::size_t i = 0; i < rays.size(); i += std::max<std::size_t>(step, 1)) some.push_back(rays[i]);
    return some;
}

void lay(const ResolutionWish& wish, int views, int pixels, Rig& rig) {
    for (int a = 0; a < 2; ++a) {
        rig.views[a] = wish.views[a] > 0 ? wish.views[a] : views;
        rig.pixels[a] = wish.pixels[a] > 0 ? wish.pixels[a] : pixels;
        // One filter stands outside the box on either side.
        rig.spacing[a] = 2 * wish.half_s[a] / std::max(1, rig.views[a] - 3);
        rig.pixel[a] = 2 * wish.half_m[a] / rig.pixels[a];
    }
}

// The finest pixels under the wished noise that a few steps find, for this number of views.
class PixelSearch {
  public:
    PixelSearch(const RaySet& set, std::span<const std::size_t> rays, const ResolutionWish& wish)
        : set_(set), rays_(rays), wish_(wish) {}

    struct Found {
        int views = 0, pixels = 0;
        double risk = INFINITY;
    };
    Found with_views(int views, Rig rig) const {
        Found best;
        double pixels = 16;
        for (int step = 0; step < kSteps; ++step) {
            const int whole = std::clamp(static_cast<int>(std::lround(pixels)), kLeastPixels, kMostPixels);
            lay(wish_, views, whole, rig);
            if (rig.coefficients() > kMostCoefficients) {
                pixels = 0.7 * whole;
                continue;
            }
            const ResolutionTrial trial = try_resolution(set_, rays_, rig);
            const double noise = trial.noise.relative();
            if (noise <= wish_.noise && trial.risk < best.risk) best = {views, whole, trial.risk};
            if (wish_.pixels.x > 0 && wish_.pixels.y > 0) break;
            // Noise grows about as the square root of the number of pixels; a little less is aimed at.
            const double next = std::clamp(0.97 * whole * wish_.noise / noise, 0.3 * whole, 3.0 * whole);
            if (!(next >= 1) || static_cast<int>(std::lround(next)) == whole) break;
            pixels = next;
        }
        return best;
    }

  private:
    const RaySet& set_;
    std::span<const std::size_t> rays_;
    const ResolutionWish& wish_;
};

}  // namespace

double CoefficientNoise::relative() const {
    const double signal = square - variance;
    return signal > 0 ? std::sqrt(variance / signal) : INFINITY;
}

ResolutionTrial try_resolution(const RaySet& set, std::span<const std::size_t> rays, const Rig& rig) {
    const std::vector<std::size_t> some = thinned(rays);
    // Fewer rays stand for all: each for `factor` of them.
    const double factor =
        static_cast<double>(rays.size()) / static_cast<double>(std::max<std::size_t>(some.size(), 1));
    std::vector<double> e(rig.coefficients());
    ResolutionTrial trial;
    double variance = 0;  // of a field from some of the rays
    for (const std::size_t r : some) {
        for_each_contribution(set.rays[r], rig, [&](std::size_t i, double add, double) {
            e[i] += add;
            variance += add * add;
        });
    }
    double square = 0;
    for (const double x : e) square += x * x;
    double agreement = 0;  // Σ flux times the field of the other rays
    for (const std::size_t r : some) {
        const double flux = double{set.rays[r].flux};
        for_each_contribution(set.rays[r], rig, [&](std::size_t i, double add, double bell) {
            agreement += flux * bell * (e[i] - add);
        });
    }
    const double volume = rig.cell_volume();  // > 0: the boxes have an area
    const double all = factor * factor;
    trial.noise.variance = all * variance / factor;  // that of all rays is less by as much
    trial.noise.square = all * (square - variance) + trial.noise.variance;
    // The norm, too, with no more noise than all rays would leave.
    double own = 0;
    for (const std::size_t r : some) {
        const Passage at(set.rays[r], rig);
        if (!at.misses_s) own += sqr(double{set.rays[r].flux}) * own_norm(at, rig, 0) * own_norm(at, rig, 1);
    }
    const double norm = squared_norm(e, rig) - own + own / factor;
    trial.risk = all * (norm - 2 * agreement) / volume;
    return trial;
}

bool choose_resolution(const RaySet& set, std::span<const std::size_t> rays, const ResolutionWish& wish,
                       Rig& rig, Monitor& monitor) {
    const PixelSearch search(set, rays, wish);
    Phase phase(monitor, "choosing the resolution", std::size(kViews));
    PixelSearch::Found best;
    int worse = 0;
    for (const int views : kViews) {
        const PixelSearch::Found found = search.with_views(views, rig);
        worse = found.risk < best.risk ? 0 : worse + 1;
        if (worse == 0) best = found;
        phase.advance(1);
        // Past the best, more views only get noisier.
        if (worse == 2 && best.views > 0) break;
        if (wish.views.x > 0 && wish.views.y > 0) break;
    }
    const bool quiet_enough = best.views > 0;
    if (!quiet_enough) best.views = kViews[0], best.pixels = kLeastPixels;
    lay(wish, best.views, best.pixels, rig);
    return quiet_enough;
}

}  // namespace lucerna
