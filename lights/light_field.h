// A measured light field: the light that a lamp sends through every point of a plane in every direction.
//
// Two parallel planes stand in front of the lamp, in the lamp's own frame (light leaves along +z):
//
//     S, the sampling plane, z = 0, coordinates (u, v): where the optical filter sat;
//     M, the measurement plane, z = D, coordinates (s, t): where its image was taken.
//
// A ray is given by the two points where it passes the planes. For every filter position ("view") (m, n) on a
// grid of S there is one image of pixels (k, l) on M. Its values E_mnkl, in W/m⁴ (or lm/m⁴), are the
// coefficients of the flux density
//
//     h(u, v, s, t) = Σ E_mnkl Φ_m(u) Φ_n(v) χ_k(s) χ_l(t)              [Goesele 2003, 3.2]
//
// with the bell Φ (bell.h) on S, or the hat for a field of point samples [Heidrich 1998], and the pixel basis
// χ on M: a box, as a camera measures, or a hat, which is 1 in the pixel's centre and 0 in those of its
// neighbours, so that h is continuous. Radiance is h over the geometric term of the two points. Coefficients
// may be negative near sharp edges and from noise, and stay so in memory and on disk. Only reconstruction
// clamps h at 0, for each pixel of M.
//
// Measuring rigs place filters and pixels evenly on their planes. A field made from rays may place them
// evenly in a coordinate that is finer in the middle (PlaneCoordinate). Directions are then uniform instead
// of places on M, and the lamp itself is resolved better than the wide margin of S that its flattest rays
// pass. h is then the density in these coordinates, and flux_density() converts it to that on the planes.
//
// In Setup A the sensor travels with the filter, so the pixel grid of view m is shifted by m·σ columns. In
// Setup B the screen stands still and σ = 0. S is centred on the z axis; `centre` is its centre in the frame
// of the lamp's file.
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

#include "engine/base/huge_pages.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/system/hash.h"
#include "lights/bell_cell.h"
#include "lights/flux_unit.h"
#include "lights/spectral_basis.h"

namespace lucerna {

using V2d = Imath::V2d;

// Defines a coordinate x along one axis of a plane, for a position s [m] on it: s itself, or
//
//     x = 2 s / (1 + √(1 + (s/c)²))        s = x / (1 - (x/2c)²)        |x| < 2c
//
// which approximates s in the middle. Seen from distance c straight above the middle, x/2c is the tangent of
// half the angle: uniform steps in x are nearly uniform in angle, a little finer towards the horizon.
struct PlaneCoordinate {
    double c = 0;  // metres; 0: x = s

    double of(double s) const {
        if (!(c > 0)) return s;
        // The clamp avoids a quotient of two infinities; x tends to ±2c.
        const double t = std::clamp(s / c, -1e150, 1e150);
        return 2 * c * t / (1 + std::sqrt(1 + t * t));
    }
    double on_plane(double x) const {
        if (!(c > 0)) return x;
        const double half = x / (2 * c);
        return x / (1 - half * half);  // |x| < 2c by Rig::fault
    }
    // Returns dx/ds at s: (1 - τ²)² / (1 + τ²) with τ = x/2c.
    double slope(double s) const {
        if (!(c > 0)) return 1;
        const double half = of(s) / (2 * c), rest = 1 - half * half;
        return rest * rest / (1 + half * half);
    }
};

// Selects the basis function χ of a pixel of M along each axis.
enum class PixelBasis : std::uint8_t { box, hat };

// Selects how radiance follows from the coefficients: exactly, with the geometric term of the ray itself, or
// by the shift-invariant approximation, with one geometric term per filter and pixel [Goesele 2003, appendix
// A].
enum class Reconstruction : std::uint8_t { exact, approximate };

// The geometry of a light field. Axis 0 is u and s, axis 1 is v and t. Lengths are in metres.
struct Rig {
    V2i views{1, 1};      // filter positions W_S, H_S
    V2d spacing{0, 0};    // Δ between filters, in S's coordinate: half the width of a bell
    V2i pixels{1, 1};     // W_M, H_M of one view's image
    V2d pixel{0, 0};      // size of a pixel, w_M, h_M, in M's coordinate
    double distance = 0;  // D, from S to M
    V2i shift{0, 0};      // σ, τ: pixels by which the sensor moves between views (0: Setup B)
    V3d centre{0, 0, 0};  // of S, in the frame of the lamp's file
    PlaneCoordinate s_coordinate, m_coordinate;  // in which filters and pixels are uniform; not with a shift
    FilterBasis filter_basis = FilterBasis::bell;
    PixelBasis basis = PixelBasis::box;  // hat: not with a shift

    // Says why this is not a valid geometry; empty if it is one.
    std::string fault() const;
    std::string fault_of_basis() const;
    std::size_t coefficients() const;  // W_S H_S W_M H_M

    // Returns the index of E_mnkl among the coefficients.
    std::size_t index(int m, int n, int k, int l) const {
        const auto z = [](int i) { return static_cast<std::size_t>(i); };
        return ((z(m) * z(views.y) + z(n)) * z(pixels.x) + z(k)) * z(pixels.y) + z(l);
    }

    int intervals(int axis) const { return views[axis] + 1; }  // of S: U_n, V_o [Goesele 2003, appendix B]
    int columns(int axis) const { return pixels[axis] + shift[axis]; }  // of M seen by one interval: S_p, T_q
    // Return, in S's coordinate, the position of filter i and the lower edge of interval n; its upper edge is
    // the lower edge of n + 1.
    double filter_x(int axis, int i) const { return (i - 0.5 * (views[axis] - 1)) * spacing[axis]; }
    double interval_edge_x(int axis, int n) const { return (n - 0.5 * (views[axis] + 1)) * spacing[axis]; }
    // Returns, in M's coordinate, the lower edge of column p in the numbering of interval n of S.
    double column_edge_x(int axis, int n, int p) const {
        const double sensor = shift[axis] > 0 ? filter_x(axis, n - 1) : 0.0;
        return sensor + (p - 0.5 * pixels[axis]) * pixel[axis];
    }
    // As above, on the planes [m].
    double filter(int axis, int i) const { return s_coordinate.on_plane(filter_x(axis, i)); }
    double interval_edge(int axis, int n) const { return s_coordinate.on_plane(interval_edge_x(axis, n)); }
    double column_edge(int axis, int n, int p) const {
        return m_coordinate.on_plane(column_edge_x(axis, n, p));
    }
    // Return the position of a point of S among the intervals, and of a point of M among the columns of
    // interval n. The integer part is the number, the fraction the position across it; points beyond the
    // planes are allowed.
    double intervals_to(int axis, double on_s) const {
        return (s_coordinate.of(on_s) - interval_edge_x(axis, 0)) / spacing[axis];
    }
    double columns_to(int axis, int n, double on_m) const {
        return (m_coordinate.of(on_m) - column_edge_x(axis, n, 0)) / pixel[axis];
    }
    // Returns how far the basis of the outermost columns extends beyond their edges, in pixels.
    double overhang() const { return basis == PixelBasis::hat ? 0.5 : 0.0; }
    // Returns the outermost position on M that light of interval n passes [m].
    double m_edge(int axis, int n, bool upper) const {
        const double beyond = overhang() * pixel[axis];
        return m_coordinate.on_plane(upper ? column_edge_x(axis, n, columns(axis)) + beyond
                                           : column_edge_x(axis, n, 0) - beyond);
    }
    // A = Δ_u Δ_v w_M h_M [m⁴] is the volume of a cell in the planes' coordinates.
    double cell_volume() const { return spacing.x * spacing.y * pixel.x * pixel.y; }
    // Returns the factor from a density in the coordinates to one on the planes.
    double slope(const V2d& on_s, const V2d& on_m) const {
        return s_coordinate.slope(on_s.x) * s_coordinate.slope(on_s.y) * m_coordinate.slope(on_m.x) *
               m_coordinate.slope(on_m.y);
    }
    // g = D² / R⁴ [1/m²] [Goesele 2003, 3]. D > 0, so R > 0.
    double geometric_term(const V2d& on_s, const V2d& on_m) const {
        const double r2 = (on_m - on_s).length2() + distance * distance;
        return distance * distance / (r2 * r2);
    }
};

// A cell is one interval of S times one pixel of M.
struct Cell {
    int n = 0, o = 0;  // along u, v
    int p = 0, q = 0;  // along s, t, in the interval's numbering
};

// Holds the colour of a light field of more than one colour: beside the coefficients of Y those of X and Z,
// CIE 1931, in the same basis and on the scale on which Y is the flux. All are stored as in a file, as halves
// times a power of 2.
//
// Particles are drawn by, and LightField::coefficients() are, not Y alone but
//
//     W = weight · (X, Y, Z)        weight_c = Ȳ / (number of channels · c̄)
//
// with the channel sums X̄, Ȳ, Z̄. W has the flux of Y and is large wherever any channel is, so that no
// particle carries a colour many times its share. A blue chip, for example, has hardly any Y.
struct ColourChannels {
    struct Pair {
        half x, z;  // divided by the scales
    };
    HugeVector<Pair> pairs;  // one per coefficient; empty: the field has one colour
    double scale_x = 1, scale_z = 1;
    V3d weight{0, 1, 0};
};

// Estimates the error of the irradiance that a field casts on a plane, over cells as fine as the rays resolve
// (measurement/held_out.h).
struct PlaneError {
    double distance;  // of the plane from S [m]; INFINITY: by direction
    double squared = 0;  // expected ∫ (difference)² over ∫ irradiance²; noise may make the estimate negative
    double counts = 0;  // for comparison, the relative noise (a root) of counting all rays in these cells
    double relative() const { return std::sqrt(std::max(0.0, squared)); }
};

struct LightFieldInfo {
    // The colour of all its light in linear sRGB with luminance 1; components are negative outside the gamut.
    // The coefficients are luminance.
    Rgb colour{1.0F};
    FluxUnit unit = FluxUnit::watt;
    std::string provenance;
    double captured = 0;         // flux that the field holds, in its unit: flux() when it was made
    double missed = 0;           // flux of the lamp that the field does not hold
    double lumens_per_watt = 0;  // luminous efficacy of the radiation of a field in watts; 0: not known
    // content_hash() of the lamp of which this is a bootstrap replicate (measurement/ray_bootstrap.h); 0:
    // none.
    std::uint64_t replicate_of = 0;
    SpectralBasis spectra;  // of the light, with its XYZ; unknown if the rays' spectra are
    // For a field made from rays, errors measured with rays that were held out from all choices of its
    // resolution.
    std::vector<PlaneError> errors;
};

class LightField {
  public:
    // Coefficients E[m][n][k][l], l fastest, are in flux unit per m⁴ and finite. Throws InputError if the
    // geometry is invalid, the number of coefficients is wrong or one is not finite (naming its view and
    // pixel).
    LightField(const Rig& rig, const std::vector<float>& coefficients, LightFieldInfo info = {});

    // Makes a field of several colours from coefficients of Y, as above, and of X and Z. They are rounded to
    // what a file holds. `weight` are the weights of W, if a file states them. Throws InputError as above,
    // and if the flux of Y is not positive.
    LightField(const Rig& rig, const std::vector<float>& x, const std::vector<float>& y,
               const std::vector<float>& z, LightFieldInfo info = {}, std::optional<V3d> weight = {});

    // Returns the same field with another description.
    LightField with(LightFieldInfo info) && {
        info_ = std::move(info);
        return std::move(*this);
    }

    // Returns the same field with the centre of its S elsewhere.
    LightField at(const V3d& centre) && {
        rig_.centre = centre;
        return std::move(*this);
    }

    const Rig& rig() const { return rig_; }
    const LightFieldInfo& info() const { return info_; }
    // Returns E: the coefficients of Y, the luminance, or of W if the field is coloured.
    std::span<const float> coefficients() const { return coefficients_; }
    bool coloured() const { return !colour_.pairs.empty(); }
    const ColourChannels& colour_channels() const { return colour_; }
    // Returns X (0), Y (1) or Z (2) alone, as a field of one colour. Without colour channels, Y is the field
    // itself, and X and Z follow from info().colour.
    LightField channel(int c) const;
    // Returns the CIE XYZ of all its light, with Y = 1.
    V3d xyz() const;
    // Returns 0 outside the views and outside a view's image.
    float coefficient(int m, int n, int k, int l) const {
        const auto in = [](int i, int size) {
            return static_cast<unsigned>(i) < static_cast<unsigned>(size);
        };
        if (!in(m, rig_.views.x) || !in(n, rig_.views.y) || !in(k, rig_.pixels.x) || !in(l, rig_.pixels.y))
            return 0;
        return coefficients_[rig_.index(m, n, k, l)];
    }

    // Returns A Σ E: the measured flux, negative coefficients included.
    double flux() const;
    // Returns ∫ max(0, h), the flux that particles drawn from the field carry. It is at least flux().
    double clamped_flux(const Workers& workers) const;

    // Returns the four coefficients over a cell; those of missing views and pixels are 0.
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

    // Holds the coefficients of X and Z over a cell, as members() does those of W.
    struct ColourCell {
        BellCell x, z;
    };
    ColourCell colour_members(const Cell& cell) const;
    // Calls visit(cell, x, y, weight) for the one to four pixels whose basis covers the ray, with its
    // position (x, y) within the cell's interval. h is Σ weight · members(cell).value(x, y) before clamping,
    // per m⁴ of the planes. Makes no call if the ray misses S or M.
    template <typename Visit>
    void for_each_pixel(const V2d& on_s, const V2d& on_m, Visit&& visit) const;

    // Returns h with each pixel's term clamped at 0 [flux unit / m⁴]; rays that miss S or M give 0.
    float flux_density(const V2d& on_s, const V2d& on_m) const;
    // Returns flux_density / g [flux unit / (m² sr)].
    float radiance(const V2d& on_s, const V2d& on_m) const;
    // As radiance(), with g taken once per filter and pixel, between their centres, so that it does not
    // depend on where the ray passes within them [Goesele 2003, appendix A]. The relative error is that of g:
    // for a filter of width W at most about W/D, at 45°, where only one filter is seen, and an eighth of that
    // where neighbours overlap.
    float approximate_radiance(const V2d& on_s, const V2d& on_m) const;
    // Returns the ratio of a reconstruction's radiance to radiance(); 0 where it is undefined.
    float over_exact(Reconstruction reconstruction, const V2d& on_s, const V2d& on_m) const;

  private:
    // Locates a ray: its interval of S, and the one or two pixels of M per axis whose basis covers it.
    struct Place {
        int interval[2];
        float within[2];  // position within the interval
        int column[2];    // lower of the pixels, which may be -1
        float upper[2];   // basis value of the next higher pixel; the lower one's is 1 minus it
    };
    std::optional<Place> place_of(const V2d& on_s, const V2d& on_m) const;

    // Recovers Y from W by subtracting the terms of X and Z.
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

// A file stores coefficients as halves times a power of 2. `scale` brings the largest magnitude into (512,
// 1024]; writing and reading again changes neither it nor the coefficients.
double storage_scale(std::span<const float> coefficients);
inline half stored_half(float coefficient, double scale) {
    return half(static_cast<float>(double{coefficient} / scale));  // a power of 2: exact but for underflow
}
inline float from_stored(half stored, double scale) {
    return static_cast<float>(static_cast<double>(static_cast<float>(stored)) * scale);
}

// Hashes the coefficients and the geometry as a file holds them, so that a field in memory and the same field
// read from its file have equal hashes.
std::uint64_t content_hash(const LightField& field);
// Adds a rig's numbers to a hash, except for the position of its centre.
void add_planes(WordHash& hash, const Rig& rig);

// The format is one OpenEXR image, an atlas of the views with v and t upwards: half coefficients times the
// attribute "scale". Throws InputError naming file and cause.
void write_light_field(const std::filesystem::path& file, const LightField& field);
LightField read_light_field(const std::filesystem::path& file);

}  // namespace lucerna
