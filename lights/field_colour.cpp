#include "lights/field_colour.h"

#include <array>
#include <vector>

#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr int kColourNodes = 3;  // Gauss nodes per cell and axis of S

// ∫ max(0, W) f over the field's S and M, relative to a cell's volume: f(w, x, z) three numbers per W.
template <typename OfLight>
V3d integral(const LightField& field, const Workers& workers, OfLight&& f) {
    const Rig& rig = field.rig();
    const std::int64_t rows = std::int64_t{rig.intervals(0)} * rig.intervals(1);
    std::vector<V3d> sums(static_cast<std::size_t>(rows), V3d(0));
    const auto nodes = gauss_rule(kColourNodes);
    parallel_chunks(workers, rows, [&](std::int64_t row) {
        Cell cell{static_cast<int>(row / rig.intervals(1)), static_cast<int>(row % rig.intervals(1)), 0, 0};
        V3d sum(0);
        for (cell.p = 0; cell.p < rig.columns(0); ++cell.p) {
            for (cell.q = 0; cell.q < rig.columns(1); ++cell.q) {
                const BellCell members = field.members(cell);
                const LightField::ColourCell colour = field.colour_members(cell);
                for (const GaussNode& a : nodes) {
                    for (const GaussNode& b : nodes) {
                        const auto u = static_cast<float>(a.x), v = static_cast<float>(b.x);
                        const float w = members.value(u, v);
                        if (w > 0)
                            sum += a.weight * b.weight * double{w} *
                                   V3d(f(w, colour.x.value(u, v), colour.z.value(u, v)));
                    }
                }
            }
        }
        sums[static_cast<std::size_t>(row)] = sum;
    });
    V3d sum(0);
    for (const V3d& s : sums) sum += s;
    return sum;
}

}  // namespace

FieldColour::FieldColour(const LightField& field, const Workers& workers) : mean_(field.info().colour) {
    if (!field.coloured()) return;
    const V3d& weight = field.colour_channels().weight;
    weight_ = V3f(weight);
    // A channel of weight 0 has hardly any light: twice as much as could be seen of one that has.
    for (int c = 0; c < 3; ++c) most_[c] = weight_[c] > 0 ? 1 / weight_[c] : 2 / weight_.y;
    const auto shares = [this](float w, float x, float z) {
        const float y = (w - weight_.x * x - weight_.z * z) / weight_.y;
        return V3f(std::min(std::max(x / w, 0.0F), most_.x), std::min(std::max(y / w, 0.0F), most_.y),
                   std::min(std::max(z / w, 0.0F), most_.z));
    };
    const V3d shown = integral(field, workers, shares);
    const double all = integral(field, workers, [](float, float, float) { return V3f(1); }).x;
    const V3d measured = field.xyz();
    // Y's mean share of W is 1, X's and Z's what was measured beside it. A channel of which nothing is shown
    // has nothing to scale.
    for (int c = 0; c < 3; ++c)
        gain_[c] = shown[c] > 0 ? static_cast<float>(measured[c] * all / shown[c]) : 1.0F;
    const V3d mean =
        integral(field, workers, [this](float w, float x, float z) { return of(w, x, z); }) / all;
    mean_ = Rgb(V3f(mean / double{luminance(Rgb(V3f(mean)))}));  // all > 0 where anything shines: its Y is 1
}

}  // namespace lucerna
