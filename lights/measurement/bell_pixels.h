// How a bell over S is shared out among the pixels of M.
//
// All rays that pass a point of a plane, or that have one direction, meet M where a linear function of their
// place on S says: what they pass of a filter's bell through each pixel is a difference of two of the bell's
// integrals.
#pragma once

#include <algorithm>
#include <cmath>

#include "lights/bell.h"

namespace lucerna {

// Light of one filter through one pixel of its image, along one axis.
struct BellShare {
    int filter, pixel;
    double weight;  // metres
};

// Calls visit(pixel, share) for every pixel of [0, pixels) through which part of a bell is seen; the shares
// add up to at most 1. `middle` is where the bell's peak is seen, in pixels from the image's lower edge, and
// `slope` how many pixels further a spacing beside it is; it may be negative or 0.
template <typename Visit>
void share_bell(double middle, double slope, int pixels, Visit&& visit) {
    // As an int, for numbers of any size.
    const auto floor_of = [](double x) { return static_cast<int>(std::floor(std::clamp(x, -1e6, 1e6))); };
    const int first = std::max(0, floor_of(middle - std::fabs(slope)));
    const int last = std::min(pixels - 1, floor_of(middle + std::fabs(slope)));
    for (int k = first; k <= last; ++k) {
        double from = -1, to = 1;  // of the bell, in spacings
        // A slope near 0 leaves the whole bell in one pixel; the quotients then lie far outside and are cut
        // to ±1, and without any slope they are not asked for.
        if (slope != 0) {
            const double a = (k - middle) / slope, b = (k + 1 - middle) / slope;
            from = std::clamp(std::min(a, b), -1.0, 1.0);
            to = std::clamp(std::max(a, b), -1.0, 1.0);
        }
        const double share = bell_upto(to) - bell_upto(from);
        if (share > 0) visit(k, share);
    }
}

}  // namespace lucerna
