// Which points of the sampling plane S send light to one place, learned beforehand.
//
// A place x sees, through every point (u, v) of S, one point of the measurement plane M: where the line from
// there by way of x meets it. A rectangular block of S so sees a rectangle of M, and what the block sends to
// x is about the mean of the flux density h over block and rectangle, times the block's area. (Radiance times
// the geometric term of x and S is h R D² / z³, with R from the point of S to x: only h varies much.)
//
// The pyramid holds these means: of blocks of 2^k x 2^k intervals of S times 2^l x 2^l columns of M, for all
// k and l. A point of S is drawn for x by descent: from the whole of S to one of four quarters by what they
// send to x, down to an interval; there to one of 8 x 8 squares by h itself, as its coefficients give it. A
// tenth of the draws goes by flux alone, whatever x is. So the density is nowhere less than a tenth of the
// one that does not know x, and never 0 where h is not.
//
// In Setup A columns of M are counted from where the sensor stood: light that goes far keeps its column from
// one interval to the next. The bell that joins the views is then in the images of the intervals. Rectangles
// are widened by half a column on each side, as far as a column's light may reach when it is interpolated.
//
// Where the planes' coordinates are finer in the middle, means are of densities in these coordinates, and
// columns are even there; what that is on the planes is a factor of each block.
//
// Numbers are floats cut to 16 bits. Memory: 16/9 of 2 bytes for every interval and column, nine tenths of
// the coefficients'; in Setup A columns are more by the shift on either side.
//
// Source: [Lu 2015]; the quadtree, the squares and the defensive part are ours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/cell_table.h"
#include "lights/huge_pages.h"
#include "lights/light_field.h"

namespace lucerna {

class FieldPyramid {
  public:
    // The share of the draws that goes by flux alone.
    static constexpr double kDefensive = 0.1;

    // Requires table.flux() > 0. The field must live on, where it is. A part is a block of 2^k x 2^k
    // intervals, with the least k that leaves at most `parts_across` of them each way.
    FieldPyramid(const LightField& field, const CellTable& table, int parts_across, const Workers& workers);

    // Per area of S [1/m²].
    struct Density {
        double whole;  // of draw() without a part
        double part;   // of draw() in the part that holds the point
    };
    struct Draw {
        int n, o;  // interval
        V2d on_s;
        Density density;
    };
    // A point of S for the place x [light frame, m; x.z is not 0]. With an interval: of the part that holds
    // it. u in [0,1)². None: the part sends nothing anywhere.
    std::optional<Draw> draw(const V3d& x, const V2f& u, std::optional<V2i> interval = {}) const;
    // Of draw() giving `on_s`, a point of S.
    Density density(const V3d& x, const V2d& on_s) const;

    // What arrives at x (as of draw()) of the clamped field's flux, estimated from the quarters of S:
    // irradiance of a surface that faces S over flux [1/m²].
    double arriving(const V3d& x) const;

    // The first interval of the part that holds one, each way.
    V2i part_of(int n, int o) const {
        return {n >> part_level_ << part_level_, o >> part_level_ << part_level_};
    }

    std::size_t bytes() const { return texels_.size() * sizeof(texels_[0]); }

  private:
    // One axis of S, as many intervals as there are leaves of the quadtree: those beyond the last have no
    // length.
    struct Axis {
        std::vector<float> edge;         // of intervals [m]
        std::vector<float> edge_x;       // the same in S's coordinate
        int intervals = 1, columns = 1;  // that there are
        int margin = 0;                  // columns on either side that no sensor has, but bells reach
    };
    struct Seeing;
    struct Halves;
    using Quarters = std::array<float, 4>;  // lower u: lower and upper v; upper u: the same
    struct Level {                          // of M
        std::size_t begin;
        int size[2];
    };
    struct Path;
    struct AxisWeights;
    struct RowReader;
    struct Grid;

    void build(const LightField& field, const CellTable& table, const Workers& workers);
    void spread_views(int n, int o, float scale, std::vector<float>& out) const;
    std::size_t node(int level, int i, int o) const {
        return first_node_[static_cast<std::size_t>(level)] +
               static_cast<std::size_t>(i) * static_cast<std::size_t>(across(level, 1)) +
               static_cast<std::size_t>(o);
    }
    int across(int level, int axis) const { return (axes_[axis].intervals + (1 << level) - 1) >> level; }
    int part_index(int n) const { return n >> part_level_; }

    Halves halves_of_block(const Seeing& seeing, int level, int i, int o) const;
    Quarters light_of(const std::array<const std::uint16_t*, 4>& images, const Halves& halves) const;
    Quarters flux_of(int level, int i, int o) const;
    Seeing seeing_from(const V3d& x) const;
    // What the quarters of a block send there.
    Quarters light_of_block(const Seeing& seeing, int level, int i, int o) const;
    template <typename Choose>
    Path descend(const V3d& x, Choose&& choose) const;
    int levels_within(double stretch) const;
    static std::pair<std::size_t, std::size_t> square_of(const Path& path, const V2d& on_s);
    AxisWeights axis_weights(int axis, const Path& path, const V3d& x) const;
    Grid grid_of(const Path& path, const V3d& x) const;
    Density mixed(const Path& path, const Grid& grid, std::size_t row, std::size_t column) const;
    V2d draw_by_flux(V2f u, std::optional<V2i> interval) const;

    const LightField* field_;
    std::array<Axis, 2> axes_;
    std::array<float, 2> columns_{}, per_metre_{};  // of M: how many, and how many per metre
    std::array<double, 2> first_column_{};          // of M, its lower edge in M's coordinate [m]
    float per_c_ = 0;                               // 1 over M's coordinate's c; 0 where that is even
    double distance_ = 0;
    double mean_ = 0;     // density h over the flux [1/m⁴]
    int levels_ = 0;      // of S: blocks of 2^0 to 2^levels_ intervals across
    int part_level_ = 0;  // whose blocks are parts
    std::vector<Level> of_m_;
    std::size_t image_ = 0;                // texels of all levels of M
    std::vector<std::size_t> first_node_;  // of every level of S
    std::vector<float> flux_;              // of every node, its share
    HugeVector<std::uint16_t> texels_;     // images, node after node
};

}  // namespace lucerna
