#include "lights/measurement/join_sides.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Returns the direction from the centre of a filter to that of one of its pixels, in the slab's frame.
V3d direction_of(const Rig& rig, int m, int n, int k, int l) {
    const auto slope = [&](int axis, int filter, int pixel) {
        const double x = rig.column_edge_x(axis, filter + 1, pixel) + 0.5 * rig.pixel[axis];
        return (rig.m_coordinate.on_plane(x) - rig.filter(axis, filter)) / rig.distance;  // D > 0
    };
    return V3d(slope(0, m, k), slope(1, n, l), 1).normalized();
}

// Returns the share of each coefficient that a slab keeps.
std::vector<float> shares_kept(const Rig& rig, const SlabAxes& axes, const SlabShares& shares,
                               std::size_t slab) {
    std::vector<float> kept(rig.coefficients());
    std::vector<double> share(shares.size());
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    shares.of(axes.to_lamp(direction_of(rig, m, n, k, l)), share);
                    kept[rig.index(m, n, k, l)] = static_cast<float>(share[slab]);
                }
            }
        }
    }
    return kept;
}

LightField shared_field(const Slab& side, const SlabShares& shares, std::size_t slab) {
    const LightField& field = side.field;
    const std::vector<float> kept = shares_kept(field.rig(), side.axes, shares, slab);
    const auto shared = [&](const LightField& whole) {
        std::vector<float> e = kept;
        for (std::size_t i = 0; i < e.size(); ++i) e[i] *= whole.coefficients()[i];
        return e;
    };
    const auto of = [&](int channel) { return shared(field.channel(channel)); };
    LightFieldInfo info = field.info();
    LightField made = field.coloured() ? LightField(field.rig(), of(0), of(1), of(2), info)
                                       : LightField(field.rig(), shared(field), info);
    info = made.info();
    info.captured = made.flux();
    info.missed = 0;
    return std::move(made).with(std::move(info));
}

Box3d box_of(const std::vector<Slab>& sides) {
    Box3d box;
    for (const Slab& side : sides) {
        const Rig& rig = side.field.rig();
        for (int corner = 0; corner < 4; ++corner) {
            const V3d on_s(rig.filter(0, corner % 2 == 0 ? 0 : rig.views.x - 1),
                           rig.filter(1, corner < 2 ? 0 : rig.views.y - 1), 0);
            box.extendBy(side.axes.to_lamp(rig.centre + on_s));
        }
    }
    for (const Slab& side : sides) {
        for (int a = 0; a < 3; ++a) {
            const double face = side.axes.n[a] * side.field.rig().centre.z;
            if (side.axes.n[a] == 1) box.max[a] = std::max(box.min[a], std::min(box.max[a], face));
            if (side.axes.n[a] == -1) box.min[a] = std::min(box.max[a], std::max(box.min[a], face));
        }
    }
    return box;
}

}  // namespace

Lumigraph join_sides(std::vector<Slab> sides) {
    if (sides.size() == 1 && sides[0].axes.straight()) return Lumigraph(std::move(sides[0].field));
    std::vector<V3d> normals;
    double whole = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        for (const V3d& n : normals) {
            if (n.dot(sides[i].axes.n) > 1 - 1e-6)
                throw InputError(fmt::format("the side {} was measured twice", sides[i].axes.name()));
        }
        normals.push_back(sides[i].axes.n);
        whole = std::max(whole, sides[i].field.info().captured + sides[i].field.info().missed);
    }
    const Box3d box = box_of(sides);
    const SlabShares shares(std::move(normals));
    double held = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        sides[i].field = shared_field(sides[i], shares, i);
        held += sides[i].field.info().captured;
    }
    if (!sides.empty()) {
        LightFieldInfo info = sides[0].field.info();
        info.missed = std::max(0.0, whole - held);
        sides[0].field = std::move(sides[0].field).with(std::move(info));
    }
    return {std::move(sides), box};
}

SlabAxes parse_side(const char* option, std::string_view word) {
    for (int side = 0; side < SlabAxes::kSides; ++side) {
        if (SlabAxes::facing(side).name() == word) return SlabAxes::facing(side);
    }
    input_error({option}, "\"{}\" is not accepted; expected +z, -z, +x, -x, +y or -y", one_line(word));
}

void require_different_sides(const char* option, std::span<const SlabAxes> sides) {
    for (std::size_t i = 0; i < sides.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            if (sides[k].n == sides[i].n)
                input_error({option}, "the side {} is given twice", sides[i].name());
        }
    }
}

}  // namespace lucerna
