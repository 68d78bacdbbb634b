// Chooses the resolution at which the field of a ray set is closest to the lamp.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/sampler.h"
#include "lights/measurement/held_out.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostCoefficients = 3e7;  // of a choice: 240 MB in memory
// A choice may also have no more than this number per ray that chooses, each of which adds to 64 of them, or
// kAlways if that is larger; with more, nearly all would be 0.
constexpr std::size_t kMostPerRay = 256, kAlways = 1e5;
// A choice of more coefficients must lower the squared error by this share.
constexpr double kWorthwhile = 0.01;
constexpr int kViews[] = {3, 4, 5, 6, 8, 10, 12, 15, 18, 22, 27, 33, 40, 50, 64, 80, 100};
constexpr int kPixels[] = {3,  4,  5,  6,  8,  10, 12, 14,  17,  20,  24,
                           29, 35, 42, 50, 60, 72, 86, 104, 125, 150, 180};
constexpr double kDuals[] = {0, 0.5, 1};
// A compressed coordinate ends at this share of 2c, which is 1.2° from the plane as seen from c above it.
constexpr double kEnd = 0.98;
// The coordinates tried compress what lies outside the middle half of the light on a plane, times these
// factors. 0 stands for a uniform S, and for a coordinate of M that is uniform in direction.
constexpr double kMiddles[] = {0, 8, 5, 3, 2, 1};

// The search begins with few rays. The best choice by them is where the search by kRound times as many
// begins, which then makes few steps. It ends with a share of the rays, within limits: the noise of the
// estimate by those is well below the error of the field of all rays, because it is a mean over thousands of
// cells.
constexpr std::size_t kFirstRays = 20'000, kRound = 4, kShareOfRays = 10;
constexpr std::size_t kLeastLast = 100'000, kMostLast = 1'600'000;

// Indices into the lists above, and the choice of coordinates.
struct Choice {
    int views, pixels, dual_s, dual_m, middle_s, middle_m;
    auto operator<=>(const Choice&) const = default;
};

// A change of a choice.
struct Step {
    int views = 0, pixels = 0, dual_s = 0, dual_m = 0, middle_s = 0, middle_m = 0;

    // Returns nothing if the lists end before.
    std::optional<Choice> from(const Choice& at) const {
        const Choice next{at.views + views,   at.pixels + pixels,     at.dual_s + dual_s,
                          at.dual_m + dual_m, at.middle_s + middle_s, at.middle_m + middle_m};
        const auto is_in = [](int i, auto& list) { return i >= 0 && i < std::ssize(list); };
        const bool known = is_in(next.views, kViews) && is_in(next.pixels, kPixels) &&
                           is_in(next.dual_s, kDuals) && is_in(next.dual_m, kDuals) &&
                           is_in(next.middle_s, kMiddles) && is_in(next.middle_m, kMiddles);
        return known ? std::optional(next) : std::nullopt;
    }
};

// The cost of a choice: first the share of the light that must be held but is not, then the error.
struct Badness {
    double lost = INFINITY, error = INFINITY;
    bool operator<(const Badness& other) const {
        return lost != other.lost ? lost < other.lost : error < other.error;
    }
};

class Search {
  public:
    // `held_out` are the rays that choose. Keeps a reference to them.
    Search(const HeldOutRays& held_out, const PlaneBoxes& boxes, const Rig& rig, const Workers& workers,
           Monitor& monitor)
        : boxes_(boxes),
          rig_(rig),
          held_out_(held_out),
          most_(boxes.views.x > 0 && boxes.pixels.x > 0
                    ? std::numeric_limits<std::size_t>::max()
                    : std::min(kMostCoefficients, std::max(kAlways, kMostPerRay * held_out.rays()))),
          workers_(workers),
          monitor_(monitor) {
        // Half of the light passes M within this, from the far field.
        const V2d slopes = held_out_.half_slopes();
        half_m_ = std::max(slopes.x, slopes.y) * rig.distance;
    }

    // Changes one property after the other as long as steps improve it, until none does. Begins with the best
    // of `starts`.
    Choice best(std::span<const Choice> starts, Phase& phase) {
        Choice at = starts.front();
        Badness least = badness_of(at);
        for (const Choice& start : starts.subspan(1)) {
            if (badness_of(start) < least) least = badness_of(start), at = start;
        }
        for (bool better = true; better;) {
            better = false;
            for (const Step& step : steps()) {
                for (;; better = true) {
                    if (monitor_.stopped()) throw Stopped("choosing the resolution: stopped");
                    const std::optional<Choice> next = step.from(at);
                    if (!next || !is_better(*next, at)) break;
                    at = *next;
                    phase.advance(1);
                }
            }
        }
        return at;
    }

    RayPlanes lay(const Choice& choice) const;

  private:
    std::vector<Step> steps() const {
        std::vector<Step> all;
        const bool pixels = !(boxes_.pixels.x > 0 && boxes_.pixels.y > 0);
        const bool views = !(boxes_.views.x > 0 && boxes_.views.y > 0);
        for (const int way : {1, -1}) {
            if (pixels) all.push_back({.pixels = way});
            if (views) all.push_back({.views = way});
            all.push_back({.middle_s = way});
            all.push_back({.middle_m = way});
            all.push_back({.dual_m = way});
            all.push_back({.dual_s = way});
            // Less of the dual is made up for by a finer basis.
            if (pixels) all.push_back({.pixels = 2 * way, .dual_m = -way});
            if (views) all.push_back({.views = 2 * way, .dual_s = -way});
        }
        return all;
    }

    bool is_better(const Choice& next, const Choice& than) {
        const Badness now = badness_of(next);
        Badness least = badness_of(than);
        if (lay(next).rig.coefficients() > lay(than).rig.coefficients())
            least.error -= kWorthwhile * std::fabs(least.error);
        return now < least;
    }

    Badness badness_of(const Choice& choice) {
        const auto known = tried_.find(choice);
        if (known != tried_.end()) return known->second;
        const RayPlanes planes = lay(choice);
        Badness badness;
        if (planes.rig.coefficients() <= most_) {
            const HeldOutRays::Found found = held_out_.find_errors(planes.rig, planes.weights, workers_);
            const double moved = found.moved * static_cast<double>(found.errors.size());
            badness = {std::max(0.0, boxes_.held - found.held), total_error(found.errors) + moved};
        }
        tried_[choice] = badness;
        return badness;
    }

    const PlaneBoxes& boxes_;
    Rig rig_;
    const HeldOutRays& held_out_;
    std::size_t most_;   // coefficients
    double half_m_ = 0;  // half size on M within which half of the light passes
    std::map<Choice, Badness> tried_;
    Workers workers_;
    Monitor& monitor_;
};

RayPlanes Search::lay(const Choice& choice) const {
    RayPlanes planes;
    planes.weights = {kDuals[choice.dual_s], kDuals[choice.dual_m]};
    Rig& rig = planes.rig;
    rig = rig_;
    rig.basis = PixelBasis::hat;
    const V2d middle = choice.middle_s > 0 ? held_out_.middle_on_s() : boxes_.centre_s;
    rig.centre.x = middle.x, rig.centre.y = middle.y;
    const V2d half = held_out_.half_on_s();
    rig.s_coordinate.c = kMiddles[choice.middle_s] * std::max(half.x, half.y);
    rig.m_coordinate.c = choice.middle_m > 0 ? kMiddles[choice.middle_m] * half_m_ : rig.distance;
    for (int a = 0; a < 2; ++a) {
        rig.views[a] = boxes_.views[a] > 0 ? boxes_.views[a] : kViews[choice.views];
        rig.pixels[a] = boxes_.pixels[a] > 0 ? boxes_.pixels[a] : kPixels[choice.pixels];
        // The box has its own centre, from which the rig's may differ.
        const double reach_s = boxes_.half_s[a] + std::fabs(boxes_.centre_s[a] - middle[a]);
        // A uniform S has one filter outside the box on either side; the outermost filters of a
        // compressed one stand for the rest of the plane.
        rig.spacing[a] = 2 * rig.s_coordinate.of(reach_s) / std::max(1, rig.views[a] - 3);
        if (choice.middle_s > 0)
            rig.spacing[a] = std::min(rig.spacing[a], 4 * kEnd * rig.s_coordinate.c / (rig.views[a] + 1));
        // The centres of the outermost pixels are at the edges of the box.
        const double reach_m =
            rig.m_coordinate.of(boxes_.half_m[a] + std::fabs(boxes_.centre_s[a] - middle[a]));
        rig.pixel[a] = std::min(2 * reach_m / std::max(1, rig.pixels[a] - 1),
                                4 * kEnd * rig.m_coordinate.c / (rig.pixels[a] + 1));
    }
    return planes;
}

}  // namespace

HeldOutParts held_out_parts(std::span<const std::size_t> rays) {
    HeldOutParts parts;
    std::uint64_t number = 0;
    for (const std::size_t ray : rays) {
        Sampler draw(0, Purpose::acquisition, 1, number++);
        // A set of one ray still has a resolution, but no stated error.
        const bool judges = !parts.choosing.empty() && (draw.bits() & 3) == 0;
        (judges ? parts.judging : parts.choosing).push_back(ray);
    }
    return parts;
}

void choose_resolution(const RaySet& set, std::span<const std::size_t> rays, const PlaneBoxes& boxes,
                       RayPlanes& planes, const Workers& workers, Monitor& monitor) {
    const HeldOutParts parts = held_out_parts(rays);
    // A compressed S differs from a uniform one in other respects, too, so the search starts from both.
    std::vector<Choice> starts{{5, 5, 0, 1, 0, 0}, {5, 5, 0, 1, 1, 0}, {5, 5, 0, 1, 3, 0}};
    Phase phase(monitor, "choosing the resolution", 0);
    const Rig rig = planes.rig;
    const std::size_t last =
        std::min(parts.choosing.size(), std::clamp(boxes.rays / kShareOfRays, kLeastLast, kMostLast));
    std::size_t part = 1;
    while (last / (part * kRound) >= kFirstRays) part *= kRound;
    for (; part > 1; part /= kRound) {
        const HeldOutRays few(set, parts.choosing, boxes.rays, rig.centre.z, last / part);
        starts = {Search(few, boxes, rig, workers, monitor).best(starts, phase)};
    }
    const HeldOutRays choosing(set, parts.choosing, boxes.rays, rig.centre.z, last);
    Search search(choosing, boxes, rig, workers, monitor);
    planes = search.lay(search.best(starts, phase));
    if (parts.judging.empty()) return;
    planes.judge = std::make_shared<const HeldOutRays>(set, parts.judging, boxes.rays, choosing);
    planes.errors = planes.judge->find_errors(planes.rig, planes.weights, workers).errors;
}

}  // namespace lucerna
