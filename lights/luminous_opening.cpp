#include "lights/luminous_opening.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

// Returns the projected area of a cylinder of length `along` whose elliptic cross-section has sizes a and b.
// w_along, w_a and w_b are the direction's cosines to its axis and to the ellipse's axes.
double cylinder(double along, double a, double b, double w_along, double w_a, double w_b) {
    return kPiD / 4 * a * b * std::fabs(w_along) + along * hypot(b * w_a, a * w_b);
}

bool alike(double a, double b) {
    return std::fabs(a - b) <= 1e-6 * std::max(a, b);
}

}  // namespace

LuminousOpening::LuminousOpening(Shape body, double along_c0, double along_c90,
                                 const std::array<double, 4>& heights)
    : LuminousOpening(body,
                      V3d(along_c0, along_c90, 0.25 * (heights[0] + heights[1] + heights[2] + heights[3]))) {
    side_heights = heights;
}

std::array<double, 2> LuminousOpening::heights_towards(const V3d& w) const {
    // The C90 plane holds -y.
    const double height_x = side_heights[w.x > 0 ? 0 : 2], height_y = side_heights[w.y < 0 ? 1 : 3];
    const double across2 = w.x * w.x + w.y * w.y;
    if (shape == Shape::box || height_x == height_y || !(across2 > 0)) return {height_x, height_y};
    const double height = (height_x * w.x * w.x + height_y * w.y * w.y) / across2;
    return {height, height};
}

double LuminousOpening::projected_area(const V3d& w) const {
    const auto [height_x, height_y] = heights_towards(w);
    switch (shape) {
        case Shape::box:
            return size.x * size.y * std::fabs(w.z) + size.y * height_x * std::fabs(w.x) +
                   size.x * height_y * std::fabs(w.y);
        case Shape::cylinder_along_c0:
            return cylinder(size.x, size.y, size.z, w.x, w.y, w.z);
        case Shape::cylinder_along_c90:
            return cylinder(size.y, size.x, size.z, w.y, w.x, w.z);
        case Shape::cylinder_upright:
            return cylinder(height_x, size.x, size.y, w.z, w.x, w.y);
        case Shape::ellipsoid:
            break;
    }
    return kPiD / 4 * V3d(size.y * size.z * w.x, size.x * size.z * w.y, size.x * size.y * w.z).length();
}

std::pair<double, double> LuminousOpening::faces() const {
    std::array<double, 6> areas{};
    for (std::size_t i = 0; i < areas.size(); ++i) {
        V3d axis(0, 0, 0);
        axis[static_cast<int>(i / 2)] = i % 2 == 0 ? 1 : -1;
        areas[i] = projected_area(axis);
    }
    const auto [least, largest] = std::minmax_element(areas.begin(), areas.end());
    return {*least, *largest};
}

bool LuminousOpening::flat() const {
    return !(size.x > 0 && size.y > 0 && size.z > 0);
}

std::string_view LuminousOpening::name() const {
    switch (shape) {
        case Shape::box:
            return flat() ? "rectangle" : "box";
        case Shape::cylinder_along_c0:
            if (!(size.x > 0)) return alike(size.y, size.z) ? "vertical disc" : "vertical ellipse";
            return alike(size.y, size.z) ? "cylinder lying along C0" : "elliptic cylinder lying along C0";
        case Shape::cylinder_along_c90:
            if (!(size.y > 0)) return alike(size.x, size.z) ? "vertical disc" : "vertical ellipse";
            return alike(size.x, size.z) ? "cylinder lying along C90" : "elliptic cylinder lying along C90";
        case Shape::cylinder_upright:
            if (!(size.z > 0)) return alike(size.x, size.y) ? "disc" : "ellipse";
            return alike(size.x, size.y) ? "upright cylinder" : "upright elliptic cylinder";
        case Shape::ellipsoid:
            break;
    }
    return alike(size.x, size.y) && alike(size.x, size.z) ? "sphere" : "ellipsoid";
}

}  // namespace lucerna
