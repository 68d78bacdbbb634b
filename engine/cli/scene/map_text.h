// Saved photon maps in words: what `lucerna info` says about them.
#pragma once

#include <ostream>

#include "photon/build_maps.h"

namespace lucerna {

void print_maps(std::ostream& out, const SavedMaps& saved);

}  // namespace lucerna
