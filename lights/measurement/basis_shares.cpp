#include "lights/measurement/basis_shares.h"

#include <algorithm>
#include <cmath>

#include "lights/bell.h"
#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr int kShareNodes = 3;  // Gauss nodes between knots, exact for a bell times a hat times a cosine

// Sums shares, filter by filter.
class ShareTable {
  public:
    ShareTable(const Rig& rig, int axis)
        : views_(rig.views[axis]),
          pixels_(rig.pixels[axis]),
          sums_(static_cast<std::size_t>(views_) * static_cast<std::size_t>(pixels_)) {}

    void add(int filter, int pixel, double weight) {
        if (filter < 0 || filter >= views_ || pixel < 0 || pixel >= pixels_) return;
        sums_[static_cast<std::size_t>(filter) * static_cast<std::size_t>(pixels_) +
              static_cast<std::size_t>(pixel)] += weight;
    }
    std::vector<BasisShare> shares() const {
        std::vector<BasisShare> all;
        auto sum = sums_.begin();
        for (int filter = 0; filter < views_; ++filter) {
            for (int pixel = 0; pixel < pixels_; ++pixel, ++sum) {
                if (*sum > 0) all.push_back({filter, pixel, *sum});
            }
        }
        return all;
    }

  private:
    int views_, pixels_;
    std::vector<double> sums_;
};

// Returns the integrand's knots in intervals of S, ascending; the ends are those of S.
std::vector<double> knots(const Rig& rig, int axis, double offset, double factor,
                          const std::optional<FacingWeight>& facing) {
    const int intervals = rig.intervals(axis);
    std::vector<double> at;
    for (int i = 0; i <= 2 * intervals; ++i) at.push_back(0.5 * i);  // bells have knots at halves
    if (factor != 0) {
        // All intervals share one grid of columns.
        const int columns = rig.pixels[axis] + rig.shift[axis] * intervals;
        for (int k = 0; k <= columns + (rig.basis == PixelBasis::hat ? 1 : 0); ++k) {
            const double y = rig.column_edge_x(axis, 0, 0) + (k - rig.overhang()) * rig.pixel[axis];
            const double x = rig.intervals_to(axis, (rig.m_coordinate.on_plane(y) - offset) / factor);
            if (x > 0 && x < intervals) at.push_back(x);
        }
    }
    if (facing) {
        const double x = rig.intervals_to(axis, facing->at);
        if (x > 0 && x < intervals) at.push_back(x);
    }
    if (factor != 0 || facing) std::sort(at.begin(), at.end());
    return at;
}

// Returns the bases at a place of interval `interval` of S, x intervals from the first one's edge, and at s.
BasisNode node_at(const Rig& rig, int axis, int interval, double x, double s) {
    BasisNode node{};
    node.on_m = s;
    node.filter = interval - 1;
    for (const int f : {0, 1}) node.under[f] = basis_value(rig.filter_basis, x - interval - f);
    const double column =
        std::clamp(rig.columns_to(axis, interval, s) - rig.overhang(), -2.0, rig.columns(axis) + 1.0);
    const double floor = std::floor(column);
    const bool hat = rig.basis == PixelBasis::hat;
    node.across[0] = hat ? 1 - (column - floor) : 1;
    node.across[1] = hat ? column - floor : 0;
    for (const int f : {0, 1}) node.pixel[f] = static_cast<int>(floor) - f * rig.shift[axis];
    return node;
}

}  // namespace

std::vector<BasisNode> basis_nodes(const Rig& rig, int axis, double offset, double factor, int count,
                                   const std::optional<FacingWeight>& facing) {
    std::vector<BasisNode> nodes;
    const std::vector<double> at = knots(rig, axis, offset, factor, facing);
    for (std::size_t i = 0; i + 1 < at.size(); ++i) {
        const double width = at[i + 1] - at[i];
        if (!(width > 0)) continue;
        for (const GaussNode& gauss : gauss_rule(count)) {
            const double x = at[i] + gauss.x * width;
            const int interval = std::min(static_cast<int>(x), rig.intervals(axis) - 1);
            const double u = rig.s_coordinate.on_plane(rig.interval_edge_x(axis, 0) + x * rig.spacing[axis]);
            BasisNode node = node_at(rig, axis, interval, x, offset + factor * u);
            node.on_s = u;
            node.weight = gauss.weight * width * rig.spacing[axis] / rig.s_coordinate.slope(u);
            nodes.push_back(node);
        }
    }
    return nodes;
}

std::vector<BasisNode> basis_nodes_at(const Rig& rig, int axis, double on_s, int count) {
    std::vector<BasisNode> nodes;
    const double x = rig.intervals_to(axis, on_s);
    if (!(x >= 0 && x < rig.intervals(axis))) return nodes;
    const int interval = static_cast<int>(x);
    const int pieces = rig.columns(axis) + (rig.basis == PixelBasis::hat ? 1 : 0);
    for (int k = 0; k < pieces; ++k) {
        for (const GaussNode& gauss : gauss_rule(count)) {
            const double y =
                rig.column_edge_x(axis, interval, 0) + (k + gauss.x - rig.overhang()) * rig.pixel[axis];
            const double s = rig.m_coordinate.on_plane(y);
            BasisNode node = node_at(rig, axis, interval, x, s);
            node.on_s = on_s;
            node.weight = gauss.weight * rig.pixel[axis] / rig.m_coordinate.slope(s);
            nodes.push_back(node);
        }
    }
    return nodes;
}

std::vector<BasisShare> basis_shares(const Rig& rig, int axis, double offset, double factor,
                                     const std::optional<FacingWeight>& facing) {
    ShareTable table(rig, axis);
    for (const BasisNode& node : basis_nodes(rig, axis, offset, factor, kShareNodes, facing)) {
        double weight = node.weight * rig.s_coordinate.slope(node.on_s) * rig.m_coordinate.slope(node.on_m);
        if (facing) weight *= std::max(0.0, (facing->at - node.on_s) * facing->per);
        for (int f = 0; f < 2; ++f) {
            for (int k = 0; k < 2; ++k)
                table.add(node.filter + f, node.pixel[f] + k, weight * node.under[f] * node.across[k]);
        }
    }
    return table.shares();
}

std::vector<BasisShare> basis_shares_at(const Rig& rig, int axis, double on_s) {
    ShareTable table(rig, axis);
    const double x = rig.intervals_to(axis, on_s) - 1;  // in spacings from filter 0
    if (!(x >= -1 && x <= rig.views[axis])) return {};
    const int below = static_cast<int>(std::floor(x));
    const double width = rig.pixel[axis] * rig.s_coordinate.slope(on_s);
    for (int filter = below; filter <= below + 1; ++filter) {
        const double weight = basis_value(rig.filter_basis, x - filter) * width;
        for (int pixel = 0; pixel < rig.pixels[axis]; ++pixel) table.add(filter, pixel, weight);
    }
    return table.shares();
}

}  // namespace lucerna
