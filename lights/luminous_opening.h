// The luminous opening of a luminaire: the body from which a photometric file states its light to come.
//
// Luminance from afar is intensity over the projected area of the opening, which CIE 117's UGR needs. All
// shapes of LM-63 and EULUMDAT are one of five bodies with three sizes: along C0-C180 (x), along C90-C270 (y)
// and in height (z). A flat opening has a size of 0. Along the unit direction w, the projected areas are:
//
//     box                 X Y |w_z| + Y Z |w_x| + X Z |w_y|
//     cylinder along z    π/4 X Y |w_z| + Z √((Y w_x)² + (X w_y)²)             along x and y alike
//     ellipsoid           π/4 √((Y Z w_x)² + (X Z w_y)² + (X Y w_z)²)
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "engine/base/vec.h"

namespace lucerna {

// The luminous part of a luminaire is the smallest solid angle that holds this share of its light, divided by
// the share. For an even luminaire that is all of it. The faint light around it is left out, which the
// housing scatters and a measured lamp's field blurs over a cell or two.
inline constexpr double kLuminousShare = 0.9;

struct LuminousOpening {
    // A cylinder's cross-section is an ellipse.
    enum class Shape : std::uint8_t {
        box,
        cylinder_along_c0,
        cylinder_along_c90,
        cylinder_upright,
        ellipsoid
    };

    LuminousOpening() = default;
    LuminousOpening(Shape body, const V3d& sizes)
        : shape(body), size(sizes), side_heights{sizes.z, sizes.z, sizes.z, sizes.z} {}
    // Makes a box or an upright cylinder whose sides facing C0, C90, C180 and C270 shine over different
    // heights. Between these planes, a cylinder's height is weighted by the squared cosines of the direction.
    LuminousOpening(Shape body, double along_c0, double along_c90, const std::array<double, 4>& heights);

    // Returns the projected area along w (unit, in the lamp's frame, away from the lamp) [m²].
    double projected_area(const V3d& w) const;
    // Returns the luminous heights of the sides perpendicular to C0-C180 and to C90-C270 that face w [m].
    // Both are the same number unless the body is a box.
    std::array<double, 2> heights_towards(const V3d& w) const;
    // Returns the least and the largest projected area over both directions of the three axes. The largest is
    // 0 if no opening is stated or if it is a line.
    std::pair<double, double> faces() const;
    bool flat() const;  // a size is 0
    // Returns "disc", "box", "upright elliptic cylinder" …
    std::string_view name() const;

    Shape shape = Shape::box;
    V3d size{0, 0, 0};                     // metres: along C0-C180, along C90-C270, height (the sides' mean)
    std::array<double, 4> side_heights{};  // metres, of the sides facing C0, C90, C180, C270
};

}  // namespace lucerna
