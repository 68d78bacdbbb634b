// Computes how the light of one filter and one pixel is shared among families of rays.
//
// For all rays through a point of a plane, or of one direction, the position on M is a linear function of
// that on S, s = offset + factor u. Along one axis they carry, of the light of filter m through pixel k,
//
//     ∫ Φ_m(x(u)) χ_k(y(s)) (dy/ds) dx
//
// with the coordinates x and y of the planes. The integrand is a polynomial between the knots of both bases
// if the coordinates are uniform, and smooth otherwise.
#pragma once

#include <optional>
#include <vector>

#include "lights/light_field.h"

namespace lucerna {

// A quadrature node along such a family of rays, with the bases there.
struct BasisNode {
    double on_s, on_m;  // metres
    double weight;      // for an integral over S, or over M if the position on S is fixed [m]
    int filter;         // the lower of two; it may be outside the rig
    int pixel[2];       // for each of the two filters, the lower of two
    double under[2];    // values of the filters' bases
    double across[2];   // values of the pixels' bases
};
// A weight over positions u of S along the axis: max(0, (at - u) per).
struct FacingWeight {
    double at = 0, per = 0;
};

// Returns `count` Gauss nodes between every two knots, which include the end of `facing`.
std::vector<BasisNode> basis_nodes(const Rig& rig, int axis, double offset, double factor, int count,
                                   const std::optional<FacingWeight>& facing = {});
// Returns nodes on M for the rays through one point of S.
std::vector<BasisNode> basis_nodes_at(const Rig& rig, int axis, double on_s, int count);

struct BasisShare {
    int filter, pixel;
    double weight;  // metres; > 0
};

// Returns shares in the order of filters, then pixels.
std::vector<BasisShare> basis_shares(const Rig& rig, int axis, double offset, double factor,
                                     const std::optional<FacingWeight>& facing = {});
// Returns the shares of the rays through one point of S: all pixels, weighted by their widths and dx/du.
std::vector<BasisShare> basis_shares_at(const Rig& rig, int axis, double on_s);

}  // namespace lucerna
