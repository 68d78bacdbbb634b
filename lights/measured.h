// The measured lamp as a light: fields, cell tables, placement in the scene, impostor.
//
// Source: [Goesele 2003].
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/colour/working_space.h"
#include "lights/cell_emission.h"
#include "lights/cell_table.h"
#include "lights/light.h"
#include "lights/light_field.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"

namespace lucerna {

struct MeasuredSettings {
    std::filesystem::path file;
    M44d world_from_light;  // rotation, translation and uniform scale, relative to the scene's origin. The
                            // lamp's file is in metres; its flux does not change with the scale
    float power_scale = 1;  // multiplies the flux, also that of `power`
    float power = 0;        // if > 0, replaces the flux of the file, in the light's unit
    LampUnit unit = {};     // of the light; the file's unless this names another
    EmissionMode mode = EmissionMode::exact;
    Reconstruction reconstruction = Reconstruction::exact;  // approximate only with EmissionMode::exact
    WorkingSpace colours = {};
};

// Maps a lamp's file to the file to read in its place.
using LampFileOf = std::function<std::filesystem::path(const std::filesystem::path& lamp)>;

// Loads the light field and, from beside it, its cell table; a missing or stale table is built and saved
// there, with a warning if the folder cannot be written. Throws InputError naming file and cause. With a
// shape, which must carry this light in the scene, the lamp is seen on it instead of on S; a warning is given
// if more than a hundredth of its light misses the shape.
std::unique_ptr<Light> make_measured_light(const MeasuredSettings& settings, const Workers& workers,
                                           Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape = nullptr);

// As above, from a field in memory and its table; settings.file only names the file in messages.
//
// Particles follow max(0, h), scaled as a whole so that their flux is the *measured* one (the sum of all
// coefficients, including negative ones) or `power`, times power_scale. Without this scale, clamping would
// add the noise of a coarse ray file to the lamp's flux. Radiance is scaled alike, so that sample_Le(),
// sample_Li() and Le() agree on one lamp. (In `constant` mode the particles follow the mean of h over each
// cell instead, as the paper approximates.) With the approximate reconstruction each particle and radiance is
// multiplied by the ratio of the two reconstructions along its line, and flux() stays that of the exact one.
// A field whose measured flux is not positive emits nothing (with a warning if any of it is bright).
std::unique_ptr<Light> make_measured_light(LightField field, CellTable table,
                                           const MeasuredSettings& settings, Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape = nullptr,
                                           const Workers& workers = {});

// As above, for several slabs with a table each, as one light. Each slab emits the flux that was measured of
// it; radiance along a line, and the density of finding it, are sums over the slabs. Without a shape, lines
// begin where they leave the lamp's box instead of on S; those that miss it begin where they pass closest to
// its centre.
std::unique_ptr<Light> make_measured_light(Lumigraph lamp, std::vector<CellTable> tables,
                                           const MeasuredSettings& settings, Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape = nullptr,
                                           const Workers& workers = {});

// A ray file as a light emits its rays as they are. It is the baseline for light fields.
//
// A finite set of lines meets no given point of a surface, so only particles carry this light. Photon maps
// show it, but methods that query a light's radiance see none.

struct RayLightSettings {
    std::filesystem::path file;
    M44d world_from_light;  // rotation, translation and uniform scale, relative to the scene's origin. The
                            // rays are in metres; their flux does not change with the scale
    float power_scale = 1;  // multiplies the flux, also that of `power`
    float power = 0;        // if > 0, replaces the flux of the file, in the light's unit
    LampUnit unit = {};     // as in MeasuredSettings
    WorkingSpace colours = {};
};

// Reads the rays. Throws InputError naming file and cause.
std::unique_ptr<Light> make_ray_light(const RayLightSettings& settings, Monitor& monitor);

// As above, from rays in memory; settings.file only names the file in messages. Each emission is a ray of the
// set, chosen in proportion to its flux in constant time, and carries the flux of all usable rays. Rays with
// individual colours (RaySet::tristimulus) are chosen by the mean of their channels, and each carries its
// colour; in total they have the set's flux and RaySet::colour().
std::unique_ptr<Light> make_ray_light(RaySet rays, const RayLightSettings& settings);

}  // namespace lucerna
