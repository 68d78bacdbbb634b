// Splits a light of many triangles into parts: one part is chosen by what it may send to a place, and within
// it a point is chosen uniformly.
//
// A mesh is one light to its user, but it may consist of two hundred ceiling panels or surround a lamp on all
// sides. Its parts are flat and compact; what a part sends to a place varies little over the part unless the
// place is closer than the part is wide.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

inline constexpr std::size_t kMostTriangleParts = 4096;

// Returns each triangle's part. Parts are numbered from 0 without gaps, at most `most` (>= 1). There is one
// part if the triangles form one flat, compact piece. Triangles of no area may be in any part.
std::vector<std::uint32_t> parts_of_triangles(std::span<const V3f> p, std::span<const V3i> triangles,
                                              std::size_t most = kMostTriangleParts);

}  // namespace lucerna
