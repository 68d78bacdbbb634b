// The measuring filter as a thing that can be printed: a film that lets through a share of the light.
//
// The dual Φ̃⊗Φ̃ with which a rig must weigh the light over a filter position is negative in places, and
// larger than 1 in others; a film's opacity is neither. So the filter is made twice, once of the dual's
// positive part and once of its negative part, each divided by its maximum; the two photographs are scaled
// back and subtracted [Goesele 2003, 4.2].
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

// The maximum of ±Φ̃⊗Φ̃ over Δ_u Δ_v [1/m²]: irradiance behind the film times this is the sign's part of E.
double filter_scale(const Rig& rig, FilterSign sign);

// What the film lets through at a place, in metres from the filter's centre: in [0, 1].
double filter_opacity(const Rig& rig, FilterSign sign, const V2d& from_centre);

// What the sensor sees behind the two films, at every filter position.
struct FilterImages {
    Rig rig;
    // Mean irradiance of each pixel [flux unit / m²], laid out as Rig::index says.
    std::vector<float> positive, negative;
    LightFieldInfo info;  // to pass on; captured and missed are not known yet
    double flux = 0;      // of the whole lamp, flux unit; 0 if nobody knows
    // Of a lamp of several colours the above are of Y, and these of X and Z, CIE 1931 on Y's scale; else
    // empty.
    struct Signed {
        std::vector<float> positive, negative;
    };
    Signed x, z;

    bool coloured() const { return !x.positive.empty(); }
    // The channels that there are, by the numbers X 0, Y 1, Z 2.
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
    // Makes all images of a lamp of one colour, or of several, black. Throws InputError if they are more than
    // the memory holds.
    void allocate(bool several_colours);

    // What a camera sees (engine/ranks/packing.h): all but `info`.
    template <typename Archive>
    void fields(Archive& archive) {
        archive(rig, flux, positive, negative, x.positive, x.negative, z.positive, z.negative);
    }
};

// E = scale⁺ I⁺ - scale⁻ I⁻ of one of images.channels(). Throws InputError if the images are not of the rig.
std::vector<float> coefficients_of(const FilterImages& images, int channel);

// The field of these coefficients, of one colour or several as the images are. Captured is the flux of Y,
// missed what is left of the lamp's (0 if that is not known). Throws InputError as above, if the images hold
// a number that is not finite, and if those of several colours hold no light.
LightField field_of(const FilterImages& images);

// Quadrature along one axis of S, with the four filters over every node weighed exactly.
//
// What a filter of one sign lets through is ∫ max(0, ±Φ̃((x - x_i)/Δ))/Δ f(x) dx. The dual is a quadratic
// between multiples of Δ/2 and changes sign within them; the light f is smooth. So f is interpolated between
// Gauss nodes, and the filter's integral against the interpolant is exact (product integration): neither the
// sign's kinks nor the dual's knots cost a node, and every light that is a quadratic between the knots, as
// all that the basis can hold, is integrated without error.

// Between whole numbers the four duals over a point are quadratic on either half, and cross 0 at the others.
inline constexpr std::array<double, 6> kDualKnots{0.0,
                                                  0.26230405792404127,  // of filter 1: 1170 Φ = 161
                                                  0.3415650255319866,   // of filter 2: 210 Φ = 49
                                                  0.5,
                                                  0.6584349744680134,   // of filter -1
                                                  0.7376959420759588};  // of filter 0

// A node, and what it adds to four neighbouring filters.
struct FilterNode {
    double x;                                  // metres on S
    int first;                                 // of the four filters; some may be no views of the rig
    std::array<double, 4> positive, negative;  // weights of f(x)
};

class FilterAxis {
  public:
    // `origin` is the place of filter 0 [m], spacing > 0 [m]; `rule` Gauss nodes per half spacing.
    FilterAxis(double origin, double spacing, int rule);

    // Panels are half spacings: panel k reaches from panel_edge(k) to panel_edge(k + 1).
    double panel_edge(int k) const { return origin_ + 0.5 * k * spacing_; }
    double panel_of(double x) const { return 2 * (x - origin_) / spacing_; }  // not rounded

    // Adds the nodes of the whole panel k.
    void add_panel(int k, std::vector<FilterNode>& nodes) const;
    // Adds the nodes of [from, to]: whole panels as above, parts of panels by Gauss nodes between all knots.
    void add_range(double from, double to, std::vector<FilterNode>& nodes) const;
    // A node of a rule made elsewhere, of that weight [m].
    FilterNode node(double x, double weight) const;
    // Calls visit(x) for the places in (from, to) where a dual over them has a knot or changes its sign,
    // rising.
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
    std::array<std::vector<FilterNode>, 2> half_;  // of panels 0 and 1 with spacing 1 and filter 0 at 0
};

}  // namespace lucerna
