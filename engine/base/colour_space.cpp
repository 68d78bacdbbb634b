#include "engine/base/colour_space.h"

#include <algorithm>

#include "engine/base/spectrum.h"

namespace lucerna {
namespace {

struct Xy {
    double x, y;
};

struct Definition {
    std::string_view name;
    Xy red, green, blue, white;
};
constexpr Xy kD65{0.3127, 0.3290}, kAcesWhite{0.32168, 0.33767};
// ITU-R BT.709, BT.2020; SMPTE RP 431 with white D65; AP1 and AP0 of the Academy's S-2014-004 and ST 2065-1.
constexpr Definition kDefinitions[] = {
    {"srgb", {0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, kD65},
    {"rec2020", {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kD65},
    {"dci-p3", {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, kD65},
    {"acescg", {0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, kAcesWhite},
    {"aces2065-1", {0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, kAcesWhite}};

V3d xyz_of(const Xy& c) {
    return {c.x / c.y, 1, (1 - c.x - c.y) / c.y};
}

// The shares in which three colours make a fourth, by Cramer's rule; they are not on one line.
V3d shares(const std::array<V3d, 3>& of, const V3d& sum) {
    const double all = of[0].dot(of[1].cross(of[2]));
    return V3d(sum.dot(of[1].cross(of[2])), of[0].dot(sum.cross(of[2])), of[0].dot(of[1].cross(sum))) / all;
}

// The cones' response by Bradford's matrix, as the XYZ that each cone alone would see.
constexpr V3d kCones[3] = {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}};

V3d cones(const V3d& xyz) {
    return {kCones[0].dot(xyz), kCones[1].dot(xyz), kCones[2].dot(xyz)};
}

// What looks under D65 as `xyz` does under `white`.
V3d adapted(const V3d& xyz, const V3d& white) {
    const V3d seen = cones(xyz) * cones(kWhiteXyz) / cones(white);
    const std::array<V3d, 3> columns = {V3d(kCones[0].x, kCones[1].x, kCones[2].x),
                                        V3d(kCones[0].y, kCones[1].y, kCones[2].y),
                                        V3d(kCones[0].z, kCones[1].z, kCones[2].z)};
    return shares(columns, seen);
}

ColourSpace made(const Definition& d) {
    const std::array<V3d, 3> pure = {xyz_of(d.red), xyz_of(d.green), xyz_of(d.blue)};
    const V3d white = xyz_of(d.white);
    const V3d parts = shares(pure, white);
    ColourSpace space{d.name, {}};
    for (int c = 0; c < 3; ++c)
        space.primaries[static_cast<std::size_t>(c)] =
            adapted(parts[c] * pure[static_cast<std::size_t>(c)], white);
    return space;
}

}  // namespace

std::span<const ColourSpace> colour_spaces() {
    static const std::array<ColourSpace, std::size(kDefinitions)> spaces = [] {
        std::array<ColourSpace, std::size(kDefinitions)> all;
        std::transform(std::begin(kDefinitions), std::end(kDefinitions), all.begin(), made);
        // The one that rendering is in, to the last bit.
        for (int c = 0; c < 3; ++c)
            all[0].primaries[static_cast<std::size_t>(c)] =
                rgb_to_xyz({c == 0 ? 1.0F : 0.0F, c == 1 ? 1.0F : 0.0F, c == 2 ? 1.0F : 0.0F});
        return all;
    }();
    return spaces;
}

const ColourSpace* find_colour_space(std::string_view name) {
    const std::span<const ColourSpace> all = colour_spaces();
    const auto found = std::ranges::find(all, name, &ColourSpace::name);
    return found == all.end() ? nullptr : &*found;
}

}  // namespace lucerna
