#include "lights/cell_emission.h"

#include <algorithm>
#include <bit>

namespace lucerna {
namespace {

constexpr std::size_t kLanes = CellTable::Block::kSize;
template <typename T>
using Column = CellTable::Block::Column<T>;

// Returns the seed of a cell's rejection: the salt mixed with the draw, so that callers without a salt get
// different numbers, too.
std::uint32_t salt_of(const LeSampleU& u) {
    const auto stir = [](std::uint32_t h, float x) {
        return (h ^ std::bit_cast<std::uint32_t>(x)) * 0x9e3779b1U;
    };
    return stir(stir(stir(stir(u.salt, u.position.x), u.position.y), u.direction.x), u.direction.y);
}

// Draws a place under a hat, in pixels from its centre, by inversion from u in [0,1). Like all functions
// called in a loop over a block, it is branch-free.
float draw_hat(float u) {
    const bool lower = u < 0.5F;
    const float root = std::sqrt(2 * (lower ? u : 1 - u));
    return lower ? root - 1 : 1 - root;
}

// Maps positions from a plane's coordinate to the plane.
void to_plane(const PlaneCoordinate& coordinate, Column<double>& x, std::size_t size) {
    if (coordinate.c == 0) return;
    const double inverse = 0.5 / coordinate.c;  // > 0
    for (std::size_t i = 0; i < size; ++i) {
        const double half = x[i] * inverse;
        x[i] /= 1 - half * half;  // |half| < 1: Rig::fault
    }
}

}  // namespace

// The state of a block of particles, in columns.
struct CellEmission::Lanes {
    CellTable::Block cells;
    std::array<Column<float>, 4> e;       // coefficients: lower or upper filter along u, then along v
    Column<float> x, y;                   // place within the interval
    Column<std::uint32_t> salt;           // seed of the rejection; only for `exact`
    Column<bool> stays;                   // whether the first place drawn is accepted; only for `exact`
    std::array<Column<float>, 4> cx, cz;  // coefficients of X and Z; only of coloured fields
    std::array<Column<float>, 3> colour;  // per unit of flux
    std::array<Column<float>, 3> p, d;
    Column<float> error;

    BellCell members(std::size_t i, FilterBasis basis) const {
        return {{{e[0][i], e[1][i]}, {e[2][i], e[3][i]}}, basis};
    }
};

CellEmission::CellEmission(const LightField& field, const FieldColour& colour, const CellTable& table,
                           const Placement& placement, const Settings& settings)
    : field_(field),
      colour_(colour),
      table_(table),
      placement_(placement),
      settings_(settings),
      normal_(to_float(placement.normal())) {}

void CellEmission::sample_Le_many(std::span<const LeSampleU> u,
                                  std::span<std::optional<LeSample>> out) const {
    for (std::size_t from = 0; from < u.size(); from += kLanes) {
        const std::size_t size = std::min(kLanes, u.size() - from);
        emit_block(u.subspan(from, size), out.subspan(from, size));
    }
}

void CellEmission::emit_block(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const {
    const std::size_t size = u.size();
    Lanes lanes;  // NOLINT: every column is written before it is read

    for (std::size_t i = 0; i < size; ++i) {
        lanes.cells.u[0][i] = u[i].position.x;
        lanes.cells.u[1][i] = u[i].position.y;
        lanes.cells.u[2][i] = u[i].direction.x;
        lanes.cells.u[3][i] = u[i].direction.y;
    }
    table_.draw(lanes.cells, size);

    // Chooses places within the cells.
    std::copy_n(lanes.cells.remainder[0].begin(), size, lanes.x.begin());
    std::copy_n(lanes.cells.remainder[1].begin(), size, lanes.y.begin());
    if (settings_.mode == EmissionMode::exact || field_.coloured()) fetch_members(lanes, size);
    if (settings_.mode == EmissionMode::exact) place_exactly(lanes, u);
    if (field_.coloured()) find_colours(lanes, size);

    place(lanes, size);
    const Rgb one = colour_.mean();
    const bool coloured = field_.coloured();
    for (std::size_t i = 0; i < size; ++i) {
        out[i] =
            LeSample{{{lanes.p[0][i], lanes.p[1][i], lanes.p[2][i]}, normal_, lanes.error[i]},
                     {lanes.d[0][i], lanes.d[1][i], lanes.d[2][i]},
                     static_cast<float>(settings_.flux) *
                         (coloured ? Rgb(lanes.colour[0][i], lanes.colour[1][i], lanes.colour[2][i]) : one),
                     lanes.cells.id[i]};
    }
}

void CellEmission::fetch_members(Lanes& lanes, std::size_t size) const {
    static constexpr float kNone = 0;  // for views and pixels outside the rig
    const Rig& rig = field_.rig();
    const float* const first = field_.coefficients().data();
    std::array<Column<const float*>, 4> at;
    // Coefficients and their X and Z are all prefetched before any is read.
    const ColourChannels& channels = field_.colour_channels();
    const ColourChannels::Pair* const first_pair = channels.pairs.data();
    const bool coloured = field_.coloured();
    const CellTable::Block& c = lanes.cells;
    // An unsigned, not a bool, so that the values combine without branches.
    const auto outside = [](int i, int count) {
        return static_cast<unsigned>(static_cast<unsigned>(i) >= static_cast<unsigned>(count));
    };
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            for (std::size_t lane = 0; lane < size; ++lane) {
                const int m = c.n[lane] - 1 + i, n = c.o[lane] - 1 + j;
                const int k = c.p[lane] - i * rig.shift.x, l = c.q[lane] - j * rig.shift.y;
                const unsigned none = outside(m, rig.views.x) | outside(n, rig.views.y) |
                                      outside(k, rig.pixels.x) | outside(l, rig.pixels.y);
                const float* const member = none != 0 ? &kNone : first + rig.index(m, n, k, l);
                __builtin_prefetch(member);
                if (coloured) __builtin_prefetch(none != 0 ? first_pair : first_pair + (member - first));
                at[static_cast<std::size_t>(2 * i + j)][lane] = member;
            }
        }
    }
    for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t lane = 0; lane < size; ++lane) lanes.e[k][lane] = *at[k][lane];
    }
    if (!coloured) return;
    const auto scale_x = static_cast<float>(channels.scale_x), scale_z = static_cast<float>(channels.scale_z);
    for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t lane = 0; lane < size; ++lane) {
            static constexpr ColourChannels::Pair kNoPair{};
            const bool none = at[k][lane] == &kNone;
            const ColourChannels::Pair& pair = none ? kNoPair : first_pair[at[k][lane] - first];
            lanes.cx[k][lane] = static_cast<float>(pair.x) * scale_x;
            lanes.cz[k][lane] = static_cast<float>(pair.z) * scale_z;
        }
    }
}

// This loop becomes vector instructions: it has no branch, and its outputs do not overlap.
template <typename Basis>
void CellEmission::find_colours_by(Lanes& lanes, std::size_t size) const {
    const Rgb mean = colour_.mean();
    const FieldColour colour = colour_;  // by value, so that no store below can alias it
    for (std::size_t i = 0; i < size; ++i) {
        const float a = Basis::value(lanes.x[i]), b = Basis::value(lanes.y[i]);
        const auto value = [&](const std::array<Column<float>, 4>& e) {  // as BellCell's
            return a * (e[0][i] * b + e[1][i] * (1 - b)) + (1 - a) * (e[2][i] * b + e[3][i] * (1 - b));
        };
        const float w = value(lanes.e), x = value(lanes.cx), z = value(lanes.cz);
        const Rgb here = colour.of(w > 0 ? w : 1.0F, x, z);
        // Where `constant` draws a place with W <= 0 there is no colour, so the lamp's mean is used.
        lanes.colour[0][i] = w > 0 ? here.x : mean.x;
        lanes.colour[1][i] = w > 0 ? here.y : mean.y;
        lanes.colour[2][i] = w > 0 ? here.z : mean.z;
    }
}

template <typename Basis>
void CellEmission::draw_positive_by(Lanes& lanes, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
        const BellCell members = lanes.members(i, FilterBasis::bell);  // Basis overrides the bell
        const V2f at = members.draw_positive<Basis>({lanes.x[i], lanes.y[i]});
        lanes.x[i] = at.x;
        lanes.y[i] = at.y;
        lanes.stays[i] = members.stays<Basis>(at, lanes.salt[i]);
    }
}

void CellEmission::find_colours(Lanes& lanes, std::size_t size) const {
    with_basis(field_.rig().filter_basis, [&](auto of) { find_colours_by<decltype(of)>(lanes, size); });
}

void CellEmission::place_exactly(Lanes& lanes, std::span<const LeSampleU> u) const {
    const FilterBasis basis = field_.rig().filter_basis;
    for (std::size_t i = 0; i < u.size(); ++i) lanes.salt[i] = salt_of(u[i]);
    with_basis(basis, [&](auto of) { draw_positive_by<decltype(of)>(lanes, u.size()); });
    for (std::size_t i = 0; i < u.size(); ++i) {
        if (lanes.stays[i]) continue;
        const V2f at = lanes.members(i, basis).draw_again(lanes.salt[i]);
        lanes.x[i] = at.x;
        lanes.y[i] = at.y;
    }
}

void CellEmission::place(Lanes& lanes, std::size_t size) const {
    const Rig& rig = field_.rig();
    const CellTable::Block& c = lanes.cells;
    // Edges are linear in the cell's numbers: the edge of number 0, plus a step for each number.
    std::array<Column<double>, 2> on_s, on_m;
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const auto& interval = axis == 0 ? c.n : c.o;
        const auto& column = axis == 0 ? c.p : c.q;
        const Column<float>& within = axis == 0 ? lanes.x : lanes.y;
        Column<float> across = c.remainder[2 + a];
        if (rig.basis == PixelBasis::hat) {
            for (std::size_t i = 0; i < size; ++i) across[i] = 0.5F + draw_hat(across[i]);
        }
        const double edge_s = rig.interval_edge_x(axis, 0), edge_m = rig.column_edge_x(axis, 0, 0);
        const double shift_m = rig.column_edge_x(axis, 1, 0) - edge_m;
        for (std::size_t i = 0; i < size; ++i) {
            on_s[a][i] = edge_s + (interval[i] + double{within[i]}) * rig.spacing[axis];
            on_m[a][i] = edge_m + interval[i] * shift_m + (column[i] + double{across[i]}) * rig.pixel[axis];
        }
        to_plane(rig.s_coordinate, on_s[a], size);
        to_plane(rig.m_coordinate, on_m[a], size);
    }
    for (std::size_t i = 0; i < size; ++i) {
        const V3d p = placement_.point(V2d(on_s[0][i], on_s[1][i]));
        const V3d d = placement_.vector({on_m[0][i] - on_s[0][i], on_m[1][i] - on_s[1][i], rig.distance});
        const double shorten = 1 / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);  // D > 0 and scale > 0
        lanes.p[0][i] = static_cast<float>(p.x);
        lanes.p[1][i] = static_cast<float>(p.y);
        lanes.p[2][i] = static_cast<float>(p.z);
        lanes.d[0][i] = static_cast<float>(d.x * shorten);
        lanes.d[1][i] = static_cast<float>(d.y * shorten);
        lanes.d[2][i] = static_cast<float>(d.z * shorten);
    }
    for (std::size_t i = 0; i < size; ++i) {
        lanes.error[i] = surface_error({lanes.p[0][i], lanes.p[1][i], lanes.p[2][i]}, settings_.extent);
    }
}

Placement::Placement(const M44d& m, const V3d& centre, const Location& at) {
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            if (!std::isfinite(m[row][column])) throw InputError(at, "the lamp's placement is not finite");
        }
    }
    if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1) {
        throw InputError(
            at, "the lamp's placement is projective; expected rotation, translation and uniform scale");
    }
    for (int axis = 0; axis < 3; ++axis) axis_[axis] = V3d(m[axis][0], m[axis][1], m[axis][2]);
    scale2_ = (axis_[0].length2() + axis_[1].length2() + axis_[2].length2()) / 3;
    if (!(scale2_ > 0) || !std::isfinite(scale2_) || !std::isfinite(1 / scale2_)) {
        throw InputError(
            at, "the lamp's placement is singular; expected rotation, translation and uniform scale");
    }
    // Compares each entry of A Aᵀ with scale² times the identity. Mirror images are isometries, too.
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            if (std::fabs(axis_[i].dot(axis_[j]) / scale2_ - (i == j ? 1 : 0)) > 1e-4) {
                input_error(at,
                            "the lamp's placement has shear or non-uniform scale (axes of length {:g}, {:g}, "
                            "{:g}); expected rotation, translation and uniform scale",
                            axis_[0].length(), axis_[1].length(), axis_[2].length());
            }
        }
    }
    m.multVecMatrix(centre, origin_);
}

}  // namespace lucerna
