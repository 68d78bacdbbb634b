#include "lights/measurement/opacity.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/system/memory.h"
#include "lights/bell.h"
#include "lights/gauss.h"

namespace lucerna {
namespace {

// Φ̃ is largest at 0 and least at ±1, where all other bells are 0 [Goesele 2003, 4.2]. A product is largest
// where both factors are, and most negative where one is largest and the other least.
constexpr double kDualMost = 1009.0 / 736.0;
constexpr double kDualLeast = -161.0 / 736.0;

constexpr double largest_product(FilterSign sign) {
    return sign == FilterSign::positive ? kDualMost * kDualMost : -kDualMost * kDualLeast;
}

}  // namespace

double filter_scale(const Rig& rig, FilterSign sign) {
    return largest_product(sign) / (rig.spacing.x * rig.spacing.y);  // spacings of a rig are > 0
}

double filter_opacity(const Rig& rig, FilterSign sign, const V2d& from_centre) {
    const double product =
        bell_dual(from_centre.x / rig.spacing.x) * bell_dual(from_centre.y / rig.spacing.y);
    const double part = sign == FilterSign::positive ? product : -product;
    return std::clamp(part / largest_product(sign), 0.0, 1.0);
}

std::span<const int> FilterImages::channels() const {
    static constexpr std::array<int, 3> kAll{0, 1, 2};
    return coloured() ? std::span<const int>(kAll) : std::span<const int>(kAll).subspan(1, 1);
}

void FilterImages::allocate(bool several_colours) {
    const std::size_t count = rig.coefficients();
    require_memory(bytes_of(count, (several_colours ? 6 : 2) * sizeof(float)),
                   fmt::format("filter images of {} coefficients", count), "use fewer views or pixels");
    for (std::vector<float>* image : {&positive, &negative}) image->assign(count, 0.0F);
    for (std::vector<float>* image : {&x.positive, &x.negative, &z.positive, &z.negative})
        image->assign(several_colours ? count : 0, 0.0F);
}

std::vector<float> coefficients_of(const FilterImages& images, int channel) {
    const Rig& rig = images.rig;
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    const std::vector<float>& positive = images.of(FilterSign::positive, channel);
    const std::vector<float>& negative = images.of(FilterSign::negative, channel);
    if (positive.size() != rig.coefficients() || negative.size() != rig.coefficients()) {
        throw InputError(fmt::format("filter images: {} and {} pixels, but the rig has {}", positive.size(),
                                     negative.size(), rig.coefficients()));
    }
    const double plus = filter_scale(rig, FilterSign::positive);
    const double minus = filter_scale(rig, FilterSign::negative);
    std::vector<float> coefficients(rig.coefficients());
    for (std::size_t i = 0; i < coefficients.size(); ++i)
        coefficients[i] = static_cast<float>(plus * double{positive[i]} - minus * double{negative[i]});
    return coefficients;
}

LightField field_of(const FilterImages& images) {
    const std::vector<float> y = coefficients_of(images, 1);
    double sum = 0;
    for (const float e : y) sum += double{e};
    LightFieldInfo info = images.info;
    info.captured = sum * images.rig.cell_volume();
    info.missed = images.flux > 0 ? images.flux - info.captured : 0;
    if (!images.coloured()) return {images.rig, y, std::move(info)};
    return {images.rig, coefficients_of(images, 0), y, coefficients_of(images, 2), std::move(info)};
}

namespace {

// Returns the Lagrange polynomial that is 1 at node j of the rule and 0 at the others.
double lagrange(std::span<const GaussNode> rule, std::size_t j, double x) {
    double product = 1;
    for (std::size_t i = 0; i < rule.size(); ++i)
        if (i != j) product *= (x - rule[i].x) / (rule[j].x - rule[i].x);  // nodes differ
    return product;
}

// Returns the nodes of panel `half` of the unit axis. Between knots, dual times Lagrange polynomial has a
// degree of at most 2 + kMaxGauss - 1 = 6, for which four Gauss nodes are exact.
std::vector<FilterNode> unit_panel(int half, int rule) {
    const std::span<const GaussNode> nodes = gauss_rule(rule);
    std::vector<FilterNode> panel;
    for (const GaussNode& node : nodes) panel.push_back({0.5 * (half + node.x), -1, {}, {}});
    const std::size_t first = half == 0 ? 0 : 3;
    for (std::size_t piece = first; piece < first + 3; ++piece) {
        const double from = kDualKnots[piece];
        const double to = piece + 1 < kDualKnots.size() ? kDualKnots[piece + 1] : 1.0;
        for (const GaussNode& g : gauss_rule(4)) {
            const double x = from + (to - from) * g.x;
            const auto duals = bell_dual_weights(x);
            for (std::size_t j = 0; j < panel.size(); ++j) {
                const double share = (to - from) * g.weight * lagrange(nodes, j, 2 * x - half);
                for (std::size_t i = 0; i < 4; ++i) {
                    panel[j].positive[i] += share * std::max(0.0, duals[i]);
                    panel[j].negative[i] += share * std::max(0.0, -duals[i]);
                }
            }
        }
    }
    return panel;
}

}  // namespace

FilterAxis::FilterAxis(double origin, double spacing, int rule)
    : origin_(origin), spacing_(spacing), rule_(rule), half_{unit_panel(0, rule), unit_panel(1, rule)} {}

void FilterAxis::add_panel(int k, std::vector<FilterNode>& nodes) const {
    const int half = k & 1;  // also for negative k
    const int interval = (k - half) / 2;
    for (FilterNode node : half_[static_cast<std::size_t>(half)]) {
        node.x = origin_ + (interval + node.x) * spacing_;
        node.first += interval;
        nodes.push_back(node);
    }
}

FilterNode FilterAxis::node(double x, double weight) const {
    const double place = (x - origin_) / spacing_;
    const double base = std::floor(place);
    FilterNode node{x, static_cast<int>(base) - 1, {}, {}};
    const auto duals = bell_dual_weights(place - base);
    for (std::size_t i = 0; i < 4; ++i) {
        const double dual = duals[i] * weight / spacing_;
        node.positive[i] = std::max(0.0, dual);
        node.negative[i] = std::max(0.0, -dual);
    }
    return node;
}

void FilterAxis::add_part(double from, double to, std::vector<FilterNode>& nodes) const {
    if (!(to > from)) return;
    double begin = from;
    const auto add_piece = [&](double end) {
        for (const GaussNode& g : gauss_rule(rule_))
            nodes.push_back(node(begin + (end - begin) * g.x, (end - begin) * g.weight));
        begin = end;
    };
    for_knots(from, to, add_piece);
    add_piece(to);
}

void FilterAxis::add_range(double from, double to, std::vector<FilterNode>& nodes) const {
    if (!(to > from)) return;
    // A panel counts as complete if only rounding puts its edge outside.
    constexpr double kRounding = 1e-12;
    const int first = static_cast<int>(std::ceil(panel_of(from) - kRounding));
    const int last = static_cast<int>(std::floor(panel_of(to) + kRounding));
    if (first >= last) return add_part(from, to, nodes);
    if (panel_of(from) < first - kRounding) add_part(from, panel_edge(first), nodes);
    for (int k = first; k < last; ++k) add_panel(k, nodes);
    if (panel_of(to) > last + kRounding) add_part(panel_edge(last), to, nodes);
}

}  // namespace lucerna
