// The place of an edge between two places.
#pragma once

namespace lucerna {

// Distances on both sides of an edge.
struct Edge {
    double inside, outside;
};
// Halves the interval from `inside`, where is_inside(distance) holds, to `outside`, where it does not or is
// not asked, until it is no longer than `exact` > 0. In between there may be several edges; one is found.
template <typename IsInside>
Edge edge_between(double inside, double outside, double exact, IsInside&& is_inside) {
    while (outside - inside > exact) {
        const double middle = (inside + outside) / 2;
        (is_inside(middle) ? inside : outside) = middle;
    }
    return {inside, outside};
}

}  // namespace lucerna
