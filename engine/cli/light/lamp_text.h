// Lamps in words: what `lucerna light` and `lucerna info` say about them.
#pragma once

#include <ostream>
#include <span>

#include "engine/base/parallel.h"
#include "lights/flux_unit.h"
#include "lights/lumigraph.h"
#include "lights/measurement/ray_projection.h"
#include "lights/photometric.h"
#include "lights/ray_set.h"

namespace lucerna {

// A light field; or of several slabs the whole, and then each.
void print_lumigraph(std::ostream& out, const Lumigraph& lamp, const Workers& workers);
void print_ray_set(std::ostream& out, const RaySet& rays);
// Where the flux of a ray set went when it was projected.
void print_account(std::ostream& out, const FluxAccount& account, FluxUnit unit);

// How far the light that a field casts is from the lamp's, plane by plane.
void print_errors(std::ostream& out, std::span<const PlaneError> errors);

// Prints the contents of a photometric web for people.
void print_photometric(std::ostream& out, const PhotometricWeb& web, FluxUnit unit);

}  // namespace lucerna
