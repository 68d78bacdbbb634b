// A photon, stored where a particle hits a surface or is scattered in a medium: 24 bytes, with its position
// stored separately.
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/base/vec.h"
#include "lights/light.h"

namespace lucerna {

// A unit vector in 32 bits, by the octahedral map [Meyer 2010] with 16 bits a side. The error of the angle is
// less than 1e-4 rad. It moves the point at which the photon crosses a tangent plane by less than 1e-4 of its
// distance from the plane along the path, divided by the cosine there (at least kGrazing).
class PackedDirection {
  public:
    PackedDirection() = default;
    explicit PackedDirection(const V3f& d) {
        const float scale =
            1.0F / (std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z));  // |d| = 1: at least 1/sqrt 3
        V2f p(d.x * scale, d.y * scale);
        if (d.z < 0) p = fold(p);
        bits_ = quantise(p.x) | quantise(p.y) << 16;
    }

    V3f unpack() const {
        V2f p(static_cast<float>(bits_ & 0xffffU) / 65535.0F * 2 - 1,
              static_cast<float>(bits_ >> 16) / 65535.0F * 2 - 1);
        const float z = 1 - std::fabs(p.x) - std::fabs(p.y);
        if (z < 0) p = fold(p);
        return V3f(p.x, p.y, z).normalized();  // never the null vector: |x|+|y|+|z| = 1
    }

    // Returns the direction as a point of the octahedron |x| + |y| + |z| = 1, of length 1/sqrt 3 to 1.
    // Searches use it, since it needs no square root and compilers vectorise it.
    static V3f along(std::uint32_t bits) {
        // Converts through int, as every processor converts ints to floats.
        const float x = static_cast<float>(static_cast<std::int32_t>(bits & 0xffffU)) * (2 / 65535.0F) - 1;
        const float y = static_cast<float>(static_cast<std::int32_t>(bits >> 16)) * (2 / 65535.0F) - 1;
        const float z = 1 - std::fabs(x) - std::fabs(y);
        const V2f folded = fold({x, y});
        return {z < 0 ? folded.x : x, z < 0 ? folded.y : y, z};
    }
    std::uint32_t bits() const { return bits_; }

  private:
    static V2f fold(const V2f& p) {
        return {std::copysign(1 - std::fabs(p.y), p.x), std::copysign(1 - std::fabs(p.x), p.y)};
    }
    static std::uint32_t quantise(float x) {
        // Rounds as lround() does, which is a call: the sum is exact in double, and negative only by
        // rounding.
        return static_cast<std::uint32_t>(static_cast<double>((x * 0.5F + 0.5F) * 65535.0F) + 0.5);
    }

    std::uint32_t bits_ = 0;
};

struct Photon {
    Photon() = default;
    Photon(const PackedDirection& of_travel, const Rgb& carried, std::uint32_t from, CellId from_cell,
           bool has_strayed = false)
        : direction(of_travel),
          power(carried),
          light(from & 0x7fffffffU),
          strayed(has_strayed ? 1 : 0),
          cell(from_cell) {}

    PackedDirection direction;  // of travel
    Rgb power;  // W, already divided by the number of emitted paths; in media, the scattered power
    std::uint32_t light : 31;   // index of the light it came from
    std::uint32_t strayed : 1;  // some bounce of its path was not off a delta lobe: its layer is not caustic
    CellId cell;                // cell of that light
};
static_assert(sizeof(Photon) == 24);

}  // namespace lucerna
