// How the light of one filter and one pixel is shared out among lines of rays.
//
// All rays that pass a point of a plane, or that have one direction, pass M where a linear function of their
// place on S says, s = offset + factor u. Along one axis they carry of the light of filter m through pixel k
//
//     ∫ Φ_m(x(u)) χ_k(y(s)) (dy/ds) dx
//
// with the coordinates x and y of the planes; the integrand is a polynomial between the knots of both bases
// where the coordinates are even, and as smooth where they are not.
#pragma once

#include <optional>
#include <vector>

#include "lights/light_field.h"

namespace lucerna {

// A place along such a line of rays, and what of the bases lies there.
struct BasisNode {
    double on_s, on_m;  // metres
    double weight;      // of an integral over the places on S, or on M if S's is fixed [m]
    int filter;         // the lower of two; some may be none of the rig's
    int pixel[2];       // of each of the two filters, the lower of two
    double under[2];    // the filters' bases
    double across[2];   // the pixels'
};
// A weight of places u of S along the axis: max(0, (at - u) per).
struct FacingWeight {
    double at = 0, per = 0;
};

// `count` Gauss nodes between every two knots; the place where `facing` ends is one.
std::vector<BasisNode> basis_nodes(const Rig& rig, int axis, double offset, double factor, int count,
                                   const std::optional<FacingWeight>& facing = {});
// Of the rays through one point of S: nodes on M.
std::vector<BasisNode> basis_nodes_at(const Rig& rig, int axis, double on_s, int count);

struct BasisShare {
    int filter, pixel;
    double weight;  // metres; > 0
};

// By filter, then pixel.
std::vector<BasisShare> basis_shares(const Rig& rig, int axis, double offset, double factor,
                                     const std::optional<FacingWeight>& facing = {});
// Of the rays through one point of S: of all pixels, each weighed by its own width, and by dx/du.
std::vector<BasisShare> basis_shares_at(const Rig& rig, int axis, double on_s);

}  // namespace lucerna
