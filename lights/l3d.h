// L3D: the geometry of a luminaire (a zip archive of structure.xml and models), of which its light-emitting
// objects are read.
//
// Parts are nested: a Geometry holds Joints, and a Joint holds Geometries; each has a position in metres and
// a rotation about the part's own axes in the order z, x, y, in degrees. A Joint's DefaultRotation is
// applied. x and y are horizontal, z points upwards. A light-emitting object shines downwards along its own
// -z; its x axis lies in C0-C180 and its y axis in C90-C270 of its photometry.
//
// Source: L3D 0.11 and its examples [GLDF 1.0].
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/vec.h"
#include "lights/luminous_opening.h"

namespace lucerna {

// In the frame of a lamp: +z is down, +x is C0, -y is C90. Lengths are metres.
struct LightEmittingObject {
    std::string name;
    V3d position;
    std::array<V3d, 3> axes;
    LuminousOpening opening;
};

// Returns the axes of a frame that is turned by the angles [degrees] about its own axes z, x and y, in this
// order. The angles are about the axes of a luminaire (z upwards); the axes are those of a lamp.
std::array<V3d, 3> turned_axes(const V3d& degrees);

// Returns the objects in the order of the file. Throws InputError naming `file` and the line.
std::vector<LightEmittingObject> read_l3d(std::string bytes, const std::string& file, Monitor& monitor);

}  // namespace lucerna
