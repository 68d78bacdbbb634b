// A measured light field: what a lamp sends through every point of a plane in every direction.
//
// Two parallel planes stand before the lamp, in the lamp's own frame (light leaves along +z):
//
//     S, the sampling plane, z = 0, coordinates (u, v): where the optical filter sat;
//     M, the measurement plane, z = D, coordinates (s, t): where its image was taken.
//
// A ray is named by the two points it passes. For every filter position ("view") (m, n) on a grid of S there
// is one image of pixels (k, l) on M, and its numbers E_mnkl, in W/m⁴ (or lm/m⁴), are the coefficients of the
// flux density
//
//     h(u, v, s, t) = Σ E_mnkl Φ_m(u) Φ_n(v) χ_k(s) χ_l(t)              [Goesele 2003, 3.2]
//
// with the bell Φ (bell.h) on S, or the hat of a field of point samples [Heidrich 1998], and the basis χ of
// one pixel on M: its box, as a camera measures, or its hat, which is 1 in the pixel's middle and 0 in its
// neighbours', so that h has no steps. Radiance is h over the geometric term of the two points. Coefficients
// may be negative near sharp edges and from noise, and stay so in memory and on disk; only what a
// reconstruction shows is clamped at 0, pixel by pixel of M.
//
// Measuring rigs have filters and pixels evenly on their planes. A field made of rays may have them even in a
// coordinate that is finer in the middle (PlaneCoordinate): directions are then even, not places on M, and
// the lamp itself is resolved better than the wide margin of S that its flattest rays pass. h is then the
// density in these coordinates, and flux_density() turns it into that on the planes.
//
// In Setup A the sensor travels with the filter, so the pixel grid of view m is shifted by m·σ columns; in
// Setup B the screen stands still and σ = 0. S is centred on the z axis; `centre` says where that is in the
// lamp file's frame.
//
// Source: [Goesele 2003].
#pragma once

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/system/hash.h"
#include "lights/bell_cell.h"
#include "lights/flux_unit.h"
#include "lights/huge_pages.h"

namespace lucerna {

using V2d = Imath::V2d;

// A coordinate x along one axis of a plane, of a place s [m] on it: s itself, or
//
//     x = 2 s / (1 + √(1 + (s/c)²))        s = x / (1 - (x/2c)²)        |x| < 2c
//
// which is s in the middle. Seen from a distance c straight above the middle, x/2c is the tangent of half the
// angle: even steps in x are nearly even in angle, a little finer towards the horizon.
struct PlaneCoordinate {
    double c = 0;  // metres; 0: x = s

    double of(double s) const {
        if (!(c > 0)) return s;
        // Beyond all bounds x is ±2c, without the quotient of two infinities.
        const double t = std::clamp(s / c, -1e150, 1e150);
        return 2 * c * t / (1 + std::sqrt(1 + t * t));
    }
    double on_plane(double x) const {
        if (!(c > 0)) return x;
        const double half = x / (2 * c);
        return x / (1 - half * half);  // |x| < 2c: Rig::fault
    }
    // dx/ds at s: (1 - τ²)² / (1 + τ²) with τ = x/2c.
    double slope(double s) const {
        if (!(c > 0)) return 1;
        const double half = of(s) / (2 * c), rest = 1 - half * half;
        return rest * rest / (1 + half * half);
    }
};

// What one pixel of M stands for along each axis.
enum class PixelBasis : std::uint8_t { box, hat };

// How radiance follows from the coefficients: exactly, h over the geometric term of the very ray; or by the
// shift-invariant approximation, the geometric term taken once per filter and pixel [Goesele 2003, appendix
// A].
enum class Reconstruction : std::uint8_t { exact, approximate };

// The geometry: everything but the numbers measured. Axis 0 is u and s, axis 1 is v and t. Lengths in metres.
struct Rig {
    V2i views{1, 1};      // filter positions W_S, H_S
    V2d spacing{0, 0};    // Δ between them, in S's coordinate: half the width of a bell
    V2i pixels{1, 1};     // of one view's image, W_M, H_M
    V2d pixel{0, 0};      // size of a pixel, w_M, h_M, in M's coordinate
    double distance = 0;  // D, from S to M
    V2i shift{0, 0};      // σ, τ: pixels by which the sensor moves from one view to the next (0: Setup B)
    V3d centre{0, 0, 0};  // of S, in the frame of the lamp's file
    PlaneCoordinate s_coordinate, m_coordinate;  // in which filters and pixels are even. Not with a shift
    FilterBasis filter_basis = FilterBasis::bell;
    PixelBasis basis = PixelBasis::box;  // a hat not with a shift

    // Why this is no geometry, in words; empty if it is one.
    std::string fault() const;
    std::string fault_of_basis() const;
    std::size_t coefficients() const;  // W_S H_S W_M H_M

    // Where E_mnkl lies among the coefficients.
    std::size_t index(int m, int n, int k, int l) const {
        const auto z = [](int i) { return static_cast<std::size_t>(i); };
        return ((z(m) * z(views.y) + z(n)) * z(pixels.x) + z(k)) * z(pixels.y) + z(l);
    }

    int intervals(int axis) const { return views[axis] + 1; }  // of S [Goesele 2003, appendix B: U_n, V_o]
    int columns(int axis) const { return pixels[axis] + shift[axis]; }  // of M seen by one interval: S_p, T_q
    // In S's coordinate: where filter i stands, and the lower edge of interval n, whose upper edge is that of
    // n + 1.
    double filter_x(int axis, int i) const { return (i - 0.5 * (views[axis] - 1)) * spacing[axis]; }
    double interval_edge_x(int axis, int n) const { return (n - 0.5 * (views[axis] + 1)) * spacing[axis]; }
    // In M's coordinate: the lower edge of column p, as interval n of S numbers them.
    double column_edge_x(int axis, int n, int p) const {
        const double sensor = shift[axis] > 0 ? filter_x(axis, n - 1) : 0.0;
        return sensor + (p - 0.5 * pixels[axis]) * pixel[axis];
    }
    // The same on the planes [m].
    double filter(int axis, int i) const { return s_coordinate.on_plane(filter_x(axis, i)); }
    double interval_edge(int axis, int n) const { return s_coordinate.on_plane(interval_edge_x(axis, n)); }
    double column_edge(int axis, int n, int p) const {
        return m_coordinate.on_plane(column_edge_x(axis, n, p));
    }
    // Where a place on S lies among the intervals, and one on M among the columns of interval n: the whole
    // part is the number, the rest how far across. Any number: places beside the planes too.
    double intervals_to(int axis, double on_s) const {
        return (s_coordinate.of(on_s) - interval_edge_x(axis, 0)) / spacing[axis];
    }
    double columns_to(int axis, int n, double on_m) const {
        return (m_coordinate.of(on_m) - column_edge_x(axis, n, 0)) / pixel[axis];
    }
    // How far the light of the outermost columns reaches beyond their edges, in pixels.
    double overhang() const { return basis == PixelBasis::hat ? 0.5 : 0.0; }
    // The outermost place on M that light passes as interval n sees it [m].
    double m_edge(int axis, int n, bool upper) const {
        const double beyond = overhang() * pixel[axis];
        return m_coordinate.on_plane(upper ? column_edge_x(axis, n, columns(axis)) + beyond
                                           : column_edge_x(axis, n, 0) - beyond);
    }
    // A = Δ_u Δ_v w_M h_M [m⁴]: the volume of a cell, in the planes' coordinates.
    double cell_volume() const { return spacing.x * spacing.y * pixel.x * pixel.y; }
    // What turns a density in the coordinates into one on the planes.
    double slope(const V2d& on_s, const V2d& on_m) const {
        return s_coordinate.slope(on_s.x) * s_coordinate.slope(on_s.y) * m_coordinate.slope(on_m.x) *
               m_coordinate.slope(on_m.y);
    }
    // g = D² / R⁴ [1/m²] [Goesele 2003, 3]; D > 0, so R > 0.
    double geometric_term(const V2d& on_s, const V2d& on_m) const {
        const double r2 = (on_m - on_s).length2() + distance * distance;
        return distance * distance / (r2 * r2);
    }
};

// A cell: one interval of S times one pixel of M.
struct Cell {
    int n = 0, o = 0;  // along u, v
    int p = 0, q = 0;  // along s, t, as the interval numbers them
};

// The colour of a light field, if it is not one: beside the coefficients of Y those of X and Z, CIE 1931, in
// the same basis, on the scale on which Y is the flux. All as a file holds them, halves times a power of 2.
//
// What particles are drawn by, and what LightField::coefficients() are, is not Y alone but
//
//     W = weight · (X, Y, Z)        weight_c = Ȳ / (number of channels · c̄)
//
// with the channels' sums X̄, Ȳ, Z̄: of the same flux as Y, and large wherever any channel is, so that no drawn
// particle has to carry a colour many times its share. A blue chip has hardly any Y.
struct ColourChannels {
    struct Pair {
        half x, z;  // over the scales
    };
    HugeVector<Pair> pairs;  // of each coefficient; empty: the field has one colour
    double scale_x = 1, scale_z = 1;
    V3d weight{0, 1, 0};
};

// How far the irradiance that a field casts on a plane is from the lamp's, in cells as fine as the rays tell
// (measurement/held_out.h).
struct PlaneError {
    double distance;  // of the plane from S [m]; INFINITY: by direction
    double squared = 0;  // expected ∫ (difference)² over ∫ irradiance². An estimate: noise may put it below 0
    double counts = 0;  // for comparison, a root: the noise that counting all rays into these cells has
    double relative() const { return std::sqrt(std::max(0.0, squared)); }
};

struct LightFieldInfo {
    // Of all its light: linear sRGB of luminance 1, with negative components outside its gamut; the
    // coefficients are luminance.
    Rgb colour{1.0F};
    FluxUnit unit = FluxUnit::watt;
    std::string provenance;
    double captured = 0;         // flux that the field holds, in its unit: flux() when it was made
    double missed = 0;           // flux of the lamp that it does not hold
    double lumens_per_watt = 0;  // luminous efficacy of the radiation of a field in watts; 0: not known
    // content_hash() of the lamp that this is a bootstrap replicate of (measurement/ray_bootstrap.h); 0: of
    // none.
    std::uint64_t replicate_of = 0;
    // Of a field made of rays, by rays that were held out from all choices of its resolution; else none.
    std::vector<PlaneError> errors;
};

class LightField {
  public:
    // Coefficients E[m][n][k][l], l fastest, in flux unit per m⁴, all finite. Throws InputError if the
    // geometry is none, the number of coefficients is wrong or one is not finite (naming its view and pixel).
    LightField(const Rig& rig, const std::vector<float>& coefficients, LightFieldInfo info = {});

    // A field of several colours: coefficients of Y, as above, and of X and Z. They are rounded to what a
    // file holds; a file says by which weights W is made of them. Throws InputError as above, and if the flux
    // of Y is not positive.
    LightField(const Rig& rig, const std::vector<float>& x, const std::vector<float>& y,
               const std::vector<float>& z, LightFieldInfo info = {}, std::optional<V3d> weight = {});

    // The same field under another description.
    LightField with(LightFieldInfo info) && {
        info_ = std::move(info);
        return std::move(*this);
    }

    const Rig& rig() const { return rig_; }
    const LightFieldInfo& info() const { return info_; }
    // E: of Y, the luminance, or of W if the field is coloured.
    std::span<const float> coefficients() const { return coefficients_; }
    bool coloured() const { return !colour_.pairs.empty(); }
    const ColourChannels& colour_channels() const { return colour_; }
    // X (0), Y (1) or Z (2) alone, as a field of one colour; of one that is not coloured, Y is itself and X
    // and Z follow from info().colour.
    LightField channel(int c) const;
    // Of all its light, CIE XYZ with Y = 1.
    V3d xyz() const;
    // 0 outside the views and outside a view's image.
    float coefficient(int m, int n, int k, int l) const {
        const auto in = [](int i, int size) {
            return static_cast<unsigned>(i) < static_cast<unsigned>(size);
        };
        if (!in(m, rig_.views.x) || !in(n, rig_.views.y) || !in(k, rig_.pixels.x) || !in(l, rig_.pixels.y))
            return 0;
        return coefficients_[rig_.index(m, n, k, l)];
    }

    // A Σ E: the measured flux, negative coefficients included.
    double flux() const;
    // ∫ max(0, h): what particles drawn from the field carry. At least flux().
    double clamped_flux(const Workers& workers) const;

    // The four coefficients over a cell; those of missing views and pixels are 0.
    BellCell members(const Cell& cell) const {
        const int k[2] = {cell.p, cell.p - rig_.shift.x};
        const int l[2] = {cell.q, cell.q - rig_.shift.y};
        BellCell c;
        c.basis = rig_.filter_basis;
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) c.e[i][j] = coefficient(cell.n - 1 + i, cell.o - 1 + j, k[i], l[j]);
        }
        return c;
    }

    // X and Z over a cell, as members() of W.
    struct ColourCell {
        BellCell x, z;
    };
    ColourCell colour_members(const Cell& cell) const;
    // Calls visit(cell, x, y, weight) for the one to four pixels whose basis holds the ray, with the place
    // (x, y) within the cell's interval: h is Σ weight · members(cell).value(x, y), before the clamp, per m⁴
    // of the planes. None if the ray misses S or M.
    template <typename Visit>
    void for_each_pixel(const V2d& on_s, const V2d& on_m, Visit&& visit) const;

    // h, each pixel's part clamped at 0 [flux unit / m⁴]; 0 for rays that miss S or M. The only clamp.
    float flux_density(const V2d& on_s, const V2d& on_m) const;
    // flux_density / g [flux unit / (m² sr)].
    float radiance(const V2d& on_s, const V2d& on_m) const;
    // The same with g taken once per filter and pixel, between their centres, so that it does not depend on
    // where within them the ray passes [Goesele 2003, appendix A]. Its relative error is that of g: for a
    // filter of width W about W/D at most, at 45°, where only one filter is seen; an eighth of that where
    // neighbours overlap.
    float approximate_radiance(const V2d& on_s, const V2d& on_m) const;
    // What radiance() is multiplied by for a reconstruction; 0 where there is none.
    float over_exact(Reconstruction reconstruction, const V2d& on_s, const V2d& on_m) const;

  private:
    // Where a ray passes: its interval of S, and the one or two pixels of M per axis whose basis holds it.
    struct Place {
        int interval[2];
        float within[2];  // of the interval
        int column[2];    // the lower of the pixels, which may be -1
        float upper[2];   // the basis of the next higher pixel there; the lower one's is the rest of 1
    };
    std::optional<Place> place_of(const V2d& on_s, const V2d& on_m) const;

    // Of Y: from W less the others' part.
    float luminance_of(std::size_t coefficient) const;

    Rig rig_;
    HugeVector<float> coefficients_;
    ColourChannels colour_;
    LightFieldInfo info_;
};

template <typename Visit>
void LightField::for_each_pixel(const V2d& on_s, const V2d& on_m, Visit&& visit) const {
    const auto place = place_of(on_s, on_m);
    if (!place) return;
    const auto slope = static_cast<float>(rig_.slope(on_s, on_m));
    for (int a = 0; a < 2; ++a) {
        const float across = slope * (a == 0 ? 1 - place->upper[0] : place->upper[0]);
        if (!(across > 0)) continue;
        for (int b = 0; b < 2; ++b) {
            const float weight = across * (b == 0 ? 1 - place->upper[1] : place->upper[1]);
            if (!(weight > 0)) continue;
            visit(Cell{place->interval[0], place->interval[1], place->column[0] + a, place->column[1] + b},
                  place->within[0], place->within[1], weight);
        }
    }
}

// What a file holds of coefficients: halves times a power of 2. `scale` brings the largest magnitude into
// (512, 1024]; writing and reading again changes neither it nor the numbers any more.
double storage_scale(std::span<const float> coefficients);
inline half stored_half(float coefficient, double scale) {
    return half(static_cast<float>(double{coefficient} / scale));  // a power of 2: exact but for underflow
}
inline float from_stored(half stored, double scale) {
    return static_cast<float>(static_cast<double>(static_cast<float>(stored)) * scale);
}

// A name for the numbers and the geometry, as a file holds them: a field in memory and the one that is read
// back from its file have the same. Others differ, for all that can be expected.
std::uint64_t content_hash(const LightField& field);
// Adds the numbers of a rig's planes to a hash: all but where its centre lies.
void add_planes(WordHash& hash, const Rig& rig);

// One OpenEXR image, an atlas of the views with v and t upwards: half coefficients times the attribute
// "scale". Throws InputError naming file and cause.
void write_light_field(const std::filesystem::path& file, const LightField& field);
LightField read_light_field(const std::filesystem::path& file);

}  // namespace lucerna
