#include "engine/scene/media_along.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace lucerna {
namespace {

// Emission is evaluated at this mean number of places along a crossing.
constexpr double kSearches = 4;

}  // namespace

MediaAlong::MediaAlong(const SceneMedia& media, std::int32_t inside, const Ray& ray, double end)
    : last_(end) {
    const auto add = [&](const Medium& medium) {
        const auto found = crossing(medium, ray, end);
        if (!found) return;
        crossings_.push_back(*found);
        scatters_ = scatters_ || !is_black(medium.sigma_s);
        emits_ = emits_ || medium.emits();
        uniform_all_ = uniform_all_ && medium.is_uniform();
    };
    if (inside != kNoMedium) add(media.all[static_cast<std::size_t>(inside)]);
    for (const std::uint32_t region : media.regions) add(media.all[region]);
    if (crossings_.empty()) return;
    // There is no medium before the first crossing and after the last.
    end_ = last_;
    last_ = 0;
    for (const MediumCrossing& c : crossings_) {
        end_ = std::min(end_, c.entry);
        last_ = std::max(last_, c.exit);
    }
}

bool MediaAlong::next() {
    if (crossings_.empty() || !(end_ < last_)) return false;
    begin_ = end_;
    end_ = last_;
    for (MediumCrossing& c : crossings_) {
        if (begin_ < c.entry) end_ = std::min(end_, c.entry);
        if (!is_active(c)) continue;
        while (c.traversal.end() <= begin_ && c.traversal.end() < c.exit) c.traversal.next();
        end_ = std::min({end_, c.traversal.end(), c.exit});
    }
    sum_up();
    return true;
}

void MediaAlong::sum_up() {
    uniform_ = bound_ = V3d(0);
    search_ = 0;
    for (const MediumCrossing& c : crossings_) {
        if (!is_active(c)) continue;
        const V3d sigma_t(c.medium->sigma_t());
        if (c.medium->is_uniform()) {
            uniform_ += sigma_t;
        } else {
            bound_ += c.traversal.bound() * sigma_t;
        }
        if (c.medium->emits() && c.traversal.bound() > 0) search_ += kSearches / (c.exit - c.entry);
    }
}

Coefficients MediaAlong::at(double t) const {
    Coefficients sum;
    for (const MediumCrossing& c : crossings_) {
        if (!is_active(c)) continue;
        const double density = c.traversal.at(t);
        sum.sigma_t += density * V3d(c.medium->sigma_t());
        sum.sigma_s += density * V3d(c.medium->sigma_s);
        sum.emission += density * V3d(c.medium->emission);
    }
    return sum;
}

V3d MediaAlong::varying_at(double t) const {
    V3d sum(0);
    for (const MediumCrossing& c : crossings_) {
        if (is_active(c) && !c.medium->is_uniform()) sum += c.traversal.at(t) * V3d(c.medium->sigma_t());
    }
    return sum;
}

MediaAlong::Choice MediaAlong::choose(double t, const V3d& weight, double u) const {
    V3d sum(0);
    for (const MediumCrossing& c : crossings_) {
        if (is_active(c)) sum += c.traversal.at(t) * V3d(c.medium->sigma_s);
    }
    const double total = weight.dot(sum);
    assert(total > 0);
    Choice choice{nullptr, V3d(0)};
    for (const MediumCrossing& c : crossings_) {
        if (!is_active(c)) continue;
        const V3d sigma_s = c.traversal.at(t) * V3d(c.medium->sigma_s);
        const double part = weight.dot(sigma_s) / total;
        if (!(part > 0)) continue;
        choice.medium = c.medium;
        for (int k = 0; k < 3; ++k) choice.share[k] = sum[k] > 0 ? sigma_s[k] / (sum[k] * part) : 0;
        if (u < part) break;
        u -= part;  // the last medium takes what rounding leaves
    }
    return choice;
}

}  // namespace lucerna
