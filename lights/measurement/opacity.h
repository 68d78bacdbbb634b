// The measuring filter as a printable film that transmits a share of the light.
//
// The dual Φ̃⊗Φ̃ with which a rig weights the light over a filter position is negative in places and larger
// than 1 in others, which a film's opacity cannot be. So two films are made, one of the dual's positive part
// and one of its negative part, each divided by its maximum. The two photographs are scaled back and
// subtracted [Goesele 2003, 4.2].
//
// Source: [Goesele 2003].
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lights/light_field.h"

namespace lucerna {

enum class FilterSign : std::uint8_t { positive, negative };

inline constexpr std::array<FilterSign, 2> kFilterSigns{FilterSign::positive, FilterSign::negative};

// Returns the maximum of ±Φ̃⊗Φ̃ over Δ_u Δ_v [1/m²], by which irradiance behind the film is multiplied in E.
double filter_scale(const Rig& rig, FilterSign sign);

// Returns what the film transmits at a place, in metres from the filter's centre, in [0, 1].
double filter_opacity(const Rig& rig, FilterSign sign, const V2d& from_centre);

// Holds what the sensor sees behind the two films, at every filter position.
struct FilterImages {
    Rig rig;
    // The mean irradiance of each pixel [flux unit / m²], laid out by Rig::index.
    std::vector<float> positive, negative;
    LightFieldInfo info;  // passed on; captured and missed are not known yet
    double flux = 0;      // of the whole lamp, flux unit; 0: unknown
    // For a lamp of several colours, the images above are of Y and these of X and Z, CIE 1931 on the scale of
    // Y; otherwise they are empty.
    struct Signed {
        std::vector<float> positive, negative;
    };
    Signed x, z;

    bool coloured() const { return !x.positive.empty(); }
    // Returns the existing channels, numbered X 0, Y 1, Z 2.
    std::span<const int> channels() const;
    std::vector<float>& of(FilterSign sign, int channel = 1) {
        return const_cast<std::vector<float>&>(std::as_const(*this).of(sign, channel));
    }
    const std::vector<float>& of(FilterSign sign, int channel = 1) const {
        const bool plus = sign == FilterSign::positive;
        if (channel == 1) return plus ? positive : negative;
        const Signed& other = channel == 0 ? x : z;
        return plus ? other.positive : other.negative;
    }
    // Allocates black images for a lamp of one colour or of several. Throws InputError if they exceed the
    // memory.
    void allocate(bool several_colours);

    // Serialises what a camera sees (engine/ranks/packing.h), which is all but `info`.
    template <typename Archive>
    void fields(Archive& archive) {
        archive(rig, flux, positive, negative, x.positive, x.negative, z.positive, z.negative);
    }
};

// Returns E = scale⁺ I⁺ - scale⁻ I⁻ for one of images.channels(). Throws InputError for images of another
// rig.
std::vector<float> coefficients_of(const FilterImages& images, int channel);

// Returns the field of these coefficients, of one colour or several as the images are. Its captured flux is
// that of Y, and missed is the rest of the lamp's (0 if that is unknown). Throws InputError as above, if a
// value is not finite, and if images of several colours hold no light.
LightField field_of(const FilterImages& images);

// Quadrature along one axis of S that weights the four filters over every node exactly.
//
// A filter of one sign transmits ∫ max(0, ±Φ̃((x - x_i)/Δ))/Δ f(x) dx. The dual is quadratic between
// multiples of Δ/2 and changes sign within these pieces; the light f is smooth. So f is interpolated between
// Gauss nodes, and the filter's integral of the interpolant is exact (product integration). Neither the kinks
// at sign changes nor the dual's knots cost nodes, and light that is quadratic between knots, like everything
// in the span of the basis, is integrated without error.

// Between integers, the four duals over a point are quadratic on either half and cross 0 at the other knots.
inline constexpr std::array<double, 6> kDualKnots{0.0,
                                                  0.26230405792404127,  // of filter 1: 1170 Φ = 161
                                                  0.3415650255319866,   // of filter 2: 210 Φ = 49
                                                  0.5,
                                                  0.6584349744680134,   // of filter -1
                                                  0.7376959420759588};  // of filter 0

// A quadrature node and its contribution to four neighbouring filters.
struct FilterNode {
    double x;                                  // metres on S
    int first;                                 // of the four filters; some may be outside the rig
    std::array<double, 4> positive, negative;  // weights of f(x)
};

class FilterAxis {
  public:
    // `origin` [m] is where filter 0 is, spacing [m] is > 0, and `rule` is the number of nodes per half
    // spacing.
    FilterAxis(double origin, double spacing, int rule);

    // Panels are half spacings: panel k extends from panel_edge(k) to panel_edge(k + 1).
    double panel_edge(int k) const { return origin_ + 0.5 * k * spacing_; }
    double panel_of(double x) const { return 2 * (x - origin_) / spacing_; }  // not rounded

    // Adds the nodes of the whole panel k.
    void add_panel(int k, std::vector<FilterNode>& nodes) const;
    // Adds the nodes of [from, to]: whole panels as above, partial ones by Gauss nodes between all knots.
    void add_range(double from, double to, std::vector<FilterNode>& nodes) const;
    // Returns a node for a position and weight [m] from another rule.
    FilterNode node(double x, double weight) const;
    // Calls visit(x) in ascending order for the places in (from, to) where a dual over them has a knot or a
    // sign change.
    template <typename Visit>
    void for_knots(double from, double to, Visit&& visit) const {
        const int last = static_cast<int>(std::ceil((to - origin_) / spacing_));
        for (int i = static_cast<int>(std::floor((from - origin_) / spacing_)); i <= last; ++i) {
            for (const double f : kDualKnots) {
                const double knot = origin_ + (i + f) * spacing_;
                if (knot > from && knot < to) visit(knot);
            }
        }
    }

  private:
    void add_part(double from, double to, std::vector<FilterNode>& nodes) const;

    double origin_, spacing_;
    int rule_;
    std::array<std::vector<FilterNode>, 2> half_;  // panels 0 and 1 for spacing 1 and filter 0 at 0
};

}  // namespace lucerna
