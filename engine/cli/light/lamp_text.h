// Prints lamps as text for `lucerna light` and `lucerna info`.
#pragma once

#include <ostream>
#include <span>

#include "engine/base/parallel.h"
#include "lights/flux_unit.h"
#include "lights/lumigraph.h"
#include "lights/measurement/lumigraph_fit.h"
#include "lights/measurement/ray_projection.h"
#include "lights/photometric.h"
#include "lights/ray_set.h"

namespace lucerna {

// Prints a light field, or a lamp of several slabs as a whole and then each slab.
void print_lumigraph(std::ostream& out, const Lumigraph& lamp, const Workers& workers);
void print_ray_set(std::ostream& out, const RaySet& rays);
// Prints the flux balance of a projected ray set.
void print_account(std::ostream& out, const FluxAccount& account, FluxUnit unit);

// Prints the error of the light that a field casts, plane by plane.
void print_errors(std::ostream& out, std::span<const PlaneError> errors);

// Prints the flux balance of a lamp that is made of rays, and the errors to expect, slab by slab.
void print_fit(std::ostream& out, const LumigraphFit& made);

// Prints the peak intensity, the beam angle and the field angle (beam_of()); of rays, those of their far
// field, and over which caps it counts them.
void print_beam(std::ostream& out, const PhotometricWeb& web, FluxUnit unit);
void print_beam(std::ostream& out, const RaySet& rays);

// Prints the contents of a photometric web.
void print_photometric(std::ostream& out, const PhotometricWeb& web, FluxUnit unit);

}  // namespace lucerna
