#include "engine/colour/colour_space.h"

#include <algorithm>
#include <cmath>

#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

struct Xy {
    double x = 0, y = 0;
};

struct Definition {
    std::string_view name;
    Xy red, green, blue, white;
};
constexpr Xy kD65{0.3127, 0.3290}, kAcesWhite{0.32168, 0.33767};
// Sources: ITU-R BT.709, BT.2020; SMPTE RP 431 with white D65; AP1 and AP0 of Academy S-2014-004 and ST
// 2065-1.
constexpr Definition kDefinitions[] = {
    {"srgb", {0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, kD65},
    {"rec2020", {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kD65},
    {"dci-p3", {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, kD65},
    {"acescg", {0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, kAcesWhite},
    {"aces2065-1", {0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, kAcesWhite}};

V3d xyz_of(const Xy& c) {
    return {c.x / c.y, 1, (1 - c.x - c.y) / c.y};
}

// Returns the shares in which three colours, not collinear, mix to a fourth, by Cramer's rule.
V3d shares(const std::array<V3d, 3>& of, const V3d& sum) {
    const double all = of[0].dot(of[1].cross(of[2]));
    return V3d(sum.dot(of[1].cross(of[2])), of[0].dot(sum.cross(of[2])), of[0].dot(of[1].cross(sum))) / all;
}

// The rows of Bradford's matrix give the responses of the three cones to XYZ.
constexpr V3d kCones[3] = {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}};

V3d cones(const V3d& xyz) {
    return {kCones[0].dot(xyz), kCones[1].dot(xyz), kCones[2].dot(xyz)};
}

RgbMatrix inverse_of(const std::array<V3d, 3>& columns) {
    std::array<V3d, 3> inverse;  // columns
    for (int c = 0; c < 3; ++c) {
        V3d one(0, 0, 0);
        one[c] = 1;
        inverse[static_cast<std::size_t>(c)] = shares(columns, one);
    }
    RgbMatrix matrix;
    for (int r = 0; r < 3; ++r)
        matrix.rows[static_cast<std::size_t>(r)] = {inverse[0][r], inverse[1][r], inverse[2][r]};
    return matrix;
}

ColourSpace made(const Definition& d) {
    const std::array<V3d, 3> pure = {xyz_of(d.red), xyz_of(d.green), xyz_of(d.blue)};
    const V3d white = xyz_of(d.white);
    const V3d parts = shares(pure, white);
    ColourSpace space{d.name, {}, {}, {}};
    std::size_t at = 0;
    for (const Xy& c : {d.red, d.green, d.blue, d.white}) {
        space.chromaticities[at++] = static_cast<float>(c.x);
        space.chromaticities[at++] = static_cast<float>(c.y);
    }
    for (int c = 0; c < 3; ++c)
        space.primaries[static_cast<std::size_t>(c)] =
            adapted_to_d65(parts[c] * pure[static_cast<std::size_t>(c)], white);
    space.from_xyz_matrix = inverse_of(space.primaries);
    return space;
}

}  // namespace

V3d adapted_to_d65(const V3d& xyz, const V3d& white) {
    const V3d seen = cones(xyz) * cones(kWhiteXyz) / cones(white);
    const std::array<V3d, 3> columns = {V3d(kCones[0].x, kCones[1].x, kCones[2].x),
                                        V3d(kCones[0].y, kCones[1].y, kCones[2].y),
                                        V3d(kCones[0].z, kCones[1].z, kCones[2].z)};
    return shares(columns, seen);
}

std::span<const ColourSpace> colour_spaces() {
    static const std::array<ColourSpace, std::size(kDefinitions)> spaces = [] {
        std::array<ColourSpace, std::size(kDefinitions)> all;
        std::transform(std::begin(kDefinitions), std::end(kDefinitions), all.begin(), made);
        // sRGB is defined by rgb_to_xyz(), so that conversions agree with xyz_to_rgb() to the last bit.
        for (int c = 0; c < 3; ++c)
            all[0].primaries[static_cast<std::size_t>(c)] =
                rgb_to_xyz({c == 0 ? 1.0F : 0.0F, c == 1 ? 1.0F : 0.0F, c == 2 ? 1.0F : 0.0F});
        all[0].from_xyz_matrix = inverse_of(all[0].primaries);
        return all;
    }();
    return spaces;
}

const ColourSpace* find_colour_space(std::string_view name) {
    const std::span<const ColourSpace> all = colour_spaces();
    const auto found = std::ranges::find(all, name, &ColourSpace::name);
    return found == all.end() ? nullptr : &*found;
}

std::optional<ColourSpace> colour_space_of(const Chromaticities& chromaticities) {
    constexpr float kSame = 1e-3F;
    for (const ColourSpace& known : colour_spaces()) {
        bool same = true;
        for (std::size_t i = 0; i < chromaticities.size(); ++i)
            same = same && std::fabs(chromaticities[i] - known.chromaticities[i]) <= kSame;
        if (same) return known;
    }
    Definition d{{}, {}, {}, {}, {}};
    std::size_t at = 0;
    for (Xy* c : {&d.red, &d.green, &d.blue, &d.white}) {
        c->x = double{chromaticities[at++]};
        c->y = double{chromaticities[at++]};
        if (!std::isfinite(c->x) || !(std::fabs(c->y) > 1e-6)) return std::nullopt;
    }
    const V3d red = xyz_of(d.red), green = xyz_of(d.green), blue = xyz_of(d.blue);
    const double all = red.dot(green.cross(blue));
    if (!(std::fabs(all) > 1e-9 * red.length() * green.length() * blue.length())) return std::nullopt;
    const V3d white = cones(xyz_of(d.white));
    if (!(d.white.y > 0 && white.x > 0 && white.y > 0 && white.z > 0)) return std::nullopt;
    const ColourSpace space = made(d);
    for (const V3d& row : space.from_xyz_matrix.rows) {
        if (!std::isfinite(row.length2())) return std::nullopt;
    }
    return space;
}

RgbMatrix RgbMatrix::operator*(const RgbMatrix& first) const {
    RgbMatrix both;
    for (std::size_t r = 0; r < 3; ++r)
        both.rows[r] = rows[r].x * first.rows[0] + rows[r].y * first.rows[1] + rows[r].z * first.rows[2];
    return both;
}

RgbMatrix conversion(const ColourSpace& from, const ColourSpace& to) {
    RgbMatrix matrix;
    for (std::size_t r = 0; r < 3; ++r) {
        const V3d& row = to.from_xyz_matrix.rows[r];
        matrix.rows[r] = {row.dot(from.primaries[0]), row.dot(from.primaries[1]), row.dot(from.primaries[2])};
    }
    return matrix;
}

V3d held_in_gamut(const V3d& rgb, const V3d& weights) {
    const double y = weights.dot(rgb);
    const double least = std::min({rgb.x, rgb.y, rgb.z});
    if (least >= 0) return rgb;
    if (!(y > 0)) return V3d(0);
    const V3d held = V3d(y) + (rgb - V3d(y)) * (y / (y - least));  // least < 0 < y
    return {std::max(0.0, held.x), std::max(0.0, held.y), std::max(0.0, held.z)};
}

}  // namespace lucerna
