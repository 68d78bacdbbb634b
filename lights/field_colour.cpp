#include "lights/field_colour.h"

#include <algorithm>
#include <array>
#include <vector>

#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr int kColourNodes = 3;  // Gauss nodes per cell and axis of S

struct Sums {
    double w = 0;
    V3d colour{0, 0, 0};
};

}  // namespace

FieldColour::FieldColour(const LightField& field, const Workers& workers, const WorkingSpace& colours)
    : mean_(field.info().colour) {
    const float least = std::min({mean_.x, mean_.y, mean_.z});
    if (!colours.is_srgb() || least < 0) mean_ = light_of_luminance_one(colours, field.xyz());
    const RgbMatrix matrix = colours.light_from_xyz();
    for (std::size_t c = 0; c < 3; ++c) {
        const V3d& row = matrix.rows[c];
        rows_[c] = V3f(V3d(row.x, -row.y, row.z));
    }
    if (!field.coloured()) return;
    const V3d& weight = field.colour_channels().weight;
    weight_ = V3f(weight);
    // A channel of weight 0 has hardly any light; its limit is twice that of Y.
    for (int c = 0; c < 3; ++c) most_[c] = weight_[c] > 0 ? 1 / weight_[c] : 2 / weight_.y;

    // Integrates max(0, W), and max(0, W) times the colour, over all cells.
    const Rig& rig = field.rig();
    const std::int64_t rows = std::int64_t{rig.intervals(0)} * rig.intervals(1);
    std::vector<Sums> sums(static_cast<std::size_t>(rows));
    const auto nodes = gauss_rule(kColourNodes);
    parallel_chunks(workers, rows, [&](std::int64_t row) {
        Cell cell{static_cast<int>(row / rig.intervals(1)), static_cast<int>(row % rig.intervals(1)), 0, 0};
        Sums& sum = sums[static_cast<std::size_t>(row)];
        for (cell.p = 0; cell.p < rig.columns(0); ++cell.p) {
            for (cell.q = 0; cell.q < rig.columns(1); ++cell.q) {
                const BellCell members = field.members(cell);
                const LightField::ColourCell colour = field.colour_members(cell);
                for (const GaussNode& a : nodes) {
                    for (const GaussNode& b : nodes) {
                        const auto u = static_cast<float>(a.x), v = static_cast<float>(b.x);
                        const float w = members.value(u, v);
                        if (!(w > 0)) continue;
                        const double part = a.weight * b.weight * double{w};
                        sum.w += part;
                        sum.colour += part * V3d(shown(w, colour.x.value(u, v), colour.z.value(u, v)));
                    }
                }
            }
        }
    });
    Sums all;
    for (const Sums& sum : sums) all.w += sum.w, all.colour += sum.colour;
    // A component without any shown light cannot be scaled; it is left out of the lamp's colour.
    for (int c = 0; c < 3; ++c) {
        gain_[c] = all.colour[c] > 0 ? static_cast<float>(double{mean_[c]} * all.w / all.colour[c]) : 0.0F;
        if (gain_[c] == 0) mean_[c] = 0;
    }
}

}  // namespace lucerna
