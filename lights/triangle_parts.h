// Parts of a light that is made of many triangles: of which one is chosen by what it may send to a place, and
// within which a place is as good as any other.
//
// A mesh is one light to its user, and may be two hundred panels of a ceiling or a lamp that shines to all
// sides. Its parts are flat and compact pieces; what one of them sends to a place varies little over it,
// unless the place is nearer than the piece is wide.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

inline constexpr std::size_t kMostTriangleParts = 4096;

// Each triangle's part; parts are numbered from 0, at most `most` (>= 1), without gaps. One for all where the
// triangles are one flat, compact piece. Triangles of no area may be anywhere.
std::vector<std::uint32_t> parts_of_triangles(std::span<const V3f> p, std::span<const V3i> triangles,
                                              std::size_t most = kMostTriangleParts);

}  // namespace lucerna
