// What a photometric web holds, for people.
#pragma once

#include <ostream>

#include "lights/flux_unit.h"
#include "lights/photometric.h"

namespace lucerna {

void print_photometric(std::ostream& out, const PhotometricWeb& web, FluxUnit unit);

}  // namespace lucerna
