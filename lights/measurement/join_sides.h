// A lamp measured from several sides, one after the other.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "lights/lumigraph.h"

namespace lucerna {

// Light fields of a lamp's sides as one lamp. Each was measured by itself and holds all that passed its
// planes, so that where they overlap they hold the same light: each keeps its share by direction
// (SlabShares), taken for each coefficient from the middle of its filter to the middle of its pixel. The
// lamp's box reaches to the planes S, and as far as the filters where no side was measured. A single straight
// field stays as it is. Throws InputError for two fields of one side, and for what makes no lamp (Lumigraph).
Lumigraph join_sides(std::vector<Slab> sides);

// "+z", "-z", "+x", "-x", "+y" or "-y". Throws InputError naming `option`.
SlabAxes parse_side(const char* option, std::string_view word);

// Throws InputError naming `option` if a side is told twice.
void require_different_sides(const char* option, std::span<const SlabAxes> sides);

}  // namespace lucerna
