// Joins the sides of a lamp that were measured one after the other.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "lights/lumigraph.h"

namespace lucerna {

// Joins light fields of a lamp's sides to one lamp. Each holds all the light that passed its planes, so
// overlapping fields hold the same light. Each keeps its share by direction (SlabShares), evaluated for each
// coefficient from the centre of its filter to the centre of its pixel. The lamp's box extends to the planes
// S and, on sides that were not measured, as far as the filters. A single straight field stays as it is.
// Throws InputError for two fields of one side, and for an invalid lamp (Lumigraph).
Lumigraph join_sides(std::vector<Slab> sides);

// Parses "+z", "-z", "+x", "-x", "+y" or "-y". Throws InputError naming `option`.
SlabAxes parse_side(const char* option, std::string_view word);

// Throws InputError naming `option` if a side is given twice.
void require_different_sides(const char* option, std::span<const SlabAxes> sides);

}  // namespace lucerna
