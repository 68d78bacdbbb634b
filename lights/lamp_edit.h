// Edits of whole lamps: they are turned, moved, mirrored, dimmed, cut by side and added.
//
// A light field is not fitted again. A turn or a move changes the place of its slabs. A mirror image of a
// slab is a slab whose planes are mirrored: because axes must be right-handed, its u axis points the other
// way, and the filters of S and the pixels of M are numbered backwards along it. A sum of lamps is the list
// of their slabs, because the radiance along a line is the sum over the slabs (lumigraph.h). Only the lamp's
// box is enlarged: a sum's light begins on the box around the boxes of all lamps, and a turned lamp's on the
// box, aligned with the axes of the new frame, around its turned box.
#pragma once

#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"

namespace lucerna {

// A place for a lamp: p -> p.x x + p.y y + p.z z + origin, in metres. The axes are orthonormal and, if the
// lamp is mirrored, left-handed.
struct LampPlacement {
    V3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    V3d origin{0, 0, 0};

    V3d vector(const V3d& d) const { return d.x * x + d.y * y + d.z * z; }
    V3d point(const V3d& p) const { return vector(p) + origin; }
    bool mirrors() const { return x.cross(y).dot(z) < 0; }
    // Returns this place, and then `next` applied to it.
    LampPlacement then(const LampPlacement& next) const;

    // `axis` is 0, 1 or 2 for x, y or z. A turn is anticlockwise for a viewer whom the axis points at;
    // quarter turns are exact. A mirror changes the sign of the coordinate.
    static LampPlacement turn(int axis, double degrees);
    static LampPlacement mirror(int axis);
    static LampPlacement move(const V3d& by) { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, by}; }
};

// Coefficients of a lamp that is only turned and moved stay bit for bit, and so do those of a mirrored lamp
// of one colour; those of several colours stay up to the rounding of a file.
Lumigraph placed(const Lumigraph& lamp, const LampPlacement& place);
RaySet placed(RaySet rays, const LampPlacement& place);

// Multiplies all light, also what the lamp misses, by a factor > 0.
Lumigraph dimmed(const Lumigraph& lamp, double factor);
RaySet dimmed(RaySet rays, double factor);

// Keeps the light that leaves towards these sides. A slab belongs to the side that its normal is closest to,
// and is kept or removed whole; the light missed is that of the slabs that are kept. Throws InputError naming
// the sides of the lamp if none of them is kept.
Lumigraph cut_to_sides(const Lumigraph& lamp, std::span<const SlabAxes> sides);
// A ray belongs to the side that its direction is closest to. Throws InputError if no light is left.
RaySet cut_to_sides(RaySet rays, std::span<const SlabAxes> sides);

// Adds lamps in one frame, at least one. Lamps in watts stay in watts if all of them have the same luminous
// efficacy, or none is known; otherwise they are converted to lumens. `names` are those of the lamps in
// messages. Throws InputError if an efficacy is required but not known, or if there are too many slabs.
Lumigraph added(std::vector<Lumigraph> lamps, std::span<const std::string> names);

// Returns the box in which a lamp's light begins: that of a simple lamp is the part of its S that the light
// passes, except for a tail of a thousandth of the flux on each side.
Box3d beginning_of(const Lumigraph& lamp);

}  // namespace lucerna
