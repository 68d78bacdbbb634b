#include "lights/measurement/point_integral.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr int kIntegralMargin =
    4;  // a node in reach of the block touches filters up to 3 outside it; 1 more for rounding

}  // namespace

PointIntegral::PointIntegral(const EmitterModel& emitter, const Rig& rig, int rule)
    : emitter_(emitter),
      rig_(rig),
      rule_(rule),
      axis_{{rig.filter(0, 0), rig.spacing.x, rule}, {rig.filter(1, 0), rig.spacing.y, rule}},
      channels_(emitter.xyz ? 3 : 1),
      share_(emitter.setback / (rig.distance + emitter.setback)) {}  // distance > 0

void PointIntegral::begin(const V2i& first, const V2i& last) {
    origin_ = first - V2i(kIntegralMargin, kIntegralMargin);
    const V2i size = last - first + V2i(1 + 2 * kIntegralMargin, 1 + 2 * kIntegralMargin);
    width_ = static_cast<std::size_t>(size.x);
    block_ = width_ * static_cast<std::size_t>(size.y);
    positive_.assign(channels_ * block_, 0.0);
    negative_.assign(positive_.size(), 0.0);
    row_positive_.resize(channels_ * width_);
    row_negative_.resize(channels_ * width_);
    for (int a = 0; a < 2; ++a) {
        reach_[a] = {rig_.filter(a, first[a]) - 2 * rig_.spacing[a],
                     rig_.filter(a, last[a]) + 2 * rig_.spacing[a]};
    }
}

void PointIntegral::add(const V2d& on_m, double weight) {
    on_m_ = on_m;
    weight_ = weight;
    centre_ = share_ * on_m;
    half_ = (1 - share_) * emitter_.half_size;  // share < 1
    if (emitter_.outline == EmitterModel::Outline::rectangle) {
        add_rectangle();
    } else {
        add_disc();
    }
}

void PointIntegral::add_rectangle() {
    std::vector<FilterNode>* nodes[2] = {&u_, &v_};
    for (int a = 0; a < 2; ++a) {
        nodes[a]->clear();
        axis_[a].add_range(std::max(centre_[a] - half_[a], reach_[a].from),
                           std::min(centre_[a] + half_[a], reach_[a].to), *nodes[a]);
    }
    if (u_.empty()) return;
    for (const FilterNode& v : v_) add_row(v);
}

void PointIntegral::add_disc() {
    const double low = std::max(centre_.y - half_.x, reach_[1].from);
    const double high = std::min(centre_.y + half_.x, reach_[1].to);
    if (!(high > low)) return;
    const int last = static_cast<int>(std::ceil(axis_[1].panel_of(high)));
    for (int k = static_cast<int>(std::floor(axis_[1].panel_of(low))); k < last; ++k) add_disc_panel(k);
}

// Adds one panel of v. Where the disc covers entire panels of u over all of it, both axes use their product
// rules. The rest, at the two ends of the chord or at the disc's poles, is cut along the circle.
void PointIntegral::add_disc_panel(int k) {
    const double r = half_.x;
    const Range v{std::max({axis_[1].panel_edge(k), reach_[1].from, centre_.y - r}),
                  std::min({axis_[1].panel_edge(k + 1), reach_[1].to, centre_.y + r})};
    if (!(v.to > v.from)) return;
    const double far = std::max(std::fabs(v.from - centre_.y), std::fabs(v.to - centre_.y));
    const double near_half = std::sqrt(std::max(0.0, r * r - far * far));  // the shortest half chord
    const bool whole = v.to - v.from > 0.5 * rig_.spacing.y * (1 - 1e-9);
    const int first = static_cast<int>(
        std::ceil(axis_[0].panel_of(std::max(centre_.x - near_half, reach_[0].from)) - 1e-9));
    const int last =
        static_cast<int>(std::floor(axis_[0].panel_of(std::min(centre_.x + near_half, reach_[0].to)) + 1e-9));
    if (!whole || first >= last) return add_cut(v, {reach_[0].from, reach_[0].to, true, true});

    u_.clear();
    for (int i = first; i < last; ++i) axis_[0].add_panel(i, u_);
    v_.clear();
    axis_[1].add_panel(k, v_);
    for (const FilterNode& node : v_) add_row(node);
    const double left = axis_[0].panel_edge(first), right = axis_[0].panel_edge(last);
    if (left > reach_[0].from + 1e-9 * rig_.spacing.x) add_cut(v, {reach_[0].from, left, true, false});
    if (right < reach_[0].to - 1e-9 * rig_.spacing.x) add_cut(v, {right, reach_[0].to, false, true});
}

// Adds rows of which one end or both follow the circle. v = r sin φ removes the square root from the chord's
// length; the rule is split where v passes a knot and where a moving end passes a panel's edge.
void PointIntegral::add_cut(const Range& v, const Chord& chord) {
    const double r = half_.x;
    const auto angle = [&](double y) { return asin(std::clamp((y - centre_.y) / r, -1.0, 1.0)); };
    const double begin = angle(v.from), end = angle(v.to);
    cuts_.clear();
    axis_[1].for_knots(v.from, v.to, [&](double y) { cuts_.push_back(angle(y)); });
    const double longest = r * cos(begin * end < 0 ? 0.0 : std::min(std::fabs(begin), std::fabs(end)));
    const double shortest = r * cos(std::max(std::fabs(begin), std::fabs(end)));
    const auto cut_at_edges = [&](double sign) {
        const auto panel = [&](double half_chord) {
            const double x = centre_.x + sign * half_chord;
            return axis_[0].panel_of(std::clamp(x, reach_[0].from, reach_[0].to));
        };
        const double a = panel(shortest), b = panel(longest);
        for (int i = static_cast<int>(std::ceil(std::min(a, b))); i <= std::max(a, b); ++i) {
            const double c =
                acos(std::clamp(std::fabs(axis_[0].panel_edge(i) - centre_.x) / r, 0.0, 1.0));
            for (const double phi : {c, -c})
                if (phi > begin && phi < end) cuts_.push_back(phi);
        }
    };
    if (chord.moving_from) cut_at_edges(-1);
    if (chord.moving_to) cut_at_edges(1);
    std::sort(cuts_.begin(), cuts_.end());
    cuts_.push_back(end);
    double from = begin;
    for (const double to : cuts_) {
        for (const GaussNode& g : gauss_rule(rule_)) {
            const double phi = from + (to - from) * g.x;
            const double half_chord = r * cos(phi);
            u_.clear();
            axis_[0].add_range(
                chord.moving_from ? std::max(centre_.x - half_chord, chord.from_edge) : chord.from_edge,
                chord.moving_to ? std::min(centre_.x + half_chord, chord.to_edge) : chord.to_edge, u_);
            if (!u_.empty())
                add_row(axis_[1].node(centre_.y + r * sin(phi), (to - from) * g.weight * half_chord));
        }
        from = to;
    }
}

void PointIntegral::add_row(const FilterNode& v) {
    if (channels_ == 1) {
        add_row_of<1>(v);
    } else {
        add_row_of<3>(v);
    }
}

template <std::size_t kChannels>
void PointIntegral::add_row_of(const FilterNode& v) {
    std::fill(row_positive_.begin(), row_positive_.end(), 0.0);
    std::fill(row_negative_.begin(), row_negative_.end(), 0.0);
    const double d2 = rig_.distance * rig_.distance;
    const double dy = on_m_.y - v.x;
    const double emitter_scale = 1 / (1 - share_);
    const double emitter_y = (v.x - share_ * on_m_.y) * emitter_scale;
    for (const FilterNode& u : u_) {
        const double dx = on_m_.x - u.x;
        const double r2 = dx * dx + dy * dy + d2;  // > 0, because the distance is
        const double per_r = 1 / std::sqrt(r2);
        const V2d position((u.x - share_ * on_m_.x) * emitter_scale, emitter_y);
        const V3d direction(dx * per_r, dy * per_r, rig_.distance * per_r);
        std::array<double, kChannels> radiance;
        if constexpr (kChannels == 1) {
            radiance[0] = emitter_.radiance(position, direction);
        } else {
            const V3d xyz = emitter_.xyz(position, direction);
            radiance = {xyz.x, xyz.y, xyz.z};
        }
        for (std::size_t c = 0; c < kChannels; ++c) {
            const double value = radiance[c] * d2 * (per_r * per_r) * (per_r * per_r);
            const std::size_t at = c * width_ + static_cast<std::size_t>(u.first - origin_.x);
            for (std::size_t i = 0; i < 4; ++i) {
                row_positive_[at + i] += u.positive[i] * value;
                row_negative_[at + i] += u.negative[i] * value;
            }
        }
    }
    // A product is positive where its factors have equal signs.
    for (std::size_t i = 0; i < 4; ++i) {
        const double same = weight_ * v.positive[i], other = weight_ * v.negative[i];
        for (std::size_t c = 0; c < kChannels; ++c) {
            const std::size_t first = c * block_ + slot(origin_.x, v.first + static_cast<int>(i));
            double *plus = &positive_[first], *minus = &negative_[first];
            const double *row_plus = &row_positive_[c * width_], *row_minus = &row_negative_[c * width_];
            for (std::size_t m = 0; m < width_; ++m) {
                plus[m] += same * row_plus[m] + other * row_minus[m];
                minus[m] += same * row_minus[m] + other * row_plus[m];
            }
        }
    }
}

}  // namespace lucerna
