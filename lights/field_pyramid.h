// Draws points of the sampling plane S by the light that they send to one place, from precomputed means.
//
// Through every point (u, v) of S, a place x sees one point of the measurement plane M, where the line
// through both meets it. A rectangular block of S thus sees a rectangle of M, and the block sends to x about
// the mean of the flux density h over block and rectangle, times the block's area. (Radiance times the
// geometric term of x and S is h R D² / z³, with R from the point of S to x, and only h varies much.)
//
// The pyramid holds these means, for blocks of 2^k x 2^k intervals of S times 2^l x 2^l columns of M, for all
// k and l. A point of S is drawn for x by descent: from all of S to one of four quarters by what they send to
// x, down to an interval, and there to one of 8 x 8 squares by h itself, evaluated from its coefficients. A
// tenth of the draws goes by flux alone, regardless of x. This defensive mixture keeps the density at a
// tenth or more of the one that ignores x, so that it is never 0 where h is not.
//
// In Setup A columns of M are counted from the position of the sensor, so that light that travels far keeps
// its column from one interval to the next. The bell that joins the views is then part of the intervals'
// images. Rectangles are widened by half a column on each side, which is how far interpolation spreads a
// column.
//
// Where the planes' coordinates are finer in the middle, means are of densities in these coordinates, in
// which columns are uniform; each block has a factor that converts them to the planes.
//
// Values are floats cut to 16 bits. Memory is 16/9 of 2 bytes for every interval and column, nine tenths of
// that of the coefficients; in Setup A the shift adds columns on either side.
//
// Source: [Lu 2015]; the quadtree, the squares and the defensive mixture are our own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/huge_pages.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/cell_table.h"
#include "lights/light_field.h"

namespace lucerna {

class FieldPyramid {
  public:
    // The share of the draws that goes by flux alone.
    static constexpr double kDefensive = 0.1;

    // Requires table.flux() > 0. The field must outlive the pyramid and stay in place. A part is a block of
    // 2^k x 2^k intervals, with the least k that gives at most `parts_across` of them along each axis.
    FieldPyramid(const LightField& field, const CellTable& table, int parts_across, const Workers& workers);

    // Densities per area of S [1/m²].
    struct Density {
        double whole;  // of draw() without an interval
        double part;   // of draw() restricted to the part that holds the point
    };
    struct Draw {
        int n, o;  // interval
        V2d on_s;
        Density density;
    };
    // Draws a point of S for the place x [light frame, m; x.z is not 0]. Given an interval, draws in the part
    // that holds it. u is in [0,1)². Returns none if the part sends nothing anywhere.
    std::optional<Draw> draw(const V3d& x, const V2f& u, std::optional<V2i> interval = {}) const;
    // Returns the density with which draw() gives `on_s`, a point of S.
    Density density(const V3d& x, const V2d& on_s) const;

    // Estimates the share of the clamped field's flux that arrives at x (as in draw()), from the quarters of
    // S: the irradiance of a surface that faces S over the flux [1/m²].
    double arriving(const V3d& x) const;

    // Returns the first interval, along each axis, of the part that holds interval (n, o).
    V2i part_of(int n, int o) const {
        return {n >> part_level_ << part_level_, o >> part_level_ << part_level_};
    }

    std::size_t bytes() const { return texels_.size() * sizeof(texels_[0]); }

  private:
    // One axis of S, padded to as many intervals as the quadtree has leaves; those beyond the last have
    // length 0.
    struct Axis {
        std::vector<float> edge;         // of intervals [m]
        std::vector<float> edge_x;       // as `edge`, in S's coordinate
        int intervals = 1, columns = 1;  // actual number, without padding
        int margin = 0;                  // columns on either side that no sensor has, but bells reach
    };
    struct Seeing;
    struct Halves;
    using Quarters = std::array<float, 4>;  // lower u: lower and upper v; then upper u likewise
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
    // Returns what the quarters of a block send to the place.
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
    std::array<float, 2> columns_{}, per_metre_{};  // of M: number of columns, and columns per metre
    std::array<double, 2> first_column_{};          // lower edge of M's first column, in M's coordinate [m]
    float per_c_ = 0;                               // 1/c of M's coordinate; 0 where that is uniform
    double distance_ = 0;
    double mean_ = 0;     // mean density h over the flux [1/m⁴]
    int levels_ = 0;      // of S: blocks of 2^0 to 2^levels_ intervals across
    int part_level_ = 0;  // level whose blocks are parts
    std::vector<Level> of_m_;
    std::size_t image_ = 0;                // texels of all levels of M, per node
    std::vector<std::size_t> first_node_;  // of every level of S
    std::vector<float> flux_;              // share of the flux, per node
    HugeVector<std::uint16_t> texels_;     // images, node after node
};

}  // namespace lucerna
