// Prints saved photon maps as text for `lucerna info`.
#pragma once

#include <ostream>

#include "photon/build_maps.h"

namespace lucerna {

void print_maps(std::ostream& out, const SavedMaps& saved);

}  // namespace lucerna
